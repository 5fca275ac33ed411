//! Which recorded clips can be diagnosed, how much of them counts, and what each is for.
//!
//! | module | |
//! |---|---|
//! | `admit` | can the clips be diagnosed at all |
//! | `torques` | torques along the measured motion, where no control law is known |
//! | `length` | how much of long clips counts |
//! | `parts` | parts of clips in place of clips, where there are few commands |
//! | `split` | which clips are for what |
//! | `ground` | where on the table objects slid |

pub mod admit;
pub mod ground;
pub mod length;
mod parts;
pub mod split;
#[cfg(test)]
pub(in crate::diagnose) mod test_clip;
pub(super) mod torques;
