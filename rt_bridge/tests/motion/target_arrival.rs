//! Streams of targets within reach arrive, at full speed and without a brake: whatever their planner plans, the guard admits.
//!
//! ```sh
//! cargo test --release -p rt_bridge --test motion target_arrival -- --nocapture
//! ```

use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_pcg::Pcg64;
use rt_bridge::motion::{Player, Target};
use rt_bridge::remark::Remark;
use rt_bridge::safety::{Guard, Limits, Trace, Workspace};
use shared_mem::cell::{Cell, Robot};
use shared_mem::msg::{Joints, MAX_JOINTS};
use std::path::Path;
use twin::arm::{ArmModel, Follower};

const T: f64 = 1e-3;
/// Periods between two targets of a stream that is kept alive.
const REPEAT: usize = 20;
/// Slow joints take long where they end near a stop [s].
const PATIENCE: f64 = 60.0;

/// The guard of an FR3 that is named by its joints only: positions in space mean nothing.
fn anywhere() -> Guard {
    let joints = (1..=7).map(|i| format!("j{i}")).collect();
    let cell = Cell { robot: Some(Robot { joints, ..Robot::default() }), ..Cell::default() };
    let workspace = Workspace::of(&cell, &ArmModel::from_cell(&cell).expect("seven joints"));
    Guard { limits: Limits::fr3(), workspace, trailing: None, period_s: T }
}

/// Where each joint is at a share of the range that targets may lie in.
fn at(limits: &Limits, shares: [f64; 7]) -> Joints {
    let place = |i: usize, share: f64| {
        let [low, high] = limits.joints[i].targets();
        (1.0 - share) * low + share * high
    };
    std::array::from_fn(|i| shares.get(i).map_or(0.0, |share| place(i, *share)))
}

/// Anywhere in the range, or at the very end of it one time out of sixteen.
fn shares(rng: &mut Pcg64) -> [f64; 7] {
    [(); 7].map(|()| match rng.random_range(0..32) {
        0 => 0.0,
        1 => 1.0,
        _ => rng.random_range(0.0..1.0),
    })
}

/// A player under way to targets, and what it commanded last.
struct Way {
    player: Player,
    trace: Trace,
    said: Vec<Remark>,
}

impl Way {
    fn from(guard: Guard, q: Joints) -> Self {
        Self { player: Player::new(guard, q), trace: Trace::at_rest(q), said: Vec::new() }
    }

    fn go_on(&mut self, target: &Target, periods: usize) {
        for period in 0..periods {
            if period % REPEAT == 0 {
                self.said.extend(self.player.aim(target));
            }
            let (point, remark) = self.player.advance();
            self.said.extend(remark);
            self.trace = self.trace.after(&point.q_d, T);
        }
    }

    /// Goes on at full speed until it rests at `q`; the time that took [s], or `None` where it does not come there.
    fn arrive(&mut self, q: Joints) -> Option<f64> {
        let target = towards(q, 1.0);
        let periods = (1..).step_by(REPEAT).take_while(|periods| *periods as f64 * T < PATIENCE);
        for gone in periods {
            self.go_on(&target, REPEAT);
            let there = (0..7).all(|i| (self.trace.q[i] - q[i]).abs() < 1e-6);
            if there && self.trace.is_at_rest(7, T) {
                return Some(gone as f64 * T);
            }
            if self.said.iter().any(|remark| !matches!(remark, Remark::Began { .. })) {
                return None;
            }
        }
        None
    }
}

fn towards(q: Joints, speed: f64) -> Target {
    Target { stream: 5, q: Some(q), speed }
}

#[test]
fn every_target_within_reach_is_arrived_at_at_full_speed() {
    let (guard, mut rng, mut seconds) = (anywhere(), Pcg64::seed_from_u64(4), 0.0);
    for number in 0..1000 {
        let [from, q] = [(); 2].map(|()| at(&guard.limits, shares(&mut rng)));
        let mut way = Way::from(guard.clone(), from);
        let took = way.arrive(q);
        seconds += took.unwrap_or_else(|| panic!("target {number}, from {from:?} to {q:?}: {:?}", way.said));
    }
    eprintln!("1000 targets, {:.4} s each", seconds / 1000.0);
}

#[test]
fn targets_that_jump_on_the_way_are_arrived_at_too() {
    let (guard, mut rng) = (anywhere(), Pcg64::seed_from_u64(5));
    for number in 0..1000 {
        let mut way = Way::from(guard.clone(), at(&guard.limits, shares(&mut rng)));
        let mut q = way.trace.q;
        for _ in 0..rng.random_range(1..5) {
            q = at(&guard.limits, shares(&mut rng));
            way.go_on(&towards(q, 1.0), rng.random_range(1..1200));
        }
        assert!(way.arrive(q).is_some(), "target {number}: {:?} at {:?}", way.said, way.trace);
    }
}

/// The way of the joints to a target, alone: whether the arm keeps a hand's breadth from table and box on it.
fn is_free(from: &Joints, to: &Joints, guard: &Guard) -> bool {
    let mut follower = Follower::calm(from, &guard.limits, T);
    follower.set_speed(1.0);
    if follower.aim(to).is_err() {
        return false;
    }
    let mut q = *from;
    for _ in 0..(PATIENCE / T) as usize {
        if guard.workspace.room(&q) < 0.1 {
            return false;
        }
        let Some(next) = follower.step() else { return false };
        if next == q && next == *to {
            break;
        }
        q = next;
    }
    true
}

#[test]
fn targets_above_the_table_of_the_cell_that_ships_are_arrived_at() {
    let lab = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let cell = Cell::read(&lab).expect("the cell that ships");
    let model = ArmModel::from_cell(&cell).expect("an FR3");
    let guard = Guard { workspace: Workspace::of(&cell, &model), ..anywhere() };
    let mut ready = *model.ready();
    let mut to = ready;
    to[0] = 1.5;
    let mut rng = Pcg64::seed_from_u64(6);
    for number in 0..60 {
        let mut way = Way::from(guard.clone(), ready);
        assert!(way.arrive(to).is_some(), "target {number}: {:?}", way.said);
        ready = to;
        while ready == to || !is_free(&ready, &to, &guard) {
            to = at(&guard.limits, shares(&mut rng));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_is_planned_is_admitted(
        targets in prop::collection::vec(
                (prop::array::uniform7(0.0..=1.0_f64), prop_oneof![Just(1.0), 0.02..1.0_f64], 1_usize..1000), 1..12,
            ),
        from in prop::array::uniform7(0.0..=1.0_f64),
    ) {
        let guard = anywhere();
        let limits = guard.limits;
        let mut way = Way::from(guard, at(&limits, from));
        for (shares, speed, periods) in targets {
            way.go_on(&towards(at(&limits, shares), speed), periods);
        }
        prop_assert_eq!(&way.said[..], &[Remark::Began { motion: 5 }]);
        prop_assert_eq!(way.trace.q[MAX_JOINTS - 1], 0.0);
    }
}
