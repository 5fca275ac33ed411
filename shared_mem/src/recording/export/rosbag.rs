//! A clip as a ROS 2 bag that `ros2 bag play` and Foxglove open, under the topic names of cell.toml's `[topics]`.

use super::super::robot::RobotModel;
use super::super::ros2::{self, JointState, StampedPose};
use super::super::tracked::Due;
use super::super::{Payload, Picture, origins, torques};
use super::bag::{Bag, COLOR, COLOR_COMPRESSED, DEPTH, EVENTS, EXTERNAL_TORQUES, FLANGE_POSE, GRIPPER, INFO, WRENCH};
use super::encode;
use super::left_out::Carried;
use super::metadata::Contents;
use super::robot::RobotTopics;
use super::source::{Beside, Source};
use super::{ExportError, Exported};
use crate::cell::Cell;
use crate::frames::{Flange, Pose};
use crate::msg::image::PixelEncoding;
use crate::output::{Output, OutputError};
use std::io;

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
    bag.put_metadata(&torques::record(source.clip.torques_end_at_rows)).map_err(failed)?;
    for record in origins::records(&source.clip.origins) {
        bag.put_metadata(&record).map_err(failed)?;
    }
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
