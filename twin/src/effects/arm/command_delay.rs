//! The command reaches the controller late.
//!
//! - Equation: `q_d(t) -> q_d(t - delay)`, `dq_d` alike; a fraction of a tick lies on the straight line between two ticks.
//! - Source: transport delay of network and application layers; 1 to 10 ms on a Franka, 10 to 550 ms in application layers.
//! - Unit: s. Plausible: 0 to 0.1. Possible: up to 2.
//! - Signature (C13): phase lag linear in frequency, no change of gain; error of about `delay dq`.
//! - Confused with: command lag (in slow motion exactly), viscous friction, camera latency (where only the camera sees the arm).

use super::effect::ArmEffect;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, milliseconds, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "command_delay",
    stage: Stage::Control,
    acts_on: Place::CommandPath,
    parameters: &[Parameter::size("delay", "s", [0.0, 0.1], 0.0).within(0.0, 2.0).searched(Search::Lateness)],
    confusable_with: &["command_lag", "joint_viscous_friction", "camera_latency"],
    separated: &[
        Separation {
            from: "command_lag",
            by: "a chirp up to 10 Hz: only a lag lowers the gain",
            record: &[Experiment::Chirp],
        },
        Separation {
            from: "camera_latency",
            by: "a chirp, and a stroke again at half its speed: a late command is late in the encoders too, a late camera only in the poses",
            record: &[Experiment::Chirp, Experiment::StrokeAgainSlower],
        },
    ],
    install: |values, effects| effects.arm.command_delay = Some(CommandDelay { delay: values.number("delay") }),
    remedy: |found| {
        let delay = found.number("delay");
        let (time, steps) = (milliseconds(delay), short(1e3 * delay));
        Remedy::new(
            format!(
                "Commands arrive {time} late: send them so much earlier, or shorten their way (a cable instead of a radio link, fewer buffers and processes between planner and robot)."
            ),
            format!("Add a delay of {time} ({steps} steps of 1 ms) before the controller."),
        )
    },
    model: |found| vec![Change::CommandDelay(found.number("delay"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CommandDelay {
    /// [s]
    pub(super) delay: f64,
}

impl ArmEffect for CommandDelay {}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{effects, first, joint};
    use crate::arm::JointState;

    #[test]
    fn a_ramp_comes_late_by_the_delay_and_so_does_its_slope() {
        let (arm, effects) = (joint(0.07), effects("[[effect]]\nname = \"command_delay\"\ndelay = 0.0124"));
        let still = JointState::default();
        let (_, mut memory) = effects.start(&arm, &still, &still.q, &still.dq);
        for tick in 0..100 {
            let t = f64::from(tick) * 1e-3;
            let (q_d, dq_d) = effects.command(&mut memory, &first(0.5 * t), &first(0.5));
            let late = t - 0.0124;
            assert!((q_d[0] - 0.5 * late.max(0.0)).abs() < 1e-12, "{t}: {}", q_d[0]);
            let slope = if late < -1e-3 {
                0.0
            } else if late < 0.0 {
                0.3
            } else {
                0.5
            };
            assert!((dq_d[0] - slope).abs() < 1e-12, "{t}: {}", dq_d[0]);
        }
    }
}
