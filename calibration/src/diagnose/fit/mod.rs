//! Hypotheses as numbers: clips linearised around them, and fitted to them.
//!
//! | module | |
//! |---|---|
//! | `sweep` | clips linearised by numbers and probes of candidates |
//! | `floor` | weights of the channels: how far residuals can be trusted |
//! | `shortlist` | how much of the gap each candidate's signature explains |
//! | `anchored` | strokes of another program around one point, with the twin's differences |
//! | `bench`, `cost`, `effort` | hypotheses fitted, what they cost, and how much work a fit gets |
//! | `convention` | what any two simulations differ by, and so no cause |
//! | `descend` | the steps of a fit |
//! | `multi_start` | one fit from several starts |
//! | `left_out` | the numbers without some of the clips |
//! | `restart` | restarts of clips whose nuisance parameters are stuck in a local minimum |
//! | `parameters`, `undetermined` | its numbers with their intervals, and those that nothing depends on |
//! | `time_step` | how far the twin's time step moves them |
//! | `stages` | the stages that its progress counts |

pub(super) mod anchored;
pub mod bench;
mod convention;
pub mod cost;
mod descend;
pub mod effort;
pub mod floor;
pub(super) mod left_out;
pub mod multi_start;
pub mod parameters;
pub mod restart;
pub mod shortlist;
pub(super) mod stages;
pub mod sweep;
pub mod time_step;
pub mod undetermined;
