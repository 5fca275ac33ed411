//! The control loop after a reflex: it takes command again when it is asked to, and never after a stop that a person pressed.
#![allow(missing_docs)]

use rt_bridge::arm::{Arm, ArmFault, Clock, Desired, Read, ReflexErrors};
use rt_bridge::motion::Player;
use rt_bridge::rt::cycle::{Beat, Cycle, Link, Plan, Turn};
use rt_bridge::rt::remark::Remark;
use rt_bridge::safety::{Guard, Limits, Workspace};
use rtrb::{Consumer, Producer, RingBuffer};
use shared_mem::cell::{Cell, Robot};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::motion::{MotionChunk, MotionKind, SetPoint};
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use twin::arm::ArmModel;

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

struct Bench {
    script: Arc<Script>,
    cycle: Cycle,
    beats: Consumer<Beat>,
    remarks: Consumer<Remark>,
    chunks: Producer<MotionChunk>,
    last: ArmState,
}

impl Bench {
    fn new() -> Self {
        let script = Arc::new(Script::default());
        *script.stands.lock().expect("no panic") = READY;
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let (to_pump, beats) = RingBuffer::new(4096);
        let (to_words, remarks) = RingBuffer::new(64);
        let (chunks, from_pump) = RingBuffer::new(64);
        let plan = Plan {
            interface: CommandInterface::JointPosition,
            law: None,
            model: ArmModel::from_cell(&cell).expect("a model"),
            tip_radius: 0.0,
            limits: Limits::fr3(),
            session: 1,
        };
        let guard = Guard { limits: Limits::fr3(), workspace: Workspace::of(&cell), period_s: 1e-3 };
        let link = Link { beats: to_pump, remarks: to_words, chunks: from_pump, pump: std::thread::current() };
        let arm = Scripted { script: script.clone(), told: 0, ticks: 0 };
        let mut cycle = Cycle::new(Box::new(arm), plan, Player::new(guard, [0.0; 8]), link);
        assert_eq!(cycle.take_command(), Turn::Continue);
        Self { script, cycle, beats, remarks, chunks, last: ArmState::default() }
    }

    /// Turns and returns how often the arm was commanded meanwhile.
    fn turn(&mut self, count: u32) -> u32 {
        let before = self.script.commands.load(Ordering::Relaxed);
        for _ in 0..count {
            assert_eq!(self.cycle.turn(None), Turn::Continue);
            while let Ok(beat) = self.beats.pop() {
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
        self.chunks.push(chunk).expect("room");
    }

    fn told(&mut self) -> Vec<Remark> {
        std::iter::from_fn(|| self.remarks.pop().ok()).collect()
    }
}

#[test]
fn after_a_reflex_the_arm_is_held_where_it_stands_and_the_next_motion_is_played() {
    let mut bench = Bench::new();
    bench.turn(5);
    bench.send(1, MotionKind::Play);
    bench.turn(20);
    bench.stop_by(1);
    bench.send(0, MotionKind::Recover);
    assert!(bench.turn(20) > 10, "commanded again");
    assert_eq!(bench.script.recoveries.load(Ordering::Relaxed), 1);
    assert!((bench.last.q_d[1] - (READY[1] + 0.01)).abs() < 1e-12, "{:?}", bench.last.q_d);
    assert!(bench.told().contains(&Remark::Recovered));
    bench.send(2, MotionKind::Last);
    bench.turn(60);
    assert_eq!((bench.last.motion_id, bench.last.motion), (2, MotionStatus::Done));
}

#[test]
fn nobody_recovers_an_arm_that_is_well_or_that_a_person_stopped() {
    let mut bench = Bench::new();
    bench.turn(5);
    bench.send(1, MotionKind::Play);
    bench.turn(5);
    bench.send(0, MotionKind::Recover);
    bench.turn(20);
    assert_eq!((bench.last.motion_id, bench.last.motion), (1, MotionStatus::Playing), "a motion is not disturbed");
    bench.stop_by(2);
    bench.send(0, MotionKind::Recover);
    assert_eq!(bench.turn(20), 0);
    assert_eq!(bench.script.recoveries.load(Ordering::Relaxed), 0);
    assert!(!bench.told().contains(&Remark::Recovered));
}
