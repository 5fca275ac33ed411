//! A simulated clip on disk: what was recorded, what the twin did, and the gap between them, on the clip's own stamps.

use super::predict::{Prediction, Replayer};
use crate::arm::{Joints, MAX_JOINTS};
use crate::description::shown_robot;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::twin::{TwinGap, TwinState};
use shared_mem::output::{Destination, Output};
use shared_mem::recording::{Clip, ClipInfo, ClipWriter, WriteError};
use std::sync::Arc;

/// Time over which [`TwinGap::joint_rms`] is taken [ns].
const RMS_WINDOW_NS: u64 = 1_000_000_000;
/// Stamps from here on are Unix time (that of 2001), those below a machine's monotonic clock [ns].
const UNIX_FROM_NS: u64 = 1_000_000_000_000_000_000;

/// Writes the clip and its simulation to a file, which is there when all of it is written.
///
/// # Errors
/// [`WriteError`] when the file appeared meanwhile or the disk fails.
pub fn write_clip(
    place: &Destination,
    replayer: &Replayer,
    clip: &Clip,
    prediction: &Prediction,
) -> Result<(), WriteError> {
    let info = ClipInfo {
        cell_toml: Some(replayer.cell().at_home_anywhere().to_toml()),
        configuration: replayer.theta().map_or_else(String::new, |theta| theta.to_toml()),
        program: concat!("twin ", env!("CARGO_PKG_VERSION"), " replay").to_owned(),
        torques_begin_at_rows: !clip.torques_end_at_rows,
        origins: clip.origins.clone(),
    };
    let begin = if in_unix_time(clip) { ClipWriter::whole_in_unix_time } else { ClipWriter::whole };
    let mut writer = begin(place.begin()?, &info)?;
    // Kinematics that cannot be read keep nobody from simulating what is known of the joints.
    if let Ok(Some(robot)) = shown_robot(replayer.cell()) {
        writer.show(&Arc::new(robot), &clip.joint_names, replayer.cell());
    }
    let latency_ns = replayer.cell().camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
    Simulated { writer: &mut writer, replayer, clip, prediction, latency_ns, pose: 0 }.write()?;
    writer.finish()?;
    Ok(())
}

/// Whether the recording's stamps are Unix time, and not those of a monotonic clock.
fn in_unix_time(clip: &Clip) -> bool {
    let first = clip.measured.stamps_ns.first().or(clip.object.stamps_ns.first());
    first.is_some_and(|stamp| *stamp >= UNIX_FROM_NS)
}

struct Simulated<'a> {
    writer: &'a mut ClipWriter<Output>,
    replayer: &'a Replayer,
    clip: &'a Clip,
    prediction: &'a Prediction,
    /// A pose becomes known one camera latency after its picture, and own clips stamp it then [ns].
    latency_ns: u64,
    /// Recorded poses written so far.
    pose: usize,
}

impl Simulated<'_> {
    fn write(&mut self) -> Result<(), WriteError> {
        let errors = self.joint_errors();
        let mut window = Window::default();
        for row in 0..self.prediction.joints.len() {
            let recorded_ns = self.clip.measured.stamps_ns[row];
            self.write_poses(recorded_ns)?;
            window.add(&self.clip.measured.stamps_ns, &errors, row);
            self.writer.arm_state(&self.arm_state(row))?;
            self.write_twin(recorded_ns, Some(row), errors[row], window.rms())?;
        }
        self.write_poses(u64::MAX)
    }

    /// Recorded poses up to `until_ns`; without an arm each brings the twin's state along.
    fn write_poses(&mut self, until_ns: u64) -> Result<(), WriteError> {
        while let Some(recorded_ns) = self.clip.object.stamps_ns.get(self.pose).filter(|stamp| **stamp <= until_ns) {
            let pose = &self.clip.object.poses[self.pose];
            let message = ObjectPose {
                stamp_ns: *recorded_ns + self.latency_ns,
                device_ns: *recorded_ns,
                sequence: self.pose as u64,
                position: pose.position(),
                wxyz: pose.wxyz(),
                ..ObjectPose::default()
            };
            self.writer.object_pose(&message)?;
            self.pose += 1;
            if self.prediction.joints.is_empty() {
                self.write_twin(*recorded_ns, None, [0.0; MAX_JOINTS], [0.0; MAX_JOINTS])?;
            }
        }
        Ok(())
    }

    fn write_twin(&mut self, stamp_ns: u64, row: Option<usize>, error: Joints, rms: Joints) -> Result<(), WriteError> {
        let cycle = row.unwrap_or(self.pose) as u64;
        let dof = u32::try_from(self.clip.measured.dof).unwrap_or(0);
        let mut state = TwinState { stamp_ns, mirrors_ns: stamp_ns, cycle, dof, ..TwinState::default() };
        if let Some(twin) = row.and_then(|row| self.prediction.joints.get(row)) {
            (state.q, state.dq, state.tau_J) = (twin.state.q, twin.state.dq, twin.tau_J);
        }
        let mut gap =
            TwinGap { stamp_ns, cycle, dof, alignments: 1, joint_error: error, joint_rms: rms, ..TwinGap::default() };
        let newest = self.pose.saturating_sub(1);
        if let (Some(twin), Some(real)) = (self.prediction.object.get(newest), self.clip.object.poses.get(newest)) {
            state.has_object = 1;
            (state.object_position, state.object_wxyz) = (twin.position(), twin.wxyz());
            if let Some(surface) = self.replayer.surface() {
                (gap.object_add_m, gap.object_add_s_m) = (surface.add(twin, real), surface.add_s(twin, real));
            }
        }
        self.writer.twin_state(&state)?;
        self.writer.twin_gap(&gap)
    }

    fn arm_state(&self, row: usize) -> ArmState {
        let Clip { measured, desired, .. } = self.clip;
        let now = measured.stamps_ns[row];
        // The newest command: what the robot followed at that time.
        let command = desired.stamps_ns.partition_point(|stamp| *stamp <= now).saturating_sub(1);
        let logged = |values: Option<&[f64]>| values.map_or([0.0; MAX_JOINTS], joints_from);
        ArmState {
            stamp_ns: now,
            device_ns: now,
            cycle: row as u64,
            dof: u32::try_from(measured.dof).unwrap_or(0),
            q: joints_from(measured.q_row(row)),
            dq: logged(measured.dq_row(row)),
            q_d: joints_from(desired.q_row(command)),
            dq_d: logged(desired.dq_row(command)),
            tau_J: logged(measured.tau_row(row)),
            tau_J_d: logged(desired.tau_row(command)),
            ..ArmState::default()
        }
    }

    fn joint_errors(&self) -> Vec<Joints> {
        let rows = self.prediction.joints.iter().enumerate();
        rows.map(|(row, twin)| {
            let real = joints_from(self.clip.measured.q_row(row));
            std::array::from_fn(|joint| twin.state.q[joint] - real[joint])
        })
        .collect()
    }
}

/// Squares of the errors of the last second.
#[derive(Default)]
struct Window {
    first: usize,
    rows: usize,
    squares: Joints,
}

impl Window {
    fn add(&mut self, stamps_ns: &[u64], errors: &[Joints], row: usize) {
        self.change(&errors[row], 1.0);
        self.rows += 1;
        while stamps_ns[row] - stamps_ns[self.first] > RMS_WINDOW_NS {
            self.change(&errors[self.first], -1.0);
            self.first += 1;
            self.rows -= 1;
        }
    }

    fn change(&mut self, error: &Joints, sign: f64) {
        for (sum, error) in self.squares.iter_mut().zip(error) {
            *sum += sign * error * error;
        }
    }

    fn rms(&self) -> Joints {
        self.squares.map(|sum| (sum.max(0.0) / self.rows.max(1) as f64).sqrt())
    }
}
