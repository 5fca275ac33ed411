//! Dry friction of a joint, the same at all speeds.
//!
//! - Equation: `tau_f = coulomb sgn(dq)` in motion; at rest whatever up to `coulomb` keeps the joint at rest. With
//!   `creep` above 0: `tau_f = coulomb tanh(dq / creep)`, and no rest under a load.
//! - Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 2.1; sizes: Gaz et al. 2019 on the Panda.
//! - Units: coulomb N m at the joint, before the torque sensor; creep rad/s. Plausible: coulomb 0 to 3 (Panda 0.15 to
//!   1.2); creep 0 to 0.02, 0.002 where it is not given.
//! - Signature (C1): odd in velocity and flat over it; `2 coulomb / stiffness` lost at each reversal; odd harmonics.
//! - Confused with: load friction (alike in one pose), backlash (lost motion too), Stribeck friction (needs creep).

use super::effect::ArmEffect;
use crate::arm::{Joints, Slip};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_coulomb_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("coulomb", "N m", [0.0, 3.0], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.25])),
        CREEP,
    ],
    confusable_with: &["joint_load_friction", "joint_stribeck_friction", "joint_backlash", "joint_presliding_friction"],
    separated: &[
        Separation {
            from: "joint_load_friction",
            by: "slow ramps once with the arm stretched out and once folded; move it there by hand before each",
            record: &[Experiment::Ramps, Experiment::Ramps],
        },
        Separation {
            from: "joint_stribeck_friction",
            by: "slow ramps from 0.005 to 0.5 rad/s with many reversals",
            record: &[Experiment::Ramps],
        },
        Separation {
            from: "joint_backlash",
            by: "approach poses from both sides, and run slow ramps: friction holds at any load, play only where the torque changes its sign",
            record: &[Experiment::Holds, Experiment::Ramps],
        },
    ],
    install: |values, effects| {
        effects.arm.joint_coulomb_friction =
            Some(JointCoulombFriction { coulomb: values.joints("coulomb"), creep: values.joints("creep") });
    },
    remedy: |found| {
        let joints = found.joints("coulomb", "N m");
        Remedy::new(
            "Warm the gears up before recording and look after their grease; what is left belongs to the gears, so it goes into the model.",
            format!("MuJoCo: joint frictionloss {joints}. URDF and SDF: the same numbers as <dynamics friction>."),
        )
    },
    model: |found| vec![Change::DryFriction { level: found.all("coulomb"), creep: found.all("creep") }],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointCoulombFriction {
    pub(super) coulomb: Joints,
    pub(super) creep: Joints,
}

impl ArmEffect for JointCoulombFriction {
    const IN_JOINTS: bool = true;

    fn dry_friction(&self, joint: usize, _: Slip) -> f64 {
        self.coulomb[joint]
    }

    fn creep(&self, joint: usize) -> f64 {
        self.creep[joint]
    }
}

/// Of every dry friction: speed over which it builds up, as `tanh(dq / creep)`. Gears creep before they break loose, and
/// many models soften friction like this; 0 makes it stick exactly.
pub(super) const CREEP: Parameter =
    Parameter::form("creep", "rad/s", [0.0, 0.02], 0.002).per_joint().within(0.0, f64::MAX).searched(Search::Held);

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};
    use crate::arm::JointState;

    const BLOCK: &str = "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.3]\ncreep = [0.0]";

    #[test]
    fn a_free_joint_stops_after_half_its_energy_over_friction_and_stays() {
        let inertia = ROTOR + 0.07;
        let states = run(&joint(0.07), &effects(BLOCK), turning(0.6), 400, |_, _| 0.0);
        let stop = inertia * 0.6 / 0.3;
        let at_100_ms = &states[100];
        assert!((at_100_ms.dq[0] - (0.6 - 0.1 * 0.3 / inertia)).abs() < 1e-12, "{at_100_ms:?}");
        let angle = 0.5 * inertia * 0.36 / 0.3;
        let last = states[400];
        assert!((last.q[0] - angle).abs() < 1e-6, "stops at {} after {stop} s, not at {angle}", last.q[0]);
        assert_eq!((last.dq[0], last.q[0]), (0.0, states[250].q[0]), "creeps");
    }

    #[test]
    fn a_joint_at_rest_moves_only_beyond_the_friction() {
        let (arm, effects) = (joint(0.07), effects(BLOCK));
        let held = run(&arm, &effects, JointState::default(), 1000, |_, _| 0.2999)[1000];
        assert_eq!(held, JointState::default());
        let moved = run(&arm, &effects, JointState::default(), 1000, |_, _| -0.31)[1000];
        assert!((moved.dq[0] + 0.01 / 0.1).abs() < 1e-9, "{}", moved.dq[0]);
    }

    #[test]
    fn a_joint_that_creeps_yields_to_every_load() {
        let creeping = effects(&BLOCK.replace("[0.0]", "[0.002]"));
        let at = |tau: f64| run(&joint(0.07), &creeping, JointState::default(), 1000, |_, _| tau)[1000].dq[0];
        for tau in [0.05, 0.15, -0.28] {
            let creep = 0.002 * f64::atanh(tau / 0.3);
            assert!((at(tau) - creep).abs() < 0.02 * creep.abs(), "{tau}: {} instead of {creep}", at(tau));
        }
        let slipping = |effects| run(&joint(0.07), effects, turning(0.6), 100, |_, _| 0.0)[100].dq[0];
        assert!((slipping(&creeping) - slipping(&effects(BLOCK))).abs() < 1e-4, "friction in motion is the same");
    }

    #[test]
    fn a_driven_arm_sticks_in_the_joints_that_friction_holds_and_in_no_other() {
        let arm = crate::arm::ArmModel::fr3();
        let theta =
            "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.9, 0.9, 0.9, 0.9, 0.6, 0.4, 0.3]\ncreep = 0.0";
        let theta: shared_mem::theta::Theta =
            shared_mem::toml_file::parse(theta, std::path::Path::new("theta.toml")).expect("a theta.toml");
        let effects = crate::effects::Effects::from_theta(&theta.effects, 7).expect("a known effect").arm;
        let start = JointState::at_rest(*arm.ready());
        let (mut state, mut memory) = effects.start(&arm, &start, &start.q, &[0.0; 8]);
        for _ in 0..200 {
            let mut tau = arm.bias(&state);
            tau[3] += 3.0;
            effects.advance(&mut memory, &arm, &mut state, (&tau, &[0.0; 8]), 1e-3);
        }
        assert!(state.dq[3] > 0.1, "{:?}", state.dq);
        // Joint 4's motion pulls hard at joint 2 and not at all at joint 1, in the plane of the ready pose.
        assert_eq!((state.dq[0], state.q[0]), (0.0, start.q[0]));
        assert!(state.dq[1] != 0.0, "{:?}", state.dq);
    }
}
