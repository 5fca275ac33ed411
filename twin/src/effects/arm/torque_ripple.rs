//! The motors' torque varies with their position.
//!
//! - Equation: `tau_f = amplitude sin(order q + phase)` at each joint.
//! - Source: cogging and wave-generator ripple of harmonic drives (twice a motor turn: order = twice the gear ratio).
//! - Units: amplitude N m at the joint; order 1 (periods per turn of the joint); phase rad. Plausible: amplitude 0 to 0.5,
//!   order 10 to 400, phase -pi to pi. Two periods per motor turn behind the smallest gears of robot arms (quasi-direct drives,
//!   5 to 1) are ten per turn of the joint. Below, a ripple is weight with more freedom: gravity at a joint has orders up to the
//!   number of joints that turn along with it, eight at most.
//! - Signature (C7): locked to the position, so its frequency is proportional to the speed.
//! - Confused with: joint elasticity (a fixed frequency), noise.

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;
use std::f64::consts::{FRAC_PI_2, PI};

/// Orders of the ripple of gears and motors [1]: from two per motor turn behind a gear of 5 to 1 to four behind one of 100 to 1.
const ORDERS: [f64; 2] = [10.0, 400.0];

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "torque_ripple",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("amplitude", "N m", [0.0, 0.5], 0.0)
            .per_joint()
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.05])),
        Parameter::form("order", "1", ORDERS, 200.0).per_joint().searched(Search::Periodic).begun_at(&[
            &[ORDERS[0]],
            &[20.0],
            &[40.0],
            &[60.0],
            &[100.0],
            &[200.0],
        ]),
        Parameter::form("phase", "rad", [-PI, PI], 0.0).per_joint().searched(Search::Angle { quarter: FRAC_PI_2 }),
    ],
    confusable_with: &["joint_elasticity", "joint_coulomb_friction"],
    separated: &[],
    install: |values, effects| {
        effects.arm.torque_ripple = Some(TorqueRipple {
            amplitude: values.joints("amplitude"),
            order: values.joints("order"),
            phase: values.joints("phase"),
        });
    },
    remedy: |found| {
        let (amplitude, order) = (found.joints("amplitude", "N m"), found.joints("order", "1"));
        let phase = found.joints("phase", "rad");
        Remedy::new(
            format!(
                "Feed forward A sin(order q + phase) with A of {amplitude}, an order of {order} and a phase of {phase}."
            ),
            format!(
                "A passive joint force -A sin(order q + phase) with A of {amplitude}, an order of {order} and a phase of {phase}."
            ),
        )
    },
    model: |_| vec![Change::Beyond("torque that varies with the position")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TorqueRipple {
    amplitude: Joints,
    order: Joints,
    phase: Joints,
}

impl ArmEffect for TorqueRipple {
    const IN_JOINTS: bool = true;

    fn drag(&self, joint: usize, q: f64, _: f64) -> f64 {
        self.amplitude[joint] * (self.order[joint] * q + self.phase[joint]).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint, run, turning};
    use super::ORDERS;
    use crate::arm::JointState;
    use shared_mem::msg::MAX_JOINTS;

    #[test]
    fn no_order_is_one_that_weight_has() {
        // sin(q1 + ... + qn) of joints that move alike: order n.
        assert!(ORDERS[0] > MAX_JOINTS as f64);
    }

    #[test]
    fn a_joint_rests_in_a_trough_and_keeps_its_energy_over_the_ripple() {
        let effects =
            effects("[[effect]]\nname = \"torque_ripple\"\namplitude = 0.1\norder = 20.0\nphase = 1.5707963267948966");
        let arm = joint(0.07);
        // cos(20 q) = 0 with a restoring slope: at q = -pi/40.
        let trough = JointState { q: first(-std::f64::consts::PI / 40.0), dq: [0.0; 8] };
        assert!((run(&arm, &effects, trough, 100, |_, _| 0.0)[100].q[0] - trough.q[0]).abs() < 1e-12);
        let inertia = ROTOR + 0.07;
        let energy = |s: &JointState| 0.5 * inertia * s.dq[0].powi(2) + 0.1 / 20.0 * (20.0 * s.q[0]).sin();
        let states = run(&arm, &effects, turning(1.0), 1000, |_, _| 0.0);
        assert!((energy(&states[1000]) / energy(&states[0]) - 1.0).abs() < 1e-4);
    }
}
