//! How far, fast and hard each joint may go. Units: rad, s, N m.

use shared_mem::msg::MAX_JOINTS;
use twin::arm::ArmModel;

/// Limits of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Lowest position [rad].
    pub q_min: f64,
    /// Highest position [rad].
    pub q_max: f64,
    /// Highest speed anywhere [rad/s].
    pub velocity: f64,
    /// Highest acceleration [rad/s²].
    pub acceleration: f64,
    /// Highest jerk [rad/s³].
    pub jerk: f64,
    /// Deceleration that the position-dependent speed limit counts on [rad/s²].
    pub deceleration: f64,
    /// Speed that is taken off the position-dependent limit [rad/s].
    pub velocity_offset: f64,
    /// Highest torque, gravity not counted [N m].
    pub torque: f64,
    /// Highest change of torque [N m/s].
    pub torque_rate: f64,
}

impl JointLimits {
    /// A joint without limits: for the unused entries of an array.
    pub const FREE: Self = Self {
        q_min: f64::NEG_INFINITY,
        q_max: f64::INFINITY,
        velocity: f64::INFINITY,
        acceleration: ACCELERATION,
        jerk: JERK,
        deceleration: ACCELERATION,
        velocity_offset: 0.0,
        torque: f64::INFINITY,
        torque_rate: f64::INFINITY,
    };

    /// Highest speed towards `q_max` (`direction` +1) or `q_min` (-1) at position `q`, when at most `deceleration` is
    /// there for stopping: `min(v_max, max(0, -offset + sqrt(2 dec distance)))`, the FR3's own rule.
    #[must_use]
    pub fn speed_towards(&self, direction: f64, q: f64, deceleration: f64) -> f64 {
        let distance = if direction > 0.0 { self.q_max - q } else { q - self.q_min };
        let stoppable = (2.0 * deceleration * distance.max(0.0)).sqrt() - self.velocity_offset;
        stoppable.clamp(0.0, self.velocity)
    }
}

/// Limits of an arm; entries beyond `dof` are [`JointLimits::FREE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Joints that count.
    pub dof: usize,
    /// One entry per joint.
    pub joints: [JointLimits; MAX_JOINTS],
}

/// Torque rate that an FR3 accepts [N m/s]; it also serves for arms that name none.
pub const TORQUE_RATE: f64 = 1000.0;
/// Acceleration of every FR3 joint [rad/s²]; it also serves for arms that name none.
pub const ACCELERATION: f64 = 10.0;
/// Jerk of every FR3 joint [rad/s³]; it also serves for arms that name none.
pub const JERK: f64 = 5000.0;

impl Limits {
    /// Franka Research 3, system image 5.9.0 and later: the vendor's specification page.
    #[must_use]
    pub fn fr3() -> Self {
        // q_min, q_max, velocity, deceleration, velocity offset, torque
        const TABLE: [[f64; 6]; 7] = [
            [-2.9007, 2.9007, 2.62, 6.0, 0.6599, 87.0],
            [-1.8361, 1.8361, 2.62, 2.585, 0.2517, 87.0],
            [-2.9007, 2.9007, 2.62, 3.5, 0.2000, 87.0],
            [-3.0770, -0.1169, 2.62, 4.0, 0.3533, 87.0],
            [-2.8763, 2.8763, 5.26, 17.0, 0.5757, 12.0],
            [0.4398, 4.6216, 4.18, 5.5, 0.4878, 12.0],
            [-3.0508, 3.0508, 5.26, 17.0, 0.4628, 12.0],
        ];
        let mut limits = Self { dof: TABLE.len(), joints: [JointLimits::FREE; MAX_JOINTS] };
        for (joint, [q_min, q_max, velocity, deceleration, velocity_offset, torque]) in
            limits.joints.iter_mut().zip(TABLE)
        {
            *joint = JointLimits {
                q_min,
                q_max,
                velocity,
                acceleration: ACCELERATION,
                jerk: JERK,
                deceleration,
                velocity_offset,
                torque,
                torque_rate: TORQUE_RATE,
            };
        }
        limits
    }

    /// What a model knows of its own arm (position, speed, torque); acceleration, jerk and torque rate are an FR3's.
    #[must_use]
    pub fn of_model(arm: &ArmModel) -> Self {
        let mut limits = Self { dof: arm.dof(), joints: [JointLimits::FREE; MAX_JOINTS] };
        for (i, joint) in limits.joints.iter_mut().enumerate().take(arm.dof()) {
            *joint = JointLimits {
                q_min: arm.q_min()[i],
                q_max: arm.q_max()[i],
                velocity: arm.velocity_limit()[i],
                torque: arm.torque_limit()[i],
                torque_rate: TORQUE_RATE,
                ..JointLimits::FREE
            };
        }
        limits
    }

    /// The same with torques no larger than those of `arm`, which cell.toml may have lowered.
    #[must_use]
    pub fn with_torque_of(mut self, arm: &ArmModel) -> Self {
        for (joint, torque) in self.joints.iter_mut().zip(arm.torque_limit()).take(self.dof) {
            joint.torque = joint.torque.min(*torque);
        }
        self
    }

    /// The joints that count.
    pub fn counted(&self) -> impl Iterator<Item = &JointLimits> {
        self.joints.iter().take(self.dof)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_fr3_may_go_full_speed_in_the_middle_and_none_at_the_end() {
        let joint = Limits::fr3().joints[0];
        assert!((joint.speed_towards(1.0, 0.0, joint.deceleration) - 2.62).abs() < 1e-12);
        // -0.6599 + sqrt(2 * 6 * 0.1) at a tenth of a radian from the end
        let near = joint.speed_towards(1.0, 2.8007, joint.deceleration);
        assert!((near - (1.2_f64.sqrt() - 0.6599)).abs() < 1e-9);
        assert!(joint.speed_towards(1.0, 2.9007, joint.deceleration).abs() < 1e-12);
        assert!(joint.speed_towards(-1.0, 2.9007, joint.deceleration) > 2.6);
    }
}
