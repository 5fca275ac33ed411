//! The control loop after a reflex: it takes command again when it is asked to, and never after a stop that a person pressed.
#![allow(missing_docs)]

mod bench;

use bench::Bench;
use rt_bridge::arm::{Arm, ArmFault, Clock, Desired, Read, ReflexErrors};
use rt_bridge::rt::cycle::Turn;
use rt_bridge::rt::remark::Remark;
use shared_mem::cell::{Cell, Robot};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::motion::{MotionChunk, MotionKind, SetPoint};
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

const READY: [f64; 8] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];

/// What the test and the robot share.
#[derive(Default)]
struct Script {
    /// 0: well, 1: in a reflex, 2: stopped by a person.
    mode: AtomicU8,
    recoveries: AtomicU32,
    commands: AtomicU32,
    stands: Mutex<[f64; 8]>,
}

struct Scripted {
    script: Arc<Script>,
    told: u8,
    ticks: u64,
}

impl Arm for Scripted {
    fn dof(&self) -> usize {
        7
    }

    fn clock(&self) -> Clock {
        Clock::Device
    }

    fn start(&mut self, _: CommandInterface) -> Result<Desired, ArmFault> {
        Ok(Desired::Commanded)
    }

    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault> {
        self.ticks += 1;
        let stands = *self.script.stands.lock().expect("no panic");
        let mode = self.script.mode.load(Ordering::Relaxed);
        let shown = [ArmMode::Move, ArmMode::Reflex, ArmMode::UserStopped][mode as usize];
        *state = ArmState { mode: shown, device_ns: self.ticks * 1_000_000, ..ArmState::default() };
        (state.q, state.q_d) = (stands, stands);
        let news = std::mem::replace(&mut self.told, mode) != mode;
        match mode {
            1 if news => Err(ArmFault::Reflex { errors: ReflexErrors::from_bits(1 << 7) }),
            2 if news => Err(ArmFault::UserStopped),
            _ => Ok(Read::Fresh),
        }
    }

    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault> {
        *self.script.stands.lock().expect("no panic") = command.q_d;
        self.script.commands.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn stop(&mut self) {}

    fn recover(&mut self) -> Result<(), ArmFault> {
        self.script.recoveries.fetch_add(1, Ordering::Relaxed);
        self.script.mode.store(0, Ordering::Relaxed);
        // The brakes let it sink a little.
        self.script.stands.lock().expect("no panic")[1] += 0.01;
        Ok(())
    }
}

/// A bridge that holds a scripted robot.
struct Bridge {
    script: Arc<Script>,
    bench: Bench,
    last: ArmState,
}

impl Bridge {
    fn new() -> Self {
        let script = Arc::new(Script::default());
        *script.stands.lock().expect("no panic") = READY;
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let arm = Scripted { script: script.clone(), told: 0, ticks: 0 };
        Self { script, bench: Bench::around(arm, &cell, CommandInterface::JointPosition), last: ArmState::default() }
    }

    /// Turns and returns how often the arm was commanded meanwhile.
    fn turn(&mut self, count: u32) -> u32 {
        let before = self.script.commands.load(Ordering::Relaxed);
        for _ in 0..count {
            assert_eq!(self.bench.cycle.turn(None), Turn::Continue);
            while let Ok(beat) = self.bench.beats.pop() {
                self.last = beat.state;
            }
        }
        self.script.commands.load(Ordering::Relaxed) - before
    }

    fn stop_by(&mut self, mode: u8) {
        self.script.mode.store(mode, Ordering::Relaxed);
        assert_eq!(self.turn(10), 0, "an arm that is stopped is not commanded");
        assert_eq!(self.last.motion, MotionStatus::Braked);
    }

    fn send(&mut self, motion_id: u64, kind: MotionKind) {
        let mut chunk = MotionChunk { motion_id, kind, length: 50, dof: 7, ..MotionChunk::default() };
        chunk.set_points = [SetPoint { q_d: self.last.q_d, dq_d: [0.0; 8] }; 50];
        self.bench.chunks.push(chunk).expect("room");
    }

    fn told(&mut self) -> Vec<Remark> {
        std::iter::from_fn(|| self.bench.remarks.pop().ok()).collect()
    }
}

#[test]
fn after_a_reflex_the_arm_is_held_where_it_stands_and_the_next_motion_is_played() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    bridge.send(1, MotionKind::Play);
    bridge.turn(20);
    bridge.stop_by(1);
    bridge.send(0, MotionKind::Recover);
    assert!(bridge.turn(20) > 10, "commanded again");
    assert_eq!(bridge.script.recoveries.load(Ordering::Relaxed), 1);
    assert!((bridge.last.q_d[1] - (READY[1] + 0.01)).abs() < 1e-12, "{:?}", bridge.last.q_d);
    assert!(bridge.told().contains(&Remark::Recovered));
    bridge.send(2, MotionKind::Last);
    bridge.turn(60);
    assert_eq!((bridge.last.motion_id, bridge.last.motion), (2, MotionStatus::Done));
}

#[test]
fn nobody_recovers_an_arm_that_is_well_or_that_a_person_stopped() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    bridge.send(1, MotionKind::Play);
    bridge.turn(5);
    bridge.send(0, MotionKind::Recover);
    bridge.turn(20);
    assert_eq!((bridge.last.motion_id, bridge.last.motion), (1, MotionStatus::Playing), "a motion is not disturbed");
    bridge.stop_by(2);
    bridge.send(0, MotionKind::Recover);
    assert_eq!(bridge.turn(20), 0);
    assert_eq!(bridge.script.recoveries.load(Ordering::Relaxed), 0);
    assert!(!bridge.told().contains(&Remark::Recovered));
}
