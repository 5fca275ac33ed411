//! Feedforward of the inertia: `M(q) ddq_d`, the torque that the desired acceleration takes of the controller's model, beside its
//! spring, damper, gravity and Coriolis torques (Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics, section 8.5.2). The desired
//! acceleration is the change of the desired velocity from one control period to the next, as a controller knows it.

use crate::arm::{ArmModel, JointState, Joints};
use shared_mem::time::TICK;

/// Desired acceleration from the velocities that were desired a control period ago and now [rad/s²].
pub(super) fn acceleration(before: &Joints, now: &Joints) -> Joints {
    std::array::from_fn(|i| (now[i] - before[i]) / TICK)
}

/// Torque of the acceleration [N m].
pub(super) fn torque(model: &ArmModel, state: &JointState, ddq_d: &Joints) -> Joints {
    let mass = model.mass_matrix(&state.q);
    std::array::from_fn(|i| mass[i].iter().zip(ddq_d).map(|(m, a)| m * a).sum())
}

#[cfg(test)]
mod tests {
    use crate::arm::{ArmModel, ControlLaw, JointState, MAX_JOINTS};
    use crate::control::{ArmMotion, ArmRollout, Drive};
    use shared_mem::cell::ControllerKind;

    /// How far an FR3 with these soft gains is off a swing of 0.3 rad at 1 Hz at most, in joint 2 [rad].
    fn off(kind: ControllerKind) -> f64 {
        let arm = ArmModel::fr3();
        let law = ControlLaw {
            kind,
            stiffness: [60.0; MAX_JOINTS],
            damping: [8.0; MAX_JOINTS],
            torque_limit: *arm.torque_limit(),
        };
        let rollout = ArmRollout { arm: &arm, nominal: &arm, law: &law, effects: None, parts: 1 };
        let (ready, turn) = (*arm.ready(), std::f64::consts::TAU);
        let desired = |tick: u32| {
            let t = f64::from(tick) * 1e-3;
            let (mut q_d, mut dq_d) = (ready, [0.0; MAX_JOINTS]);
            q_d[1] += 0.15 * (1.0 - (turn * t).cos());
            dq_d[1] = 0.15 * turn * (turn * t).sin();
            (q_d, dq_d)
        };
        let mut motion = ArmMotion::unstarted();
        rollout.put(&mut motion, &JointState::at_rest(ready), &ready, &[0.0; MAX_JOINTS]);
        let mut most = 0.0_f64;
        for tick in 0..1500 {
            let (q_d, dq_d) = desired(tick);
            most = most.max((motion.state.q[1] - q_d[1]).abs());
            rollout.period(&mut motion, &Drive::JointImpedance { q_d, dq_d });
        }
        most
    }

    #[test]
    fn an_arm_that_is_fed_its_inertia_follows_a_swing_that_the_spring_alone_does_not() {
        let [without, with] = [ControllerKind::JointImpedance, ControllerKind::InverseDynamics].map(off);
        assert!(without > 0.05, "{without}");
        // What stays is the period that a difference comes late.
        assert!(with < 0.01 * without, "{with} of {without}");
    }
}
