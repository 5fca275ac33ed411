//! Dry friction of a joint that builds up over a way: teeth and bearings bend before they slip.
//!
//! - Equation: `dw/dt = (dq - |dq| w) / displacement`, `tau_f = coulomb w + damping displacement dw/dt`; with bristles of
//!   stiffness `s0 = coulomb / displacement` that is LuGre's law without its Stribeck part, and Dahl's without damping.
//! - Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995; Dahl 1968.
//! - Units: coulomb N m at the joint, before the torque sensor; displacement rad; damping N m s/rad. Plausible: coulomb 0 to 3;
//!   displacement 1e-5 to 0.01, where it is not given 0.001; damping 0 to 10, 0 where it is not given.
//! - Signature (C4): a loop of torque over displacement with a memory, the same at all speeds; small reversals spring back.
//! - Confused with: Coulomb friction (its limit at no displacement; creep loses with speed, this with the way), backlash and
//!   elasticity (a loop without an area).

use super::effect::ArmEffect;
use crate::arm::{Joints, Presliding, Slip};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_presliding_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("coulomb", "N m", [0.0, 3.0], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.25])),
        Parameter::form("displacement", "rad", [1e-5, 0.01], 1e-3)
            .per_joint()
            .within(1e-9, f64::MAX)
            .begun_at(&[&[3e-4], &[3e-3]]),
        Parameter::form("damping", "N m s/rad", [0.0, 10.0], 0.0)
            .per_joint()
            .within(0.0, f64::MAX)
            .searched(Search::Held),
    ],
    confusable_with: &["joint_coulomb_friction", "joint_stribeck_friction", "joint_backlash", "joint_elasticity"],
    separated: &[
        Separation {
            from: "joint_coulomb_friction",
            by: "slow ramps from 0.005 to 0.5 rad/s with many reversals: friction that builds up over a way does so alike at all speeds",
            record: &[Experiment::Ramps],
        },
        Separation {
            from: "joint_backlash",
            by: "approach poses from both sides; then hang a weight on the flange that keeps the gears pressed, and do it again in a session of its own whose cell.toml has the weight",
            record: &[Experiment::Holds],
        },
        Separation {
            from: "joint_elasticity",
            by: "a chirp up to 40 Hz: a gear that yields rings, friction damps",
            record: &[Experiment::FastChirp],
        },
    ],
    install: |values, effects| {
        effects.arm.joint_presliding_friction = Some(JointPreslidingFriction {
            coulomb: values.joints("coulomb"),
            displacement: values.joints("displacement"),
            damping: values.joints("damping"),
        });
    },
    remedy: |found| {
        let (coulomb, displacement) = (found.joints("coulomb", "N m"), found.joints("displacement", "rad"));
        Remedy::new(
            "Warm the gears up before recording, and let motions that must be exact end from the same side: after a reversal the joint springs back within the way named for the model.",
            format!(
                "MuJoCo: joint frictionloss {coulomb}, with a softer solreffriction that lets the joint move by {displacement} before it slips. URDF and SDF: <dynamics friction> holds the torque alone."
            ),
        )
    },
    model: |found| {
        vec![
            Change::DryFriction { level: found.all("coulomb"), creep: vec![0.0] },
            Change::Beyond("the way over which dry friction builds up"),
        ]
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointPreslidingFriction {
    pub(super) coulomb: Joints,
    displacement: Joints,
    damping: Joints,
}

impl ArmEffect for JointPreslidingFriction {
    const IN_JOINTS: bool = true;

    fn dry_friction(&self, joint: usize, _: Slip) -> f64 {
        self.coulomb[joint]
    }
}

impl JointPreslidingFriction {
    pub(super) fn bristles(&self, joint: usize) -> Presliding {
        Presliding { displacement: self.displacement[joint], damping: self.damping[joint] }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};
    use crate::arm::JointState;

    const BLOCK: &str =
        "[[effect]]\nname = \"joint_presliding_friction\"\ncoulomb = 0.3\ndisplacement = 0.002\ndamping = 5.0";

    /// From 0 to 1 within so many ticks, so smoothly that nothing overshoots.
    fn rise(tick: usize, ticks: usize) -> f64 {
        0.5 - 0.5 * (std::f64::consts::PI * f64::min(1.0, tick as f64 / ticks as f64)).cos()
    }

    #[test]
    fn a_load_within_the_friction_is_held_after_the_way_that_the_law_says() {
        let effects = effects(BLOCK);
        for tau in [0.15, -0.24, 0.06_f64] {
            // w = tau / coulomb = 1 - exp(-q / displacement)
            let last = run(&joint(0.07), &effects, JointState::default(), 8000, |tick, _| tau * rise(tick, 6000))[8000];
            let way = -0.002 * (1.0 - tau.abs() / 0.3).ln() * tau.signum();
            assert!((last.q[0] / way - 1.0).abs() < 0.01, "{tau}: {} instead of {way}", last.q[0]);
            assert!(last.dq[0].abs() < 1e-6, "{}", last.dq[0]);
        }
    }

    #[test]
    fn a_joint_springs_back_when_the_load_goes_and_keeps_the_rest_of_the_loop() {
        let effects = effects(BLOCK);
        let load = |tick: usize| 0.2 * if tick < 6000 { rise(tick, 6000) } else { 1.0 - rise(tick - 6000, 6000) };
        let states = run(&joint(0.07), &effects, JointState::default(), 13_000, |tick, _| load(tick));
        // Up: 1 - w = exp(-q / d); back: 1 + w = (1 + w0) exp(-(q0 - q) / d), until w = 0.
        let w: f64 = 0.2 / 0.3;
        let (up, back) = (-0.002 * (1.0 - w).ln(), 0.002 * (1.0 + w).ln());
        assert!((states[6000].q[0] / up - 1.0).abs() < 0.01, "{} instead of {up}", states[6000].q[0]);
        let last = states[13_000].q[0];
        assert!((last / (up - back) - 1.0).abs() < 0.02, "{last} instead of {}", up - back);
    }

    #[test]
    fn in_motion_it_is_coulomb_friction_and_energy_is_only_lost() {
        let effects = effects(BLOCK);
        let states = run(&joint(0.07), &effects, turning(1.0), 100, |_, _| 0.0);
        let expected = 1.0 - 0.1 * 0.3 / (ROTOR + 0.07);
        assert!((states[100].dq[0] - expected).abs() < 1e-6, "{} instead of {expected}", states[100].dq[0]);
        // Stiff bristles, no damping, no load: kinetic energy and what the bristles store never grow.
        let stiff = effects_of(1e-5, 0.0);
        let mut states = run(&joint(0.07), &stiff, turning(0.02), 300, |_, _| 0.0);
        let last = states.split_off(200);
        assert!(last.iter().all(|state| state.dq[0].abs() < 0.02), "{:?}", last.last());
    }

    #[test]
    fn without_a_way_to_speak_of_it_sticks_like_coulomb_friction() {
        let (bent, dry) = (
            effects_of(1e-7, 1.0),
            effects("[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = 0.3\ncreep = 0.0"),
        );
        let swing = |tick: usize| 0.5 * (tick as f64 * 6e-3).sin();
        let [a, b] =
            [&bent, &dry].map(|effects| run(&joint(0.07), effects, JointState::default(), 3000, |tick, _| swing(tick)));
        let apart = a.iter().zip(&b).map(|(a, b)| (a.q[0] - b.q[0]).abs()).fold(0.0, f64::max);
        let far = b.iter().map(|state| state.q[0].abs()).fold(0.0, f64::max);
        assert!(apart < 2e-3 * far, "{apart} of {far}");
    }

    fn effects_of(displacement: f64, damping: f64) -> crate::effects::arm::ArmEffects {
        effects(&format!(
            "[[effect]]\nname = \"joint_presliding_friction\"\ncoulomb = 0.3\ndisplacement = {displacement:?}\ndamping = {damping:?}"
        ))
    }
}
