//! Pictures of the cell, drawn by the crate [`splat`]: a CPU rasteriser of flat-shaded triangles, colour and depth in one
//! pass, fast enough for the simulated camera on one core; and Gaussian splats and meshes in one picture, which with the
//! feature `render` a Vulkan device draws as well. A [`Painter`] is the one or the other.
//!
//! Camera frame: z forward, x right, y down, metres; pixel centres lie at whole numbers. `f32` throughout: at 2 m a
//! depth is good to a micrometre. Called by [`crate::sensors::camera`].

#[cfg(feature = "render")]
pub mod device;
mod glb;
mod live;
pub(crate) mod looks;
mod misplaced;
mod painter;
mod portrait;
mod robot;
pub mod session;
mod shown;

pub use live::{Beside, LiveView};
pub(crate) use misplaced::misplaced;
pub use painter::{Drawer, Model, PaintError, Painter};
pub use portrait::portrait;
#[cfg(feature = "teleop")]
pub(crate) use portrait::{Framing, Look, points_of};
pub use robot::{Hand, RobotSurface};
pub(crate) use shown::{ScannedLink, Shown};
pub use splat::{Mesh, Pinhole, Raster};
