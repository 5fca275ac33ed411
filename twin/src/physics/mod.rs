//! Rigid bodies and contact: the only code that knows parry. World frame = the robot's base frame, SI.
//!
//! Each law stands in its own file: where tool and object touch ([`touch`], on parry's distances), how they part
//! ([`hit`]), how the object tumbles (`tumble`), and, outside, how it slides ([`crate::sliding`]); [`TableObject`] puts
//! them together. There is no engine below: rapier slides a spinning box 32 % off in yaw, and cannot solve a tool that belongs
//! to an arm outside of it together with the table. Called by [`crate::sim`].

mod convert;
pub mod hit;
mod hull;
mod impulses;
mod material;
mod outline;
mod pieces;
mod push;
mod shape;
mod surface;
mod table_object;
#[cfg(test)]
pub(crate) mod test_box;
pub mod touch;
mod tumble;

pub use hull::{Face, Hull};
pub use material::Material;
pub use outline::Outline;
pub use pieces::{Piece, convex_pieces};
pub use shape::FlatMesh;
pub use surface::Surface;
pub use table_object::{ObjectMotion, TableObject};
