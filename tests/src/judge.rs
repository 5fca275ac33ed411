//! Reads what the bridge commands and what the arm does, and keeps the worst ratio to each limit: 1 is the limit.

use rt_bridge::safety::workspace::TABLE_GAP;
use rt_bridge::safety::{Limits, Trace, Workspace};
use shared_mem::cell::Cell;
use shared_mem::msg::Joints;
use shared_mem::msg::arm::{ArmCommand, ArmState};
use std::collections::{BTreeMap, VecDeque};
use twin::arm::ArmModel;

/// What rounding may add to the ratio of a command.
const ROUNDING: f64 = 1e-6;
/// How far the arm may be beyond a command that is at a limit, as a share of the limit: it follows within its gains.
const FOLLOWING: f64 = 1e-3;
/// Control period [s].
const T: f64 = 1e-3;
/// Below this a joint stands [rad/s]: the rounding of differences of positions.
const STANDING: f64 = 1e-9;

/// States whose torque is remembered until their command comes: those of a look at both topics, and some more.
const REMEMBERED: usize = 256;

/// The torque that a robot has in force in a cycle.
#[derive(Debug)]
struct InForce {
    cycle: u64,
    tau: Joints,
}

/// What was commanded last.
#[derive(Debug)]
struct Last {
    cycle: u64,
    trace: Trace,
    tau: Joints,
    /// Commands without a gap before this one: a difference needs one, a second difference two.
    row: u32,
}

/// The judge of one arm.
#[derive(Debug)]
pub struct Judge {
    limits: Limits,
    workspace: Workspace,
    last: Option<Last>,
    in_force: VecDeque<InForce>,
    worst: BTreeMap<&'static str, f64>,
    /// Commands and states that were judged.
    pub judged: [u64; 2],
    /// Commands and states that failed their check, and so could not be judged.
    pub overlooked: u64,
    /// Commands that differ from the one before.
    pub moved: u64,
}

impl Judge {
    /// For the arm of a cell.
    ///
    /// # Panics
    /// When the cell has no arm.
    pub fn new(cell: &Cell) -> Self {
        let model = ArmModel::from_cell(cell).expect("a cell with an arm");
        Self {
            limits: Limits::of(cell, &model),
            workspace: Workspace::of(cell, &model),
            last: None,
            in_force: VecDeque::new(),
            worst: BTreeMap::new(),
            judged: [0; 2],
            overlooked: 0,
            moved: 0,
        }
    }

    /// The worst ratio to each limit.
    pub fn worst(&self) -> &BTreeMap<&'static str, f64> {
        &self.worst
    }

    /// The limits that were exceeded.
    pub fn exceeded(&self) -> Vec<&'static str> {
        let allowed = |what: &str| 1.0 + if what.starts_with("state") { FOLLOWING } else { ROUNDING };
        self.worst.iter().filter(|(what, ratio)| **ratio > allowed(what)).map(|(what, _)| *what).collect()
    }

    /// Judges a command against the one before it.
    pub fn command(&mut self, command: &ArmCommand) {
        self.judged[0] += 1;
        let follows = self.last.take().filter(|last| last.cycle + 1 == command.cycle);
        let row = follows.as_ref().map_or(0, |last| last.row.saturating_add(1));
        let (before, tau) = match &follows {
            Some(last) => (last.trace, last.tau),
            None => (Trace::at_rest(command.q_d), command.tau_J_d),
        };
        let in_force = self.in_force.iter().find(|state| state.cycle == command.cycle).map(|state| state.tau);
        let mut trace = before.after(&command.q_d, T);
        if row < 2 {
            trace.a = [0.0; 8];
        }
        self.moved += u64::from(row > 0 && trace.q != before.q);
        let limits = self.limits;
        for (i, joint) in limits.counted().enumerate() {
            let (q, v) = (trace.q[i], trace.v[i]);
            let fastest = joint.speed_towards(v.signum(), q, joint.deceleration);
            self.note("command: position", share_of_range(q, joint.q_min, joint.q_max));
            self.note("command: speed", if v.abs() < STANDING { 0.0 } else { v.abs() / fastest });
            self.note("command: desired speed", command.dq_d[i].abs() / joint.velocity);
            self.note("command: acceleration", trace.a[i].abs() / joint.acceleration);
            if row >= 3 {
                self.note("command: jerk", ((trace.a[i] - before.a[i]) / T).abs() / joint.jerk);
            }
            self.note("command: torque", command.tau_J_d[i].abs() / joint.torque);
            // A command that came too late never was in force: the robot steps from the one that is.
            let step = (command.tau_J_d[i] - tau[i]).abs();
            let step = in_force.map_or(step, |in_force| step.min((command.tau_J_d[i] - in_force[i]).abs()));
            self.note("command: torque rate", step / (joint.torque_rate * T));
        }
        self.place("command: workspace", &command.q_d, 0.0);
        self.last = Some(Last { cycle: command.cycle, trace, tau: command.tau_J_d, row });
    }

    /// Judges what the arm does. Read before the commands that answer it, so that their steps count from the torque in force.
    pub fn state(&mut self, state: &ArmState) {
        self.judged[1] += 1;
        if self.in_force.len() == REMEMBERED {
            self.in_force.pop_front();
        }
        self.in_force.push_back(InForce { cycle: state.cycle, tau: state.tau_J_d });
        let limits = self.limits;
        for (i, joint) in limits.counted().enumerate() {
            self.note("state: position", share_of_range(state.q[i], joint.q_min, joint.q_max));
            self.note("state: speed", state.dq[i].abs() / joint.velocity);
            self.note("state: desired torque", state.tau_J_d[i].abs() / joint.torque);
        }
        // The arm does not follow exactly; the gap above the table is there for that.
        self.place("state: workspace", &state.q, TABLE_GAP);
    }

    /// How near arm and tool come to the nearest bound of their workspace: 1 less the distance to it [m], of which `spare` is
    /// not counted.
    fn place(&mut self, what: &'static str, q: &Joints, spare: f64) {
        self.note(what, 1.0 - (self.workspace.room(q) + spare));
    }

    /// A ratio that is no number counts as infinite.
    fn note(&mut self, what: &'static str, ratio: f64) {
        let ratio = if ratio.is_nan() { f64::INFINITY } else { ratio };
        let worst = self.worst.entry(what).or_insert(0.0);
        *worst = worst.max(ratio);
    }
}

/// 0 in the middle of the range, 1 at its ends.
fn share_of_range(value: f64, low: f64, high: f64) -> f64 {
    (value - 0.5 * (low + high)).abs() / (0.5 * (high - low))
}
