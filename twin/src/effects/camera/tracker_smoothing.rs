//! The tracker smooths its poses.
//!
//! - Equation: `time_constant dy/dt + y = pose`, taken exactly from picture to picture; rotations along the shorter arc.
//! - Source: first-order filters of object trackers, one to three pictures long.
//! - Unit: s. Plausible: 0 to 0.2.
//! - Signature (V10): lags in motion, rounds the corner at the impact and the stop; none at rest.
//! - Confused with: camera latency (no rounding), command lag, contact compliance.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, milliseconds};
use nalgebra::Isometry3;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "tracker_smoothing",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[Parameter::size("time_constant", "s", [0.0, 0.2], 0.0).within(0.0, 10.0)],
    confusable_with: &["camera_latency", "command_lag", "contact_compliance"],
    separated: &[],
    install: |values, effects| {
        effects.camera.tracker_smoothing = Some(TrackerSmoothing { time_constant: values.number("time_constant") });
    },
    remedy: |found| {
        let time = milliseconds(found.number("time_constant"));
        Remedy::new(
            format!("Switch the tracker's smoothing off, or shorten its time constant of {time}."),
            format!(
                "Nothing in the cell's model; a simulated tracker reports poses through a first-order low-pass of time constant {time}."
            ),
        )
    },
    model: |_| vec![Change::Beyond("a low-pass in the tracker")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TrackerSmoothing {
    /// [s]
    time_constant: f64,
}

impl TrackerSmoothing {
    /// The smoothed pose `elapsed` seconds after the one before.
    pub(super) fn follow(&self, last: &Isometry3<f64>, pose: &Isometry3<f64>, elapsed: f64) -> Isometry3<f64> {
        let share = -(-elapsed / self.time_constant).exp_m1();
        let translation = last.translation.vector.lerp(&pose.translation.vector, share);
        let rotation = last.rotation.try_slerp(&pose.rotation, share, 1e-9).unwrap_or(pose.rotation);
        Isometry3::from_parts(translation.into(), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::super::CameraMemory;
    use super::super::test_camera::effects;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn a_jump_is_followed_exponentially_whatever_the_rate() {
        let effects = effects("[[effect]]\nname = \"tracker_smoothing\"\ntime_constant = 0.05");
        let (from, to) = (Isometry3::identity(), Isometry3::new(Vector3::x(), Vector3::z() * 0.4));
        for stamps in [&[100_000_000u64][..], &[20_000_000, 30_000_000, 100_000_000][..]] {
            let mut memory = CameraMemory::default();
            assert_eq!(effects.report(&mut memory, 0, &from), from);
            let seen = stamps.iter().map(|stamp| effects.report(&mut memory, *stamp, &to)).last().expect("a pose");
            let expected = 1.0 - (-2.0f64).exp();
            assert!((seen.translation.x - expected).abs() < 1e-12, "{}", seen.translation.x);
            assert!((seen.rotation.angle() / 0.4 - expected).abs() < 1e-12, "{}", seen.rotation.angle());
        }
    }
}
