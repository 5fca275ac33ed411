//! Links have weight that the model does not know of: no masses are given for the arm.
//!
//! - Equation: `tau_w = constant + sine sin(q) + cosine cos(q)`, a torque that pulls at the joint and that no controller takes
//!   off. Of an arm whose other joints rest this is gravity exactly, for each joint with its own three numbers (Spong, Hutchinson,
//!   Vidyasagar, "Robot Modeling and Control", chapter 7: a planar arm's potential energy); the constant takes up springs and
//!   axes that are not level as well.
//! - Units: N m. Plausible: what a joint holds for long, up to 0.8 of its torque limit; 5 N m where that is not known.
//! - Signature: at rest a joint stays off its command, by more where it reaches further out.
//! - Confused with: payload, base tilt, joint friction asymmetry (which change a weight that is known, or add a constant).
//!
//! Where the masses of the links are known it is no cause that a diagnosis looks for; where they are not
//! (`[robot] joints` without `urdf`), its numbers are identified with the gains.

use super::effect::ArmEffect;
use crate::arm::{JointState, Joints};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;

/// Searched this far [N m], where no torque limit is known.
const HELD: [f64; 2] = [-5.0, 5.0];
/// The same as a share of the torque limit.
const SHARE_HELD: Elsewhere = Elsewhere::OfTorqueLimit([-0.8, 0.8]);

/// One of three numbers of every joint; no cause, since every arm has weight.
const fn weight(name: &'static str) -> Parameter {
    Parameter::size(name, "N m", HELD, 0.0).per_joint().elsewhere(SHARE_HELD).searched(Search::OnRequest)
}

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_weight",
    stage: Stage::Control,
    acts_on: Place::ArmModel,
    parameters: &[
        weight("constant"),
        weight("sine"),
        weight("cosine"),
    ],
    confusable_with: &["payload", "base_tilt", "joint_friction_asymmetry"],
    separated: &[],
    install: |values, effects| {
        let [constant, sine, cosine] = ["constant", "sine", "cosine"].map(|name| values.joints(name));
        effects.arm.joint_weight = Some(JointWeight { constant, sine, cosine });
    },
    remedy: |found| {
        let of = |name: &str| found.joints(name, "N m");
        Remedy::new(
            "Nothing: arms have weight.".to_owned(),
            format!(
                "Give the URDF of the arm with masses (`urdf` under [robot]), or add a joint torque of -({}) - ({}) sin(q) - ({}) cos(q).",
                of("constant"),
                of("sine"),
                of("cosine")
            ),
        )
    },
    model: |found| {
        let constant = found.all("constant").into_iter().map(|torque| -torque).collect();
        let turns = ["sine", "cosine"].iter().any(|name| found.all(name).iter().any(|torque| *torque != 0.0));
        let rest = turns
            .then_some(Change::Beyond("weight of links whose masses are not known, as it follows the joint's angle"));
        [Change::ConstantTorque(constant)].into_iter().chain(rest).collect()
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointWeight {
    constant: Joints,
    sine: Joints,
    cosine: Joints,
}

impl ArmEffect for JointWeight {}

impl JointWeight {
    /// Torques that hold the arm at `q` against this weight [N m].
    pub(super) fn held_at(&self, q: &Joints) -> Joints {
        std::array::from_fn(|i| {
            let (sin, cos) = q[i].sin_cos();
            self.constant[i] + self.sine[i] * sin + self.cosine[i] * cos
        })
    }

    /// Torques from outside over a step of `dt` seconds, this weight among them [N m]: taken in the middle of the way, so that
    /// the step stays of second order.
    pub(super) fn beside(&self, external: &Joints, state: &JointState, dt: f64) -> Joints {
        let held = self.held_at(&std::array::from_fn(|i| state.q[i] + 0.5 * dt * state.dq[i]));
        std::array::from_fn(|i| external[i] - held[i])
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint, run, turning};
    use crate::arm::JointState;

    const BLOCK: &str = "[[effect]]\nname = \"joint_weight\"\nconstant = 0.2\nsine = 1.5\ncosine = -0.4";

    #[test]
    fn a_pendulum_keeps_its_energy() {
        let (inertia, weight) = (ROTOR + 0.07, effects(BLOCK));
        let energy = |state: &JointState| {
            let (sin, cos) = state.q[0].sin_cos();
            0.5 * inertia * state.dq[0].powi(2) + 0.2 * state.q[0] - 1.5 * cos - 0.4 * sin
        };
        let states = run(&joint(0.07), &weight, turning(3.0), 2000, |_, _| 0.0);
        let most = states.iter().map(|state| state.q[0].abs()).fold(0.0, f64::max);
        assert!(most > 0.5, "it hardly swings");
        for state in &states {
            assert!((energy(state) - energy(&states[0])).abs() < 1e-4 * 1.5, "{}", energy(state) - energy(&states[0]));
        }
    }

    #[test]
    fn what_holds_it_keeps_it_at_rest_with_friction_and_a_gear_that_yields_too() {
        for beside in [
            "",
            "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = 0.1\ncreep = 0.0",
            "[[effect]]\nname = \"joint_elasticity\"\nstiffness = 3000.0\ndamping = 1.0",
        ] {
            let both = effects(&format!("{BLOCK}\n{beside}"));
            let start = JointState { q: first(0.7), dq: first(0.0) };
            let weight = both.joint_weight.expect("weight");
            let states = run(&joint(0.07), &both, start, 500, |_, state| weight.held_at(&state.q)[0]);
            assert!(
                (states[500].q[0] - states[0].q[0]).abs() < 1e-5,
                "{beside}: {}",
                states[500].q[0] - states[0].q[0]
            );
        }
    }
}
