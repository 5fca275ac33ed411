//! Gaussian splats: files, projection, and the reference renderer of splats and meshes together.
//!
//! Camera frame: z forward, x right, y down, metres; pixel centres lie at whole numbers.
//!
//! | module | owns |
//! |---|---|
//! | `cloud` | the splats of one body |
//! | `ply`, `compressed` | 3DGS PLY and SuperSplat's compressed PLY |
//! | `harmonics` | colour by direction |
//! | `links` | a folder with one file for each link |
//! | `lens` | pinhole and Brown-Conrady distortion, both ways |
//! | `project` | one splat in a picture |
//! | `straight` | the pinhole's picture beside the lens's |
//! | `mesh`, `raster` | triangles of one colour, and a CPU rasteriser of them |
//! | `reference` | the picture |

mod cloud;
mod compressed;
mod harmonics;
mod lens;
mod links;
mod mesh;
mod ply;
mod project;
mod raster;
mod reference;
mod straight;

pub use cloud::{Splat, SplatCloud, SplatError};
pub use lens::Lens;
pub use links::{link_file, read_links};
pub use mesh::Mesh;
pub use project::{Projected, project, slope_ends};
pub use raster::{Pinhole, Raster};
pub use reference::{Body, Canvas, Picture, Shape, Surroundings, render};
pub use straight::{NOWHERE, Straight};
