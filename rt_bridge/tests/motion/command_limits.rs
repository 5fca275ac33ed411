//! Whatever is sent to the bridge, no command outside any limit leaves it. A hundred thousand strokes and targets, good and
//! bad, go through whole control cycles to an arm that checks what it is told: position, speed, acceleration, jerk, torque
//! and torque rate, in either interface, and where arm and tool are. The cycle knows its arm by one trait alone, so this holds for every backend.

use crate::bench::Bench;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rt_bridge::arm::{Arm, ArmFault, Clock, Desired, Read};
use rt_bridge::rt::cycle::Turn;
use rt_bridge::safety::{Limits, Trace, Workspace};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use shared_mem::msg::{Joints, MAX_JOINTS};
use std::path::Path;
use std::sync::{Arc, Mutex};
use twin::arm::ArmModel;

const T: f64 = 1e-3;
/// Rounding that the arm forgives, as a share of a limit.
const ROUNDING: f64 = 1e-3;

/// What the arm was told last, and what it makes of it.
struct Judged {
    trace: Trace,
    tau: Joints,
    moved: u64,
    /// Commands within 5 mm of the table's or the box's bounds, while moving.
    near: u64,
    told: u64,
    broken: Option<String>,
}

/// Follows its commands with a little noise, loses a state now and then, and judges every command.
struct StrictArm {
    limits: Limits,
    workspace: Workspace,
    /// Least distance to the workspace's bounds that it may come to [m].
    least_room: f64,
    judged: Arc<Mutex<Judged>>,
    rng: Pcg64,
    device_ns: u64,
}

impl Arm for StrictArm {
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
        self.device_ns += 1_000_000;
        if self.rng.random_range(0..500) == 0 {
            return Ok(Read::Missing);
        }
        let judged = self.judged.lock().expect("one thread");
        state.device_ns = self.device_ns;
        state.mode = ArmMode::Move;
        (state.q_d, state.tau_J_d) = (judged.trace.q, judged.tau);
        let follows = judged.told > 0;
        for i in 0..7 {
            let noise = if follows { self.rng.random_range(-1e-3..1e-3) } else { 0.0 };
            state.q[i] = judged.trace.q[i] + noise;
            state.dq[i] = judged.trace.v[i] + 10.0 * noise;
        }
        Ok(Read::Fresh)
    }

    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault> {
        let mut judged = self.judged.lock().expect("one thread");
        let next = judged.trace.after(&command.q_d, T);
        for (i, joint) in self.limits.counted().enumerate() {
            let (q, v, a) = (next.q[i], next.v[i], next.a[i]);
            let jerk = (a - judged.trace.a[i]) / T;
            let step = command.tau_J_d[i] - judged.tau[i];
            let towards_its_end = joint.speed_towards(v.signum(), q, joint.deceleration);
            let checks = [
                ("position", q, joint.q_max),
                ("position", -q, -joint.q_min),
                ("speed", v.abs(), if v == 0.0 { 0.0 } else { towards_its_end }),
                ("desired speed", command.dq_d[i].abs(), joint.velocity),
                ("acceleration", a.abs(), joint.acceleration),
                ("jerk", jerk.abs(), joint.jerk),
                ("torque", command.tau_J_d[i].abs(), joint.torque),
                ("torque step", step.abs(), joint.torque_rate * T),
            ];
            for (what, value, limit) in checks {
                let beyond = value.is_nan() || value > limit + ROUNDING * limit.abs() + 1e-9;
                if beyond && judged.broken.is_none() {
                    judged.broken = Some(format!("joint {}: {what} {value} beyond {limit}", i + 1));
                }
            }
        }
        let room = self.workspace.room(&next.q);
        if (room.is_nan() || room < self.least_room) && judged.broken.is_none() {
            judged.broken = Some(format!("{} mm inside the workspace, {} at least", 1e3 * room, 1e3 * self.least_room));
        }
        judged.near += u64::from(room < 5e-3 && next.q != judged.trace.q);
        judged.moved += u64::from(next.q != judged.trace.q);
        judged.told += 1;
        (judged.trace, judged.tau) = (next, command.tau_J_d);
        Ok(())
    }

    fn stop(&mut self) {}

    fn recover(&mut self) -> Result<(), ArmFault> {
        Ok(())
    }
}

/// A bridge that holds somewhere.
struct Bridge {
    bench: Bench,
    judged: Arc<Mutex<Judged>>,
    model: ArmModel,
}

impl Bridge {
    fn new(cell: &Cell, interface: CommandInterface, start: Joints, seed: u64) -> Self {
        let judged =
            Judged { trace: Trace::at_rest(start), tau: [0.0; MAX_JOINTS], moved: 0, near: 0, told: 0, broken: None };
        let judged = Arc::new(Mutex::new(judged));
        let rng = Pcg64::seed_from_u64(seed);
        let model = ArmModel::from_cell(cell).expect("a model");
        let workspace = Workspace::of(cell, &model);
        // An arm that begins outside may get a millimetre deeper.
        let at_start = workspace.room(&start);
        let least_room = if at_start < 0.0 { at_start - 1.001e-3 } else { -1e-6 };
        let (limits, judged_too) = (Limits::fr3(), judged.clone());
        let arm = StrictArm { limits, workspace, least_room, judged: judged_too, rng, device_ns: 0 };
        Self { bench: Bench::around(arm, cell, interface), judged, model }
    }

    fn turn(&mut self, cycles: usize) {
        for _ in 0..cycles {
            assert_eq!(self.bench.cycle.turn(None), Turn::Continue);
        }
    }

    /// Where the arm is told to be.
    fn commanded(&self) -> Joints {
        self.judged.lock().expect("one thread").trace.q
    }

    /// Sends a motion, spoilt or not, stops it at some moment or not, and waits for rest. What was broken, if anything.
    fn attempt(&mut self, motion_id: u64, rng: &mut Pcg64) -> Option<String> {
        let mut points = motion(&self.commanded(), &self.model, rng);
        if rng.random_range(0..4) == 0 {
            spoil(&mut points, rng);
        }
        let count = points.len().div_ceil(CHUNK_LENGTH);
        let sent = if rng.random_range(0..8) == 0 { rng.random_range(0..=count) } else { count };
        for (index, part) in points.chunks(CHUNK_LENGTH).take(sent).enumerate() {
            let kind = if index + 1 == count { MotionKind::Last } else { MotionKind::Play };
            let (index, length) = (index as u32, part.len() as u32);
            let mut chunk = MotionChunk { motion_id, kind, index, length, dof: 7, ..MotionChunk::default() };
            chunk.set_points[..part.len()].copy_from_slice(part);
            while !self.bench.orders.send(&chunk) {
                self.turn(1);
            }
        }
        if rng.random_range(0..4) == 0 {
            self.turn(rng.random_range(0..=points.len()));
            let stop = MotionChunk { motion_id, kind: MotionKind::Stop, ..MotionChunk::default() };
            assert!(self.bench.orders.send(&stop), "a stop needs no room");
            // After it nothing begins before half a second of silence.
            self.turn(600);
        }
        let mut patience = points.len() + 3000;
        while !(self.bench.orders.is_empty() && self.bench.cycle.is_at_rest()) && patience > 0 {
            self.turn(1);
            patience -= 1;
        }
        self.turn(3);
        let broken = self.judged.lock().expect("one thread").broken.take();
        broken.or_else(|| (patience == 0).then(|| "the arm does not come to rest".to_owned()))
    }
}

/// A target to go to, or a stroke along a line of the tool, of any size and at any pace.
fn motion(from: &Joints, model: &ArmModel, rng: &mut Pcg64) -> Vec<SetPoint> {
    let mut way = [0.0; MAX_JOINTS];
    if rng.random_range(0..2) == 0 {
        for (way, joint) in way.iter_mut().zip(Limits::fr3().counted()) {
            *way = rng.random_range(-0.5..0.5) * (joint.q_max - joint.q_min);
        }
        let size: f64 = rng.random_range(0.0..1.0);
        way = way.map(|way| way * size * size);
    } else {
        // The joints that move the tip most along a line, as far as the line is long.
        let line: [f64; 3] = [(); 3].map(|()| rng.random_range(-0.4..0.4));
        let tip = model.tip(from).position();
        for (way, column) in way.iter_mut().zip(model.jacobian(from, tip)).take(7) {
            *way = column.iter().zip(line).map(|(c, l)| c * l).sum::<f64>();
        }
    }
    let seconds: f64 = 0.05 + 1.5 * rng.random_range(0.0_f64..1.0).powi(2);
    let samples = (seconds / T) as usize + 1;
    let span = (samples as f64) * T;
    let point = |k: usize| {
        let x = k as f64 / samples as f64;
        let (part, slope) = (x * x * x * (10.0 - x * (15.0 - 6.0 * x)), 30.0 * x * x * (1.0 - x) * (1.0 - x) / span);
        let mut point = SetPoint { q_d: *from, dq_d: [0.0; MAX_JOINTS] };
        for ((q_d, dq_d), way) in point.q_d.iter_mut().zip(&mut point.dq_d).zip(way) {
            *q_d += way * part;
            *dq_d = way * slope;
        }
        point
    };
    (0..=samples).map(point).collect()
}

/// Damages set points as a sender with a fault would.
fn spoil(points: &mut [SetPoint], rng: &mut Pcg64) {
    let values = [f64::NAN, f64::INFINITY, 1e300, -1e9, 10.0, 0.1, 1e-2, 1e-4, -1e-5, 1e-6];
    for _ in 0..rng.random_range(1..4) {
        let (k, joint) = (rng.random_range(0..points.len()), rng.random_range(0..8));
        let value = values[rng.random_range(0..values.len())];
        let point = &mut points[k];
        match rng.random_range(0..3) {
            0 => point.q_d[joint] += value,
            1 => point.dq_d[joint] += value,
            // From here on everything is elsewhere.
            _ => points[k..].iter_mut().for_each(|point| point.q_d[joint] += value),
        }
    }
}

/// Somewhere inside the joints' ranges, the whole arm above the table; or a little below it, one time out of sixteen.
fn somewhere(cell: &Cell, model: &ArmModel, rng: &mut Pcg64) -> Joints {
    let space = Workspace::of(cell, model);
    let lowest = if rng.random_range(0..16) == 0 { -0.05 } else { 0.0 };
    loop {
        let mut q = [0.0; MAX_JOINTS];
        for (q, joint) in q.iter_mut().zip(Limits::fr3().counted()) {
            *q = joint.q_min + rng.random_range(0.0..1.0) * (joint.q_max - joint.q_min);
        }
        if space.room(&q) > lowest {
            return q;
        }
    }
}

/// Attempts `count` motions; how many cycles moved the arm, and how many did so near the workspace's bounds.
fn attempts(count: u64) -> [u64; 2] {
    let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let cell = Cell::read(&lab).expect("the cell that ships");
    let model = ArmModel::from_cell(&cell).expect("a model");
    let (mut rng, mut moved, mut near, mut done) = (Pcg64::seed_from_u64(20), 0, 0, 0);
    while done < count {
        let interface =
            if rng.random_range(0..2) == 0 { CommandInterface::Torque } else { CommandInterface::JointPosition };
        let start = somewhere(&cell, &model, &mut rng);
        let mut bridge = Bridge::new(&cell, interface, start, rng.random_range(0..u64::MAX));
        for motion_id in 1..=20 {
            let before = bridge.commanded();
            if let Some(what) = bridge.attempt(motion_id, &mut rng) {
                panic!("attempt {done} ({interface:?}, from {before:?}): {what}");
            }
            done += 1;
        }
        let judged = bridge.judged.lock().expect("one thread");
        (moved, near) = (moved + judged.moved, near + judged.near);
    }
    [moved, near]
}

#[test]
fn no_command_outside_any_limit_leaves_the_bridge() {
    let [moved, near] = attempts(10_000);
    assert!(
        moved > 1_000_000 && near > 10_000,
        "the arm was moved in {moved} cycles only, {near} of them near the table"
    );
}

#[test]
#[ignore = "takes half a minute: cargo test --release -p rt_bridge --test motion command_limits -- --ignored"]
fn no_command_outside_any_limit_leaves_the_bridge_in_a_hundred_thousand_attempts() {
    let [moved, near] = attempts(100_000);
    assert!(
        moved > 10_000_000 && near > 100_000,
        "the arm was moved in {moved} cycles only, {near} of them near the table"
    );
}
