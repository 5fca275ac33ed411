//! The controller sums up what a joint is off, until nothing is.
//!
//! - Equation: `tau += s`, `ds/dt = rate k (q_d - q)`, `k` the stiffness: a PID law whose integral gain is `rate k`. While the torque
//!   is at its limit nothing is summed. A recording that begins at rest begins with what holds the joint there.
//! - Source: Astrom, Hagglund 1995, PID Controllers, sections 3.2 (law) and 3.5 (windup); `1 / rate` is their integral time.
//! - Unit: 1/s. Plausible: 0 to 20, neutral 0; beyond about a tenth of the loop's bandwidth it overshoots.
//! - Signature: errors at rest fade within `1 / rate`; slow swings lead instead of lagging.
//! - Confused with: payload and base tilt (what it fades), dry friction (a stuck joint is pushed free in the end).

use super::effect::ArmEffect;
use super::transmission::AT_REST;
use crate::arm::{ArmModel, ControlLaw, JointState, Joints};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};
use shared_mem::time::TICK;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "integral_action",
    stage: Stage::Control,
    acts_on: Place::TorquePath,
    parameters: &[Parameter::size("rate", "1/s", [0.0, 20.0], 0.0).per_joint().within(0.0, 1000.0)],
    confusable_with: &["payload", "base_tilt", "joint_coulomb_friction"],
    separated: &[Separation {
        from: "joint_coulomb_friction",
        by: "rest in eight poses: an integral fades what the joint is off there, friction keeps it",
        record: &[Experiment::Holds],
    }],
    install: |values, effects| effects.arm.integral_action = Some(IntegralAction { rate: values.joints("rate") }),
    remedy: |found| {
        let rate = found.joints("rate", "1/s");
        Remedy::new(
            format!(
                "Switch the integral part of the drives off where they allow it; it acts like one of {rate} times the stiffness."
            ),
            format!(
                "An integral gain of {rate} times the stiffness beside it (MuJoCo: a second actuator of dyntype=\"integrator\" on the position's error, or the PID plugin)."
            ),
        )
    },
    model: |_| vec![Change::Beyond("a controller that sums up what a joint is off")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct IntegralAction {
    rate: Joints,
}

impl ArmEffect for IntegralAction {}

impl IntegralAction {
    /// What had been summed up where an arm rests at `reading` under `tau` [N m]; nothing of joints that move, and of those
    /// without integral action.
    pub(super) fn settled(&self, arm: &ArmModel, reading: &JointState, tau: &Joints) -> Joints {
        let gravity = arm.gravity(&reading.q);
        std::array::from_fn(|i| {
            let rests = self.rate[i] > 0.0 && reading.dq[i].abs() < AT_REST;
            if rests { gravity[i] - tau[i] } else { 0.0 }
        })
    }

    /// The torque that is asked for in this tick; `summed` goes on by one tick.
    pub(super) fn asked(
        &self,
        summed: &mut Joints,
        law: &ControlLaw,
        (reading, q_d): (&JointState, &Joints),
        tau: &Joints,
    ) -> Joints {
        std::array::from_fn(|i| {
            let (limit, now) = (law.torque_limit[i], tau[i] + summed[i]);
            let step = self.rate[i] * law.stiffness[i] * (q_d[i] - reading.q[i]) * TICK;
            if now.abs() < limit || step * now < 0.0 {
                summed[i] += step;
            }
            now.clamp(-limit, limit)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint};
    use crate::arm::{ControlLaw, JointState, MAX_JOINTS};
    use crate::control::{ArmMotion, ArmRollout, Drive};
    use shared_mem::cell::ControllerKind;

    const INERTIA: f64 = ROTOR + 0.07;
    const STIFFNESS: f64 = 40.0;
    const DAMPING: f64 = 4.0;
    const RATE: f64 = 3.0;

    /// The joint's way to a command that jumps to 0.1 rad, at every tick.
    fn way(ticks: usize) -> Vec<f64> {
        let effects = effects(&format!("[[effect]]\nname = \"integral_action\"\nrate = {RATE:?}"));
        let (arm, nominal) = (joint(0.07), joint(0.07));
        let law = ControlLaw {
            kind: ControllerKind::JointImpedance,
            stiffness: first(STIFFNESS),
            damping: first(DAMPING),
            torque_limit: [f64::INFINITY; MAX_JOINTS],
        };
        let rollout = ArmRollout { arm: &arm, nominal: &nominal, law: &law, effects: Some(&effects), parts: 1 };
        let mut motion = ArmMotion::unstarted();
        rollout.put(&mut motion, &JointState::default(), &first(0.0), &first(0.0));
        let hold = |q_d: f64| Drive::JointImpedance { q_d: first(q_d), dq_d: first(0.0) };
        rollout.period(&mut motion, &hold(0.0));
        let step = |_| {
            rollout.period(&mut motion, &hold(0.1));
            motion.state.q[0]
        };
        (0..ticks).map(step).collect()
    }

    #[test]
    fn a_step_is_answered_as_by_a_pid_controller() {
        // I q'' = k e - d q' + s, s' = rate k e, in steps that are 20 times finer.
        let (mut q, mut dq, mut s, mut at) = (0.0, 0.0, 0.0, Vec::new());
        let dt = 5e-5;
        for tick in 0..1500 * 20 {
            let e = 0.1 - q;
            let before = dq;
            dq += dt * (STIFFNESS * e - DAMPING * dq + s) / INERTIA;
            q += 0.5 * dt * (before + dq);
            s += dt * RATE * STIFFNESS * e;
            if tick % 20 == 19 {
                at.push(q);
            }
        }
        let simulated = way(1500);
        let apart = simulated.iter().zip(&at).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-3, "{apart}");
        let most = simulated.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.11, "an integral overshoots: {most}");
    }

    #[test]
    fn nothing_is_summed_while_the_torque_is_at_its_limit_but_what_leads_away_from_it() {
        let effect = super::IntegralAction { rate: first(RATE) };
        let law = ControlLaw {
            kind: ControllerKind::JointImpedance,
            stiffness: first(STIFFNESS),
            damping: first(DAMPING),
            torque_limit: [2.0; MAX_JOINTS],
        };
        let after = |tau: f64, error: f64| {
            let mut summed = first(0.5);
            let asked = effect.asked(&mut summed, &law, (&JointState::default(), &first(error)), &first(tau));
            (asked[0], summed[0])
        };
        let step = RATE * STIFFNESS * 0.1 * 1e-3;
        assert_eq!(after(1.0, 0.1), (1.5, 0.5 + step));
        assert_eq!(after(4.0, 0.1), (2.0, 0.5), "at the limit");
        assert_eq!(after(4.0, -0.1), (2.0, 0.5 - step), "away from it");
        assert_eq!(after(-4.0, -0.1), (-2.0, 0.5), "at the other one");
    }
}
