//! Figures: each takes plain numbers and names and returns a picture for the page. None knows what a diagnosis is.

pub(super) mod bars;
pub(super) mod calibration_curve;
pub(super) mod chart;
pub(super) mod forest;
pub(super) mod matrix;
pub(super) mod where_map;
