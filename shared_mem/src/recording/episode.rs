//! One run of a task as an own clip, there and back: every body by its name, joints, the gripper, and what was commanded to them.
//!
//! Stamps are simulated time since the start; poses are in the task's world. The clip is whole or not there. What came of the
//! run stands in a metadata record before the first message.

use super::container::Messages;
use super::error::ReadError;
use super::logged::Logged;
use super::wire::Wire;
use super::wire::proto::{foxglove, twinalign};
use super::writer::{ClipInfo, ClipWriter, WriteError, WriteSummary};
use crate::msg::arm::ArmState;
use crate::msg::gripper::GripperState;
use crate::msg::object::ObjectPose;
use crate::output::Output;
use crate::topics;
use mcap::records::Metadata;
use prost::Message as _;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

/// Metadata record and its keys.
const RECORD: &str = "twinalign.episode";
const TASK: &str = "task";
const SEED: &str = "seed";
const NOISE: &str = "noise_m";
const SUCCESS: &str = "success";
const DURATION: &str = "duration_s";
/// Frame that poses are in.
const WORLD: &str = "world";
const JOINT_STATES: &str = "foxglove.JointStates";

/// What a run was about and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeInfo {
    /// Name of the task.
    pub task: String,
    /// By which the start was drawn.
    pub seed: u64,
    /// One sigma of what was added to the script's way points [m].
    pub noise_m: f64,
    /// Whether the task was done.
    pub success: bool,
    /// How long it took [s].
    pub duration_s: f64,
}

/// A pose in the task's world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidPose {
    /// [m]
    pub position: [f64; 3],
    /// Quaternion.
    pub wxyz: [f64; 4],
}

/// One run: what its columns are called, and its rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// What it was about.
    pub info: EpisodeInfo,
    /// Bodies, in the order of [`EpisodeMoment::poses`].
    pub bodies: Vec<String>,
    /// Moved bodies, in the order of [`EpisodeMoment::targets`].
    pub moved: Vec<String>,
    /// Bodies on joints, in the order of [`EpisodeMoment::joints`].
    pub joints: Vec<String>,
    /// Bodies on joints with a drive, in the order of [`EpisodeMoment::drives`].
    pub driven: Vec<String>,
    /// The body that `/object/pose` is about: the first that nothing but contacts moves.
    pub object: Option<String>,
    /// By time.
    pub moments: Vec<EpisodeMoment>,
}

/// All that was at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeMoment {
    /// Since the start [ns].
    pub time_ns: u64,
    /// Where the bodies are.
    pub poses: Vec<RigidPose>,
    /// Where the moved bodies are commanded to be at this moment.
    pub targets: Vec<RigidPose>,
    /// Joint positions [rad or m].
    pub joints: Vec<f64>,
    /// Joint positions that the drives are commanded to go to [rad or m].
    pub drives: Vec<f64>,
    /// The gripper, where the task has one; its stamp does not count.
    pub gripper: Option<GripperState>,
    /// The arm, where the task has one; without torques, and its stamps do not count.
    pub arm: Option<Box<ArmState>>,
}

/// Writes a run; `info` says with which program and configuration it was made.
///
/// # Errors
/// [`WriteError`]; nothing of it is there then.
pub fn write_episode(output: Output, info: &ClipInfo, episode: &Episode) -> Result<WriteSummary, WriteError> {
    let mut writer = ClipWriter::whole_in_unix_time(output, info)?;
    writer.note(&episode.info.record())?;
    Logged::WITHOUT_TORQUES.record().map_or(Ok(()), |record| writer.note(&record))?;
    for moment in &episode.moments {
        let stamp_ns = moment.time_ns;
        for (name, pose) in episode.bodies.iter().zip(&moment.poses) {
            let is_object = episode.object.as_ref() == Some(name);
            let topics = is_object.then(|| ObjectPose::TOPIC.to_owned()).into_iter().chain([topics::object_pose(name)]);
            for topic in topics {
                put_pose(&mut writer, &topic, stamp_ns, pose)?;
            }
        }
        for (name, pose) in episode.moved.iter().zip(&moment.targets) {
            put_pose(&mut writer, &topics::object_target(name), stamp_ns, pose)?;
        }
        let joints = [
            (topics::TASK_JOINTS, &episode.joints, &moment.joints),
            (topics::TASK_DRIVES, &episode.driven, &moment.drives),
        ];
        for (topic, names, positions) in joints.into_iter().filter(|(_, names, _)| !names.is_empty()) {
            let joint = |(name, position): (&String, &f64)| foxglove::JointState {
                name: name.clone(),
                position: Some(*position),
                ..foxglove::JointState::default()
            };
            let message = foxglove::JointStates {
                timestamp: writer.clock().timestamp(stamp_ns),
                joints: names.iter().zip(positions).map(joint).collect(),
            };
            writer.named(topic, JOINT_STATES, stamp_ns, &message)?;
        }
        if let Some(gripper) = &moment.gripper {
            writer.gripper(&GripperState { stamp_ns, ..*gripper })?;
        }
        if let Some(arm) = &moment.arm {
            writer.arm_state(&ArmState { stamp_ns, device_ns: stamp_ns, ..**arm })?;
        }
    }
    writer.finish()
}

fn put_pose(writer: &mut ClipWriter<Output>, topic: &str, stamp_ns: u64, pose: &RigidPose) -> Result<(), WriteError> {
    let ([x, y, z], [w, i, j, k]) = (pose.position, pose.wxyz);
    let message = foxglove::PoseInFrame {
        timestamp: writer.clock().timestamp(stamp_ns),
        frame_id: WORLD.into(),
        pose: Some(foxglove::Pose {
            position: Some(foxglove::Vector3 { x, y, z }),
            orientation: Some(foxglove::Quaternion { x: i, y: j, z: k, w }),
        }),
        twinalign: Some(twinalign::ObjectPoseDetail { stamp_ns, ..twinalign::ObjectPoseDetail::default() }),
    };
    writer.named(topic, ObjectPose::SCHEMA, stamp_ns, &message)
}

/// Reads a run.
///
/// # Errors
/// [`ReadError`] when the file is missing, is no run of a task, is cut or changed, or a moment lacks a body or a joint.
pub fn read_episode(path: &Path) -> Result<Episode, ReadError> {
    let mut messages = Messages::open(path)?;
    // The record stands before the first message.
    messages.peek()?;
    let record = messages.metadata.iter().find(|record| record.name == RECORD).ok_or_else(|| {
        let what = "is no run of a task; give clips that `twin task --record` has written";
        ReadError::kind(path, what)
    })?;
    let info = EpisodeInfo::of(&record.pairs).map_err(|key| {
        ReadError::kind(path, format!("says nothing readable about `{key}`; record the episode again"))
    })?;
    let (mut read, budget) = (Columns::default(), messages.budget().clone());
    while let Some(message) = messages.next()? {
        let kept = read.cost(message.log_time_ns, message.channel.type_name(), message.data);
        budget.take(kept).map_err(ReadError::budget(path))?;
        let topic = &message.channel.topic;
        read.take(message.log_time_ns, topic, message.channel.type_name(), message.data)
            .map_err(|what| ReadError::content(path, topic, what))?;
    }
    if let Some(damage) = messages.damage().summary() {
        return Err(ReadError::kind(path, format!("{damage}; record the episode again")));
    }
    read.episode(info).map_err(|what| ReadError::kind(path, format!("{what}; record the episode again")))
}

impl EpisodeInfo {
    fn record(&self) -> Metadata {
        let pair = |key: &str, value: &dyn Display| (key.to_owned(), value.to_string());
        let pairs = [
            pair(TASK, &self.task),
            pair(SEED, &self.seed),
            pair(NOISE, &self.noise_m),
            pair(SUCCESS, &self.success),
            pair(DURATION, &self.duration_s),
        ];
        Metadata { name: RECORD.into(), metadata: pairs.into() }
    }

    /// Out of the record's pairs; else the key that is missing or of no use.
    fn of(pairs: &BTreeMap<String, String>) -> Result<Self, &'static str> {
        fn value<T: FromStr>(pairs: &BTreeMap<String, String>, key: &'static str) -> Result<T, &'static str> {
            pairs.get(key).and_then(|text| text.parse().ok()).ok_or(key)
        }
        Ok(Self {
            task: value(pairs, TASK)?,
            seed: value(pairs, SEED)?,
            noise_m: value(pairs, NOISE)?,
            success: value(pairs, SUCCESS)?,
            duration_s: value(pairs, DURATION)?,
        })
    }
}

/// What has been read so far: names in the order in which they came, and moments.
#[derive(Default)]
struct Columns {
    bodies: Vec<String>,
    moved: Vec<String>,
    joints: Vec<String>,
    driven: Vec<String>,
    /// The first pose on `/object/pose`.
    object: Option<RigidPose>,
    moments: Vec<EpisodeMoment>,
}

impl Columns {
    /// Bytes that a message takes at most.
    fn cost(&self, time_ns: u64, schema: &str, data: &[u8]) -> usize {
        let begins = self.moments.last().is_none_or(|last| last.time_ns != time_ns);
        let moment = if begins { size_of::<EpisodeMoment>() } else { 0 };
        // Of joints a number and, in the first moment, a name are kept.
        moment
            + if schema == ArmState::SCHEMA { size_of::<ArmState>() } else { size_of::<RigidPose>() + 2 * data.len() }
    }

    fn take(&mut self, time_ns: u64, topic: &str, schema: &str, data: &[u8]) -> Result<(), String> {
        if self.moments.last().is_none_or(|last| last.time_ns != time_ns) {
            let (poses, targets, joints, drives) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            self.moments.push(EpisodeMoment { time_ns, poses, targets, joints, drives, gripper: None, arm: None });
        }
        let is_first = self.moments.len() == 1;
        let Some(moment) = self.moments.last_mut() else { return Ok(()) };
        match schema {
            ObjectPose::SCHEMA => {
                let pose = rigid_pose(data)?;
                if topic == ObjectPose::TOPIC {
                    self.object.get_or_insert(pose);
                } else if let Some(name) = topics::object_of(topic, "pose") {
                    named(&mut self.bodies, &mut moment.poses, is_first, name, pose)?;
                } else if let Some(name) = topics::object_of(topic, "target") {
                    named(&mut self.moved, &mut moment.targets, is_first, name, pose)?;
                }
            }
            JOINT_STATES => {
                let states = foxglove::JointStates::decode(data).map_err(|error| error.to_string())?;
                let is_state = topic == topics::TASK_JOINTS;
                for joint in states.joints {
                    let position = joint.position.ok_or("a joint has no position")?;
                    let (names, positions) = match is_state {
                        true => (&mut self.joints, &mut moment.joints),
                        false => (&mut self.driven, &mut moment.drives),
                    };
                    named(names, positions, is_first, &joint.name, position)?;
                }
            }
            ArmState::SCHEMA => moment.arm = Some(Box::new(super::messages::decode(data)?)),
            GripperState::SCHEMA => moment.gripper = Some(super::messages::decode(data)?),
            _ => {}
        }
        Ok(())
    }

    fn episode(self, info: EpisodeInfo) -> Result<Episode, String> {
        let Self { bodies, moved, joints, driven, object, moments } = self;
        let whole = |moment: &&EpisodeMoment| {
            let counts = [moment.poses.len(), moment.targets.len(), moment.joints.len(), moment.drives.len()];
            counts == [bodies.len(), moved.len(), joints.len(), driven.len()]
                && moment.gripper.is_some() == moments[0].gripper.is_some()
                && moment.arm.is_some() == moments[0].arm.is_some()
        };
        if let Some(bad) = moments.iter().find(|moment| !whole(moment)) {
            return Err(format!("lacks a body or a joint at {} s", bad.time_ns as f64 * 1e-9));
        }
        let first = moments.first().ok_or("holds no moment")?;
        let place = object.and_then(|object| first.poses.iter().position(|pose| *pose == object));
        let object = place.map(|place| bodies[place].clone());
        Ok(Episode { info, bodies, moved, joints, driven, object, moments })
    }
}

/// Adds a value to its column: the first moment names the columns, all others have the same in the same order.
fn named<T>(names: &mut Vec<String>, values: &mut Vec<T>, is_first: bool, name: &str, value: T) -> Result<(), String> {
    if is_first {
        names.push(name.to_owned());
    } else if names.get(values.len()).is_none_or(|known| known != name) {
        return Err(format!("`{name}` is not where it was in the moment before"));
    }
    values.push(value);
    Ok(())
}

fn rigid_pose(data: &[u8]) -> Result<RigidPose, String> {
    let ObjectPose { position, wxyz, .. } = super::messages::decode(data)?;
    Ok(RigidPose { position, wxyz })
}
