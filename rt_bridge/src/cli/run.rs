//! `rt_bridge run`.

use super::stop_flag;
use crate::gripper::GripperChoice;
use crate::rt::Realtime;
use crate::run::{ArmChoice, CameraChoice, ControllerChoice, RunReport, Settings, run};
use crate::times;
use crate::tracker::TrackerChoice;
use crate::wrench::WrenchChoice;
use anyhow::{Result, bail};
use clap::Args;
use shared_mem::answer;
use shared_mem::output::Destination;
use shared_mem::quantity::seconds;
use std::path::PathBuf;
use std::time::Duration;

/// Drive an arm and publish what it does, until Ctrl-C
///
/// The arm holds its pose until somebody sends a motion (`calibration capture` does). Every set point passes the
/// safety limits; a motion that breaks one, or whose sender dies, is braked and held.
///
/// With --arm replay:// the recording's states, object, pictures, force sensor and gripper are sent again at their pace; its
/// /twin/state and /twin/gap are not, because `twin shadow` makes them anew.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    rt_bridge run --cell fr3 --arm sim\n  \
    rt_bridge run --cell fr3 --arm sim --effects hidden.toml --record clip.mcap --duration 20 --json\n  \
    rt_bridge run --cell cell.toml --arm fci://172.16.0.2 --controller torque_pd --realtime enforce\n  \
    rt_bridge run --cell cell.toml --arm fci://172.16.0.2 --gripper serial:///dev/ttyUSB0 --wrench can://can0\n  \
    rt_bridge run --cell fr3 --arm sim --tracker rgbd\n  \
    rt_bridge run --cell cell.toml --arm replay://clip.mcap\n\n\
    JSON: cycles, missed_cycles (deadlines that passed unused), overruns (work longer than a period), lost_packets,\n\
    wake_us (wake-up latency), exec_us, period_us, age_us (a state's arrival to shared memory), recorded, faults; null for\n\
    what was not measured.")]
pub struct RunArguments {
    /// What the laboratory knows about its cell; `fr3` for the one that is built in
    #[arg(long, value_name = "cell.toml")]
    cell: PathBuf,
    /// sim, fci://HOST or replay://CLIP.mcap
    #[arg(long, value_name = "ARM")]
    arm: ArmChoice,
    /// Who computes the torque: the bridge (joint impedance with the gains of cell.toml) or the arm's own controller.
    /// Default: torque_pd, and joint_impedance where cell.toml describes a servo or the simulated arm hides something in its
    /// own controller: gains, command_delay, command_lag
    #[arg(long)]
    controller: Option<ControllerChoice>,
    /// sim, realsense, bag://FILE.bag (a recording by librealsense), replay or off.
    /// Default: sim where the arm is simulated and cell.toml has a [camera], replay with a recording, else off
    #[arg(long, value_name = "CAMERA")]
    camera: Option<CameraChoice>,
    /// The simulated camera draws the robot from splats of its links (link0.ply to link7.ply, as `twin label-splats` writes
    /// them), on a graphics card where the program was built with `--features render` and finds one
    #[arg(long, value_name = "FOLDER")]
    splats: Option<PathBuf>,
    /// The arm holds the simulated camera as this file says (`calibration hand-eye` writes one): pictures move with the arm
    #[arg(long, value_name = "hand_eye.toml")]
    hand_eye: Option<PathBuf>,
    /// Who publishes the object's pose: the simulated cell, the bridge from the camera's colour and depth, the recording,
    /// or (off) another process. Default: sim with the simulated arm, replay with a recording, rgbd with a RealSense
    /// camera, else off
    #[arg(long)]
    tracker: Option<TrackerChoice>,
    /// sim, serial:///dev/ttyUSB0 (a Robotiq 2F), fci://HOST (the Franka Hand), replay or off.
    /// Default: sim where the arm is simulated and cell.toml has a [gripper], replay with a recording, else off
    #[arg(long, value_name = "GRIPPER")]
    gripper: Option<GripperChoice>,
    /// Force/torque sensor: sim, can://INTERFACE, replay or off.
    /// Default: sim where the arm is simulated and cell.toml has a [wrench], replay with a recording, else off
    #[arg(long, value_name = "SENSOR")]
    wrench: Option<WrenchChoice>,
    /// Effects of the simulated cell that nobody else knows of
    #[arg(long, value_name = "hidden.toml")]
    effects: Option<PathBuf>,
    /// Parameters of the simulated cell that nobody else knows of
    #[arg(long, value_name = "theta.toml")]
    parameters: Option<PathBuf>,
    /// Record everything on shared memory to this new file
    #[arg(long, value_name = "CLIP.mcap")]
    record: Option<PathBuf>,
    /// Replaces the file of --record where it is there already
    #[arg(long, requires = "record")]
    force: bool,
    /// Stop after this many seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<Duration>,
    /// Refuse to run, or go on and say so, where the machine grants neither SCHED_FIFO nor locked memory.
    /// Default: enforce with a robot, else ignore
    #[arg(long)]
    realtime: Option<Realtime>,
    /// End, braking first, when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl RunArguments {
    pub(super) fn execute(self) -> Result<()> {
        // First of all: whoever started us may be killed at any moment.
        let stop = stop_flag(self.parent)?;
        // Before an arm is asked to do anything.
        Destination::of(self.record.as_deref(), self.force)?;
        let default = if matches!(self.arm, ArmChoice::Fci(_)) { Realtime::Enforce } else { Realtime::Ignore };
        let settings = Settings {
            cell: self.cell,
            arm: self.arm,
            controller: self.controller,
            camera: self.camera,
            splats: self.splats,
            hand_eye: self.hand_eye,
            tracker: self.tracker,
            gripper: self.gripper,
            wrench: self.wrench,
            effects: self.effects,
            parameters: self.parameters,
            record: self.record,
            force: self.force,
            duration: self.duration,
            realtime: self.realtime.unwrap_or(default),
        };
        let report = run(&settings, &stop)?;
        if self.json {
            answer::json(&report)?;
        } else {
            answer::words(in_words(&report))?;
        }
        match report.faults.first() {
            Some(fault) => bail!("{fault}"),
            None => Ok(()),
        }
    }
}

fn in_words(report: &RunReport) -> String {
    let mut text = format!(
        "{} cycles, {} missed, {} overruns, {} lost packets\nwake-up p99.9 {}, work p99.9 {}, age p99 {}",
        report.cycles,
        report.missed_cycles,
        report.overruns,
        report.lost_packets,
        times::in_words(report.wake_us.p999),
        times::in_words(report.exec_us.p999),
        times::in_words(report.age_us.p99)
    );
    if let Some(recorded) = &report.recorded {
        text += &format!("\n{}", recorded.in_words());
    }
    text
}
