//! What a recorded session says about its cell: capture it, replay it, explain it.
//!
//! The robot is reached only through shared memory and the other programs only as processes, so nothing here can tell a
//! real cell from a simulated one.
//!
//! | module | owns |
//! |---|---|
//! | [`capture`] | planning a motion, having the bridge play it, recording it into a session folder |
//! | [`demo`] | the whole story on the simulated cell, in one command |
//! | [`diagnose`] | where the gap lies, what causes it, how far it shrinks |
//! | [`estimate`] | fits over clips: what all clips share, what varies from clip to clip |
//! | [`forward`] | what the twin makes of recorded clips, as residuals |
//! | [`identify`] | the parameters that a session tells, and what it cannot tell |
//! | [`report`] | pages with plots |
//! | [`viewpoint`] | the camera's pose from pictures of the robot |
//! | [`typed`] | commands as they are typed |
//! | [`processes`] | the other programs as children |
//! | [`interrupt`] | Ctrl-C, and a budget of time |
//! | [`kept`] | what long work has found so far, for when it is interrupted |
//! | [`seed`] | what is drawn is drawn from it |

pub mod benchmark;
pub mod capture;
pub mod demo;
pub mod diagnose;
pub mod estimate;
pub mod forward;
pub mod identify;
pub mod interrupt;
pub mod kept;
pub mod keys;
pub mod processes;
pub mod report;
pub mod seed;
pub mod typed;
pub mod viewpoint;
