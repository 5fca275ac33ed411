//! From what was found to an answer: the verdict in words, what to do about it, and what to record next.
//!
//! | module | |
//! |---|---|
//! | `verdict`, `headline` | which of the five verdicts it is, and its sentence |
//! | `advice`, `site` | what to record next, and the commands for it |
//! | `written` | the motion of an arm that no bridge drives, as CSV |
//! | `remedies` | what to do about what was named |
//! | `ranked`, `reason` | what is said of every candidate, and why |
//! | `conclusion` | the answer |

pub mod advice;
pub mod conclusion;
pub mod headline;
pub mod ranked;
pub(super) mod reason;
pub mod remedies;
pub mod site;
pub mod verdict;
pub mod written;
