//! The thread that stands in for the cell: it steps the physics once per command and gives out states, scenes and what
//! the tracker sees.

use super::SimArm;
use crate::rt::process;
use crate::sighting::Sighting;
use crate::starting::ThreadError;
use rtrb::{Consumer, Producer, RingBuffer};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::object::ObjectName;
use shared_mem::msg::wrench::Wrench;
use shared_mem::theta::Theta;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use twin::control::Drive;
use twin::effects::CameraEffects;
use twin::scene::{MOST_BODIES, SceneSnapshot};
use twin::sensors::tracker::SimTracker;
use twin::sensors::wrench::SimWrench;
use twin::sim::{SimError, SimScene};

/// States and commands that can be under way: one of each in lock-step.
const IN_FLIGHT: usize = 2;
/// Scenes that wait for the camera: a quarter of a second.
const SCENES: usize = 256;

/// Poses that wait for the pump: two of every body, and more than a second of one at frame rate.
const POSES: usize = 2 * MOST_BODIES;

/// Force samples that wait for their thread: a quarter of a second at the highest rate.
const WRENCHES: usize = 256;

/// What the cell gives beside its arm.
#[derive(Debug)]
pub struct Views {
    /// Scenes for a camera, one per period.
    pub scenes: Consumer<SceneSnapshot>,
    /// What the tracker sees, as it becomes known; `stamp_ns` is 0.
    pub poses: Consumer<Sighting>,
    /// What the force sensor at the wrist measures; `stamp_ns` is 0.
    pub wrenches: Consumer<Wrench>,
    /// Effects on what a camera or a tracker reports, hidden from everybody else.
    pub camera_effects: CameraEffects,
}

/// The world's ends of the rings.
struct Outlets {
    states: Producer<ArmState>,
    scenes: Producer<SceneSnapshot>,
    poses: Producer<Sighting>,
    /// One for each body, with its name.
    trackers: Vec<(ObjectName, SimTracker)>,
    wrenches: Producer<Wrench>,
    sensor: SimWrench,
}

/// The cell cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// Cell or parameters.
    #[error(transparent)]
    Cell(#[from] SimError),
    #[error(transparent)]
    Thread(#[from] ThreadError),
}

/// The running cell. It ends when its [`SimArm`] is dropped.
#[derive(Debug)]
pub struct World {
    handle: JoinHandle<()>,
}

impl World {
    /// Sets the cell up and starts it. `theta` are the *simulated* cell's own parameters and effects, which the twin is
    /// never reported. Returns the arm's end, and what else there is to see.
    ///
    /// # Errors
    /// [`WorldError`] when cell or parameters cannot be simulated, or there is no thread for it.
    pub fn start(cell: &Cell, theta: Option<&Theta>) -> Result<(Self, SimArm, Views), WorldError> {
        let mut scene = SimScene::new(cell, theta)?;
        let camera_effects = scene.cell().camera_effects();
        let (trackers, sensor) = (trackers(cell, &scene), SimWrench::new(cell));
        let (to_arm, states) = RingBuffer::new(IN_FLIGHT);
        let (commands, mut from_arm) = RingBuffer::<ArmCommand>::new(IN_FLIGHT);
        let (to_camera, scenes) = RingBuffer::new(SCENES);
        let (to_pump, poses) = RingBuffer::new(POSES);
        let (to_wrench, wrenches) = RingBuffer::new(WRENCHES);
        let mut out =
            Outlets { states: to_arm, scenes: to_camera, poses: to_pump, trackers, wrenches: to_wrench, sensor };
        let dof = scene.cell().arm_model().map_or(0, twin::arm::ArmModel::dof);
        let body = move || {
            // It plays the robot, which is always in time; where that is not granted, late states count as lost packets.
            let _not_granted = process::set_fifo(process::SIMULATION_PRIORITY);
            out.give(&mut scene);
            while !from_arm.is_abandoned() {
                let Ok(command) = from_arm.pop() else {
                    thread::park_timeout(Duration::from_millis(100));
                    continue;
                };
                scene.step(&drive(&command));
                out.give(&mut scene);
            }
        };
        let handle = thread::Builder::new()
            .name("world".into())
            .spawn(body)
            .map_err(|source| ThreadError::Refused { name: "world", source })?;
        let arm = SimArm { dof, states, commands, world: handle.thread().clone() };
        Ok((Self { handle }, arm, Views { scenes, poses, wrenches, camera_effects }))
    }

    /// Waits for the thread, after its [`SimArm`] was dropped.
    ///
    /// # Errors
    /// [`ThreadError::Failed`] when the simulation panicked.
    pub fn finish(self) -> Result<(), ThreadError> {
        self.handle.thread().unpark();
        self.handle.join().map_err(|_| ThreadError::Failed { name: "world" })
    }
}

impl Outlets {
    fn give(&mut self, cell: &mut SimScene) {
        let mut state = ArmState { mode: ArmMode::Move, success_rate: 1.0, ..ArmState::default() };
        cell.read(&mut state);
        // Lock-step leaves room for the state; a camera or a pump that is late misses something, not the other way round.
        let _state = self.states.push(state);
        let scene = cell.snapshot();
        let _scene = self.scenes.push(scene);
        for (number, (name, tracker)) in self.trackers.iter_mut().enumerate() {
            if let Some(pose) = tracker.look(scene.time_ns, cell.object(number)) {
                let _pose = self.poses.push(Sighting { is_first: number == 0, name: *name, pose });
            }
        }
        if !self.wrenches.is_abandoned()
            && let Some(wrench) = self.sensor.observe(cell.cell())
        {
            let _wrench = self.wrenches.push(wrench);
        }
    }
}

/// A tracker for each body, under the hidden effects.
fn trackers(cell: &Cell, scene: &SimScene) -> Vec<(ObjectName, SimTracker)> {
    let effects = scene.cell().camera_effects();
    let tracker = |(number, name): (usize, &ObjectName)| {
        let one = Cell { in_question: scene.object_of(number), ..cell.clone() };
        (*name, SimTracker::of_body(&one, number).with_effects(effects))
    };
    scene.names().iter().enumerate().map(tracker).collect()
}

fn drive(command: &ArmCommand) -> Drive {
    match command.interface {
        CommandInterface::Torque => Drive::Torque { tau_J_d: command.tau_J_d },
        CommandInterface::JointPosition => Drive::JointImpedance { q_d: command.q_d, dq_d: command.dq_d },
    }
}
