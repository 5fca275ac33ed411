//! A ROS 2 bag (storage mcap, messages in CDR) as a clip. Topic names come from `[topics]` of cell.toml.

use super::clip::{self, Clip, NamedLog};
use super::container::{Message, Messages};
use super::error::ReadError;
use super::joint_log::JointLog;
use super::origins;
use super::ros2::{JointState, StampedPose};
use super::series::JointSeries;
use super::torques;
use super::tracked::{self, ObjectTopics, PoseRow};
use crate::budget::Budget;
use crate::cell::{Cell, ClipKind, ControllerKind};
use crate::frames::Pose;
use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::Path;

/// A quaternion's length is 1 up to rounding by single precision and a little more.
const UNIT: f64 = 1e-3;

/// What a topic should hold, and the block and key that name it.
type Wanted = (&'static str, &'static str);

const OF_OBJECT: Wanted = ("object poses", "[topics] object_pose");
const OF_NAMED_OBJECT: Wanted = ("object poses", "[[object]] topic");

/// What the wanted topics held.
#[derive(Debug, Default)]
struct Collected {
    measured: JointLog,
    desired: JointLog,
    /// By topic.
    poses: BTreeMap<String, Poses>,
}

/// What a topic held about an object.
#[derive(Debug, Default)]
struct Poses {
    rows: Vec<PoseRow>,
    /// Frame that they name.
    frame: String,
    /// Whether any carried a stamp of its own.
    stamped: bool,
    log_times_ns: Vec<u64>,
    /// Length, less 1, of the quaternion whose length is farthest from 1.
    too_long: f64,
}

/// Reads a bag.
pub(super) fn read<R: Read + Seek>(
    path: &Path,
    messages: Messages<R>,
    kind: ClipKind,
    cell: &Cell,
) -> Result<Clip, ReadError> {
    clip(path, messages, kind, cell, true)
}

/// What the arm of a bag did, where it does not matter what it was told: the clip's other series are empty.
pub(super) fn measured<R: Read + Seek>(path: &Path, messages: Messages<R>, cell: &Cell) -> Result<Clip, ReadError> {
    clip(path, messages, ClipKind::Excitation, cell, false)
}

fn clip<R: Read + Seek>(
    path: &Path,
    mut messages: Messages<R>,
    kind: ClipKind,
    cell: &Cell,
    with_commands: bool,
) -> Result<Clip, ReadError> {
    let (mut collected, objects) = (Collected::default(), ObjectTopics::ros2(cell));
    let budget = messages.budget().clone();
    while let Some(message) = messages.next()? {
        collected.take(&message, (cell, &objects), (path, &budget))?;
    }
    let needs_arm = cell.robot.is_some() && kind != ClipKind::FreeMotion;
    let topics = &cell.topics;
    let mut clip = Clip::empty(path, kind);
    clip.damage = messages.damage().summary();
    clip.origins = origins::read(&messages, false);
    clip.torques_end_at_rows = torques::end_at_rows(&messages, false);
    let missing = |topic: &str, wanted: Wanted| missing(path, topic, wanted, &messages);
    if !with_commands {
        // Two equal series are checked as one.
        collected.desired = collected.measured.clone();
    }
    if needs_arm || !collected.measured.is_empty() {
        collected.joints(&missing, cell, &mut clip)?;
    }
    if !with_commands {
        clip.desired = JointSeries::default();
        return Ok(clip);
    }
    let tracked = objects.take(&mut collected.poses);
    if kind != ClipKind::Excitation && tracked[0].2.rows.is_empty() {
        let is_common = objects.expected() == topics.object_pose;
        return Err(missing(objects.expected(), if is_common { OF_OBJECT } else { OF_NAMED_OBJECT }));
    }
    let base_frame = cell.robot.as_ref().and_then(|robot| robot.base_frame.as_deref());
    for (number, (name, topic, poses)) in tracked.into_iter().enumerate() {
        let rows = poses.rows(&topic, base_frame, &mut clip.warnings);
        tracked::put(&mut clip, number, name, &topic, rows)?;
    }
    Ok(clip)
}

impl Collected {
    /// Takes a message over when it is on a wanted topic and what that topic should hold.
    fn take(
        &mut self,
        message: &Message<'_>,
        (cell, objects): (&Cell, &ObjectTopics),
        (path, budget): (&Path, &Budget),
    ) -> Result<(), ReadError> {
        let (topic, topics) = (&message.channel.topic, &cell.topics);
        let fail = |what: String| ReadError::content(path, topic, what);
        if *topic == topics.measured || *topic == topics.desired {
            expect_type(message, &[JointState::TYPE]).map_err(fail)?;
            let mut state = JointState::decode(message.data).map_err(|e| fail(not_decoded(&e)))?;
            // What a velocity interface is sent need not hold positions: they follow from the velocities.
            let velocities = cell.controller.as_ref().is_some_and(|law| law.kind == ControllerKind::JointVelocity);
            if velocities && *topic == topics.desired && state.position.is_empty() {
                state.position = vec![0.0; state.velocity.len()];
            }
            let log = if *topic == topics.measured { &mut self.measured } else { &mut self.desired };
            let (bytes, compared) = log.cost(&state);
            budget.step(compared).and_then(|()| budget.take(bytes)).map_err(ReadError::budget(path))?;
            log.push(&state, message.log_time_ns);
        } else if objects.wants(topic) {
            expect_type(message, &[StampedPose::POSE_TYPE, StampedPose::TRANSFORM_TYPE]).map_err(fail)?;
            let has_child = message.channel.type_name() == StampedPose::TRANSFORM_TYPE;
            let pose = StampedPose::decode(message.data, has_child).map_err(|e| fail(not_decoded(&e)))?;
            budget.take(size_of::<PoseRow>() + size_of::<u64>()).map_err(ReadError::budget(path))?;
            let poses = self.poses.entry(topic.clone()).or_default();
            poses.stamped |= pose.stamp_ns != 0;
            poses.log_times_ns.push(message.log_time_ns);
            if poses.frame.is_empty() {
                poses.frame = pose.frame.to_owned();
            }
            let (stamp_ns, too_long) = (pose.stamp_ns, pose.wxyz.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0);
            let pose = Pose::from_parts(pose.position, pose.wxyz);
            if pose.is_some() && too_long.abs() > poses.too_long.abs() {
                poses.too_long = too_long;
            }
            poses.rows.push((stamp_ns, pose));
        }
        Ok(())
    }

    /// Puts the rows of the two joint topics into `clip`.
    fn joints(
        &mut self,
        missing: &dyn Fn(&str, Wanted) -> ReadError,
        cell: &Cell,
        clip: &mut Clip,
    ) -> Result<(), ReadError> {
        let (path, topics) = (clip.file.clone(), &cell.topics);
        if self.measured.is_empty() {
            return Err(missing(&topics.measured, ("measured joints", "[topics] measured")));
        }
        if self.desired.is_empty() {
            return Err(missing(&topics.desired, ("desired joints", "[topics] desired")));
        }
        let measured = NamedLog { topic: &topics.measured, log: std::mem::take(&mut self.measured) };
        let desired = NamedLog { topic: &topics.desired, log: std::mem::take(&mut self.desired) };
        let joints = clip::joints(&path, measured, desired, &clip::wanted_joints(cell))?;
        clip.joint_names = joints.names;
        clip.measured = joints.measured;
        clip.desired = joints.desired;
        clip.warnings.extend(joints.warnings);
        Ok(())
    }
}

impl Poses {
    /// Its rows by one clock, and what is odd about the rest.
    fn rows(mut self, topic: &str, base_frame: Option<&str>, warnings: &mut Vec<String>) -> Vec<PoseRow> {
        if !self.stamped {
            for ((stamp, _), log_time) in self.rows.iter_mut().zip(&self.log_times_ns) {
                *stamp = *log_time;
            }
        }
        if let Some(base) = base_frame
            && !self.frame.is_empty()
            && self.frame != base
        {
            warnings.push(format!(
                "`{topic}`: poses name the frame `{}`, the base frame is `{base}`; they are taken as given in the \
                 base frame: set `[robot] base_frame` or publish them in it",
                self.frame
            ));
        }
        if self.too_long.abs() > UNIT {
            warnings.push(format!(
                "`{topic}`: a quaternion has the length {:.3} instead of 1; they were scaled: look at what computes them",
                1.0 + self.too_long
            ));
        }
        self.rows
    }
}

/// Why nothing came from a topic: the file lost it, nobody published on it, or it is called otherwise.
fn missing<R: Read + Seek>(path: &Path, topic: &str, (role, key): Wanted, messages: &Messages<R>) -> ReadError {
    if let Some(damage) = messages.damage().summary() {
        return ReadError::content(path, topic, format!("no {role} are left ({damage}); record it again"));
    }
    if messages.has(topic) {
        return ReadError::content(
            path,
            topic,
            format!(
                "the topic is there, but nobody published {role} on it; start what publishes them, then record again"
            ),
        );
    }
    ReadError::Topic { path: path.to_owned(), topic: topic.to_owned(), role, key, present: messages.present() }
}

fn expect_type(message: &Message<'_>, wanted: &[&str]) -> Result<(), String> {
    let found = message.channel.type_name();
    if wanted.contains(&found) {
        return Ok(());
    }
    Err(format!("holds `{found}`, not `{}`; set `[topics]` in cell.toml to the right topic", wanted.join("` or `")))
}

fn not_decoded(error: &super::cdr::CdrError) -> String {
    format!("a message cannot be decoded: {error}; record the bag again, or set `[topics]` to another topic")
}
