//! How good the diagnosis is: sealed worlds, diagnosed and scored, beside the simple rules that people use.
//!
//! | module | owns |
//! |---|---|
//! | [`trial`] | the diagnosis, the oracle and the rules on one session |
//! | [`rules`] | the simple rules |
//! | [`score`] | rates, intervals, calibration |
//! | [`run`] | all worlds of a benchmark |
//! | [`calibrate`] | the measured numbers that decide, regenerated from labelled sessions |

pub mod calibrate;
pub mod rules;
pub mod run;
pub mod score;
pub mod trial;
