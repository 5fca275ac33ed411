//! How good the diagnosis is: sealed simulated worlds, diagnosed and scored, beside the simple rules that people use.
//!
//! | module | owns |
//! |---|---|
//! | [`world`], [`draw`] | what is true in a world, from its number |
//! | [`session`] | the clips that it gives |
//! | [`trial`] | the diagnosis, the oracle and the rules on one session |
//! | [`rules`] | the simple rules |
//! | [`score`] | rates, intervals, calibration |
//! | [`run`] | all worlds of a benchmark |
//! | [`coverage`] | whether printed intervals hold the truth |
//! | [`calibrate`] | the measured numbers that decide, regenerated from labelled sessions |
//! | [`pairs`] | two sessions of one world, of which something changed or nothing did |

pub mod calibrate;
pub mod coverage;
pub mod draw;
pub mod pairs;
pub mod rules;
pub mod run;
pub mod score;
pub mod session;
pub mod trial;
pub mod world;
