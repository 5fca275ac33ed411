//! Poses and twists of the end effector as set points.
//!
//! Base frame; a twist is the velocity of the commanded frame's origin [m/s], then its angular velocity [rad/s]. What is
//! commanded goes through inverse kinematics and has to be possible for the joints as well: most commands that a robot
//! refuses, it refuses there.

use super::Surroundings;
use super::rules::{FOLLOWING, JointRules, check_end_effector, check_end_effector_end, exceeds};
use crate::safety::Trace;
use crate::serve::faults::{Fault, Verdict};
use crate::serve::kinematics::{ELBOW, elbow};
use crate::serve::settings::isometry;
use crate::serve::wire::SetPoint;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use shared_mem::time::TICK;
use twin::arm::{Joints, pose_difference};

/// How far from the arm's desired pose a motion may begin [m, rad], and from its elbow [rad]. The robot's own
/// tolerances are not published.
const START: [f64; 2] = [0.01, 0.05];

/// Pose, twist and rate of the twist.
#[derive(Debug, Clone, Copy)]
pub(in crate::serve) struct CartesianTrace {
    pub(in crate::serve) pose: Isometry3<f64>,
    pub(in crate::serve) twist: Vector6<f64>,
    pub(in crate::serve) acceleration: Vector6<f64>,
}

/// What the end effector is to do.
#[derive(Debug, Clone)]
pub(in crate::serve) struct CartesianGenerator {
    twists: bool,
    begun: bool,
    trace: CartesianTrace,
    joints: Trace,
}

impl CartesianGenerator {
    pub(super) fn of_poses(q: &Joints, around: &Surroundings) -> Self {
        let zero = Vector6::zeros();
        let trace = CartesianTrace { pose: around.ee.pose(q), twist: zero, acceleration: zero };
        Self { twists: false, begun: false, trace, joints: Trace::at_rest(*q) }
    }

    pub(super) fn of_twists(q: &Joints, around: &Surroundings) -> Self {
        Self { twists: true, ..Self::of_poses(q, around) }
    }

    pub(super) fn trace(&self) -> &CartesianTrace {
        &self.trace
    }

    pub(super) fn joints(&self) -> &Trace {
        &self.joints
    }

    pub(super) fn follow(&mut self, set_point: Option<&SetPoint>, around: &Surroundings) -> Verdict {
        let Some(set_point) = set_point else {
            self.go_on(around);
            return Ok(());
        };
        let next = self.trace.to(&self.commanded_pose(set_point)?);
        if !self.begun {
            self.check_start(set_point, &next.pose)?;
        }
        if let Some([_, side]) = set_point.elbow_c
            && side != elbow(&self.joints.q)[1]
        {
            return Err(Fault::ElbowSignInconsistent.alone());
        }
        let joint_3 = set_point.elbow_c.map(|[position, _]| position);
        let elbow = &around.rules.limits.joints[ELBOW];
        if joint_3.is_some_and(|position| !(elbow.q_min..=elbow.q_max).contains(&position)) {
            return Err(Fault::ElbowLimit.alone());
        }
        let jerk = (next.acceleration - self.trace.acceleration) / TICK;
        check_end_effector(&next.twist, &next.acceleration, &jerk)?;
        let q =
            around.ee.reach(&self.joints.q, &next.pose, joint_3).ok_or(Fault::CartesianJointVelocityLimits.alone())?;
        let joints = self.joints.after(&q, TICK);
        around.rules.check(&self.joints, &joints, &FOLLOWING)?;
        (self.begun, self.trace, self.joints) = (true, next, joints);
        Ok(())
    }

    fn commanded_pose(&self, set_point: &SetPoint) -> Result<Isometry3<f64>, crate::arm::ReflexErrors> {
        if !self.twists {
            return isometry(&set_point.O_T_EE_c).ok_or(Fault::InvalidFrame.alone());
        }
        let twist = Vector6::from(set_point.O_dP_EE_c);
        let sane = twist.iter().all(|x| x.is_finite());
        sane.then(|| moved(&self.trace.pose, &twist)).ok_or(Fault::CartesianVelocityDiscontinuity.alone())
    }

    fn check_start(&self, set_point: &SetPoint, pose: &Isometry3<f64>) -> Verdict {
        let miss = pose_difference(&self.trace.pose, pose);
        let [way, turn] = START;
        if exceeds(miss.fixed_rows::<3>(0).norm(), way) || exceeds(miss.fixed_rows::<3>(3).norm(), turn) {
            return Err(Fault::CartesianStartPose.alone());
        }
        match set_point.elbow_c {
            Some([position, _]) if exceeds((position - self.joints.q[ELBOW]).abs(), turn) => {
                Err(Fault::StartElbow.alone())
            }
            _ => Ok(()),
        }
    }

    /// One period on at the same acceleration; where no joint position has that pose, the joints go on alone.
    fn go_on(&mut self, around: &Surroundings) {
        let CartesianTrace { pose, twist, acceleration } = self.trace;
        let twist = twist + acceleration * TICK;
        let pose = moved(&pose, &twist);
        self.trace = CartesianTrace { pose, twist, acceleration };
        self.joints = match around.ee.reach(&self.joints.q, &pose, None) {
            Some(q) => self.joints.after(&q, TICK),
            None => self.joints.onward(TICK),
        };
    }

    pub(super) fn finish(&self, rules: &JointRules) -> Verdict {
        check_end_effector_end(&self.trace.twist)?;
        rules.check_end(&self.joints, &FOLLOWING)
    }
}

impl CartesianTrace {
    /// The trace after `pose` was commanded.
    fn to(&self, pose: &Isometry3<f64>) -> Self {
        let twist = pose_difference(&self.pose, pose) / TICK;
        Self { pose: *pose, twist, acceleration: (twist - self.twist) / TICK }
    }
}

/// The pose after a period at `twist`.
fn moved(pose: &Isometry3<f64>, twist: &Vector6<f64>) -> Isometry3<f64> {
    let (linear, angular): (Vector3<f64>, Vector3<f64>) =
        (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + linear * TICK),
        UnitQuaternion::from_scaled_axis(angular * TICK) * pose.rotation,
    )
}
