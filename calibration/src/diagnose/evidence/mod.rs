//! What is measured against the twin, where in a clip, and how far it can be trusted.
//!
//! | module | |
//! |---|---|
//! | `measured` | residuals of clips under the numbers of every hypothesis, and where in a clip each stands |
//! | `arm_clips`, `cell_clips`, `contact` | of the arm alone, of the arm and an object, of the arm in contact |
//! | `deviations` | how the object of a clip deviates from any simulated path |
//! | `regime` | what a joint is commanded to do at a moment |
//! | `recent` | where a search has just been |
//! | `scatter` | what every clip has of its own |
//! | `noise` | what holds for most residuals, and how many of them say the same |
//! | `scatter_scale` | how widely clips scatter under one of them |

pub mod arm_clips;
pub mod cell_clips;
pub mod contact;
pub(super) mod deviations;
pub mod measured;
pub mod noise;
pub(super) mod recent;
mod regime;
pub mod scatter;
pub mod scatter_scale;
