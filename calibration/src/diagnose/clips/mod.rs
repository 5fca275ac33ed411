//! Which recorded clips can be diagnosed, how much of them counts, and what each is for.
//!
//! | module | |
//! |---|---|
//! | `admit` | can the clips be diagnosed at all |
//! | `torques` | torques along the measured motion, where no control law is known |
//! | `length` | how much of long clips counts |
//! | `split` | which clips are for what |
//! | `ground` | where on the table objects slid |

pub mod admit;
pub mod ground;
pub mod length;
pub mod split;
pub(super) mod torques;
