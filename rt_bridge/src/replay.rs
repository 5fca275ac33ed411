//! A recording as an arm: its states come at the pace they were recorded with, its commands are what was commanded then.
//! What the bridge is asked to play is refused. Beside it go the recording's pictures ([`crate::camera`]), and its force sensor and
//! gripper ([`Instruments`]).

mod instruments;

pub use instruments::{InstrumentError, Instruments};

use crate::arm::{Arm, ArmFault, Clock, Desired, Read};
use crate::rt::process::sleep_until;
use crate::sighting::Sighting;
use rtrb::{Consumer, Producer, RingBuffer};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::joints_from;
use shared_mem::msg::object::{ObjectName, ObjectPose};
use shared_mem::recording::{Clip, ObjectSeries, ReadError, read_clip};
use shared_mem::time::now_ns;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use twin::arm::ArmModel;

/// Longest sleep before looking whether to stop.
const LONGEST_SLEEP: Duration = Duration::from_millis(20);

/// When the replay of a clip began: turns its stamps into moments of now. Shared by its arm and all that goes beside it.
#[derive(Debug, Clone, Default)]
pub struct ReplayClock(Arc<AtomicU64>);

impl ReplayClock {
    /// When a recorded stamp is replayed: monotonic clock [ns]; `None` before the arm has begun.
    pub fn moment_of(&self, stamp_ns: u64) -> Option<u64> {
        // Wrapping: a bag's stamps are Unix time, far ahead of the monotonic clock.
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            shift_ns => Some(stamp_ns.wrapping_add(shift_ns)),
        }
    }

    /// Sleeps until the replay has come to `stamp_ns`; `false` when it is to stop before.
    pub fn wait_for(&self, stamp_ns: u64, stop: &AtomicBool) -> bool {
        loop {
            if stop.load(Ordering::Relaxed) {
                return false;
            }
            let left = match self.moment_of(stamp_ns) {
                Some(moment_ns) => Duration::from_nanos(moment_ns.saturating_sub(now_ns())),
                None => LONGEST_SLEEP,
            };
            if left.is_zero() {
                return true;
            }
            std::thread::sleep(left.min(LONGEST_SLEEP));
        }
    }

    fn begin(&self, first_stamp_ns: u64) {
        self.0.store(now_ns().wrapping_sub(first_stamp_ns), Ordering::Relaxed);
    }
}

/// Poses that wait for the pump.
const POSES: usize = 256;

#[derive(Debug)]
pub struct ReplayArm {
    clip: Clip,
    next: usize,
    /// Name of each object, the first one first, and its next pose to give out.
    objects: Vec<(ObjectName, usize)>,
    poses: Producer<Sighting>,
    /// Row of the desired series in force.
    desired: usize,
    clock: ReplayClock,
}

impl ReplayArm {
    /// Reads a clip of the arm that `model` describes. Also returns the poses of its objects, as their moment comes, and
    /// the clock of the replay.
    ///
    /// # Errors
    /// [`ReadError`] when it cannot be read, or its joints are not the model's.
    pub fn open(
        path: &Path,
        cell: &Cell,
        model: &ArmModel,
    ) -> Result<(Self, Consumer<Sighting>, ReplayClock), ReadError> {
        let clip = read_clip(path, ClipKind::Excitation, cell)?.reorder(model.joint_names())?;
        if clip.desired.is_empty() {
            let what = "nobody logged commands, and an arm that is replayed reports what it was commanded; replay a clip that holds them";
            return Err(ReadError::Content { path: path.to_owned(), topic: "desired".into(), what: what.into() });
        }
        for warning in clip.warnings.iter().chain(&clip.damage) {
            tracing::warn!("{}: {warning}", path.display());
        }
        let (to_pump, poses) = RingBuffer::new(POSES);
        let clock = ReplayClock::default();
        let others = clip.others.iter().map(|other| other.name.as_str());
        let named = |name: &str| (ObjectName::new(name).unwrap_or_default(), 0);
        let objects = [cell.object_name().unwrap_or("")].into_iter().chain(others).map(named).collect();
        let arm = Self { clip, next: 0, objects, poses: to_pump, desired: 0, clock: clock.clone() };
        Ok((arm, poses, clock))
    }

    /// Gives out the poses that were recorded up to `stamp_ns`.
    fn give_poses(&mut self, stamp_ns: u64) {
        let all = [&self.clip.object].into_iter().chain(self.clip.others.iter().map(|other| &other.series));
        for (number, (series, (name, next))) in all.zip(&mut self.objects).enumerate() {
            while let Some(pose) = due(series, *next, stamp_ns) {
                // A pump that is late loses poses, not states.
                let _full = self.poses.push(Sighting { is_first: number == 0, name: *name, pose });
                *next += 1;
            }
        }
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
        match self.clock.moment_of(stamp_ns) {
            Some(moment_ns) => sleep_until(moment_ns),
            None => self.clock.begin(stamp_ns),
        }
        self.give_poses(stamp_ns);
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

/// Pose number `row` of an object where it was recorded up to `stamp_ns`.
fn due(series: &ObjectSeries, row: usize, stamp_ns: u64) -> Option<ObjectPose> {
    let (stamp, pose) = (series.stamps_ns.get(row)?, series.poses.get(row)?);
    (*stamp <= stamp_ns).then(|| ObjectPose {
        device_ns: *stamp,
        sequence: row as u64,
        position: pose.position(),
        wxyz: pose.wxyz(),
        ..ObjectPose::default()
    })
}
