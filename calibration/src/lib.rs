//! What a recorded session says about its cell: capture it, replay it, explain it.
//!
//! The robot is reached only through shared memory and the other programs only as processes, so nothing here can tell a
//! real cell from a simulated one.
//!
//! | module | owns |
//! |---|---|
//! | [`acting`] | a policy on a robot, through a running bridge |
//! | [`answer`] | what verbs answer, as plain types |
//! | [`check`] | the doctor of a recording: whether the data can mean what they say |
//! | [`cli`] | the command line: one file a verb |
//! | [`demonstrations`] | recorded episodes of tasks as data to learn from |
//! | [`demo`] | the whole story on the simulated cell, in one command |
//! | [`diagnose`] | where the gap lies, what causes it, how far it shrinks |
//! | [`init`] | a cell.toml to begin with, commented |
//! | [`identify`] | the parameters that a session tells, and what it cannot tell |
//! | [`model`] | what was found as a model file of MuJoCo, ROS or Gazebo |
//! | [`page`] | what all pages are made of: pictures of plain numbers |
//! | [`report`] | pages with plots |
//! | [`study`] | policies on tasks from the same starts, in several worlds |
//! | [`sweep`] | work in units, on many cores and machines |
//! | [`words`] | numbers, units and names as people read them |

pub mod acting;
pub mod answer;
pub mod benchmark;
pub mod check;
pub mod cli;
pub mod demo;
pub mod demonstrations;
pub mod diagnose;
pub mod identify;
pub mod init;
pub mod keys;
pub mod model;
pub mod page;
pub mod report;
pub mod study;
pub mod sweep;
pub mod words;
