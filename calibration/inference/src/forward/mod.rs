//! What the twin makes of recorded clips: residuals of every clip for any parameters of the cell.
//!
//! | module | owns |
//! |---|---|
//! | [`setting`] | from a vector of numbers to the parameters of a cell |
//! | [`motion`] | who moves the arm: the twin, or another program |
//! | [`arm`] | what an arm's sensors log |
//! | [`object`] | clips with an object: poses |
//! | [`random_effects`], [`random_effects_scale`] | what varies from clip to clip, and how widely under a hypothesis |
//! | [`recent`] | what was simulated where a search has just been |
//! | [`rows`] | what every residual is about |
//! | [`smoothing`] | logged series smoothed, with slopes |

pub mod arm;
pub mod motion;
pub mod object;
pub mod random_effects;
pub mod random_effects_scale;
pub mod recent;
pub mod rows;
pub mod setting;
pub mod smoothing;

pub use setting::{Setting, Settings};
