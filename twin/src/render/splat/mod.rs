//! Gaussian splats: files, projection, and the reference renderer of splats and meshes together.
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
//! | `reference` | the picture |

mod cloud;
mod compressed;
mod harmonics;
mod lens;
mod links;
mod ply;
mod project;
mod reference;
mod straight;

#[cfg(feature = "render")]
pub(super) use project::held;
#[cfg(feature = "render")]
pub(super) use straight::Straight;

pub use cloud::{Splat, SplatCloud, SplatError};
pub use lens::Lens;
pub use links::{link_file, read_links};
pub use project::{Projected, project};
pub use reference::{Body, Canvas, Picture, Shape, Surroundings, render};
