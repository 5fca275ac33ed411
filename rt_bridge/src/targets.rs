//! From `/arm/target` to the control thread: targets that are too old are left out, and poses become joints. In the pump's
//! thread: the control thread computes no inverse kinematics.

use crate::motion::Target;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use shared_mem::msg::Joints;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::target::{ArmTarget, SILENCE_NS, TargetKind};
use shared_mem::time::now_ns;
use twin::arm::{ArmModel, Limits};

/// Turns what was sent into joints.
#[derive(Debug)]
pub struct Targets {
    model: ArmModel,
    limits: Limits,
    /// Stream and joints of the last pose: the next one's are searched from there.
    last: Option<(u64, Joints)>,
    /// The stream of the last complaint.
    complained: u64,
}

impl Targets {
    /// For an arm.
    #[must_use]
    pub fn new(model: ArmModel, limits: Limits) -> Self {
        Self { model, limits, last: None, complained: 0 }
    }

    /// The joints of a target that was just received, with the arm in this state. `None`: it does not count.
    ///
    /// # Errors
    /// What is wrong with the stream, once.
    pub fn take(&mut self, target: &ArmTarget, state: &ArmState) -> Result<Option<Target>, String> {
        // A stamp of the future is none of this machine's clock.
        if now_ns().abs_diff(target.stamp_ns) > SILENCE_NS {
            return self.complain(target.stream, "it is older than 0.2 s or its stamp is not of the monotonic clock");
        }
        let q = match target.kind {
            TargetKind::Joints if target.dof as usize != self.model.dof() => {
                let what = format!("it speaks of {} joints, the arm has {}", target.dof, self.model.dof());
                return self.complain(target.stream, &what);
            }
            TargetKind::Joints => target.q,
            TargetKind::Pose if !self.model.has_geometry() => {
                return self.complain(target.stream, "cell.toml names the arm's joints only; send joint targets");
            }
            TargetKind::Pose => self.joints(target, state),
        };
        Ok(Some(Target { stream: target.stream, q, speed: target.speed }))
    }

    fn joints(&mut self, target: &ArmTarget, state: &ArmState) -> Joints {
        let from = match self.last {
            Some((stream, q)) if stream == target.stream => q,
            _ => state.q_d,
        };
        let [w, i, j, k] = target.wxyz;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let pose = Isometry3::from_parts(target.position.into(), turn);
        let found = self.model.nearest(&self.limits, &from, &pose);
        self.last = Some((target.stream, found.q));
        found.q
    }

    fn complain(&mut self, stream: u64, what: &str) -> Result<Option<Target>, String> {
        if std::mem::replace(&mut self.complained, stream) == stream {
            return Ok(None);
        }
        Err(format!("a target of motion {stream} does not count: {what}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn now(kind: TargetKind) -> ArmTarget {
        ArmTarget { stamp_ns: now_ns(), stream: 3, dof: 7, kind, ..ArmTarget::default() }
    }

    fn at(q: Joints) -> ArmState {
        ArmState { dof: 7, q_d: q, ..ArmState::default() }
    }

    #[test]
    fn a_pose_becomes_joints_near_to_where_the_arm_is_commanded_to_be() {
        let model = ArmModel::fr3();
        let ready = *model.ready();
        let mut targets = Targets::new(model.clone(), Limits::fr3());
        let mut target = now(TargetKind::Pose);
        let pose = model.flange(&ready).isometry();
        target.position = (pose.translation.vector + nalgebra::Vector3::new(0.0, 0.0, 0.01)).into();
        let turn = pose.rotation.quaternion();
        target.wxyz = [turn.w, turn.i, turn.j, turn.k];
        let found = targets.take(&target, &at(ready)).expect("no complaint").expect("it counts");
        let there = model.flange(&found.q).isometry();
        assert!((there.translation.vector - pose.translation.vector).z > 0.0099, "{there}");
        assert!(found.q.iter().zip(&ready).all(|(a, b)| (a - b).abs() < 0.1));
    }

    #[test]
    fn what_does_not_count_is_said_once_a_stream() {
        let mut targets = Targets::new(ArmModel::fr3(), Limits::fr3());
        let state = at([0.0; 8]);
        let old = ArmTarget { stamp_ns: 1, ..now(TargetKind::Joints) };
        let line = targets.take(&old, &state).expect_err("too old");
        assert!(line.contains("motion 3") && line.contains("0.2 s"), "{line}");
        assert_eq!(targets.take(&old, &state), Ok(None), "said already");
        let short = ArmTarget { dof: 6, stream: 4, ..now(TargetKind::Joints) };
        assert!(targets.take(&short, &state).expect_err("six").contains("the arm has 7"));
        assert!(targets.take(&now(TargetKind::Joints), &state).is_ok_and(|target| target.is_some()));
    }
}
