//! Identification: what a recorded session says about the parameters that cell.toml leaves open, how sure that is, and
//! what it cannot say. Called by `calibration identify`. SI units, base frame.
//!
//! | module | owns |
//! |---|---|
//! | [`arm`] | gains of the controller, and arm effects on request |
//! | [`object`] | friction, mass, centre of mass and tip friction of the object |
//! | [`joint`] | friction and damping of a hinge or a slide of an object that moves in itself |
//! | `used` | which clips are fitted, held out, left out |
//! | `options`, `error` | what an arm or an object is identified from, and how; why it cannot be |
//! | `finding`, `figures` | a fit number by number; how far the twin is off over sets of clips |
//! | `run` | a search: its way, its progress, its resumption |
//! | `work` | what is kept of long work and what ends it, until its answer is in its file |

pub mod arm;
mod error;
mod figures;
mod finding;
pub mod joint;
pub mod object;
mod options;
mod run;
#[cfg(test)]
mod test_arm;
#[cfg(test)]
mod test_finding;
#[cfg(test)]
mod test_laws;
#[cfg(test)]
mod test_object;
#[cfg(test)]
#[path = "../../tests/pushes/mod.rs"]
mod test_pushes;
#[cfg(test)]
mod test_refusals;
#[cfg(test)]
#[path = "../../inference/src/likelihood/test_servo.rs"]
mod test_servo;
#[cfg(test)]
#[path = "../../tests/slides/mod.rs"]
mod test_slides;
mod used;
mod work;

pub use crate::answer::identification::Identification;
pub use error::IdentifyError;
pub use options::{Optimizer, Options};
