//! Ratios that people's units are apart by.

use super::limits::NEAR_CONVERSION;
use std::f64::consts::TAU;

/// A ratio and what it means for the larger quantity.
const KNOWN: [(f64, &str); 6] = [
    (57.295_78, "degrees for radians"),
    (1e3, "a thousandth of the unit"),
    (1e6, "a millionth of the unit"),
    (TAU, "radians for turns"),
    (60.0 / TAU, "turns a minute for radians a second"),
    (57.295_78 * 57.295_78, "degrees converted twice"),
];

/// What a ratio other than 1 means, whichever of both is the larger: the factor, and what one unit was taken for the other.
/// `None` where it is no known conversion.
pub(super) fn known(ratio: f64) -> Option<(f64, &'static str)> {
    let size = ratio.abs();
    let near = |factor: f64| (size / factor - 1.0).abs() < NEAR_CONVERSION;
    KNOWN
        .into_iter()
        .flat_map(|(factor, what)| [(factor, what), (factor.recip(), what)])
        .find(|(factor, _)| near(*factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_known_both_ways_and_a_controllers_error_is_none() {
        assert!(known(56.0).is_some_and(|(factor, what)| factor > 57.0 && what.contains("degrees")));
        assert!(known(0.0177).is_some_and(|(factor, _)| (factor * 57.295_78 - 1.0).abs() < 1e-9));
        assert!(known(-1010.0).is_some());
        assert_eq!([1.0, 0.8, 1.4, 30.0, 200.0].map(known), [None; 5]);
    }
}
