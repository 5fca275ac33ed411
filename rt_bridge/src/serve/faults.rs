//! What the served robot objects to, by the names of the protocol's list, and the shorthand to gather several.

use crate::arm::ReflexErrors;

/// The errors that this robot raises; the number is the place in the arrays `errors` and `reflex_reason`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Fault {
    JointPositionLimits = 0,
    SelfCollision = 2,
    JointVelocity = 3,
    CartesianVelocity = 4,
    JointReflex = 6,
    CartesianReflex = 7,
    GoalPoseDeviation = 8,
    PathPoseDeviation = 9,
    JointStartPose = 11,
    JointVelocityLimits = 13,
    JointVelocityDiscontinuity = 14,
    JointAccelerationDiscontinuity = 15,
    CartesianStartPose = 16,
    ElbowLimit = 17,
    CartesianVelocityLimits = 18,
    CartesianVelocityDiscontinuity = 19,
    CartesianAccelerationDiscontinuity = 20,
    ElbowSignInconsistent = 21,
    StartElbow = 22,
    CommunicationConstraints = 25,
    /// Also raised where no joint position has the commanded pose: then the arm cannot get there at any speed.
    CartesianJointVelocityLimits = 28,
    CartesianJointVelocityDiscontinuity = 29,
    CartesianJointAccelerationDiscontinuity = 30,
    InvalidFrame = 31,
    TorqueDiscontinuity = 32,
    TorqueRange = 34,
    /// A target that cannot be planned to. By which name the robot refuses one is not published.
    PlanningJointLimits = 38,
}

/// Nothing to object to, or everything there is.
pub(super) type Verdict = Result<(), ReflexErrors>;

impl Fault {
    /// This one alone.
    pub(super) fn alone(self) -> ReflexErrors {
        ReflexErrors::from_bits(1 << self as u8)
    }
}

/// Several at once: the robot raises all that hold.
pub(super) fn all(faults: &[Fault]) -> ReflexErrors {
    ReflexErrors::from_bits(faults.iter().fold(0, |bits, fault| bits | 1 << *fault as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_the_protocols_names_agree() {
        for (fault, name) in [
            (Fault::JointPositionLimits, "joint_position_limits_violation"),
            (Fault::SelfCollision, "self_collision_avoidance_violation"),
            (Fault::ElbowLimit, "cartesian_motion_generator_elbow_limit_violation"),
            (Fault::PlanningJointLimits, "joint_via_motion_generator_planning_joint_limit_violation"),
            (Fault::JointVelocity, "joint_velocity_violation"),
            (Fault::JointReflex, "joint_reflex"),
            (Fault::CartesianReflex, "cartesian_reflex"),
            (Fault::PathPoseDeviation, "max_path_pose_deviation_violation"),
            (Fault::JointStartPose, "joint_position_motion_generator_start_pose_invalid"),
            (Fault::JointVelocityLimits, "joint_motion_generator_velocity_limits_violation"),
            (Fault::JointVelocityDiscontinuity, "joint_motion_generator_velocity_discontinuity"),
            (Fault::JointAccelerationDiscontinuity, "joint_motion_generator_acceleration_discontinuity"),
            (Fault::CartesianStartPose, "cartesian_position_motion_generator_start_pose_invalid"),
            (Fault::CartesianVelocityLimits, "cartesian_motion_generator_velocity_limits_violation"),
            (Fault::CartesianVelocityDiscontinuity, "cartesian_motion_generator_velocity_discontinuity"),
            (Fault::CartesianAccelerationDiscontinuity, "cartesian_motion_generator_acceleration_discontinuity"),
            (Fault::ElbowSignInconsistent, "cartesian_motion_generator_elbow_sign_inconsistent"),
            (Fault::StartElbow, "cartesian_motion_generator_start_elbow_invalid"),
            (Fault::CommunicationConstraints, "communication_constraints_violation"),
            (Fault::CartesianJointVelocityLimits, "cartesian_motion_generator_joint_velocity_limits_violation"),
            (Fault::CartesianJointVelocityDiscontinuity, "cartesian_motion_generator_joint_velocity_discontinuity"),
            (
                Fault::CartesianJointAccelerationDiscontinuity,
                "cartesian_motion_generator_joint_acceleration_discontinuity",
            ),
            (Fault::InvalidFrame, "cartesian_position_motion_generator_invalid_frame_flag"),
            (Fault::TorqueDiscontinuity, "controller_torque_discontinuity"),
            (Fault::TorqueRange, "tau_J_range_violation"),
        ] {
            assert_eq!(fault.alone().to_string(), name);
        }
    }
}
