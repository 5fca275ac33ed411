//! From `/arm/target` to the control thread: the newest target of each stream counts, those that are too old are left out, and
//! poses become joints. In the pump's thread, between states that wait to be published: so at most one pose a round becomes
//! joints, and none of a stream that cannot steer.

use crate::motion::Target;
use crate::remark::Newest;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use shared_mem::msg::Joints;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::target::{ArmTarget, SILENCE_NS, TargetKind};
use shared_mem::time::now_ns;
use shared_mem::topics;
use std::collections::VecDeque;
use twin::arm::{ArmModel, Limits};

/// Streams whose targets are kept: one of every sender. Of more, those that are not there yet wait for their next target.
const STREAMS: usize = topics::ARM_TARGET.limits.publishers;

/// Turns what was sent into joints.
#[derive(Debug)]
pub struct Targets {
    model: ArmModel,
    limits: Limits,
    /// The newest target of each stream, and first the stream that has waited longest.
    waiting: VecDeque<ArmTarget>,
    /// Stream and joints of the last pose: while it steers, the next one's are searched from there.
    last: Option<(u64, Joints)>,
    /// Streams whose fault was said.
    said: Newest<u64>,
}

/// A stream's targets do not count.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Fault {
    Stamp,
    Joints { came: u32, has: usize },
    NoGeometry,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stamp => f.write_str("it is older than 0.2 s or its stamp is not of the monotonic clock"),
            Self::Joints { came, has } => write!(f, "it speaks of {came} joints, the arm has {has}"),
            Self::NoGeometry => f.write_str("cell.toml names the arm's joints only; send joint targets"),
        }
    }
}

impl Targets {
    /// For an arm.
    pub fn new(model: ArmModel, limits: Limits) -> Self {
        Self { model, limits, waiting: VecDeque::with_capacity(STREAMS + 1), last: None, said: Newest::default() }
    }

    /// Keeps a target that was just received, with the arm in this state, in the place of an earlier one of its stream. The
    /// stream that steers always has a place.
    pub fn keep(&mut self, target: &ArmTarget, state: &ArmState) {
        let has_room = self.waiting.len() < STREAMS || steers(target.stream, state);
        match self.waiting.iter_mut().find(|waits| waits.stream == target.stream) {
            Some(earlier) => *earlier = *target,
            None if has_room => self.waiting.push_back(*target),
            None => {}
        }
    }

    /// Forgets what waits: a stop came after it.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }

    /// Hands on what waits, with the arm in this state: of poses that of the stream that steers, without its joints those of
    /// others; while nobody steers, the one that has waited longest, and the others wait on. Returns what is wrong with a
    /// stream, once.
    pub fn hand_on(&mut self, state: &ArmState, mut to: impl FnMut(&Target)) -> Vec<String> {
        let (mut complaints, mut is_spent) = (Vec::new(), false);
        let is_free = state.motion != MotionStatus::Playing;
        for _ in 0..self.waiting.len() {
            let Some(target) = self.waiting.pop_front() else { break };
            let q = match self.fault(&target) {
                Some(fault) => {
                    if self.said.note(target.stream) {
                        complaints.push(format!("a target of motion {} does not count: {fault}", target.stream));
                    }
                    None
                }
                None if target.kind == TargetKind::Joints => Some(target.q),
                None if steers(target.stream, state) || is_free && !is_spent => {
                    is_spent = true;
                    Some(self.joints(&target, state))
                }
                None if is_free => {
                    self.waiting.push_back(target);
                    continue;
                }
                None => None,
            };
            to(&Target { stream: target.stream, q, speed: target.speed });
        }
        complaints
    }

    fn fault(&self, target: &ArmTarget) -> Option<Fault> {
        let has = self.model.dof();
        match target.kind {
            // A stamp of the future is none of this machine's clock.
            _ if now_ns().abs_diff(target.stamp_ns) > SILENCE_NS => Some(Fault::Stamp),
            TargetKind::Joints if target.dof as usize != has => Some(Fault::Joints { came: target.dof, has }),
            TargetKind::Pose if !self.model.has_geometry() => Some(Fault::NoGeometry),
            TargetKind::Joints | TargetKind::Pose => None,
        }
    }

    fn joints(&mut self, target: &ArmTarget, state: &ArmState) -> Joints {
        let from = match self.last {
            Some((stream, q)) if stream == target.stream && steers(stream, state) => q,
            _ => state.q_d,
        };
        let [w, i, j, k] = target.wxyz;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let pose = Isometry3::from_parts(target.position.into(), turn);
        let found = self.model.nearest(&self.limits, &from, &pose);
        self.last = Some((target.stream, found.q));
        found.q
    }
}

/// Whether the arm follows this stream.
fn steers(stream: u64, state: &ArmState) -> bool {
    state.motion == MotionStatus::Playing && state.motion_id == stream
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

    fn steered_by(stream: u64, q: Joints) -> ArmState {
        ArmState { motion_id: stream, motion: MotionStatus::Playing, ..at(q) }
    }

    /// The pose of the ready arm, a little higher.
    fn higher(model: &ArmModel, stream: u64) -> ArmTarget {
        let pose = model.flange(model.ready()).isometry();
        let turn = pose.rotation.quaternion();
        let position = (pose.translation.vector + nalgebra::Vector3::new(0.0, 0.0, 0.01)).into();
        ArmTarget { stream, position, wxyz: [turn.w, turn.i, turn.j, turn.k], ..now(TargetKind::Pose) }
    }

    /// What comes out of a round, and what is said.
    fn round(targets: &mut Targets, came: &[ArmTarget], state: &ArmState) -> (Vec<Target>, Vec<String>) {
        came.iter().for_each(|target| targets.keep(target, state));
        let mut out = Vec::new();
        let said = targets.hand_on(state, |target| out.push(*target));
        (out, said)
    }

    #[test]
    fn a_pose_becomes_joints_near_to_where_the_arm_is_commanded_to_be() {
        let model = ArmModel::fr3();
        let ready = *model.ready();
        let mut targets = Targets::new(model.clone(), Limits::fr3());
        let (out, said) = round(&mut targets, &[higher(&model, 3)], &at(ready));
        assert!(said.is_empty() && out.len() == 1 && out[0].stream == 3, "{out:?} {said:?}");
        let q = out[0].q.expect("joints");
        let rise = model.flange(&q).position()[2] - model.flange(&ready).position()[2];
        assert!(rise > 0.0099, "{rise}");
        assert!(q.iter().zip(&ready).all(|(a, b)| (a - b).abs() < 0.1));
    }

    #[test]
    fn of_a_flood_of_poses_one_a_round_becomes_joints_and_each_stream_has_its_turn() {
        let model = ArmModel::fr3();
        let mut targets = Targets::new(model.clone(), Limits::fr3());
        let flood: Vec<ArmTarget> = (0..400).map(|k| higher(&model, 1 + k % 4)).collect();
        let mut turns = Vec::new();
        for _ in 0..8 {
            let (out, _) = round(&mut targets, &flood, &at(*model.ready()));
            assert!(out.len() == 1 && out[0].q.is_some(), "{out:?}");
            turns.push(out[0].stream);
        }
        assert_eq!(turns, [1, 2, 3, 4, 1, 2, 3, 4]);
        // Each with an id of its own: no more of them are kept than there are senders.
        let ids: Vec<ArmTarget> = (10..400).map(|id| higher(&model, id)).collect();
        round(&mut targets, &ids, &at(*model.ready()));
        assert!(targets.waiting.len() < STREAMS);
    }

    #[test]
    fn only_the_stream_that_steers_has_its_poses_turned_into_joints_and_the_others_are_heard() {
        let model = ArmModel::fr3();
        let mut targets = Targets::new(model.clone(), Limits::fr3());
        let flood: Vec<ArmTarget> = (1..40).map(|id| higher(&model, id)).collect();
        let (out, _) = round(&mut targets, &flood, &steered_by(30, *model.ready()));
        let computed: Vec<u64> = out.iter().filter(|target| target.q.is_some()).map(|target| target.stream).collect();
        assert_eq!(computed, [30]);
        assert_eq!(out.len(), STREAMS + 1);
        // A motion is played: nobody's pose can be followed.
        let (out, _) = round(&mut targets, &flood, &steered_by(77, *model.ready()));
        assert!(out.len() == STREAMS && out.iter().all(|target| target.q.is_none()));
    }

    #[test]
    fn what_waits_at_a_stop_is_forgotten() {
        let model = ArmModel::fr3();
        let mut targets = Targets::new(model.clone(), Limits::fr3());
        let state = at(*model.ready());
        round(&mut targets, &[1, 2, 3].map(|id| higher(&model, id)), &state);
        targets.forget();
        assert_eq!(round(&mut targets, &[], &state), (Vec::new(), Vec::new()));
    }

    #[test]
    fn what_does_not_count_is_said_once_a_stream_and_heard() {
        let mut targets = Targets::new(ArmModel::fr3(), Limits::fr3());
        let state = at([0.0; 8]);
        let old = ArmTarget { stamp_ns: 1, ..now(TargetKind::Joints) };
        let short = ArmTarget { dof: 6, stream: 4, ..now(TargetKind::Joints) };
        let (out, said) = round(&mut targets, &[old, short], &state);
        assert!(said[0].contains("motion 3") && said[0].contains("0.2 s"), "{said:?}");
        assert!(said[1].contains("the arm has 7"), "{said:?}");
        assert!(out.len() == 2 && out.iter().all(|target| target.q.is_none()), "{out:?}");
        let (out, said) = round(&mut targets, &[old, short], &state);
        assert!(out.len() == 2 && said.is_empty(), "said already: {said:?}");
        let (out, said) = round(&mut targets, &[now(TargetKind::Joints)], &state);
        assert!(out[0].q.is_some() && said.is_empty());
    }
}
