//! Gaussian splats: files, projection, and the reference renderer of splats and meshes together.
//!
//! The reference draws in double precision, training runs in single, which takes less time (`cargo bench -p splat --bench step`).
//!
//! Camera frame: z forward, x right, y down, metres; pixel centres lie at whole numbers.
//!
//! | module | owns |
//! |---|---|
//! | `cloud` | the splats of one body |
//! | `file` | a file of them, read and written |
//! | `ply`, `compressed` | 3DGS PLY and SuperSplat's compressed PLY |
//! | `real` | single and double precision |
//! | `harmonics` | colour by direction |
//! | `links` | a folder with one file for each link |
//! | `lens` | pinhole and distortion, both ways |
//! | `project` | one splat in a picture |
//! | `gradient` | the picture once more, and from pixels back to splats |
//! | `loss` | how far a picture is from a photograph |
//! | `train` | splats trained on photographs |
//! | `straight` | the pinhole's picture beside the lens's |
//! | `mesh`, `raster` | triangles of one colour, and a CPU rasteriser of them |
//! | `reference` | the picture |
#![warn(missing_docs)]

mod cloud;
mod compressed;
mod file;
mod gradient;
mod harmonics;
mod lens;
mod links;
mod loss;
mod mesh;
mod ply;
mod ply_rows;
mod project;
mod raster;
mod real;
mod reference;
mod straight;
mod train;

pub use cloud::{Splat, SplatCloud};
pub use file::SplatError;
pub use gradient::{COLOR_DEPTH, COLOR_PLANE, Frame, Parameters, Planes};
pub use lens::Lens;
pub use links::{link_file, read_links};
pub use loss::{Loss, Target, Weights};
pub use mesh::Mesh;
pub use project::{Projected, project, slope_ends};
pub use raster::{Pinhole, Raster};
pub use real::Real;
pub use reference::{Body, Canvas, Picture, Shape, Surroundings, render};
pub use shared_mem::lens::Distortion;
pub use straight::{NOWHERE, Straight};
pub use train::{Camera, Photograph, Progress, Quality, Rates, Settings, StateError, TrainError, train};
