//! Which candidates are tried, on what, and where their fits begin.
//!
//! | module | |
//! |---|---|
//! | `signatures` | every candidate's signature, linearised once |
//! | `screening` | which of them are fitted |
//! | `arm_alone` | effects in the joints, fitted to the arm first |
//! | `starts`, `ripple`, `along_motion` | where a fit begins |

pub mod along_motion;
pub mod arm_alone;
pub mod ripple;
pub mod screening;
pub mod signatures;
pub mod starts;
