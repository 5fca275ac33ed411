//! What a fitted hypothesis is worth: how well it predicts clips, how much of the gap it closes, how sure that is, and what is left.
//!
//! | module | |
//! |---|---|
//! | `score` | how well it predicts clips: leave-one-clip-out log-likelihood |
//! | `held_out` | numbers for clips that it was not fitted to |
//! | `confirm` | whether held-out clips speak for what was found |
//! | `closing` | how much of the gap it closes |
//! | `apart` | whether a time that all joints share is each joint's own |
//! | `ends` | which of its sizes stopped at an end of their search |
//! | `remainder`, `drift` | what it leaves |
//! | `gap`, `localise`, `sizes` | how large the gap is, and where |
//! | `recorded_arm` | whose an object's gap is: the arm's, or the object's |
//! | `unproven` | what more clips would prove |
//! | `tolerance` | whether a gap is of interest |
//! | `needed` | whether a final model needs each of its effects, and what could stand in for one |
//! | `partly` | what is proven although a part of the gap stays |
//! | `confidence` | how sure a finding is, and what its rivals are |
//! | `trial` | candidates tried on top of a hypothesis, and what makes one of them a cause |

pub(super) mod apart;
pub mod closing;
pub mod confidence;
pub(super) mod confirm;
pub mod drift;
pub(super) mod ends;
pub mod gap;
pub(super) mod held_out;
pub mod localise;
pub(super) mod needed;
pub(super) mod partly;
pub(super) mod recorded_arm;
pub mod remainder;
pub mod score;
pub(super) mod sizes;
#[cfg(test)]
mod test_trial;
pub(super) mod tolerance;
pub mod trial;
pub(super) mod unproven;
