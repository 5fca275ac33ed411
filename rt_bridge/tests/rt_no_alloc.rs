//! The control loop on the simulated arm allocates nothing: neither while it holds, nor while a motion is refused, played
//! or braked. Counted in the thread that turns the cycle; the simulated world runs in another.
#![allow(missing_docs)]

mod counting;

use counting::allocations;
use rt_bridge::motion::Player;
use rt_bridge::rt::cycle::{Beat, Cycle, Link, Plan, Turn};
use rt_bridge::rt::deadline::Grid;
use rt_bridge::rt::law::TorquePd;
use rt_bridge::rt::process::sleep_until;
use rt_bridge::rt::remark::{BrakeReason, Remark};
use rt_bridge::safety::{Guard, Limits, Workspace};
use rt_bridge::sim::World;
use rtrb::{Consumer, Producer, RingBuffer};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, SetPoint};
use shared_mem::time::now_ns;
use std::path::Path;
use twin::arm::{ArmModel, ControlLaw};

struct Bench {
    cycle: Cycle,
    beats: Consumer<Beat>,
    remarks: Consumer<Remark>,
    chunks: Producer<MotionChunk>,
    last: ArmState,
}

impl Bench {
    fn new() -> Self {
        let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
        let cell = Cell::read(&lab).expect("the cell that ships");
        let model = ArmModel::from_cell(&cell).expect("a model");
        let law = ControlLaw::new(cell.controller.as_ref(), None, &model).expect("gains");
        let (_world, arm, _views) = World::start(&cell, None).expect("a world");
        let plan = Plan {
            interface: CommandInterface::Torque,
            law: Some(TorquePd::new(&law, model.clone())),
            model,
            tip_radius: 0.012,
            limits: Limits::fr3(),
            session: 1,
        };
        let guard = Guard { limits: Limits::fr3(), workspace: Workspace::of(&cell), period_s: 1e-3 };
        let (to_pump, beats) = RingBuffer::new(64);
        let (to_words, remarks) = RingBuffer::new(64);
        let (chunks, from_pump) = RingBuffer::new(64);
        let link = Link { beats: to_pump, remarks: to_words, chunks: from_pump, pump: std::thread::current() };
        let mut cycle = Cycle::new(Box::new(arm), plan, Player::new(guard, [0.0; 8]), link);
        assert_eq!(cycle.take_command(), Turn::Continue);
        Self { cycle, beats, remarks, chunks, last: ArmState::default() }
    }

    /// Turns on the timer's grid until `count` states were answered; returns what this thread allocated meanwhile.
    fn turn(&mut self, count: u64) -> u64 {
        let mut grid = Grid::new(now_ns(), 1_000_000);
        let (before, until) = (allocations(), self.last.cycle + count);
        while self.last.cycle < until {
            sleep_until(grid.next_ns());
            let wake = grid.woke(now_ns());
            assert_eq!(self.cycle.turn(Some(wake)), Turn::Continue);
            while let Ok(beat) = self.beats.pop() {
                self.last = beat.state;
            }
        }
        allocations() - before
    }

    /// Sends the first `count` chunks of a swing of all joints from where the arm is told to be.
    fn send_swing(&mut self, motion_id: u64, count: u32) {
        for index in 0..count {
            let mut chunk = MotionChunk { motion_id, index, length: 50, dof: self.last.dof, ..MotionChunk::default() };
            for (k, point) in chunk.set_points.iter_mut().enumerate() {
                *point = swing(&self.last, index as usize * CHUNK_LENGTH + k);
            }
            self.chunks.push(chunk).expect("room for a second of motion");
        }
    }
}

/// `0.05 (1 - cos wt)^2` at `w` = 3 rad/s.
fn swing(from: &ArmState, millisecond: usize) -> SetPoint {
    let (w, t) = (3.0, millisecond as f64 * 1e-3);
    let (lift, slope) = (1.0 - (w * t).cos(), w * (w * t).sin());
    let mut point = SetPoint { q_d: from.q_d, dq_d: [0.0; 8] };
    for joint in 0..from.dof as usize {
        point.q_d[joint] += 0.05 * lift * lift;
        point.dq_d[joint] = 0.1 * lift * slope;
    }
    point
}

#[test]
fn holding_playing_refusing_and_braking_allocate_nothing() {
    let mut bench = Bench::new();
    bench.turn(5);
    assert_eq!(bench.turn(200), 0, "while holding");
    bench.send_swing(1, 12);
    assert_eq!(bench.turn(300), 0, "while playing");
    assert_eq!((bench.last.motion, bench.last.motion_id), (MotionStatus::Playing, 1));
    bench.send_swing(2, 1);
    assert_eq!(bench.turn(100), 0, "while refusing a second motion");
    assert_eq!(bench.turn(600), 0, "while braking, when the set points ran out");
    assert_eq!(bench.last.motion, MotionStatus::Braked);
    let mut told = Vec::new();
    while let Ok(remark) = bench.remarks.pop() {
        told.push(remark);
    }
    assert!(
        matches!(
            told[..],
            [
                Remark::Began { motion: 1 },
                Remark::Refused { motion: 2, .. },
                Remark::Braked { motion: 1, why: BrakeReason::Underrun }
            ]
        ),
        "{told:?}"
    );
    let stats = bench.cycle.finish();
    assert!(stats.cycles > 1000 && stats.wake.count() > 1000);
}
