//! The control rate of the arm: motions are planned, checked and played in steps of it.

/// Set points a second: the control rate of the arm.
pub const RATE: f64 = 1000.0;
