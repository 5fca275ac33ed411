//! Identification: what a recorded session says about the parameters that cell.toml leaves open, how sure that is, and
//! what it cannot say. Called by `calibration identify`. SI units, base frame.
//!
//! | module | owns |
//! |---|---|
//! | [`arm`] | gains of the controller, and arm effects on request |
//! | [`object`] | friction, mass, centre of mass and tip friction of the object |
//! | [`joint`] | friction and damping of a hinge or a slide of an object that moves in itself |
//! | [`split`] | which clips are fitted and which are held out |
//! | `remarks` | what is odd about clips, said once for all that share it |
//! | `run` | the way of searching, its progress, its interruption and resumption |

pub mod arm;
pub mod joint;
pub mod object;
pub(crate) mod remarks;
mod run;
pub mod split;

pub use crate::answer::identification::Identification;
pub use run::Optimizer;
