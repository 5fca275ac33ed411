//! `rt_bridge run`: puts arm, control thread, pump, camera and recorder together, watches over them, and takes them down
//! in the order in which nothing is lost.

mod devices;
mod report;

pub use devices::{ArmChoice, CameraChoice, ControllerChoice};
pub use report::RunReport;

use crate::camera::{self, Camera};
use crate::device::Service;
use crate::gripper::GripperChoice;
use crate::motion::Player;
use crate::pump::{Notice, Pump, PumpReport, Rings};
use crate::recorder::child::{Change, RecorderChild};
use crate::replay::Instruments;
use crate::rt::Realtime;
use crate::rt::control;
use crate::rt::cycle::{Cycle, Link, Plan};
use crate::rt::idle::{DeepIdle, ShallowIdle};
use crate::rt::orders::orders;
use crate::rt::stats::LoopStats;
use crate::starting::ThreadError;
use crate::targets::Targets;
use crate::tracker::{self, TrackerChoice};
use crate::wrench::{self, WrenchChoice};
use anyhow::{Result, bail, ensure};
use devices::{Devices, Pictures};
use nalgebra::Isometry3;
use rtrb::{Consumer, RingBuffer};
use shared_mem::cell::Cell;
use shared_mem::hand_eye::HandEye;
use shared_mem::msg::event::EventLevel;
use shared_mem::msg::joints_from;
use shared_mem::msg::origin::ArmOrigin;
use shared_mem::msg::wrench::Wrench;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Beats that can wait for the pump: 4 s.
const BEATS: usize = 4096;
/// Chunks that can wait for the control thread, beside the set points in its own queue.
const CHUNKS: usize = 16;
/// Chunks that can wait before those: what a sender may be ahead beyond the 4 s of the control thread's queue.
const HELD_CHUNKS: usize = 64;
/// Remarks that can wait for the pump.
const REMARKS: usize = 64;
/// How often the main thread looks after the others.
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// How often it clears away what dead processes left on shared memory.
const CLEAR_EVERY: Duration = Duration::from_secs(1);

/// What to run.
#[derive(Debug, Clone)]
pub struct Settings {
    pub cell: PathBuf,
    pub arm: ArmChoice,
    /// Who computes the torque; none: the bridge for `joint_impedance`, the arm itself for a servo and where the simulated
    /// arm hides something in its own controller.
    pub controller: Option<ControllerChoice>,
    /// The camera; none: simulated with the simulated arm where cell.toml has a `[camera]`, the recording's with a
    /// recording, else off.
    pub camera: Option<CameraChoice>,
    /// Splats of the robot's links, which the simulated camera draws.
    pub splats: Option<PathBuf>,
    /// How the arm holds the simulated camera; none: it stands where cell.toml says.
    pub hand_eye: Option<PathBuf>,
    /// Who tracks the object; none: the simulated cell with the simulated arm, the recording's poses with a recording,
    /// the bridge with a RealSense camera, else nobody.
    pub tracker: Option<TrackerChoice>,
    /// The gripper; none: simulated with the simulated arm where cell.toml has a `[gripper]`, the recording's with a recording,
    /// else off.
    pub gripper: Option<GripperChoice>,
    /// The force/torque sensor; none: simulated with the simulated arm where cell.toml has a `[wrench]`, the recording's with a
    /// recording, else off.
    pub wrench: Option<WrenchChoice>,
    /// Effects of the simulated cell.
    pub effects: Option<PathBuf>,
    /// Parameters of the simulated cell.
    pub parameters: Option<PathBuf>,
    /// Record to this new file.
    pub record: Option<PathBuf>,
    /// Whether that file is replaced where it is there already.
    pub force: bool,
    /// Stop after this long.
    pub duration: Option<Duration>,
    /// What to do without real-time guarantees.
    pub realtime: Realtime,
}

impl Settings {
    /// What is in force, defaults resolved, as the TOML text that rides along in a recording.
    fn in_force(&self, plan: &Plan) -> String {
        let mut text = format!("arm = {:?}\ninterface = {:?}\n", self.arm.to_string(), format!("{:?}", plan.interface));
        let files = [("effects", &self.effects), ("parameters", &self.parameters), ("hand_eye", &self.hand_eye)];
        for (key, path) in files {
            if let Some(path) = path {
                text += &format!("{key} = {:?}\n", path.display().to_string());
            }
        }
        for (key, choice) in [
            ("camera", self.camera.as_ref().map(ToString::to_string)),
            ("tracker", self.tracker.map(|choice| format!("{choice:?}").to_lowercase())),
            ("gripper", self.gripper.as_ref().map(ToString::to_string)),
            ("wrench", self.wrench.as_ref().map(ToString::to_string)),
        ] {
            if let Some(choice) = choice {
                text += &format!("{key} = {choice:?}\n");
            }
        }
        text + &format!("realtime = {:?}\n", format!("{:?}", self.realtime))
    }
}

impl Settings {
    /// The camera in force, which has to go with the arm.
    fn camera(&self, cell: &Cell) -> Result<CameraChoice> {
        let default = match &self.arm {
            ArmChoice::Sim if cell.camera.is_some() => CameraChoice::Sim,
            ArmChoice::Replay(_) => CameraChoice::Replay,
            _ => CameraChoice::Off,
        };
        let choice = self.camera.clone().unwrap_or(default);
        match (&choice, &self.arm) {
            (CameraChoice::Sim, ArmChoice::Fci(_) | ArmChoice::Replay(_)) => {
                bail!("--camera sim shows the simulated cell; use it with --arm sim")
            }
            (CameraChoice::Replay, ArmChoice::Sim | ArmChoice::Fci(_)) => {
                bail!("--camera replay shows a recording's pictures; use it with --arm replay://CLIP.mcap")
            }
            _ => Ok(choice),
        }
    }

    /// Where the arm holds the simulated camera: its optical frame in the flange's.
    fn held(&self, cell: &Cell, is_drawn: bool) -> Result<Option<Isometry3<f64>>> {
        let Some(file) = &self.hand_eye else { return Ok(None) };
        ensure!(is_drawn, "--hand-eye is for the simulated camera: leave it out, or add --camera sim");
        ensure!(
            self.tracker(cell)? != TrackerChoice::Rgbd,
            "--tracker rgbd needs a camera that stands still: leave --hand-eye out, or choose another --tracker"
        );
        let mount = HandEye::read(file)?.end_effector_from_camera();
        Ok(Some(mount.map_err(|what| anyhow::anyhow!("{} {what}", file.display()))?))
    }

    /// The tracker in force.
    fn tracker(&self, cell: &Cell) -> Result<TrackerChoice> {
        let (simulated, recorded) = (self.arm == ArmChoice::Sim, matches!(self.arm, ArmChoice::Replay(_)));
        match self.tracker {
            Some(TrackerChoice::Sim) if !simulated => {
                bail!("--tracker sim reports the simulated cell's object; use it with --arm sim")
            }
            Some(TrackerChoice::Replay) if !recorded => {
                bail!("--tracker replay shows a recording's poses; use it with --arm replay://CLIP.mcap")
            }
            Some(TrackerChoice::Rgbd) if self.camera(cell)? == CameraChoice::Off => {
                bail!("--tracker rgbd needs pictures; choose a --camera")
            }
            Some(choice) => Ok(choice),
            None if simulated && cell.object().is_some() => Ok(TrackerChoice::Sim),
            None if recorded => Ok(TrackerChoice::Replay),
            None if cell.object().is_some() && matches!(self.camera(cell)?, CameraChoice::RealSense(_)) => {
                Ok(TrackerChoice::Rgbd)
            }
            None => Ok(TrackerChoice::Off),
        }
    }

    /// The gripper in force.
    fn gripper(&self, cell: &Cell) -> Result<GripperChoice> {
        let recorded = matches!(self.arm, ArmChoice::Replay(_));
        match &self.gripper {
            Some(GripperChoice::Replay) if !recorded => {
                bail!("--gripper replay shows a recording's gripper; use it with --arm replay://CLIP.mcap")
            }
            Some(choice) => Ok(choice.clone()),
            None if recorded => Ok(GripperChoice::Replay),
            None if self.arm == ArmChoice::Sim && cell.gripper.is_some() => Ok(GripperChoice::Sim),
            None => Ok(GripperChoice::Off),
        }
    }

    /// The force sensor in force.
    fn wrench(&self, cell: &Cell) -> Result<WrenchChoice> {
        let (simulated, recorded) = (self.arm == ArmChoice::Sim, matches!(self.arm, ArmChoice::Replay(_)));
        match &self.wrench {
            Some(WrenchChoice::Replay) if !recorded => {
                bail!("--wrench replay shows a recording's force sensor; use it with --arm replay://CLIP.mcap")
            }
            Some(WrenchChoice::Sim) if !simulated => {
                bail!("--wrench sim measures in the simulated cell; use it with --arm sim")
            }
            Some(choice) => Ok(choice.clone()),
            None if recorded => Ok(WrenchChoice::Replay),
            None if simulated && cell.wrench.is_some() => Ok(WrenchChoice::Sim),
            None => Ok(WrenchChoice::Off),
        }
    }

    /// Puts gripper and force sensor to work.
    fn instruments(
        &self,
        cell: &Cell,
        wrenches: Option<Consumer<Wrench>>,
        notices: &mpsc::Sender<Notice>,
    ) -> Result<Vec<Service>> {
        let gripper = self.gripper(cell)?.serve(cell, notices.clone())?;
        let wrench = match (self.wrench(cell)?, wrenches) {
            (WrenchChoice::Can(interface), _) => Some(wrench::serve_can(&interface, cell, notices.clone())?),
            (WrenchChoice::Sim, Some(samples)) => Some(wrench::serve_simulated(samples, notices.clone())?),
            _ => None,
        };
        Ok(gripper.into_iter().chain(wrench).collect())
    }
}

/// Runs until `stop` is set, the duration is over, the arm is lost or its recording ends.
///
/// # Errors
/// One line with a remedy when the run cannot begin. Faults on the way, of the arm, the recorder, shared memory or a thread
/// of this program, are no errors here: they end the run or not, and are in the report.
pub fn run(settings: &Settings, stop: &Arc<AtomicBool>) -> Result<RunReport> {
    let cell = Cell::read(&settings.cell)?;
    let devices = Devices::open(settings, &cell)?;
    let is_drawn = matches!(devices.pictures, Pictures::Scenes(..));
    ensure!(
        is_drawn || settings.splats.is_none(),
        "--splats is for the simulated camera: leave it out, or add --camera sim"
    );
    let held = settings.held(&cell, is_drawn)?;
    let node = Node::open("rt_bridge")?;

    let (to_pump, beats) = RingBuffer::new(BEATS);
    let (to_words, remarks) = RingBuffer::new(REMARKS);
    let (to_control, orders) = orders(CHUNKS, HELD_CHUNKS);
    let (notices, received) = mpsc::channel();
    let targets = Targets::new(devices.model, devices.plan.limits);
    let origin = ArmOrigin::new(&settings.arm.to_string());
    let rings = Rings { beats, remarks, orders: to_control, targets, poses: devices.poses, origin, notices: received };
    let mut pump = Pump::start(rings)?;
    let recorder = match &settings.record {
        Some(file) => {
            let events = node.subscriber(topics::EVENTS)?;
            Some(RecorderChild::start(
                (file, settings.force),
                &settings.cell,
                settings.in_force(&devices.plan),
                &events,
            )?)
        }
        None => None,
    };
    let mut instruments = settings.instruments(&cell, devices.wrenches, &notices)?;
    let replayed = match devices.replay {
        // A TwinAligner folder holds neither.
        Some((clip, clock)) if clip.is_file() => {
            let wrench = settings.wrench(&cell)? == WrenchChoice::Replay;
            let gripper = settings.gripper(&cell)? == GripperChoice::Replay;
            Some(Instruments::replayed(&clip, clock, wrench, gripper)?)
        }
        _ => None,
    };
    let camera = match devices.pictures {
        Pictures::Scenes(scenes, effects) => {
            Some(Camera::simulated(&cell, scenes, &effects, settings.splats.as_deref(), held)?)
        }
        Pictures::Clip(clip, clock) => Some(Camera::replayed(&clip, clock)?),
        Pictures::RealSense(source) => {
            instruments.push(camera::serve(&source, &cell, notices.clone())?);
            None
        }
        Pictures::None => None,
    };

    let tracker = match settings.tracker(&cell)? {
        TrackerChoice::Rgbd => Some(tracker::serve(&cell, notices.clone())?),
        _ => None,
    };
    let player = Player::new(devices.guard, joints_from(&[]));
    let link = Link { beats: to_pump, remarks: to_words, orders, pump: pump.thread() };
    let cycle = Cycle::new(devices.arm, devices.plan, player, link);

    let mut watch = Watch { node, recorder, notices, faults: Vec::new() };
    let driven = watch.over(settings, cycle, stop, &mut pump);
    // Whatever happened, everything is taken down in this order, and the recording is finished.
    drop(tracker);
    drop(camera);
    drop(replayed);
    let missing: Vec<String> = instruments.into_iter().filter_map(Service::finish).collect();
    let (pumped, pump_failed) = match pump.finish() {
        Ok(pumped) => (pumped, None),
        Err(error) => (PumpReport::default(), Some(error.to_string())),
    };
    let (recorded, unrecorded) = watch.recorder.map_or((None, None), RecorderChild::finish);
    let world_failed = devices.world.and_then(|world| world.finish().err()).map(|error| error.to_string());
    let measured = driven?;
    let failed = pump_failed.into_iter().chain(world_failed).chain(unrecorded);
    let faults = pumped.faults.into_iter().chain(watch.faults).chain(missing).chain(failed).collect();
    Ok(RunReport::new(&measured, &pumped.age, recorded, faults))
}

/// What the main thread looks after while the control thread runs.
struct Watch {
    node: Node,
    recorder: Option<RecorderChild>,
    notices: mpsc::Sender<Notice>,
    faults: Vec<String>,
}

impl Watch {
    /// Starts the control thread and stays until it has ended. A pump that fails ends the run: nobody would see the arm.
    fn over(&mut self, settings: &Settings, cycle: Cycle, stop: &AtomicBool, pump: &mut Pump) -> Result<LoopStats> {
        let end_control = Arc::new(AtomicBool::new(false));
        let _shallow_idle = self.shallow_idle();
        let control = control::spawn(cycle, settings.realtime, end_control.clone())?;
        tracing::info!("driving {}; it holds its pose until a motion is sent", settings.arm);
        let begin = Instant::now();
        let mut cleared = begin;
        while !control.is_finished() {
            let over = settings.duration.is_some_and(|duration| begin.elapsed() >= duration);
            if over || stop.load(Ordering::Relaxed) || !pump.is_well() {
                end_control.store(true, Ordering::Relaxed);
            }
            self.look(&mut cleared);
            std::thread::sleep(LOOK_EVERY);
        }
        match control.join() {
            Ok(ended) => Ok(ended?),
            Err(_) => {
                self.faults.push(ThreadError::Failed { name: "control" }.to_string());
                Ok(LoopStats::default())
            }
        }
    }

    /// Keeps processors out of deep sleep while the loop runs.
    fn shallow_idle(&self) -> Option<ShallowIdle> {
        let refused = |error: DeepIdle| {
            let notice = Notice { level: EventLevel::Warning, text: error.to_string() };
            let _pump_gone = self.notices.send(notice);
        };
        ShallowIdle::hold().map_err(refused).ok()
    }

    fn look(&mut self, cleared: &mut Instant) {
        if let Some(change) = self.recorder.as_mut().and_then(RecorderChild::look) {
            let notice = match change {
                Change::Replaced(file) => {
                    let text = format!(
                        "the recorder was killed; its file is readable up to its last half second, recording goes on in {}",
                        file.display()
                    );
                    Notice { level: EventLevel::Warning, text }
                }
                Change::Ended(why) => {
                    self.faults.push(why.clone());
                    Notice { level: EventLevel::Error, text: why }
                }
            };
            let _pump_gone = self.notices.send(notice);
        }
        if cleared.elapsed() >= CLEAR_EVERY {
            *cleared = Instant::now();
            self.node.clear_dead_nodes();
        }
    }
}
