//! What a recorded session says about its cell: capture it, replay it, explain it.
//!
//! The robot is reached only through shared memory and the other programs only as processes, so nothing here can tell a
//! real cell from a simulated one.
//!
//! | module | owns |
//! |---|---|
//! | [`acting`] | a policy on a robot, through a running bridge |
//! | [`capture`] | planning a motion, having the bridge play it, recording it into a session folder |
//! | [`check`] | the doctor of a recording: whether the data can mean what they say |
//! | [`demonstrations`] | recorded episodes of tasks as data to learn from |
//! | [`demo`] | the whole story on the simulated cell, in one command |
//! | [`diagnose`] | where the gap lies, what causes it, how far it shrinks |
//! | [`engine`] | another program that simulates the arm |
//! | [`estimate`] | fits over clips: what all clips share, what varies from clip to clip |
//! | [`forward`] | what the twin makes of recorded clips, as residuals |
//! | [`hand_eye`] | where a camera is mounted on an arm or beside it, from pictures of a board |
//! | [`init`] | a cell.toml to begin with, commented |
//! | [`identify`] | the parameters that a session tells, and what it cannot tell |
//! | [`model`] | what was found as a model file of MuJoCo, ROS or Gazebo |
//! | [`page`] | what all pages are made of: words for numbers, pictures of plain numbers |
//! | [`report`] | pages with plots |
//! | [`study`] | policies on tasks from the same starts, in several worlds |
//! | [`sweep`] | work in units, on many cores and machines |
//! | [`viewpoint`] | the camera's pose from pictures of the robot |
//! | [`processes`] | the other programs as children |
//! | [`interrupt`] | Ctrl-C, and a budget of time |
//! | [`kept`] | what long work has found so far, for when it is interrupted |
//! | `child_output` | what other programs say on their pipes |
//! | [`seed`] | what is drawn is drawn from it |
//! | [`statistics`] | medians, and quantiles of distributions |
//!
//! # Words
//!
//! | word | meaning here |
//! |---|---|
//! | clip | one recorded motion, the unit of evidence: rows within one are not independent, clips are |
//! | residual | measured less simulated, in sigmas of the sensor |
//! | baseline | the twin with the paper's own parameters identified, and no effect |
//! | effect | something a real cell has and the nominal twin lacks; all of them stand in `twin::effects` |
//! | candidate | an effect that may show in the clips at hand |
//! | hypothesis | the baseline's numbers and those of some effects, fitted together |
//! | shared parameters | numbers that are the same in all clips |
//! | nuisance parameters, or own numbers | numbers of one clip alone: random effects with a known scatter, eliminated clip by clip |
//! | discrepancy | what any twin leaves for reasons of its own, beyond the sensors' noise |
//! | overdispersion | how many times larger the discrepancy is than was taken for noise |
//! | deviance | `-2 ln` of the likelihood; a nat is half a unit of it |
//! | screening | a score test of each candidate by its linearised signature: which are worth a fit |
//! | restart | a fit once more from elsewhere, where one is stuck in a local minimum |
//! | held-out clips | clips that a fit has not seen; those kept for confirming are opened once, at the end |
//! | identifiable | shown by the clips beyond what other parameters imitate |
//! | class | candidates that these clips cannot tell apart |
//! | shrink | `1 - after / before` of the mean squared residual on held-out clips |

pub mod acting;
pub mod benchmark;
pub mod capture;
pub mod check;
mod child_output;
pub mod demo;
pub mod demonstrations;
pub mod diagnose;
pub mod engine;
pub mod estimate;
pub mod forward;
pub mod hand_eye;
pub mod identify;
pub mod init;
pub mod interrupt;
pub mod kept;
pub mod keys;
pub mod model;
pub mod page;
pub mod processes;
pub mod report;
pub mod seed;
pub mod statistics;
pub mod study;
pub mod sweep;
pub mod viewpoint;
