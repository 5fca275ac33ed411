//! What a robot's safety functions can object to: the 41 errors of FCI version 10, as one bit each.

use std::fmt;

/// Names in the order of the arrays `errors` and `reflex_reason` of an FCI version 10 state.
const NAMES: [&str; 41] = [
    "joint_position_limits_violation",
    "cartesian_position_limits_violation",
    "self_collision_avoidance_violation",
    "joint_velocity_violation",
    "cartesian_velocity_violation",
    "force_control_safety_violation",
    "joint_reflex",
    "cartesian_reflex",
    "max_goal_pose_deviation_violation",
    "max_path_pose_deviation_violation",
    "cartesian_velocity_profile_safety_violation",
    "joint_position_motion_generator_start_pose_invalid",
    "joint_motion_generator_position_limits_violation",
    "joint_motion_generator_velocity_limits_violation",
    "joint_motion_generator_velocity_discontinuity",
    "joint_motion_generator_acceleration_discontinuity",
    "cartesian_position_motion_generator_start_pose_invalid",
    "cartesian_motion_generator_elbow_limit_violation",
    "cartesian_motion_generator_velocity_limits_violation",
    "cartesian_motion_generator_velocity_discontinuity",
    "cartesian_motion_generator_acceleration_discontinuity",
    "cartesian_motion_generator_elbow_sign_inconsistent",
    "cartesian_motion_generator_start_elbow_invalid",
    "force_controller_desired_force_tolerance_violation",
    "start_elbow_sign_inconsistent",
    "communication_constraints_violation",
    "power_limit_violation",
    "cartesian_motion_generator_joint_position_limits_violation",
    "cartesian_motion_generator_joint_velocity_limits_violation",
    "cartesian_motion_generator_joint_velocity_discontinuity",
    "cartesian_motion_generator_joint_acceleration_discontinuity",
    "cartesian_position_motion_generator_invalid_frame_flag",
    "controller_torque_discontinuity",
    "joint_p2p_insufficient_torque_for_planning",
    "tau_J_range_violation",
    "instability_detected",
    "joint_move_in_wrong_direction",
    "cartesian_spline_motion_generator_violation",
    "joint_via_motion_generator_planning_joint_limit_violation",
    "base_acceleration_initialization_timeout",
    "base_acceleration_invalid_reading",
];

/// A set of FCI errors: bit i stands for error i of the protocol's list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReflexErrors(u64);

impl ReflexErrors {
    /// From bits, bit i for error i.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// From the protocol's array of flags.
    pub fn from_flags(flags: &[bool]) -> Self {
        Self(flags.iter().take(64).enumerate().fold(0, |bits, (i, set)| bits | u64::from(*set) << i))
    }

    pub fn bits(self) -> u64 {
        self.0
    }

    /// `true` when nothing is objected to.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl fmt::Display for ReflexErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("no reason given");
        }
        let mut separator = "";
        for (_, name) in NAMES.iter().enumerate().filter(|(i, _)| self.0 >> i & 1 == 1) {
            write!(f, "{separator}{name}")?;
            separator = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_and_bits_say_the_same() {
        let mut flags = [false; 41];
        flags[32] = true;
        let errors = ReflexErrors::from_flags(&flags);
        assert_eq!(errors, ReflexErrors::from_bits(1 << 32));
        assert_eq!(errors.to_string(), "controller_torque_discontinuity");
    }
}
