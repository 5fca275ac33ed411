//! Pictures of the cell: a CPU rasteriser of flat-shaded triangles, colour and depth in one pass, fast enough for the
//! simulated camera on one core; and beside it [`splat`], Gaussian splats and meshes in one picture.
//!
//! Camera frame: z forward, x right, y down, metres; pixel centres lie at whole numbers. `f32` throughout: at 2 m a
//! depth is good to a micrometre. Called by [`crate::sensors::camera`].

mod glb;
mod mesh;
mod raster;
mod robot;
pub mod session;
pub mod splat;

pub use mesh::Mesh;
pub use raster::{Pinhole, Raster};
pub use robot::{Hand, RobotSurface};
