//! The gears have play: within it the motor turns and the link does not feel it.
//!
//! - Equation: `tau_J = 0` while `|theta - q| < play / 2`; beyond, a spring of stiffness `1 / compliance`, or that of
//!   `joint_elasticity`. A flank only pushes.
//! - Source: Nordin, Gutman 2002 (dead zone with damping).
//! - Units: play rad, from flank to flank at the joint; compliance rad/(N m). Plausible: play 0 to 1e-3 on an arm of this
//!   class, to 0.03 on hobby servos; compliance 1e-7 (rigid: a full load twists it by 10 microrad) to 1e-4.
//! - Signature (C18): motion lost at each reversal of the torque, not of the velocity; chatter near no load.
//! - Confused with: Coulomb and Stribeck friction; a load that keeps one flank pressed makes it vanish.

use super::effect::ArmEffect;
use crate::arm::{Joints, Spring};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, degrees, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_backlash",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        // Hobby servos reach the end of the range; gears of an arm have a tenth of that play.
        Parameter::size("play", "rad", [0.0, 0.03], 0.0)
            .per_joint()
            .within(0.0, 1.0)
            .usually_up_to(3e-3)
            .searched(Search::Threshold),
        Parameter::form("compliance", "rad/(N m)", [1e-7, 1e-4], 1e-7)
            .per_joint()
            .within(1e-7, 1e-2)
            // Rigid flanks, and such as yield like the gears of an arm.
            .begun_at(&[&[1e-7], &[4e-5]]),
    ],
    confusable_with: &["joint_coulomb_friction", "joint_stribeck_friction", "joint_presliding_friction"],
    separated: &[],
    install: |values, effects| {
        effects.arm.joint_backlash =
            Some(JointBacklash { play: values.joints("play"), compliance: values.joints("compliance") });
    },
    remedy: |found| {
        let play = found.joints_by("play", &|play| format!("{} rad ({})", short(play), degrees(play)));
        let half = found.joints_by("play", &|play| format!("-{} to {} rad", short(0.5 * play), short(0.5 * play)));
        Remedy::new(
            format!(
                "Have the gears adjusted: play {play}. Until then approach every pose from the same side, or load the joint so that one flank stays pressed."
            ),
            format!("A second hinge between motor and link that turns freely from {half} and is stopped there."),
        )
    },
    model: |_| vec![Change::Beyond("play between motor and link")],
};

/// Damping of a flank [N m s/rad]: links part again with little speed.
const FLANK_DAMPING: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointBacklash {
    play: Joints,
    compliance: Joints,
}

impl ArmEffect for JointBacklash {
    const IN_JOINTS: bool = true;
}

impl JointBacklash {
    pub(super) fn spring(&self, joint: usize) -> Option<Spring> {
        let (play, stiffness) = (self.play[joint], self.compliance[joint].recip());
        (play > 0.0).then_some(Spring { stiffness, damping: FLANK_DAMPING, play })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint};
    use crate::arm::JointState;

    const BLOCK: &str = "[[effect]]\nname = \"joint_backlash\"\nplay = 0.01";

    #[test]
    fn the_motor_crosses_the_play_alone_and_then_takes_the_link_along() {
        let (arm, effects) = (joint(0.07), effects(BLOCK));
        let (mut state, mut memory) = effects.start(&arm, &JointState::default(), &[0.0; 8], &[0.0; 8]);
        let crossing = (2.0f64 * 0.005 * ROTOR / 0.3).sqrt();
        for tick in 1..=200 {
            effects.advance(&mut memory, &arm, &mut state, (&first(0.3), &[0.0; 8]), 1e-3);
            if f64::from(tick) * 1e-3 < crossing - 1e-3 {
                assert_eq!(state.q[0], 0.0, "the link stands until the flank is reached at {crossing} s");
            }
        }
        // Whatever the bounces were, momentum is the torque's impulse, and in the end the two move as one.
        let momentum = ROTOR * memory.motor.dq[0] + 0.07 * state.dq[0];
        assert!((momentum - 0.3 * 0.2).abs() < 1e-9, "{momentum}");
        for _ in 0..300 {
            effects.advance(&mut memory, &arm, &mut state, (&first(0.3), &[0.0; 8]), 1e-3);
        }
        let twist = memory.motor.q[0] - state.q[0];
        assert!((twist - 0.005 - 0.3 * 0.07 / (ROTOR + 0.07) / 1e7).abs() < 1e-9, "{twist}");
    }
}
