//! Forward selection by clips that were not fitted: one procedure for effects in a session and for changes between two.
//!
//! | module | |
//! |---|---|
//! | `gain` | what one model is worth over another: log-likelihood of clips left out |
//! | `criteria` | when that is enough, and which extensions are fitted |
//! | `forward` | extensions taken on while one is worth it, and dropped where others do without |

pub mod criteria;
pub mod forward;
pub mod gain;
