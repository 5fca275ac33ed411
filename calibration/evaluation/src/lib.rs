//! Policies on tasks, and how far success in one world predicts success in another.
//!
//! Data goes one way: a task and a policy give an outcome, outcomes are trials, trials give findings.
//!
//! | module | owns |
//! |---|---|
//! | [`policy`] | who acts: the task's script, a policy behind openpi's protocol, or one in an ONNX file |
//! | [`rollout`] | one episode of a policy on a task |
//! | [`trial`] | trials, and files of them from other worlds |
//! | [`statistics`] | intervals, tests and ranks of trials that succeed or fail |
//! | [`findings`] | what trials say: policies against each other, worlds against each other |
//! | [`film`] | moments of an episode as a picture |
#![warn(missing_docs)]

pub mod film;
pub mod findings;
pub mod policy;
pub mod rollout;
pub mod statistics;
pub mod trial;
