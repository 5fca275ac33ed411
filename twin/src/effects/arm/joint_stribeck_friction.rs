//! Dry friction of a joint that is larger at creep than in motion.
//!
//! - Equation: `tau_f = (coulomb + excess exp(-(dq / velocity)^2)) sgn(dq)`; at rest up to `coulomb + excess`.
//!   `creep` as in Coulomb friction.
//! - Source: Armstrong-Helouvry et al. 1994, section 2.1 (Stribeck curve, Gaussian form).
//! - Units: coulomb, excess N m at the joint, before the torque sensor; velocity rad/s. Plausible: coulomb and
//!   excess 0 to 3, an excess up to once coulomb; velocity 0.01 to 0.2.
//! - Signature (C3): what Coulomb friction does not explain lies below three times `velocity`; stick-slip at creep.
//! - Confused with: Coulomb friction (its limit at no excess), backlash, encoder quantisation.

use super::effect::ArmEffect;
use super::joint_coulomb_friction::CREEP;
use crate::arm::{Joints, Slip};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_stribeck_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("coulomb", "N m", [0.0, 3.0], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.25])),
        Parameter::size("excess", "N m", [0.0, 3.0], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.25])),
        Parameter::form("velocity", "rad/s", [0.01, 0.2], 0.05)
            .per_joint()
            .within(1e-6, f64::MAX)
            .begun_at(&[&[0.03], &[0.1]]),
        CREEP,
    ],
    confusable_with: &["joint_coulomb_friction", "joint_backlash", "joint_presliding_friction"],
    separated: &[Separation {
        from: "joint_backlash",
        by: "approach poses from both sides; then hang a weight on the flange that keeps the gears pressed, and do it again in a session of its own whose cell.toml has the weight",
        record: &[Experiment::Holds],
    }],
    install: |values, effects| {
        effects.arm.joint_stribeck_friction = Some(JointStribeckFriction {
            coulomb: values.joints("coulomb"),
            excess: values.joints("excess"),
            velocity: values.joints("velocity"),
            creep: values.joints("creep"),
        });
    },
    remedy: |found| {
        let (coulomb, excess) = (found.joints("coulomb", "N m"), found.joints("excess", "N m"));
        let velocity = found.joints("velocity", "rad/s");
        Remedy::new(
            "Avoid creeping: move faster than three times the speeds named for the model, or warm the gears up before recording.",
            format!(
                "MuJoCo: joint frictionloss {coulomb}, and as a passive force what creep adds, \
                 -excess exp(-(dq / v)^2) sgn(dq), with an excess of {excess} and v of {velocity}. URDF: <dynamics friction> holds the first part alone."
            ),
        )
    },
    model: |found| {
        vec![
            Change::DryFriction { level: found.all("coulomb"), creep: found.all("creep") },
            Change::Beyond("what dry friction has more of at creep"),
        ]
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointStribeckFriction {
    coulomb: Joints,
    excess: Joints,
    velocity: Joints,
    pub(super) creep: Joints,
}

impl ArmEffect for JointStribeckFriction {
    const IN_JOINTS: bool = true;

    fn dry_friction(&self, joint: usize, slip: Slip) -> f64 {
        let ratio = slip.speed / self.velocity[joint];
        self.coulomb[joint] + self.excess[joint] * (-ratio * ratio).exp()
    }

    fn creep(&self, joint: usize) -> f64 {
        self.creep[joint]
    }

    fn falls_over(&self, joint: usize) -> f64 {
        if self.excess[joint] > 0.0 { self.velocity[joint] } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};
    use crate::arm::JointState;

    const BLOCK: &str =
        "[[effect]]\nname = \"joint_stribeck_friction\"\ncoulomb = 0.2\nexcess = 0.15\nvelocity = 0.05\ncreep = 0.0";

    #[test]
    fn breaking_loose_takes_the_excess_and_fast_motion_does_not_feel_it() {
        let (arm, effects) = (joint(0.07), effects(BLOCK));
        assert_eq!(run(&arm, &effects, JointState::default(), 500, |_, _| 0.3499)[500], JointState::default());
        assert!(run(&arm, &effects, JointState::default(), 500, |_, _| 0.36)[500].dq[0] > 0.1);
        let fast = run(&arm, &effects, turning(1.0), 100, |_, _| 0.0)[100];
        assert!((fast.dq[0] - (1.0 - 0.1 * 0.2 / (ROTOR + 0.07))).abs() < 1e-9, "{}", fast.dq[0]);
    }
}
