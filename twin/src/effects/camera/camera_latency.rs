//! The object was there earlier than the stamp of its pose says.
//!
//! - Equation: `pose_reported(t) = pose(t - latency)`, on top of the latency that cell.toml knows.
//! - Source: exposure, transfer and estimation take time; 9 to 70 ms on depth cameras.
//! - Unit: s. Plausible: 0 to 0.1.
//! - Signature (V4): error of `latency v`, none at rest; contact seems late.
//! - Confused with: command delay (moves the contact too), tracker smoothing.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, milliseconds, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "camera_latency",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[Parameter::size("latency", "s", [0.0, 0.1], 0.0).within(0.0, 10.0)],
    confusable_with: &["command_delay", "tracker_smoothing"],
    separated: &[Separation {
        from: "tracker_smoothing",
        by: "fix a block where the object slides to, so that it stops sharply: smoothing rounds the stop, latency does not",
        record: &[Experiment::Strokes],
    }],
    install: |values, effects| {
        effects.camera.camera_latency = Some(CameraLatency { latency: values.number("latency") })
    },
    remedy: |found| {
        let latency = found.number("latency");
        let known = found.cell().camera.as_ref().map_or(0.0, |camera| camera.latency);
        Remedy::new(
            format!(
                "In cell.toml under [camera]: latency = {} ({} s more than there is).",
                short(known + latency),
                short(latency)
            ),
            format!("Report poses {} later, or shift the recorded ones by so much.", milliseconds(latency)),
        )
    },
    model: |found| vec![Change::PoseLatency(found.number("latency"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CameraLatency {
    /// [s]
    latency: f64,
}

impl CameraLatency {
    pub(super) fn nanoseconds(&self) -> u64 {
        (self.latency * 1e9).round() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_camera::effects;

    #[test]
    fn a_pose_is_older_than_its_stamp_by_the_latency() {
        assert_eq!(effects("[[effect]]\nname = \"camera_latency\"\nlatency = 0.04").latency_ns(), 40_000_000);
    }
}
