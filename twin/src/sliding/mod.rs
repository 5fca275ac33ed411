//! How an object that stands with a face on the table slides, spins and stops: Coulomb friction over the contact patch.
//!
//! The body has three freedoms, `x`, `y` of its centre of mass and its yaw. Friction acts at the table's height, below
//! the centre of mass, so the load moves towards the leading edge; translation and spin share one friction, because
//! every place of the base is braked against its own velocity. At rest the friction is whatever keeps the body at rest,
//! up to its limit: nothing creeps.
//!
//! This module knows no engine, no robot and no file. The cell's physics calls it while the object is flat on the table
//! and gets [`Ending::Lifts`] back when the load would have to be negative: then a free rigid body takes over, and hands
//! back through [`Footing::find`].
//!
//! Units SI. Frames: "world" has z up along the table's normal; the "patch frame" is the world turned by the body's yaw
//! about z, with its origin on the table below the centre of mass.

mod footing;
mod friction;
mod impulse;
mod load;
mod patch;
mod planar;
mod polygon;
mod slider;

pub use footing::{BASE, Closeness, Footing, FreeBody, Solid};
pub use friction::{Coulomb, SlidingFriction};
pub use load::Wrench;
pub use patch::{Patch, PatchError};
pub use planar::PlanarState;
pub use polygon::MAX_POINTS;
pub use slider::{Ending, Slider};
