//! How far gains may be off that cell.toml states by value.

use inference::estimate::Unknown;
use shared_mem::cell::Cell;

/// How far gains stated by value may be off: cell.toml's own statement, and a quarter more.
const GAIN_TOLERANCE: f64 = 0.25;

/// Gains that cell.toml states by value are right to 20 %: without that, viscous friction is a damping that is off.
pub(super) fn keep(cell: &Cell, unknown: &mut Unknown) {
    let Some(controller) = &cell.controller else { return };
    let known =
        |name: &str, values: &[f64], ranged: bool| unknown.name.starts_with(name) && !ranged && !values.is_empty();
    let stated = known("stiffness", &controller.stiffness, controller.stiffness_range.is_some())
        || known("damping", &controller.damping, controller.damping_range.is_some());
    if stated {
        // The bounds are symmetric in the logarithm around the stated value.
        let nominal = (unknown.lower * unknown.upper).sqrt();
        unknown.lower = nominal * (1.0 - GAIN_TOLERANCE);
        unknown.upper = nominal * (1.0 + GAIN_TOLERANCE);
        unknown.start = unknown.start.clamp(unknown.lower, unknown.upper);
    }
}

/// Whether a gain with these bounds is known by its range alone.
pub(super) fn by_range(unknown: &Unknown) -> bool {
    let widest_stated = (1.0 + GAIN_TOLERANCE) / (1.0 - GAIN_TOLERANCE);
    unknown.upper > 1.01 * widest_stated * unknown.lower
}
