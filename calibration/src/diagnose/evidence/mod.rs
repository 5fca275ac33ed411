//! What is measured against the twin, where in a clip, and how far it can be trusted.
//!
//! | module | |
//! |---|---|
//! | `measured` | residuals of clips under the numbers of every hypothesis, and where in a clip each stands |
//! | `arm_clips`, `cell_clips`, `contact` | of the arm alone, of the arm and an object, of the arm in contact |
//! | `noise` | what holds for most residuals, and how many of them say the same |

pub mod arm_clips;
pub mod cell_clips;
pub mod contact;
pub mod measured;
pub mod noise;
