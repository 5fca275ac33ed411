//! A clip as an own one. An own state holds what the arm did and what it was told at one moment; where they were stamped at
//! different ones, what it was told goes into messages of its own. What nobody recorded is 0, and the clip says so.

use super::super::cdr::CdrError;
use super::super::container::Messages;
use super::super::logged::Logged;
use super::super::ros2::{JointState, StampedPose};
use super::super::tracked::Due;
use super::super::writer::{ClipInfo, ClipWriter};
use super::super::{Clip, Payload, Picture, ReadError, RobotModel, WriteError, WriteSummary};
use super::bag::{EXTERNAL_TORQUES, FLANGE_POSE};
use super::left_out::Carried;
use super::source::{Beside, Kind, Source};
use super::{ExportError, Exported, FlangeAt};
use crate::cell::Cell;
use crate::frames::{Base, Flange, Pose};
use crate::input;
use crate::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use crate::msg::event::Event;
use crate::msg::gripper::GripperState;
use crate::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use crate::msg::object::ObjectPose;
use crate::msg::wrench::Wrench;
use crate::msg::{Joints, joints_from};
use crate::output::{Output, OutputError};
use crate::topics;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Writes the clip.
pub(super) fn write(
    source: &Source,
    (cell, carried): (&Cell, &mut Carried),
    output: Output,
    (flange_at, robot): (FlangeAt<'_>, Option<&Arc<RobotModel>>),
) -> Result<Exported, ExportError> {
    if source.is_own() {
        return copy(source, output);
    }
    let clip = &source.clip;
    let mut exported = Exported::of(source, output.path());
    let info = ClipInfo {
        cell_toml: Some(cell.to_toml()),
        configuration: String::new(),
        program: concat!("twinalign ", env!("CARGO_PKG_VERSION"), ", export").into(),
        torques_begin_at_rows: !clip.torques_end_at_rows,
        origins: clip.origins.clone(),
    };
    let mut writer = ClipWriter::whole_in_unix_time(output, &info)?;
    if let Some(robot) = robot {
        writer.show(robot, robot.names(&clip.joint_names), cell);
    }
    let logged = Logged::of(clip);
    if let Some(record) = logged.record() {
        writer.note(&record)?;
    }
    let known = if matches!(source.kind, Kind::Bag) { Known::read(&source.path)? } else { Known::default() };
    let latency_ns = latency_ns(cell);
    let mut rows = Rows::new((clip, cell), logged, known, flange_at);
    for beside in source.beside()? {
        let beside = beside?;
        rows.put_until(beside.stamp_ns, &mut writer)?;
        exported.pictures += usize::from(matches!(beside.payload, Payload::Picture(_)));
        put_beside(beside, cell, latency_ns, &mut writer, (&mut exported, carried))?;
    }
    rows.put_until(u64::MAX, &mut writer)?;
    writer.finish()?;
    Ok(exported)
}

/// Writes a clip that was put together elsewhere, in Unix time or in time since its beginning; `program` names what did it,
/// and viewers are shown `robot`.
///
/// # Errors
/// [`WriteError`]; nothing of it is there then.
pub fn write_clip(
    clip: &Clip,
    (cell, robot): (&Cell, Option<&Arc<RobotModel>>),
    program: &str,
    output: Output,
) -> Result<WriteSummary, WriteError> {
    let info = ClipInfo {
        cell_toml: Some(cell.to_toml()),
        configuration: String::new(),
        program: program.into(),
        torques_begin_at_rows: !clip.torques_end_at_rows,
        origins: clip.origins.clone(),
    };
    let mut writer = ClipWriter::whole_in_unix_time(output, &info)?;
    if let Some(robot) = robot {
        writer.show(robot, robot.names(&clip.joint_names), cell);
    }
    let logged = Logged::of(clip);
    if let Some(record) = logged.record() {
        writer.note(&record)?;
    }
    let mut rows = Rows::new((clip, cell), logged, Known::default(), &|_| None);
    rows.put_until(u64::MAX, &mut writer)?;
    writer.finish()
}

fn latency_ns(cell: &Cell) -> u64 {
    cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64)
}

/// An own clip is one already: bit by bit.
fn copy(source: &Source, mut output: Output) -> Result<Exported, ExportError> {
    let mut exported = Exported::of(source, output.path());
    for beside in source.beside()? {
        exported.pictures += usize::from(matches!(beside?.payload, Payload::Picture(_)));
    }
    let mut file = input::open(&source.path).map_err(ReadError::from)?;
    std::io::copy(&mut file, &mut output).map_err(|error| OutputError::of(output.path(), error))?;
    output.finish()?;
    Ok(exported)
}

fn put_beside(
    beside: Beside,
    cell: &Cell,
    latency_ns: u64,
    writer: &mut ClipWriter<Output>,
    (exported, carried): (&mut Exported, &mut Carried),
) -> Result<(), ExportError> {
    let stamp_ns = beside.stamp_ns;
    match beside.payload {
        Payload::Picture(Picture::Pixels { header, pixels }) => {
            let topic = match header.encoding {
                PixelEncoding::Rgb8 => topics::CAMERA_COLOR,
                PixelEncoding::Depth16 => topics::CAMERA_DEPTH,
            };
            // An own picture is stamped when it arrived.
            writer.image(topic, &ImageHeader { stamp_ns: stamp_ns + latency_ns, ..header }, &pixels)?;
        }
        Payload::Picture(Picture::Compressed { .. }) => {
            exported.pictures -= 1;
            let what = "compressed pictures have no room in an own clip; a ROS 2 bag holds them";
            if !exported.warnings.iter().any(|w| w == what) {
                exported.warnings.push(what.into());
            }
            return Ok(());
        }
        Payload::CameraInfo(info) => {
            let stands = cell.camera.as_ref().map(|camera| camera.pose);
            let (position, wxyz) = stands.map_or((info.position, info.wxyz), |pose| (pose.position, pose.orientation));
            writer.camera_info(&CameraInfo { stamp_ns, position, wxyz, ..*info })?;
        }
        Payload::Wrench(wrench) => writer.wrench(&Wrench { stamp_ns, ..wrench })?,
        Payload::Gripper(gripper) => writer.gripper(&GripperState { stamp_ns, ..gripper })?,
        Payload::Event(event) => writer.event(&Event { stamp_ns, ..*event })?,
        _ => return Ok(()),
    }
    carried.one(&beside.topic);
    Ok(())
}

/// States, commands and poses, written in between the rest in the order of their stamps.
struct Rows<'a> {
    clip: &'a Clip,
    known: Known,
    flange_at: FlangeAt<'a>,
    latency_ns: u64,
    /// Stamps of commands that have messages of their own [ns].
    commands: &'a [u64],
    state: usize,
    command: usize,
    poses: Due<'a>,
}

impl<'a> Rows<'a> {
    fn new((clip, cell): (&'a Clip, &Cell), logged: Logged, known: Known, flange_at: FlangeAt<'a>) -> Self {
        let commands = if logged.commands_apart { &clip.desired.stamps_ns[..] } else { &[] };
        let (latency_ns, poses) = (latency_ns(cell), Due::own(clip, cell));
        Self { clip, known, flange_at, latency_ns, commands, state: 0, command: 0, poses }
    }

    fn put_until(&mut self, stamp_ns: u64, writer: &mut ClipWriter<Output>) -> Result<(), WriteError> {
        let clip = self.clip;
        loop {
            let state = clip.measured.stamps_ns.get(self.state).copied();
            let pose = self.poses.next_ns();
            let command = self.commands.get(self.command).copied();
            let Some(first) = state.into_iter().chain(command).chain(pose).min().filter(|first| *first <= stamp_ns)
            else {
                return Ok(());
            };
            if command == Some(first) {
                writer.arm_command(&self.arm_command(self.command, first))?;
                self.command += 1;
            }
            if state == Some(first) {
                writer.arm_state(&self.arm_state(self.state, first))?;
                self.state += 1;
            }
            while let Some(due) = self.poses.take(first) {
                let pose = ObjectPose {
                    // An own pose is stamped when it became known.
                    stamp_ns: first + self.latency_ns,
                    device_ns: first,
                    sequence: due.row as u64,
                    position: due.pose.position(),
                    wxyz: due.pose.wxyz(),
                    ..ObjectPose::default()
                };
                due.topics.iter().try_for_each(|topic| writer.object_pose_on(topic, &pose))?;
            }
        }
    }

    fn arm_command(&self, row: usize, stamp_ns: u64) -> ArmCommand {
        let desired = &self.clip.desired;
        let of = |values: Option<&[f64]>| joints_from(values.unwrap_or(&[]));
        ArmCommand {
            stamp_ns,
            answers_device_ns: stamp_ns,
            cycle: row as u64,
            dof: desired.dof as u32,
            interface: CommandInterface::JointPosition,
            q_d: joints_from(desired.q_row(row)),
            dq_d: of(desired.dq_row(row)),
            tau_J_d: of(desired.tau_row(row)),
        }
    }

    fn arm_state(&self, row: usize, stamp_ns: u64) -> ArmState {
        let clip = self.clip;
        // What it was told last; before anything was, what it is told first.
        let told = clip.desired.stamps_ns.partition_point(|stamp| *stamp <= stamp_ns).saturating_sub(1);
        let of = |values: Option<&[f64]>| joints_from(values.unwrap_or(&[]));
        let q = clip.measured.q_row(row);
        let flange = self.known.flange.get(&stamp_ns).copied().or_else(|| {
            let (position, wxyz) = (self.flange_at)(q)?;
            Pose::from_parts(position, wxyz)
        });
        let mut state = ArmState {
            stamp_ns,
            device_ns: stamp_ns,
            cycle: row as u64,
            dof: clip.measured.dof as u32,
            mode: ArmMode::Other,
            q: joints_from(q),
            dq: of(clip.measured.dq_row(row)),
            q_d: joints_from(clip.desired.q_row(told)),
            dq_d: of(clip.desired.dq_row(told)),
            tau_J: of(clip.measured.tau_row(row)),
            tau_J_d: of(clip.desired.tau_row(told)),
            tau_ext: self.known.tau_ext.get(&stamp_ns).copied().unwrap_or_default(),
            ..ArmState::default()
        };
        if let Some(flange) = flange {
            state.O_T_EE.copy_from_slice(flange.isometry().to_homogeneous().as_slice());
        }
        state
    }
}

/// What a bag may hold beside the two joint topics, by stamp.
#[derive(Debug, Default)]
struct Known {
    tau_ext: HashMap<u64, Joints>,
    flange: HashMap<u64, Pose<Base, Flange>>,
}

impl Known {
    fn read(path: &Path) -> Result<Self, ReadError> {
        let (mut messages, mut known) = (Messages::open(path)?, Self::default());
        while let Some(message) = messages.next()? {
            let topic = &message.channel.topic;
            let bad = |e: CdrError| ReadError::content(path, topic, e.to_string());
            match (topic.as_str(), message.channel.type_name()) {
                (EXTERNAL_TORQUES, JointState::TYPE) => {
                    let joints = JointState::decode(message.data).map_err(bad)?;
                    known.tau_ext.insert(joints.stamp_ns, joints_from(&joints.effort));
                }
                (FLANGE_POSE, StampedPose::POSE_TYPE) => {
                    let pose = StampedPose::decode(message.data, false).map_err(bad)?;
                    known.flange.extend(Pose::from_parts(pose.position, pose.wxyz).map(|p| (pose.stamp_ns, p)));
                }
                _ => {}
            }
        }
        Ok(known)
    }
}
