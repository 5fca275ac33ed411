//! Streams of targets: whatever is sent, what comes out stays inside every limit, ends at rest, and no motion is lost sight of.

use proptest::prelude::*;
use rt_bridge::motion::{Player, Target};
use rt_bridge::remark::{BrakeReason, Refusal, Remark};
use rt_bridge::safety::{Guard, Limits, Trace, Violation, Workspace};
use shared_mem::cell::{Cell, Robot, Table, Tool};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::motion::{MotionChunk, MotionKind};
use twin::arm::ArmModel;

const T: f64 = 1e-3;
const READY: [f64; MAX_JOINTS] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
/// Periods that a stream may be silent.
const SILENCE: usize = 200;

/// The guard of an FR3 with a tool over a table of this height, or none.
fn above(table: Option<f64>) -> Guard {
    let tool = Tool { mass: 0.25, length: 0.16, radius: 0.012 };
    let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
    let table = table.map(|height| Table { height });
    let cell = Cell { robot: Some(robot), tool: Some(tool), table, ..Cell::default() };
    let workspace = Workspace::of(&cell, &ArmModel::from_cell(&cell).expect("an FR3"));
    Guard { limits: Limits::fr3(), workspace, trailing: None, period_s: T }
}

/// A player, what it commanded last, and all that it said.
struct Bench {
    player: Player,
    trace: Trace,
    said: Vec<Remark>,
}

impl Bench {
    fn new(table: Option<f64>) -> Self {
        Self { player: Player::new(above(table), READY), trace: Trace::at_rest(READY), said: Vec::new() }
    }

    fn aim(&mut self, stream: u64, q: [f64; MAX_JOINTS], speed: f64) {
        self.said.extend(self.player.aim(&Target { stream, q: Some(q), speed }));
    }

    /// So many periods; position, speed, acceleration and jerk of all joints are inside their limits in each.
    fn go_on(&mut self, periods: usize) {
        for _ in 0..periods {
            let (point, remark) = self.player.advance();
            self.said.extend(remark);
            let next = self.trace.after(&point.q_d, T);
            for (i, joint) in Limits::fr3().counted().enumerate() {
                let (q, v) = (next.q[i], next.v[i]);
                let jerk = (next.a[i] - self.trace.a[i]) / T;
                assert!((joint.q_min..=joint.q_max).contains(&q), "joint {i} at {q}");
                assert!(next.a[i].abs() <= joint.acceleration * 1.0001, "joint {i}: acceleration {}", next.a[i]);
                assert!(jerk.abs() <= joint.jerk * 1.001, "joint {i}: jerk {jerk}");
                let bound = joint.speed_towards(v.signum(), q, joint.deceleration);
                assert!(v == 0.0 || v.abs() <= bound + 1e-9, "joint {i}: {v} rad/s at {q}, bound {bound}");
                assert!(point.dq_d[i].abs() <= joint.velocity * 1.0001);
            }
            self.trace = next;
        }
    }

    fn state(&self) -> ArmState {
        let mut state = ArmState::default();
        self.player.report(&mut state);
        state
    }

    fn brakes(&self) -> Vec<BrakeReason> {
        self.said
            .iter()
            .filter_map(|remark| if let Remark::Braked { why, .. } = remark { Some(*why) } else { None })
            .collect()
    }
}

fn moved(joint: usize, by: f64) -> [f64; MAX_JOINTS] {
    let mut q = READY;
    q[joint] += by;
    q
}

#[test]
fn a_target_that_is_repeated_is_reached_and_a_sender_that_ends_there_is_done() {
    let mut bench = Bench::new(None);
    for _ in 0..200 {
        bench.aim(5, moved(3, 0.3), 0.5);
        bench.go_on(20);
    }
    assert!((bench.trace.q[3] - READY[3] - 0.3).abs() < 1e-6);
    assert_eq!((bench.state().motion_id, bench.state().motion), (5, MotionStatus::Playing));
    bench.go_on(SILENCE + 1);
    assert_eq!(bench.state().motion, MotionStatus::Done);
    assert_eq!(bench.said, [Remark::Began { motion: 5 }, Remark::Done { motion: 5 }]);
}

#[test]
fn a_sender_that_falls_silent_on_the_way_has_the_arm_braked_and_needs_a_new_id() {
    let mut bench = Bench::new(None);
    bench.aim(5, moved(3, 1.5), 0.3);
    bench.go_on(SILENCE);
    assert!(bench.trace.v[3] > 0.3, "it is on its way");
    bench.go_on(600);
    assert!(bench.player.is_at_rest() && bench.trace.is_at_rest(7, T));
    assert_eq!(bench.brakes(), [BrakeReason::Silent]);
    let held = bench.trace.q;
    bench.aim(5, moved(3, 1.5), 0.3);
    bench.go_on(300);
    assert_eq!(bench.trace.q, held, "the stream is over");
    bench.aim(6, READY, 0.3);
    bench.go_on(100);
    assert!(bench.trace.v[3] < -0.1, "another goes on");
}

#[test]
fn a_second_sender_is_refused_in_one_remark_and_the_first_goes_on() {
    let mut bench = Bench::new(None);
    for _ in 0..50 {
        bench.aim(5, moved(3, 0.3), 0.5);
        bench.aim(6, moved(3, -0.3), 0.5);
        bench.go_on(20);
    }
    let refused = Remark::Refused { motion: 6, why: Refusal::Busy { playing: 5 } };
    assert_eq!(bench.said, [Remark::Began { motion: 5 }, refused]);
    assert!(bench.trace.q[3] > READY[3] + 0.2);
}

#[test]
fn a_stop_ends_a_stream_and_a_motion_is_refused_beside_one() {
    let mut bench = Bench::new(None);
    bench.aim(5, moved(3, 0.8), 0.5);
    bench.go_on(100);
    let chunk = |kind| MotionChunk { motion_id: 9, kind, length: 1, dof: 7, ..MotionChunk::default() };
    let refused = bench.player.take(&chunk(MotionKind::Last));
    assert_eq!(refused, Some(Remark::Refused { motion: 9, why: Refusal::Busy { playing: 5 } }));
    bench.player.take(&chunk(MotionKind::Stop));
    for _ in 0..40 {
        bench.aim(5, moved(3, 0.8), 0.5);
        bench.go_on(20);
    }
    assert_eq!(bench.state().motion, MotionStatus::Braked);
    assert!(bench.player.is_at_rest());
}

#[test]
fn targets_out_of_range_or_below_the_table_are_passed_over_and_said_once() {
    let mut bench = Bench::new(Some(0.0));
    for _ in 0..30 {
        bench.aim(5, moved(3, 0.1), 0.5);
        bench.go_on(20);
    }
    // Joint 4 beyond its range; then stretched forward and down, into the table.
    let below = [0.0, 1.6, 0.0, -0.6, 0.0, 1.5, 0.785, 0.0];
    for wrong in [moved(3, 9.0), moved(3, f64::NAN), below] {
        bench.said.clear();
        for _ in 0..30 {
            bench.aim(5, wrong, 0.5);
            bench.go_on(20);
        }
        assert!(matches!(bench.said[..], [Remark::PassedOver { motion: 5, .. }]), "{:?}", bench.said);
        assert!((bench.trace.q[3] - READY[3] - 0.1).abs() < 1e-6, "it stays where it was");
        bench.aim(5, moved(3, 0.1), 0.5);
    }
    assert!(matches!(bench.said[..], [Remark::PassedOver { why: Violation::Workspace, .. }]));
}

#[test]
fn each_stream_whose_target_is_passed_over_hears_of_it() {
    let mut bench = Bench::new(None);
    for stream in [5, 6, 5, 6] {
        bench.aim(stream, moved(3, 9.0), 0.5);
        bench.go_on(20);
    }
    assert!(
        matches!(bench.said[..], [Remark::PassedOver { motion: 5, .. }, Remark::PassedOver { motion: 6, .. }]),
        "{:?}",
        bench.said
    );
}

/// A number for a joint: mostly near its range, now and then one of the kinds that no arm has.
fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -4.0..4.0_f64,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e300), Just(-0.0)],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_stream_of_targets_takes_any_joint_beyond_a_limit(
        targets in prop::collection::vec((prop::array::uniform8(wild()), wild(), 1_u64..4, 0_usize..300), 1..25),
        table in prop::option::of(-0.2..0.1_f64),
    ) {
        let mut bench = Bench::new(table);
        for (q, speed, stream, periods) in targets {
            bench.aim(stream, q, speed);
            bench.go_on(periods);
        }
        bench.go_on(1500);
        prop_assert!(bench.player.is_at_rest() && bench.trace.is_at_rest(7, T));
    }

    #[test]
    fn targets_within_reach_never_end_a_stream(
        targets in prop::collection::vec((prop::array::uniform7(0.0..1.0_f64), 0.05..1.0_f64, 1_usize..150), 1..20),
    ) {
        let (mut bench, limits) = (Bench::new(None), Limits::fr3());
        bench.player = Player::new(Guard { workspace: anywhere(), ..above(None) }, READY);
        for (places, speed, periods) in targets {
            let q = std::array::from_fn(|i| places.get(i).map_or(0.0, |place| {
                let [low, high] = limits.joints[i].targets();
                low + place * (high - low)
            }));
            bench.aim(5, q, speed);
            bench.go_on(periods);
        }
        prop_assert_eq!(&bench.said[..], &[Remark::Began { motion: 5 }]);
    }
}

/// The space of an arm that is named by its joints only.
fn anywhere() -> Workspace {
    let joints = (1..=7).map(|i| format!("j{i}")).collect();
    let cell = Cell { robot: Some(Robot { joints, ..Robot::default() }), ..Cell::default() };
    Workspace::of(&cell, &ArmModel::from_cell(&cell).expect("seven joints"))
}
