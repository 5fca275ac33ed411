//! A clip as a ROS 2 bag that `ros2 bag play` and Foxglove open, under the topic names of cell.toml's `[topics]`.

use super::super::robot::RobotModel;
use super::super::ros2::{self, JointState, StampedPose};
use super::super::tracked::Due;
use super::super::{Payload, Picture, torques};
use super::definitions::definition;
use super::encode;
use super::left_out::Carried;
use super::metadata::{Contents, TopicCount, latched_profile};
use super::robot::RobotTopics;
use super::source::{Beside, Source};
use super::{ExportError, Exported};
use crate::cell::Cell;
use crate::frames::{Flange, Pose};
use crate::msg::image::PixelEncoding;
use crate::output::{Output, OutputError};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::{BTreeMap, HashMap};
use std::io::{self, BufWriter, Write as _};

/// Topics that cell.toml does not name.
pub(super) const EXTERNAL_TORQUES: &str = "/franka_robot_state_broadcaster/external_joint_torques";
pub(super) const FLANGE_POSE: &str = "/franka_robot_state_broadcaster/current_pose";
const COLOR: &str = "/camera/color/image_raw";
const COLOR_COMPRESSED: &str = "/camera/color/image_raw/compressed";
const DEPTH: &str = "/camera/aligned_depth_to_color/image_raw";
const INFO: &str = "/camera/color/camera_info";
const WRENCH: &str = "/wrench";
const GRIPPER: &str = "/gripper/joint_states";
const EVENTS: &str = "/events";
/// Frame of a force sensor at the flange.
const FLANGE: &str = "fr3_link8";

/// Writes the bag, and says what it holds.
pub(super) fn write(
    source: &Source,
    (cell, carried): (&Cell, &mut Carried),
    output: Output,
    robot: Option<&RobotModel>,
) -> Result<(Exported, Contents), ExportError> {
    let target = output.path().to_owned();
    let mut exported = Exported::of(source, &target);
    let failed = |error: mcap::McapError| {
        let error = match error {
            mcap::McapError::Io(error) => error,
            other => io::Error::other(other),
        };
        OutputError::of(&target, error)
    };
    let mut bag = Bag::create(output).map_err(failed)?;
    bag.mcap.write_metadata(&torques::record(source.clip.torques_end_at_rows)).map_err(failed)?;
    let mut rows = Rows::new(source, cell, robot);
    for beside in source.beside()? {
        let beside = beside?;
        rows.put_until(beside.stamp_ns, &mut bag).map_err(failed)?;
        exported.pictures += usize::from(matches!(beside.payload, Payload::Picture(_)));
        put_beside(&beside, source.unix_ns(beside.stamp_ns), &mut bag).map_err(failed)?;
        carried.one(&beside.topic);
    }
    rows.put_until(u64::MAX, &mut bag).map_err(failed)?;
    let (output, contents) = bag.finish().map_err(failed)?;
    output.finish()?;
    Ok((exported, contents))
}

fn put_beside(beside: &Beside, unix_ns: u64, bag: &mut Bag) -> Result<(), mcap::McapError> {
    match &beside.payload {
        Payload::Picture(picture) => {
            let topic = match picture {
                Picture::Compressed { .. } => COLOR_COMPRESSED,
                Picture::Pixels { header, .. } if header.encoding == PixelEncoding::Depth16 => DEPTH,
                Picture::Pixels { .. } => COLOR,
            };
            let (kind, message) = encode::picture(unix_ns, picture);
            bag.put(topic, kind, unix_ns, &message)
        }
        Payload::CameraInfo(info) => bag.put(INFO, ros2::CAMERA_INFO, unix_ns, &encode::camera_info(unix_ns, info)),
        Payload::Wrench(wrench) => bag.put(WRENCH, ros2::WRENCH, unix_ns, &encode::wrench(unix_ns, FLANGE, wrench)),
        Payload::Gripper(gripper) => {
            let names = [ros2::GRIPPER_JOINT.to_owned()];
            let message = encode::joint_state(unix_ns, &names, [&[gripper.width], &[], &[gripper.force]]);
            bag.put(GRIPPER, JointState::TYPE, unix_ns, &message)
        }
        Payload::Event(event) => bag.put(EVENTS, ros2::LOG, unix_ns, &encode::log(unix_ns, event)),
        _ => Ok(()),
    }
}

/// Joints, poses and states, which are written in between the rest in the order of their stamps.
struct Rows<'a> {
    source: &'a Source,
    cell: &'a Cell,
    frame: String,
    /// Next row of measured joints and of desired ones.
    next: [usize; 2],
    poses: Due<'a>,
    states: std::iter::Peekable<Box<dyn Iterator<Item = (u64, &'a crate::msg::arm::ArmState)> + 'a>>,
    names: &'a [String],
    robot: Option<RobotTopics<'a>>,
}

impl<'a> Rows<'a> {
    fn new(source: &'a Source, cell: &'a Cell, robot: Option<&'a RobotModel>) -> Self {
        let frame = cell.base_frame().to_owned();
        let states: Box<dyn Iterator<Item = _>> = Box::new(source.states());
        let recorded = &source.clip.joint_names[..];
        let names = robot.map_or(recorded, |model| model.names(recorded));
        let robot = robot.map(|model| RobotTopics::new(model, names, cell));
        Self {
            source,
            cell,
            frame,
            next: [0; 2],
            poses: Due::ros2(&source.clip, cell),
            states: states.peekable(),
            names,
            robot,
        }
    }

    /// Writes every row that is not later than `stamp_ns`.
    fn put_until(&mut self, stamp_ns: u64, bag: &mut Bag) -> Result<(), mcap::McapError> {
        let clip = &self.source.clip;
        let topics = &self.cell.topics;
        loop {
            let due = [&clip.measured.stamps_ns, &clip.desired.stamps_ns];
            let due: [Option<u64>; 2] = std::array::from_fn(|i| due[i].get(self.next[i]).copied());
            let state = self.states.peek().map(|(stamp, _)| *stamp);
            let Some(first) =
                due.into_iter().chain([state, self.poses.next_ns()]).flatten().min().filter(|first| *first <= stamp_ns)
            else {
                return Ok(());
            };
            let unix_ns = self.source.unix_ns(first);
            for (kind, (series, topic)) in
                [(&clip.measured, &topics.measured), (&clip.desired, &topics.desired)].into_iter().enumerate()
            {
                if due[kind] == Some(first) {
                    let row = self.next[kind];
                    let of = |values: Option<&'a [f64]>| values.unwrap_or(&[]);
                    let numbers = [series.q_row(row), of(series.dq_row(row)), of(series.tau_row(row))];
                    let message = encode::joint_state(unix_ns, self.names, numbers);
                    bag.put(topic, JointState::TYPE, unix_ns, &message)?;
                    if let Some(robot) = self.robot.as_mut().filter(|_| kind == 0) {
                        robot.put(series, row, unix_ns, bag)?;
                    }
                    self.next[kind] += 1;
                }
            }
            while let Some(due) = self.poses.take(first) {
                let message = encode::pose(unix_ns, &self.frame, due.pose.position(), due.pose.wxyz());
                due.topics.iter().try_for_each(|topic| bag.put(topic, StampedPose::POSE_TYPE, unix_ns, &message))?;
            }
            if state == Some(first)
                && let Some((_, state)) = self.states.next()
            {
                let dof = (state.dof as usize).min(state.tau_ext.len());
                let torques = [&[], &[], &state.tau_ext[..dof]];
                let message = encode::joint_state(unix_ns, self.names, torques);
                bag.put(EXTERNAL_TORQUES, JointState::TYPE, unix_ns, &message)?;
                if let Some(flange) = flange(&state.O_T_EE) {
                    let message = encode::pose(unix_ns, &self.frame, flange.position(), flange.wxyz());
                    bag.put(FLANGE_POSE, StampedPose::POSE_TYPE, unix_ns, &message)?;
                }
            }
        }
    }
}

/// Pose of a column-major 4x4; `None` where it is no rigid transform.
fn flange(m: &[f64; 16]) -> Option<Pose<crate::frames::Base, Flange>> {
    use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
    let rotation = Matrix3::new(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]);
    let rigid = (rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-3 && rotation.determinant() > 0.0;
    rigid.then(|| {
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Pose::from_isometry(Isometry3::from_parts(Translation3::new(m[12], m[13], m[14]), turn))
    })
}

/// A bag that is being written.
pub(super) struct Bag {
    mcap: mcap::Writer<BufWriter<Output>>,
    /// Channel and next sequence number of each topic, and its place in what the bag holds.
    channels: HashMap<String, (u16, u32, usize)>,
    contents: Contents,
}

impl Bag {
    fn create(output: Output) -> Result<Self, mcap::McapError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("twinalign ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0);
        Ok(Self {
            mcap: options.create(BufWriter::new(output))?,
            channels: HashMap::new(),
            contents: Contents::default(),
        })
    }

    /// Adds index and footer.
    fn finish(mut self) -> Result<(Output, Contents), mcap::McapError> {
        self.mcap.finish()?;
        let mut buffer = self.mcap.into_inner();
        buffer.flush()?;
        Ok((buffer.into_inner().map_err(io::IntoInnerError::into_error)?, self.contents))
    }

    /// A message on a topic that late subscribers get the last message of.
    pub(super) fn put_latched(
        &mut self,
        topic: &str,
        kind: &'static str,
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        self.put_with(topic, (kind, true), unix_ns, message)
    }

    pub(super) fn put(
        &mut self,
        topic: &str,
        kind: &'static str,
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        self.put_with(topic, (kind, false), unix_ns, message)
    }

    fn put_with(
        &mut self,
        topic: &str,
        (kind, is_latched): (&'static str, bool),
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        let (channel_id, sequence, at) = match self.channels.get(topic) {
            Some(known) => *known,
            None => {
                let schema = self.mcap.add_schema(kind, "ros2msg", definition(kind).as_bytes())?;
                // rosbag2 asks for the key even where it is empty.
                let profile = if is_latched { latched_profile() } else { String::new() };
                let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), profile)]);
                self.contents.topics.push(TopicCount { name: topic.to_owned(), kind, is_latched, messages: 0 });
                (self.mcap.add_channel(schema, topic, "cdr", &metadata)?, 0, self.contents.topics.len() - 1)
            }
        };
        self.channels.insert(topic.to_owned(), (channel_id, sequence.wrapping_add(1), at));
        self.contents.topics[at].messages += 1;
        let (first, last) = self.contents.span_ns.unwrap_or((unix_ns, unix_ns));
        self.contents.span_ns = Some((first.min(unix_ns), last.max(unix_ns)));
        let header = MessageHeader { channel_id, sequence, log_time: unix_ns, publish_time: unix_ns };
        self.mcap.write_to_known_channel(&header, message)
    }
}
