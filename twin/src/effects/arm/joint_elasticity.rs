//! The gears yield: motor and link of a joint are two bodies with a spring between them.
//!
//! - Equation: `tau_J = stiffness (theta - q) + damping (dtheta - dq)`; the rotor inertia lies on the motor's side. The
//!   encoders sit on the motors, as on a Franka.
//! - Source: Spong 1987, reduced model of the elastic joint. Integrated implicitly: [`crate::arm::Transmission`].
//! - Units: stiffness N m/rad; damping N m s/rad. Plausible: stiffness 1e3 to 2e4 (a first mode of 5 to 40 Hz), neutral
//!   without bound (`inf`); damping 0 to 10. A joint without rotor inertia stays rigid.
//! - Signature (C17): sags by `tau_J / stiffness`, seen by a camera and not by the encoders; a resonance.
//! - Confused with: payload and camera extrinsics (static sag), torque delay (rings too), rotor inertia below resonance.

use super::effect::ArmEffect;
use crate::arm::{Joints, Spring};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::Remedy;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_elasticity",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("stiffness", "N m/rad", [1e3, 2e4], f64::INFINITY)
            .per_joint()
            .within(1.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([12.0, 230.0])),
        Parameter::form("damping", "N m s/rad", [0.0, 10.0], 2.0).per_joint().within(0.0, f64::MAX),
    ],
    confusable_with: &[
        "payload",
        "rotor_inertia",
        "torque_delay",
        "camera_extrinsic_rotation",
        "joint_presliding_friction",
    ],
    separated: &[],
    install: |values, effects| {
        effects.arm.joint_elasticity =
            Some(JointElasticity { stiffness: values.joints("stiffness"), damping: values.joints("damping") });
    },
    remedy: |found| {
        let (stiffness, damping) = (found.joints("stiffness", "N m/rad"), found.joints("damping", "N m s/rad"));
        Remedy::new(
            "Measure the tool's place on the link's side (a camera sees the sag, the encoders do not), and keep accelerations low where it rings.",
            format!(
                "A second hinge between motor and link, its spring {stiffness}, its damper {damping}; the armature stays on the motor's side."
            ),
        )
    },
    model: |_| vec![Change::Beyond("a spring between motor and link")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointElasticity {
    stiffness: Joints,
    damping: Joints,
}

impl ArmEffect for JointElasticity {
    const IN_JOINTS: bool = true;
}

impl JointElasticity {
    pub(super) fn spring(&self, joint: usize) -> Option<Spring> {
        let (stiffness, damping) = (self.stiffness[joint], self.damping[joint]);
        stiffness.is_finite().then_some(Spring { stiffness, damping, play: 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint, run};
    use crate::arm::{ArmModel, JointState};

    fn block(stiffness: f64, damping: f64) -> String {
        format!("[[effect]]\nname = \"joint_elasticity\"\nstiffness = {stiffness:?}\ndamping = {damping:?}")
    }

    #[test]
    fn motor_and_link_swing_against_each_other_at_their_frequency() {
        let (link, stiffness) = (0.07, 800.0);
        let (arm, effects) = (joint(link), effects(&block(stiffness, 0.0)));
        let (_, mut memory) = effects.start(&arm, &JointState::default(), &[0.0; 8], &[0.0; 8]);
        // The link stands, twisted against the motor by 1 mrad: both swing about their common centre.
        let mut state = JointState { q: first(1e-3), dq: [0.0; 8] };
        let centre = 1e-3 * link / (link + ROTOR);
        let mut crossings = Vec::new();
        for tick in 0..500 {
            let before = state.q[0] - centre;
            effects.advance(&mut memory, &arm, &mut state, (&[0.0; 8], &[0.0; 8]), 1e-3);
            let after = state.q[0] - centre;
            if before < 0.0 && after >= 0.0 {
                crossings.push(f64::from(tick) + before / (before - after));
            }
        }
        let period = (crossings[crossings.len() - 1] - crossings[0]) * 1e-3 / (crossings.len() - 1) as f64;
        let expected = std::f64::consts::TAU / (stiffness * (1.0 / link + 1.0 / ROTOR)).sqrt();
        assert!((period / expected - 1.0).abs() < 2e-3, "{period} s instead of {expected} s");
    }

    #[test]
    fn a_load_twists_the_gear_by_its_torque_over_the_stiffness() {
        let (arm, effects) = (ArmModel::fr3(), effects(&block(7000.0, 5.0)));
        let reading = JointState::at_rest(*arm.ready());
        let (state, memory) = effects.start(&arm, &reading, &reading.q, &reading.dq);
        let gravity = arm.gravity(&reading.q);
        for (i, gravity) in gravity.iter().enumerate().take(7) {
            assert!((reading.q[i] - state.q[i] - gravity / 7000.0).abs() < 1e-15);
        }
        assert_eq!(effects.measured(&memory, &state), reading, "the encoders see the motors");
    }

    #[test]
    fn a_stiff_gear_moves_like_a_rigid_one() {
        let arm = joint(0.07);
        let [stiff, rigid] = [effects(&block(1e7, 100.0)), super::super::ArmEffects::default()]
            .map(|effects| run(&arm, &effects, JointState::default(), 200, |tick, _| (tick as f64 * 0.05).sin())[200]);
        assert!((stiff.q[0] - rigid.q[0]).abs() < 1e-6, "{} {}", stiff.q[0], rigid.q[0]);
        assert!((stiff.dq[0] - rigid.dq[0]).abs() < 1e-5, "{} {}", stiff.dq[0], rigid.dq[0]);
    }
}
