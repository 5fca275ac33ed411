//! The control loop on the simulated arm allocates nothing: neither while it holds, nor while a motion is refused, played
//! or braked. Counted in the thread that turns the cycle; the simulated world runs in another.
#![allow(missing_docs)]

mod bench;
mod counting;

use bench::Bench;
use counting::allocations;
use rt_bridge::motion::Target;
use rt_bridge::remark::{BrakeReason, Remark};
use rt_bridge::rt::cycle::Turn;
use rt_bridge::rt::deadline::Grid;
use rt_bridge::rt::process::sleep_until;
use rt_bridge::sim::World;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, SetPoint};
use shared_mem::time::now_ns;
use std::path::Path;

/// A bridge that holds the simulated arm.
struct Bridge {
    bench: Bench,
    last: ArmState,
}

impl Bridge {
    fn new() -> Self {
        let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
        let cell = Cell::read(&lab).expect("the cell that ships");
        let (_world, arm, _views) = World::start(&cell, None).expect("a world");
        Self { bench: Bench::around(arm, &cell, CommandInterface::Torque), last: ArmState::default() }
    }

    /// Turns on the timer's grid until `count` states were answered; returns what this thread allocated meanwhile.
    fn turn(&mut self, count: u64) -> u64 {
        let mut grid = Grid::new(now_ns(), 1_000_000);
        let (before, until) = (allocations(), self.last.cycle + count);
        while self.last.cycle < until {
            sleep_until(grid.next_ns());
            let wake = grid.woke(now_ns());
            assert_eq!(self.bench.cycle.turn(Some(wake)), Turn::Continue);
            while let Ok(beat) = self.bench.beats.pop() {
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
            assert!(self.bench.orders.send(&chunk), "room for a second of motion");
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
fn following_targets_and_braking_when_they_end_allocates_nothing() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    let mut allocated = 0;
    for k in 0..30 {
        let mut q = bridge.last.q_d;
        q[k % 7] += if k % 2 == 0 { 0.4 } else { -0.3 };
        // Each third of another sender, each fifth out of range.
        q[3] = if k % 5 == 4 { f64::NAN } else { q[3] };
        bridge.bench.orders.aim(&Target { stream: if k % 3 == 2 { 8 } else { 7 }, q: Some(q), speed: 0.5 });
        allocated += bridge.turn(20);
    }
    assert_eq!((bridge.last.motion, bridge.last.motion_id), (MotionStatus::Playing, 7));
    assert_eq!(allocated, 0, "while following");
    assert_eq!(bridge.turn(900), 0, "while braking, when no target came any more");
    assert_ne!(bridge.last.motion, MotionStatus::Playing);
    let stats = bridge.bench.cycle.finish();
    assert!(stats.exec.count() > 1000);
}

#[test]
fn holding_playing_refusing_and_braking_allocate_nothing() {
    let mut bridge = Bridge::new();
    bridge.turn(5);
    assert_eq!(bridge.turn(200), 0, "while holding");
    bridge.send_swing(1, 12);
    assert_eq!(bridge.turn(300), 0, "while playing");
    assert_eq!((bridge.last.motion, bridge.last.motion_id), (MotionStatus::Playing, 1));
    bridge.send_swing(2, 1);
    assert_eq!(bridge.turn(100), 0, "while refusing a second motion");
    assert_eq!(bridge.turn(600), 0, "while braking, when the set points ran out");
    assert_eq!(bridge.last.motion, MotionStatus::Braked);
    let mut told = Vec::new();
    while let Ok(remark) = bridge.bench.remarks.pop() {
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
    let stats = bridge.bench.cycle.finish();
    assert!(stats.cycles > 1000 && stats.wake.count() > 1000);
}
