//! A recording as an arm: its states come at the pace they were recorded with, its commands are what was commanded then.
//! What the bridge is told to play is refused.

use crate::arm::{Arm, ArmFault, Clock, Desired, Read};
use crate::rt::process::sleep_until;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::joints_from;
use shared_mem::recording::{Clip, ReadError, read_clip};
use shared_mem::time::now_ns;
use std::path::Path;
use twin::arm::ArmModel;

/// The recording.
#[derive(Debug)]
pub struct ReplayArm {
    clip: Clip,
    next: usize,
    /// Row of the desired series in force.
    desired: usize,
    /// What is added to a recorded stamp to get the moment of its replay [ns].
    shift_ns: Option<u64>,
}

impl ReplayArm {
    /// Reads a clip of the arm that `model` describes.
    ///
    /// # Errors
    /// [`ReadError`] when it cannot be read, or its joints are not the model's.
    pub fn open(path: &Path, cell: &Cell, model: &ArmModel) -> Result<Self, ReadError> {
        let clip = read_clip(path, ClipKind::Excitation, cell)?.reorder(model.joint_names())?;
        for warning in clip.warnings.iter().chain(&clip.damage) {
            tracing::warn!("{}: {warning}", path.display());
        }
        Ok(Self { clip, next: 0, desired: 0, shift_ns: None })
    }

    /// Row of the desired series in force at `stamp_ns`: the newest that is not later.
    fn desired_at(&mut self, stamp_ns: u64) -> usize {
        let stamps = &self.clip.desired.stamps_ns;
        while stamps.get(self.desired + 1).is_some_and(|next| *next <= stamp_ns) {
            self.desired += 1;
        }
        self.desired
    }
}

impl Arm for ReplayArm {
    fn dof(&self) -> usize {
        self.clip.measured.dof
    }

    fn clock(&self) -> Clock {
        Clock::Device
    }

    fn start(&mut self, _interface: CommandInterface) -> Result<Desired, ArmFault> {
        Ok(Desired::Recorded)
    }

    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault> {
        let Some(stamp_ns) = self.clip.measured.stamps_ns.get(self.next).copied() else { return Ok(Read::End) };
        let shift_ns = *self.shift_ns.get_or_insert_with(|| now_ns().wrapping_sub(stamp_ns));
        sleep_until(stamp_ns.wrapping_add(shift_ns));
        let desired = self.desired_at(stamp_ns);
        let row = self.next;
        self.next += 1;
        let (measured, desired_series) = (&self.clip.measured, &self.clip.desired);
        *state = ArmState {
            stamp_ns: now_ns(),
            device_ns: stamp_ns,
            mode: ArmMode::Move,
            q: joints_from(measured.q_row(row)),
            dq: joints_from(measured.dq_row(row).unwrap_or(&[])),
            tau_J: joints_from(measured.tau_row(row).unwrap_or(&[])),
            q_d: joints_from(desired_series.q_row(desired)),
            dq_d: joints_from(desired_series.dq_row(desired).unwrap_or(&[])),
            tau_J_d: joints_from(desired_series.tau_row(desired).unwrap_or(&[])),
            success_rate: 1.0,
            ..ArmState::default()
        };
        Ok(Read::Fresh)
    }

    fn command(&mut self, _command: &ArmCommand) -> Result<(), ArmFault> {
        Ok(())
    }

    fn stop(&mut self) {}

    fn recover(&mut self) -> Result<(), ArmFault> {
        Ok(())
    }
}
