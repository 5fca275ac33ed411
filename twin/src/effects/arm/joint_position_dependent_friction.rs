//! Dry friction of a joint that rises and falls once a turn, as gears that are worn or run out of true have it.
//!
//! - Equation: `tau_f = amplitude (1 + cos(q - phase)) / 2 sgn(dq)`; at rest up to that. `creep` as in Coulomb friction, which
//!   has what is the same all around.
//! - Source: Armstrong-Helouvry, Control of Machines with Friction (1991): friction of a PUMA over the angle of its joints;
//!   Popovic and Goldenberg, Modeling of friction using spectral analysis, IEEE T-RA 14 (1998): its harmonics, of which this is
//!   the first.
//! - Units: amplitude N m at the joint, before the torque sensor, most of it at the angle `phase` and none half a turn on; phase
//!   rad, -pi to pi. Plausible: amplitude 0 to 1.5, half of what Coulomb friction may be (a choice).
//! - Signature: odd in velocity and flat over it at every angle; what is lost at a reversal differs from pose to pose.
//! - Confused with: Coulomb friction (alike in one pose), load friction (follows the pose too), torque ripple (even in velocity).

use super::effect::ArmEffect;
use super::joint_coulomb_friction::CREEP;
use crate::arm::{Joints, Slip};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};
use std::f64::consts::{FRAC_PI_2, PI};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_position_dependent_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("amplitude", "N m", [0.0, 1.5], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.125]))
            // In a clip that turns a joint by less than a radian it is Coulomb friction; the diagnosis's thresholds are
            // calibrated without it.
            .searched(Search::OnRequest),
        Parameter::form("phase", "rad", [-PI, PI], 0.0).per_joint().searched(Search::Angle { quarter: FRAC_PI_2 }),
        CREEP,
    ],
    confusable_with: &["joint_coulomb_friction", "joint_load_friction", "torque_ripple"],
    separated: &[
        Separation {
            from: "joint_coulomb_friction",
            by: "slow ramps through the whole range of the joint, to and fro",
            record: &[Experiment::Ramps],
        },
        Separation {
            from: "joint_load_friction",
            by: "slow ramps once empty and once with a weight on the flange, in a session of its own whose cell.toml has the weight",
            record: &[Experiment::Ramps, Experiment::Ramps],
        },
    ],
    install: |values, effects| {
        effects.arm.joint_position_dependent_friction = Some(JointPositionDependentFriction {
            amplitude: values.joints("amplitude"),
            phase: values.joints("phase"),
            creep: values.joints("creep"),
        });
    },
    remedy: |found| {
        let (amplitude, phase) = (found.joints("amplitude", "N m"), found.joints("phase", "rad"));
        Remedy::new(
            format!(
                "Look after the gears: friction is largest at joint positions of {phase}, where wear, dirt or a shaft out of true are to be sought; work at other positions meanwhile."
            ),
            format!(
                "Set the joint friction anew each step to A (1 + cos(q - phase)) / 2 with A of {amplitude} and a phase of {phase} (MuJoCo: frictionloss; URDF has no word for it)."
            ),
        )
    },
    model: |_| vec![Change::Beyond("dry friction that depends on the joint's position")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointPositionDependentFriction {
    amplitude: Joints,
    phase: Joints,
    creep: Joints,
}

impl ArmEffect for JointPositionDependentFriction {
    const IN_JOINTS: bool = true;

    fn dry_friction(&self, joint: usize, slip: Slip) -> f64 {
        0.5 * self.amplitude[joint] * (1.0 + (slip.q - self.phase[joint]).cos())
    }

    fn creep(&self, joint: usize) -> f64 {
        self.creep[joint]
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint, run, turning};
    use crate::arm::JointState;
    use std::f64::consts::PI;

    const BLOCK: &str =
        "[[effect]]\nname = \"joint_position_dependent_friction\"\namplitude = 0.3\nphase = 0.4\ncreep = 0.0";

    #[test]
    fn a_joint_is_held_most_at_the_phase_half_as_much_a_quarter_turn_on_and_not_at_all_opposite() {
        let (arm, effects) = (joint(0.07), effects(BLOCK));
        let after = |q: f64, tau: f64| {
            let start = JointState { q: first(q), dq: [0.0; 8] };
            run(&arm, &effects, start, 100, |_, _| tau)[100].dq[0]
        };
        assert_eq!((after(0.4, 0.299), after(0.4 + 0.5 * PI, 0.149)), (0.0, 0.0));
        assert!(after(0.4, 0.31) > 0.0 && after(0.4 + 0.5 * PI, 0.16) > 0.0 && after(0.4 + PI, 1e-3) > 0.0);
    }

    #[test]
    fn a_turning_joint_loses_the_work_of_the_friction_along_its_way() {
        let inertia = ROTOR + 0.07;
        let end = run(&joint(0.07), &effects(BLOCK), turning(3.0), 500, |_, _| 0.0)[500];
        let way = end.q[0];
        let work = 0.5 * 0.3 * (way + (way - 0.4).sin() + 0.4f64.sin());
        let lost = 0.5 * inertia * (9.0 - end.dq[0].powi(2));
        assert!(way > 0.5 && (lost / work - 1.0).abs() < 2e-3, "{lost} J lost, {work} J of work over {way} rad");
    }
}
