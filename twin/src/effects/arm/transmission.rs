//! All effects between motor and link together: dry frictions add up to one bound (that creeps as the one that creeps most, or
//! builds up over the way of presliding friction), the other losses to one drag, and elasticity and backlash to one spring
//! with play.

use super::{ArmEffects, ArmMemory};
use crate::arm::{ArmModel, JointState, Joints, MAX_JOINTS, Passed, Presliding, Slip, Spring, Transmission};

/// Longest step of a gear that yields [s]: a wrist link on its spring rings at up to 200 Hz.
const LONGEST_STEP: f64 = 2.5e-4;
/// Where friction turns round over some mrad/s it changes by as much as it can within a few periods of 1 ms: while a joint is slower
/// than so many times that, a period is taken in so many parts. One part leaves 55 sigma² of the torque asked for at a Stribeck
/// velocity of 14 mrad/s, two leave 5. Beyond, `exp(-25)` of the change is left.
const SLOW_RATIO: f64 = 5.0;
const SLOW_PARTS: usize = 4;
/// Where it turns round over hundreds of them, one part will do [rad/s].
const SLOW_AT_MOST: f64 = 0.05;
/// Bristles bend over a way; this is slow for some mrad [rad/s].
const SLOW_TO_BEND: f64 = 0.05;
/// A joint that is slower rests when it is first seen [rad/s]: encoders' noise, and a tenth of the slowest motions.
pub(super) const AT_REST: f64 = 1e-3;

impl ArmEffects {
    /// Whether motor and link of a joint may be at different positions.
    pub(crate) fn yields(&self) -> bool {
        self.joint_elasticity.is_some() || self.joint_backlash.is_some()
    }

    /// Twist at rest under a load [rad].
    pub(super) fn twist_under(&self, joint: usize, torque: f64) -> f64 {
        self.spring(joint).map_or(0.0, |spring| {
            let flank = if torque == 0.0 { 0.0 } else { torque.signum() };
            torque / spring.stiffness + 0.5 * spring.play * flank
        })
    }

    /// [`ArmEffects::advance`] where something acts in the joints.
    pub(super) fn advance_through(
        &self,
        memory: &mut ArmMemory,
        arm: &ArmModel,
        state: &mut JointState,
        torques: (&Joints, &Joints),
        dt: f64,
    ) -> Passed {
        let motor = &mut memory.motor;
        if self.joint_presliding_friction.is_none() {
            memory.bent = Some([0.0; MAX_JOINTS]);
        }
        let bent = memory.bent.get_or_insert_with(|| self.bent_at(arm, state, torques));
        let parts = if self.yields() {
            (dt / LONGEST_STEP - 1e-9).ceil().max(1.0) as usize
        } else {
            *motor = *state;
            let slow = |i: usize| state.dq[i].abs() < self.slow(i);
            if (0..arm.dof()).any(slow) { SLOW_PARTS } else { 1 }
        };
        arm.step_through(self, (state, motor, bent), torques, (dt, parts))
    }

    /// Below this speed the dry friction of a joint changes within a few periods [rad/s]; 0 where it turns round at once.
    fn slow(&self, joint: usize) -> f64 {
        let bends = if self.joint_presliding_friction.is_some() { SLOW_TO_BEND } else { 0.0 };
        (SLOW_RATIO * self.creep(joint).max(self.falls_over(joint))).min(SLOW_AT_MOST).max(bends)
    }

    /// How far bristles are bent where nothing is known of what was before: as far as keeps a joint at rest, wholly in motion.
    fn bent_at(&self, arm: &ArmModel, state: &JointState, (motor_torque, external): (&Joints, &Joints)) -> Joints {
        let bias = arm.bias(state);
        std::array::from_fn(|i| {
            let bound =
                self.dry_friction(i, Slip { q: state.q[i], speed: state.dq[i].abs(), motor_torque: motor_torque[i] });
            let load = motor_torque[i] + external[i] - bias[i];
            match bound > 0.0 {
                true if state.dq[i].abs() > AT_REST => state.dq[i].signum(),
                true => (load / bound).clamp(-1.0, 1.0),
                false => 0.0,
            }
        })
    }
}

impl Transmission for ArmEffects {
    fn spring(&self, joint: usize) -> Option<Spring> {
        let elastic = self.joint_elasticity.and_then(|effect| effect.spring(joint));
        match self.joint_backlash.and_then(|effect| effect.spring(joint)) {
            None => elastic,
            Some(backlash) => Some(elastic.map_or(backlash, |spring| Spring { play: backlash.play, ..spring })),
        }
    }

    fn dry_friction(&self, joint: usize, slip: Slip) -> f64 {
        self.all_dry_friction(joint, slip)
    }

    fn presliding(&self, joint: usize) -> Option<Presliding> {
        self.joint_presliding_friction.map(|effect| effect.bristles(joint))
    }

    fn creep(&self, joint: usize) -> f64 {
        self.largest_creep(joint)
    }

    fn drag(&self, joint: usize, q: f64, dq: f64) -> f64 {
        self.all_drag(joint, q, dq)
    }
}
