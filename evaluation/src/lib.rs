//! Policies on tasks, and how far success in one world predicts success in another.
//!
//! | module | owns |
//! |---|---|
//! | [`statistics`] | intervals, tests and ranks of trials that succeed or fail |

pub mod statistics;
