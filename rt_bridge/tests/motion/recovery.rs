//! The control loop after a reflex: it takes command again when it is asked to, and never after a stop that a person pressed.
//! And after a `Stop`, which goes before everything that waits.

use crate::bench::Bench;
use rt_bridge::arm::{Arm, ArmFault, Clock, Desired, Read, ReflexErrors};
use rt_bridge::motion::Target;
use rt_bridge::remark::{BrakeReason, Refusal, Remark};
use rt_bridge::rt::cycle::Turn;
use shared_mem::cell::{Cell, Robot};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::motion::{MotionChunk, MotionKind, SetPoint};
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

const READY: [f64; 8] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
/// Periods without a sender after which motions may begin again after a stop, and one more.
const SILENCE: u32 = 501;

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
        assert!(self.bench.orders.send(&chunk), "room");
    }

    /// Sends chunk `index` of a motion that swings the last joint, for ever.
    fn send_swing(&mut self, motion_id: u64, index: u32) -> bool {
        let mut chunk = MotionChunk { motion_id, index, length: 50, dof: 7, ..MotionChunk::default() };
        for (k, point) in (50 * index..).zip(&mut chunk.set_points) {
            // 0.1 (1 - cos wt)^2 rad at w = 2 rad/s: begins at rest.
            let (sin, cos) = (2e-3 * f64::from(k)).sin_cos();
            *point = SetPoint { q_d: READY, dq_d: [0.0; 8] };
            point.q_d[6] += 0.1 * (1.0 - cos) * (1.0 - cos);
            point.dq_d[6] = 0.4 * (1.0 - cos) * sin;
        }
        self.bench.orders.send(&chunk)
    }

    fn send_stop(&mut self, motion_id: u64) {
        let stop = MotionChunk { motion_id, kind: MotionKind::Stop, ..MotionChunk::default() };
        assert!(self.bench.orders.send(&stop), "a stop needs no room");
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
    bridge.turn(SILENCE);
    bridge.send(2, MotionKind::Last);
    bridge.turn(60);
    assert_eq!((bridge.last.motion_id, bridge.last.motion), (2, MotionStatus::Done));
}

#[test]
fn who_sends_on_through_a_reflex_does_not_move_the_arm_when_it_is_commanded_again() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    let send_on = |bridge: &mut Bridge, periods: u32| {
        for _ in 0..periods / 10 {
            let mut q = READY;
            q[0] += 0.5;
            bridge.bench.orders.aim(&Target { stream: 5, q: Some(q), speed: 0.5 });
            bridge.turn(10);
        }
    };
    bridge.send(1, MotionKind::Play);
    bridge.turn(20);
    bridge.stop_by(1);
    send_on(&mut bridge, 100);
    bridge.send(0, MotionKind::Recover);
    send_on(&mut bridge, 2 * SILENCE);
    assert!(bridge.told().contains(&Remark::Recovered));
    assert_eq!(bridge.last.q_d[0], READY[0], "it holds where it stands");
    bridge.turn(SILENCE);
    send_on(&mut bridge, 100);
    assert!(bridge.last.q_d[0] > READY[0], "somebody who asks anew");
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

/// 4 s of set points in the player and 6 s in the ring before it: that long a stop would wait if it waited its turn.
#[test]
fn a_stop_brakes_in_the_next_cycle_whatever_is_queued_and_whoever_sends_it() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    let mut sent = 0;
    while bridge.send_swing(1, sent) {
        sent += 1;
    }
    bridge.turn(600);
    while bridge.send_swing(1, sent) {
        sent += 1;
    }
    assert!(bridge.last.motion_queued > 3900 && bridge.last.dq_d[6].abs() > 0.1, "{:?}", bridge.last);
    // Another sender, which knows nothing of the motion.
    bridge.send_stop(0);
    bridge.turn(1);
    assert_eq!((bridge.last.motion, bridge.last.motion_queued), (MotionStatus::Braked, 0));
    let mut speed = bridge.last.dq_d[6].abs();
    for _ in 0..200 {
        bridge.turn(1);
        assert!(bridge.last.dq_d[6].abs() <= speed);
        speed = bridge.last.dq_d[6].abs();
    }
    assert!(speed == 0.0 && bridge.bench.orders.is_empty(), "at rest, and nothing of the motion is left");
    assert!(bridge.send_swing(1, sent), "what its sender still sends is dropped");
    bridge.turn(5);
    let why = BrakeReason::Asked;
    assert_eq!(bridge.told(), [Remark::Began { motion: 1 }, Remark::Braked { motion: 1, why }]);
    bridge.turn(SILENCE);
    bridge.send(2, MotionKind::Last);
    bridge.turn(60);
    assert_eq!((bridge.last.motion_id, bridge.last.motion), (2, MotionStatus::Done));
}

#[test]
fn a_motion_that_was_sent_before_a_stop_does_not_begin_after_it() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    assert!(bridge.send_swing(1, 0));
    bridge.send_stop(1);
    assert!(bridge.send_swing(1, 1), "sent by somebody who does not know of the stop yet");
    bridge.turn(30);
    assert_eq!((bridge.last.motion_id, bridge.last.motion, bridge.last.q_d), (1, MotionStatus::Braked, READY));
    assert_eq!(bridge.told(), [Remark::Braked { motion: 1, why: BrakeReason::Asked }]);
    bridge.send_stop(0);
    bridge.turn(5);
    bridge.send(2, MotionKind::Last);
    bridge.turn(SILENCE);
    assert_eq!(bridge.told(), [Remark::Refused { motion: 2, why: Refusal::Stopped }]);
    bridge.send(3, MotionKind::Last);
    bridge.turn(60);
    assert_eq!(
        (bridge.last.motion_id, bridge.last.motion),
        (3, MotionStatus::Done),
        "a stop stops what was, not what comes after a silence"
    );
}
