//! Figures: each takes plain numbers and names and returns a picture for the page. None knows what a diagnosis is.

pub(crate) mod bars;
pub(crate) mod calibration_curve;
pub(crate) mod chart;
pub(crate) mod forest;
pub(crate) mod matrix;
pub(crate) mod regression;
pub(crate) mod scatter;
mod shares;
pub(crate) mod where_map;
