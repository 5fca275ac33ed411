//! The arm that is there stays above the table, not only the one that is asked for: motions into the table and along it are
//! played through whole control cycles to the simulated arm, period after period without waiting for a clock, under both
//! controllers. Above the table counts what the arm's own state says, of the tool and of every link.
//!
//! ```sh
//! cargo test --release -p rt_bridge --test motion arm_above_table -- --nocapture
//! ```

use crate::bench::Bench;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rt_bridge::arm::{Arm, ArmFault, Clock, Desired, Read};
use rt_bridge::remark::{BrakeReason, Remark};
use rt_bridge::rt::cycle::Turn;
use rt_bridge::rt::deadline::Wake;
use rt_bridge::safety::workspace::TABLE_GAP;
use rt_bridge::safety::{Limits, Violation, Workspace};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmCommand, ArmState, CommandInterface};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::time::TICK_NS;
use std::path::Path;
use std::sync::{Arc, Mutex};
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::sim::SimCell;

const T: f64 = 1e-3;

/// What was seen of the arm.
struct Seen {
    q_d: Joints,
    /// Least height of any part of the arm above the table [m], and of what it was told.
    lowest: f64,
    lowest_told: f64,
}

/// The simulated arm, a period for each command.
struct SteppedArm {
    cell: SimCell,
    workspace: Workspace,
    seen: Arc<Mutex<Seen>>,
}

impl Arm for SteppedArm {
    fn dof(&self) -> usize {
        7
    }

    fn clock(&self) -> Clock {
        Clock::Timer { period_ns: TICK_NS }
    }

    fn start(&mut self, _: CommandInterface) -> Result<Desired, ArmFault> {
        Ok(Desired::Commanded)
    }

    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault> {
        self.cell.read(state);
        let mut seen = self.seen.lock().expect("one thread");
        seen.lowest = seen.lowest.min(self.workspace.room(&state.q) + TABLE_GAP);
        Ok(Read::Fresh)
    }

    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault> {
        self.cell.step(&match command.interface {
            CommandInterface::Torque => Drive::Torque { tau_J_d: command.tau_J_d },
            CommandInterface::JointPosition => Drive::JointImpedance { q_d: command.q_d, dq_d: command.dq_d },
        });
        let mut seen = self.seen.lock().expect("one thread");
        seen.q_d = command.q_d;
        seen.lowest_told = seen.lowest_told.min(self.workspace.room(&command.q_d) + TABLE_GAP);
        Ok(())
    }

    fn stop(&mut self) {}

    fn recover(&mut self) -> Result<(), ArmFault> {
        Ok(())
    }
}

/// A bridge around the simulated arm.
struct Bridge {
    bench: Bench,
    seen: Arc<Mutex<Seen>>,
    motions: u64,
    said: Vec<Remark>,
}

impl Bridge {
    fn new(cell: &Cell, interface: CommandInterface) -> Self {
        let model = ArmModel::from_cell(cell).expect("a model");
        let seen = Seen { q_d: [0.0; MAX_JOINTS], lowest: f64::INFINITY, lowest_told: f64::INFINITY };
        let seen = Arc::new(Mutex::new(seen));
        let sim = SimCell::new(cell, None).expect("a simulated cell");
        let arm = SteppedArm { cell: sim, workspace: Workspace::of(cell, &model), seen: seen.clone() };
        Self { bench: Bench::around(arm, cell, interface), seen, motions: 0, said: Vec::new() }
    }

    fn turn(&mut self, cycles: usize) {
        for _ in 0..cycles {
            assert_eq!(self.bench.cycle.turn(Some(Wake { late_ns: 0, missed: 0 })), Turn::Continue);
            while self.bench.beats.pop().is_ok() {}
            while let Ok(remark) = self.bench.remarks.pop() {
                self.said.push(remark);
            }
        }
    }

    /// Plays a motion and waits until the arm is told to rest, and for `settling` cycles more.
    fn play(&mut self, points: &[SetPoint], settling: usize) {
        self.motions += 1;
        let count = points.len().div_ceil(CHUNK_LENGTH);
        for (index, part) in points.chunks(CHUNK_LENGTH).enumerate() {
            let kind = if index + 1 == count { MotionKind::Last } else { MotionKind::Play };
            let (index, length) = (index as u32, part.len() as u32);
            let mut chunk =
                MotionChunk { motion_id: self.motions, kind, index, length, dof: 7, ..MotionChunk::default() };
            chunk.set_points[..part.len()].copy_from_slice(part);
            while !self.bench.orders.send(&chunk) {
                self.turn(1);
            }
        }
        let mut patience = points.len() + 3000;
        while !(self.bench.orders.is_empty() && self.bench.cycle.is_at_rest()) {
            self.turn(1);
            patience -= 1;
            assert!(patience > 0, "the arm does not come to rest");
        }
        self.turn(settling);
    }

    fn told(&self) -> Joints {
        self.seen.lock().expect("one thread").q_d
    }

    fn braked(&self) -> usize {
        let why = BrakeReason::Limit(Violation::Workspace);
        self.said.iter().filter(|remark| matches!(remark, Remark::Braked { why: told, .. } if *told == why)).count()
    }
}

/// From rest to rest in `seconds`, smoothly up to the jerk.
fn smooth(from: &Joints, to: &Joints, seconds: f64) -> Vec<SetPoint> {
    let n = (seconds / T) as u32;
    let point = |k| {
        let x = f64::from(k) / f64::from(n);
        let part = x.powi(4) * (35.0 - x * (84.0 - x * (70.0 - 20.0 * x)));
        let slope = 140.0 * (x * (1.0 - x)).powi(3) / seconds;
        SetPoint {
            q_d: std::array::from_fn(|i| from[i] + part * (to[i] - from[i])),
            dq_d: std::array::from_fn(|i| slope * (to[i] - from[i])),
        }
    };
    (1..=n).map(point).collect()
}

/// The shortest time in which speed and acceleration of such a motion stay inside the limits [s].
fn shortest(from: &Joints, to: &Joints) -> f64 {
    let limits = Limits::fr3();
    let seconds = limits.counted().zip(from.iter().zip(to)).map(|(joint, (from, to))| {
        let way = (to - from).abs();
        (2.19 * way / joint.velocity).max((7.52 * way / joint.acceleration).sqrt())
    });
    seconds.fold(0.1, f64::max)
}

/// Somewhere in front of the base or beside it, from high above the table to far below it.
fn anywhere_low(from: &Joints, rng: &mut Pcg64) -> Joints {
    let mut to = *from;
    to[0] = rng.random_range(-1.5..1.5);
    to[1] = rng.random_range(-0.2..1.4);
    to[3] = rng.random_range(-2.8..-1.2);
    to[5] = rng.random_range(1.0..3.2);
    to
}

/// Plays `count` motions under each of the controllers, and says how low the arm came.
fn motions(count: u64) {
    let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let mut cell = Cell::read(&lab).expect("the cell that ships");
    // Nothing but the table is in the way.
    cell.objects.clear();
    for interface in [CommandInterface::Torque, CommandInterface::JointPosition] {
        let mut bridge = Bridge::new(&cell, interface);
        let mut rng = Pcg64::seed_from_u64(6);
        for _ in 0..count {
            let from = bridge.told();
            let to = anywhere_low(&from, &mut rng);
            let pace: f64 = rng.random_range(0.4..0.95);
            // Now and then the next one begins while the arm still swings.
            let settling = if rng.random_range(0..2) == 0 { 0 } else { 600 };
            bridge.play(&smooth(&from, &to, shortest(&from, &to) / pace), settling);
        }
        let (braked, seen) = (bridge.braked(), bridge.seen.lock().expect("one thread"));
        let millimetres = |metres: f64| 1e3 * metres;
        eprintln!(
            "{interface:?}: {count} motions, {braked} of them braked: the arm came down to {:.2} mm above the table, its commands to \
             {:.2} mm",
            millimetres(seen.lowest),
            millimetres(seen.lowest_told),
        );
        assert!(seen.lowest > 0.0, "the arm came {:.2} mm below the table", -millimetres(seen.lowest));
        assert!(seen.lowest_told >= TABLE_GAP - 1e-6);
        assert!(braked as u64 > count / 4, "few motions go to the table: {braked} of {count}");
    }
}

#[test]
fn the_arm_itself_stays_above_the_table() {
    motions(60);
}

#[test]
#[ignore = "takes a minute: cargo test --release -p rt_bridge --test motion arm_above_table -- --ignored --nocapture"]
fn the_arm_itself_stays_above_the_table_in_a_thousand_motions() {
    motions(1000);
}
