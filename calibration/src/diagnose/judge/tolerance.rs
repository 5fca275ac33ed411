//! Whether a gap is of interest at all: the laboratory's `[tolerance]`, and what smoothing a motion leaves of torques.

use shared_mem::cell::Tolerance;

/// Torques along a measured motion are predicted no better than this where cell.toml says nothing [N m]: accelerations are slopes of
/// smoothed velocities. Sessions of another engine with nothing wrong leave 0.23, identified models of real Pandas 0.1 to 0.4
/// (Gaz et al. 2019).
const TORQUE_NM: f64 = 0.3;

/// How large a gap is in units of the hand; `None` where that was not measured.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::diagnose) struct Measured {
    /// Root mean square over joints and time [rad].
    pub(in crate::diagnose) joints: Option<f64>,
    /// Root mean square over joints and time along the measured motion [N m].
    pub(in crate::diagnose) torques: Option<f64>,
    /// Mean ADD [m].
    pub(in crate::diagnose) object: Option<f64>,
}

/// Whether all that was measured lies within the tolerance.
pub(in crate::diagnose) fn holds(tolerance: &Tolerance, measured: Measured) -> bool {
    let torque = Some(tolerance.torque.unwrap_or(TORQUE_NM));
    let pairs = [(measured.joints, tolerance.joint), (measured.torques, torque), (measured.object, tolerance.position)];
    let mut known = pairs.into_iter().filter_map(|(gap, most)| Some((gap?, most.unwrap_or(0.0)))).peekable();
    known.peek().is_some() && known.all(|(gap, most)| gap < most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_within_the_tolerance_where_each_of_its_figures_is() {
        let stated = Tolerance { joint: Some(2e-3), torque: None, position: Some(3e-3) };
        let gap = |joints, object| Measured { joints, torques: None, object };
        assert!(holds(&stated, gap(Some(1e-3), None)) && holds(&stated, gap(Some(1e-3), Some(2e-3))));
        assert!(!holds(&stated, gap(Some(1e-3), Some(4e-3))) && !holds(&stated, gap(None, None)));
        assert!(!holds(&Tolerance::default(), gap(Some(1e-6), None)), "without a tolerance every gap counts");
        let torques = |torques| Measured { torques: Some(torques), ..Measured::default() };
        assert!(holds(&Tolerance::default(), torques(0.2)) && !holds(&Tolerance::default(), torques(0.4)));
    }
}
