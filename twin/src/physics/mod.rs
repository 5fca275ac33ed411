//! Rigid bodies and contact: the only code that knows rapier and parry. World frame = the robot's base frame, SI.
//!
//! Three laws meet here, each behind its own file, so that one can be exchanged without the others noticing:
//! the table under the object ([`TableObject`], rapier), the hit of the tool ([`hit`], own), and the numbers that
//! bend rapier's defaults (`settings`). Called by [`crate::sim`].

mod convert;
pub mod hit;
mod settings;
mod table_object;

pub use table_object::{FlatMesh, Push, TableObject};
