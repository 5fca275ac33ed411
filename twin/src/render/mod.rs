//! Pictures of the cell. Today a CPU rasteriser of flat-shaded triangles, colour and depth in one pass, fast enough
//! for the simulated camera on one core; a renderer of splats and meshes on the GPU finds its place beside it.
//!
//! Camera frame: z forward, x right, y down, metres; pixel centres lie at whole numbers. `f32` throughout: at 2 m a
//! depth is good to a micrometre. Called by [`crate::sensors::camera`].

mod glb;
mod mesh;
mod raster;
mod robot;

pub use mesh::Mesh;
pub use raster::{Pinhole, Raster};
pub use robot::{Hand, RobotSurface};
