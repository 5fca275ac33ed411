//! An own recording as a clip: joints from `/arm/state`, poses from `/object/pose`. Stamps begin at the monotonic clock
//! of the machine that recorded and go on by the robot's clock; a pose is stamped with its picture's time.

use super::checks;
use super::clip::{Clip, numbered_joints};
use super::container::Messages;
use super::device_clock::DeviceClock;
use super::error::ReadError;
use super::logged::Logged;
use super::messages::decode;
use super::series::JointSeries;
use super::tracked::{self, ObjectTopics, PoseRow};
use super::wire::Wire;
use super::writer::{CELL_TOML, CONFIGURATION, ClipInfo, METADATA, PROGRAM};
use super::{origins, torques};
use crate::cell::{Cell, ClipKind};
use crate::msg::Joints;
use crate::msg::arm::{ArmCommand, ArmState};
use crate::msg::object::ObjectPose;
use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::Path;

/// What rides along with the clip, as far as it was read; `None` when this is no own clip.
pub(super) fn clip_info<R: Read + Seek>(messages: &Messages<R>) -> Option<ClipInfo> {
    let record = messages.metadata.iter().find(|m| m.name == METADATA)?;
    let text = |key: &str| record.pairs.get(key).cloned().unwrap_or_default();
    let cell = messages.attachments.iter().find(|a| a.name == CELL_TOML);
    let origins = origins::said(messages);
    Some(ClipInfo {
        cell_toml: cell.map(|a| String::from_utf8_lossy(&a.data).into_owned()),
        configuration: text(CONFIGURATION),
        program: text(PROGRAM),
        torques_begin_at_rows: !torques::end_at_rows(messages, true),
        origins,
    })
}

/// Whether the file says that it is an own clip; what stands before its first message must have been read.
pub(super) fn is_own<R: Read + Seek>(messages: &Messages<R>) -> bool {
    messages.metadata.iter().any(|m| m.name == METADATA)
}

/// Largest row of a [`JointSeries`]: a stamp, q, dq and tau.
const ROW: usize = size_of::<u64>() + 3 * size_of::<Joints>();

/// Joint rows as they are collected.
#[derive(Default)]
struct Rows {
    measured: JointSeries,
    desired: JointSeries,
    device_ns: Vec<u64>,
    /// What the arm was told, where that has stamps of its own.
    commands: JointSeries,
    /// States of another number of joints than the first.
    odd: usize,
}

impl Rows {
    fn push(&mut self, state: &ArmState) {
        let dof = state.dof as usize;
        if self.device_ns.is_empty() {
            self.measured.dof = dof;
            self.desired.dof = dof;
        }
        if dof != self.measured.dof || dof == 0 {
            self.odd += 1;
            return;
        }
        self.device_ns.push(state.device_ns);
        push_row(&mut self.measured, state.stamp_ns, [&state.q, &state.dq, &state.tau_J]);
        push_row(&mut self.desired, state.stamp_ns, [&state.q_d, &state.dq_d, &state.tau_J_d]);
    }

    /// A command, where what the arm was told has stamps of its own.
    fn push_command(&mut self, command: &ArmCommand) {
        if self.commands.is_empty() {
            self.commands.dof = command.dof as usize;
        }
        if command.dof as usize == self.commands.dof && command.dof > 0 {
            push_row(&mut self.commands, command.stamp_ns, [&command.q_d, &command.dq_d, &command.tau_J_d]);
        }
    }

    /// Takes what the file says about itself into account.
    fn believe(&mut self, logged: Logged) {
        let desired = if logged.commands_apart { &mut self.commands } else { &mut self.desired };
        logged.strip(&mut self.measured, desired);
    }

    /// Leaves out rows that were stamped wrongly, before any clock is made of their stamps.
    fn leave_outlying_out(&mut self) -> Result<Vec<String>, String> {
        let (kept, warnings) = well_stamped(&self.measured.stamps_ns, &self.device_ns)?;
        if kept.len() < self.device_ns.len() {
            for series in [&mut self.measured, &mut self.desired] {
                *series = series.select_rows(&kept);
            }
            self.device_ns = kept.iter().filter_map(|row| self.device_ns.get(*row).copied()).collect();
        }
        Ok(warnings)
    }

    fn use_device_clock(&mut self) -> DeviceClock {
        let clock = DeviceClock::new(&self.measured.stamps_ns, &self.device_ns);
        if let Some(stamps_ns) = clock.stamps() {
            for series in [&mut self.measured, &mut self.desired].into_iter().filter(|series| !series.is_empty()) {
                series.stamps_ns = stamps_ns.to_vec();
            }
        }
        clock
    }
}

/// Adds the numbers of the joints that count.
fn push_row(series: &mut JointSeries, stamp_ns: u64, [q, dq, tau]: [&Joints; 3]) {
    series.stamps_ns.push(stamp_ns);
    series.q.extend(q.iter().take(series.dof));
    series.dq.extend(dq.iter().take(series.dof));
    series.tau.extend(tau.iter().take(series.dof));
}

/// The states, by number, whose stamps by the host and by the robot [ns] both lie among the others', and what there is to
/// say about the rest. Where many of the robot's lie apart, its clock was set: the host's are better then.
///
/// # Errors
/// A sentence where the host's stamps are of no use.
pub(super) fn well_stamped(host_ns: &[u64], device_ns: &[u64]) -> Result<(Vec<usize>, Vec<String>), String> {
    let topic = ArmState::TOPIC;
    let mut kept: Vec<usize> = (0..host_ns.len()).collect();
    let mut warnings = Vec::new();
    if let Some(outlying) = checks::outlying_rows(host_ns, topic)? {
        kept = outlying.kept;
        warnings.push(outlying.warning);
    }
    let device_ns: Vec<u64> = kept.iter().filter_map(|row| device_ns.get(*row).copied()).collect();
    if let Ok(Some(outlying)) = checks::outlying_rows(&device_ns, topic)
        && outlying.few
    {
        kept = outlying.kept.iter().filter_map(|row| kept.get(*row).copied()).collect();
        warnings.push(format!("by the robot's clock {}", outlying.warning));
    }
    Ok((kept, warnings))
}

/// Reads an own clip.
pub(super) fn read<R: Read + Seek>(
    path: &Path,
    mut messages: Messages<R>,
    kind: ClipKind,
    cell: &Cell,
) -> Result<Clip, ReadError> {
    let (mut rows, mut poses) = (Rows::default(), BTreeMap::<String, Vec<PoseRow>>::new());
    let objects = ObjectTopics::own(cell);
    // It stands before the first message.
    messages.peek()?;
    let logged = Logged::read(&messages);
    let budget = messages.budget().clone();
    while let Some(message) = messages.next()? {
        let topic = &message.channel.topic;
        let fail = |what: String| ReadError::content(path, topic, what);
        let keep = |bytes: usize| budget.take(bytes).map_err(ReadError::budget(path));
        match message.channel.type_name() {
            ArmState::SCHEMA => {
                keep(2 * ROW)?;
                rows.push(&decode(message.data).map_err(fail)?);
            }
            ArmCommand::SCHEMA if logged.commands_apart => {
                keep(ROW)?;
                rows.push_command(&decode(message.data).map_err(fail)?);
            }
            ObjectPose::SCHEMA if objects.wants(topic) => {
                let pose: ObjectPose = decode(message.data).map_err(fail)?;
                let row = (pose.stamp_ns, pose.pose());
                keep(size_of::<PoseRow>())?;
                match poses.get_mut(topic) {
                    Some(rows) => rows.push(row),
                    None => drop(poses.insert(topic.clone(), vec![row])),
                }
            }
            _ => {}
        }
    }
    let mut clip = Clip { torques_end_at_rows: torques::end_at_rows(&messages, true), ..Clip::empty(path, kind) };
    clip.damage = messages.damage().summary();
    clip.origins = origins::read(&messages, true);
    let needs_arm = cell.robot.is_some() && kind != ClipKind::FreeMotion;
    if needs_arm && rows.device_ns.is_empty() {
        return Err(missing(path, ArmState::TOPIC, &messages.present()));
    }
    let tracked = objects.take(&mut poses);
    if kind != ClipKind::Excitation && tracked[0].2.is_empty() {
        return Err(missing(path, objects.expected(), &messages.present()));
    }
    rows.believe(logged);
    let fail = |what| ReadError::content(path, ArmState::TOPIC, what);
    clip.warnings.extend(rows.leave_outlying_out().map_err(fail)?);
    let clock = rows.use_device_clock();
    rows.commands.stamps_ns.iter_mut().for_each(|stamp| *stamp = clock.map(*stamp));
    // A pose is stamped when it became known, one camera latency after its picture.
    let latency_ns = cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
    take_joints(path, cell, rows, &mut clip)?;
    for (number, (name, topic, mut poses)) in tracked.into_iter().enumerate() {
        for (stamp_ns, _) in &mut poses {
            *stamp_ns = clock.map(stamp_ns.saturating_sub(latency_ns));
        }
        tracked::put(&mut clip, number, name, &topic, poses)?;
    }
    Ok(clip)
}

fn take_joints(path: &Path, cell: &Cell, rows: Rows, clip: &mut Clip) -> Result<(), ReadError> {
    let topic = ArmState::TOPIC;
    clip.joint_names = numbered_joints(cell, rows.measured.dof);
    if rows.odd > 0 {
        let what =
            format!("`{topic}`: {} states of another number of joints left out; record one arm a clip", rows.odd);
        clip.warnings.push(what);
    }
    // The robot's own clock tells lost packets from a late arrival.
    clip.warnings.extend(checks::gaps(&rows.device_ns, topic));
    let apart = !rows.commands.is_empty();
    let (commands, told) = if apart { (rows.commands, ArmCommand::TOPIC) } else { (rows.desired, topic) };
    for (series, topic, into) in [(rows.measured, topic, &mut clip.measured), (commands, told, &mut clip.desired)] {
        // An object alone, or an arm whose commands nobody logged.
        if series.is_empty() {
            continue;
        }
        let fail = |what| ReadError::content(path, topic, what);
        let (series, warnings) = checks::joints(series, topic, &clip.joint_names).map_err(fail)?;
        *into = series;
        let new: Vec<String> = warnings.into_iter().filter(|w| !clip.warnings.contains(w)).collect();
        clip.warnings.extend(new);
    }
    if apart {
        clip.warnings.extend(checks::gaps(&clip.desired.stamps_ns, told));
        clip.warnings.extend(checks::pair(&mut clip.desired, &mut clip.measured));
    } else {
        // Commands within the states.
        clip.warnings.extend(checks::same_turn(&mut clip.desired, &clip.measured));
    }
    Ok(())
}

fn missing(path: &Path, topic: &str, present: &str) -> ReadError {
    ReadError::content(path, topic, format!("no messages; the clip has {present}: record with the device switched on"))
}

/// All arm states of an own clip, in the order they were recorded.
///
/// # Errors
/// [`ReadError`] when the file is missing, is no clip, or holds no arm state.
pub fn read_arm_states(path: &Path) -> Result<Vec<ArmState>, ReadError> {
    let mut messages = Messages::open(path)?;
    let (mut states, budget) = (Vec::new(), messages.budget().clone());
    while let Some(message) = messages.next()? {
        if message.channel.type_name() == ArmState::SCHEMA {
            budget.take(size_of::<ArmState>()).map_err(ReadError::budget(path))?;
            states.push(decode(message.data).map_err(|what| ReadError::content(path, ArmState::TOPIC, what))?);
        }
    }
    if states.is_empty() {
        return Err(missing(path, ArmState::TOPIC, &messages.present()));
    }
    Ok(states)
}

/// What an own clip says about itself: cell.toml, configuration and program it was recorded with. `None` for the
/// recording of another program.
///
/// # Errors
/// [`ReadError`] when the file is missing or no MCAP file.
pub fn read_clip_info(path: &Path) -> Result<Option<ClipInfo>, ReadError> {
    let mut messages = Messages::open(path)?;
    // Both records are written before the first message.
    messages.next()?;
    Ok(clip_info(&messages))
}
