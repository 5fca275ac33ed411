//! The player with its guard and brake: whatever is sent, what comes out stays inside the limits and ends at rest.

use proptest::prelude::*;
use rt_bridge::motion::Player;
use rt_bridge::remark::{BrakeReason, Refusal, Remark};
use rt_bridge::safety::{Guard, Limits, Trace, Violation, Workspace};
use shared_mem::cell::{Cell, Robot, Table, Tool};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use twin::arm::ArmModel;

const T: f64 = 1e-3;
const READY: [f64; MAX_JOINTS] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
/// The tool is the lowest part of the arm.
const LOW: [f64; MAX_JOINTS] = [0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.0];

fn guard() -> Guard {
    above(None)
}

/// The guard of an FR3 with a tool over a table of this height, or none.
fn above(table: Option<f64>) -> Guard {
    let tool = Tool { mass: 0.25, length: 0.16, radius: 0.012 };
    let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
    let table = table.map(|height| Table { height });
    let cell = Cell { robot: Some(robot), tool: Some(tool), table, ..Cell::default() };
    let workspace = Workspace::of(&cell, &ArmModel::from_cell(&cell).expect("an FR3"));
    Guard { limits: Limits::fr3(), workspace, trailing: None, period_s: T }
}

fn chunks(motion_id: u64, points: &[SetPoint]) -> Vec<MotionChunk> {
    let count = points.len().div_ceil(CHUNK_LENGTH);
    let mut out = Vec::new();
    for (index, part) in points.chunks(CHUNK_LENGTH).enumerate() {
        let mut chunk = MotionChunk {
            motion_id,
            kind: if index + 1 == count { MotionKind::Last } else { MotionKind::Play },
            index: u32::try_from(index).unwrap(),
            length: u32::try_from(part.len()).unwrap(),
            dof: 7,
            ..MotionChunk::default()
        };
        chunk.set_points[..part.len()].copy_from_slice(part);
        out.push(chunk);
    }
    out
}

/// `amplitude * (1 - cos)^2` windows: starts and ends at rest with no acceleration.
fn swing(start: &[f64; MAX_JOINTS], amplitude: f64, seconds: f64) -> Vec<SetPoint> {
    let n = (seconds / T) as usize;
    (0..=n)
        .map(|k| {
            let (w, t) = (std::f64::consts::TAU / seconds, k as f64 * T);
            let (s, ds) = ((1.0 - (w * t).cos()).powi(2), 2.0 * (1.0 - (w * t).cos()) * w * (w * t).sin());
            let mut point = SetPoint { q_d: *start, dq_d: [0.0; MAX_JOINTS] };
            for j in 0..7 {
                point.q_d[j] += amplitude / 4.0 * s;
                point.dq_d[j] = amplitude / 4.0 * ds;
            }
            point
        })
        .collect()
}

/// Runs the player until it rests (at most `cycles`), asserting every limit on what it commands.
fn run(player: &mut Player, trace: &mut Trace, cycles: usize) -> Vec<Remark> {
    let mut remarks = Vec::new();
    for _ in 0..cycles {
        let (point, remark) = player.advance();
        remarks.extend(remark);
        let next = trace.after(&point.q_d, T);
        for (i, joint) in Limits::fr3().counted().enumerate() {
            let (q, v) = (next.q[i], next.v[i]);
            let jerk = (next.a[i] - trace.a[i]) / T;
            assert!((joint.q_min..=joint.q_max).contains(&q), "joint {i} at {q}");
            assert!(next.a[i].abs() <= joint.acceleration * 1.0001, "joint {i}: acceleration {}", next.a[i]);
            assert!(jerk.abs() <= joint.jerk * 1.001, "joint {i}: jerk {jerk}");
            let bound = joint.speed_towards(v.signum(), q, joint.deceleration);
            assert!(v == 0.0 || v.abs() <= bound + 1e-9, "joint {i}: {v} rad/s at {q}, bound {bound}");
            assert!(point.dq_d[i].abs() <= joint.velocity * 1.0001);
        }
        *trace = next;
        if player.is_at_rest() {
            break;
        }
    }
    remarks
}

fn status(player: &Player) -> ArmState {
    let mut state = ArmState::default();
    player.report(&mut state);
    state
}

#[test]
fn a_smooth_motion_is_played_to_its_end_point_by_point() {
    let (mut player, mut trace) = (Player::new(guard(), READY), Trace::at_rest(READY));
    let points = swing(&READY, 0.3, 2.0);
    let mut remarks = Vec::new();
    for chunk in chunks(7, &points) {
        remarks.extend(player.take(&chunk));
    }
    assert_eq!(status(&player).motion_queued as usize, points.len());
    remarks.extend(run(&mut player, &mut trace, 3000));
    assert_eq!(remarks, [Remark::Began { motion: 7 }, Remark::Done { motion: 7 }]);
    let end = status(&player);
    assert_eq!((end.motion, end.motion_played as usize, end.motion_queued), (MotionStatus::Done, points.len(), 0));
}

#[test]
fn a_sender_that_dies_leaves_the_arm_braked_and_holding() {
    let (mut player, mut trace) = (Player::new(guard(), READY), Trace::at_rest(READY));
    for chunk in chunks(3, &swing(&READY, 0.4, 2.0)).iter().take(9) {
        player.take(chunk);
    }
    let remarks = run(&mut player, &mut trace, 3000);
    assert_eq!(remarks, [Remark::Braked { motion: 3, why: BrakeReason::Underrun }]);
    assert!(player.is_at_rest());
    assert_eq!(status(&player).motion, MotionStatus::Braked);
    assert_eq!(status(&player).motion_played, 450);
    let (held, _) = player.advance();
    assert_eq!(held.q_d, trace.q);
}

#[test]
fn a_motion_that_starts_elsewhere_is_refused_and_the_next_one_is_taken() {
    let mut player = Player::new(guard(), READY);
    let mut elsewhere = READY;
    elsewhere[2] += 2e-3;
    let refused = chunks(5, &swing(&elsewhere, 0.1, 1.0));
    assert_eq!(
        player.take(&refused[0]),
        Some(Remark::Refused { motion: 5, why: Refusal::StartsElsewhere { joint: 3 } })
    );
    assert_eq!(player.take(&refused[1]), None);
    assert_eq!(status(&player).motion, MotionStatus::Refused);
    assert_eq!(player.take(&chunks(6, &swing(&READY, 0.1, 1.0))[0]), Some(Remark::Began { motion: 6 }));
}

#[test]
fn gaps_other_arms_and_second_senders_are_refused() {
    let mut player = Player::new(guard(), READY);
    let motion = chunks(1, &swing(&READY, 0.1, 1.0));
    let why = |remark| match remark {
        Some(Remark::Refused { why, .. }) => why,
        other => panic!("{other:?}"),
    };
    assert_eq!(why(player.take(&motion[1])), Refusal::Gap { due: 0, came: 1 });
    assert_eq!(why(player.take(&MotionChunk { motion_id: 2, dof: 6, ..motion[0] })), Refusal::Dof { came: 6, has: 7 });
    assert_eq!(why(player.take(&MotionChunk { motion_id: 3, length: 51, ..motion[0] })), Refusal::Length);
    assert_eq!(why(player.take(&MotionChunk { motion_id: 0, ..motion[0] })), Refusal::NoId);
    assert_eq!(player.take(&MotionChunk { motion_id: 8, ..motion[0] }), Some(Remark::Began { motion: 8 }));
    assert_eq!(why(player.take(&MotionChunk { motion_id: 9, ..motion[0] })), Refusal::Busy { playing: 8 });
    assert_eq!(
        player.take(&MotionChunk { motion_id: 8, ..motion[2] }),
        Some(Remark::Braked { motion: 8, why: BrakeReason::Chunk(Refusal::Gap { due: 1, came: 2 }) })
    );
}

/// The law multiplies `dq_d` by the damping: a velocity that the positions do not have is a torque nobody planned.
#[test]
fn a_velocity_that_the_positions_do_not_have_is_refused_even_at_rest() {
    for dq_d in [1e30, -3.0, 0.011] {
        let mut points = swing(&READY, 0.1, 1.0);
        points[0].dq_d[1] = dq_d;
        let (mut player, mut trace) = (Player::new(guard(), READY), Trace::at_rest(READY));
        for chunk in chunks(1, &points) {
            player.take(&chunk);
        }
        let why = BrakeReason::Limit(Violation::Inconsistent { joint: 2 });
        assert_eq!(run(&mut player, &mut trace, 100), [Remark::Braked { motion: 1, why }]);
    }
}

#[test]
fn a_velocity_above_the_limit_is_refused_though_the_positions_keep_it() {
    let limits = Limits::fr3();
    let last = Trace { v: [2.615; MAX_JOINTS], ..Trace::at_rest(READY) };
    let mut point = SetPoint { q_d: READY, dq_d: last.v };
    for i in 0..7 {
        point.q_d[i] += last.v[i] * T;
    }
    assert!(guard().check(&last, &point, &guard().workspace.outside(&READY), None).is_ok());
    point.dq_d[0] = limits.joints[0].velocity + 1e-3;
    assert_eq!(
        guard().check(&last, &point, &guard().workspace.outside(&READY), None),
        Err(Violation::Velocity { joint: 1 })
    );
}

#[test]
fn a_motion_that_ends_at_speed_is_braked() {
    let (mut player, mut trace) = (Player::new(guard(), READY), Trace::at_rest(READY));
    for chunk in chunks(4, &swing(&READY, 0.4, 2.0)[..600]) {
        player.take(&chunk);
    }
    assert_eq!(run(&mut player, &mut trace, 3000), [Remark::Braked { motion: 4, why: BrakeReason::EndsMoving }]);
}

/// Joint 2 forward and joint 4 along, from rest to rest: the tool comes down, or rises where `way` is negative.
fn lowering(from: &[f64; MAX_JOINTS], way: f64, seconds: f64) -> Vec<SetPoint> {
    let n = (seconds / T) as u32;
    let point = |k| {
        let x = f64::from(k) / f64::from(n);
        let (part, slope) = (x * x * x * (10.0 - x * (15.0 - 6.0 * x)), 30.0 * (x * (1.0 - x)).powi(2) / seconds);
        let mut point = SetPoint { q_d: *from, dq_d: [0.0; MAX_JOINTS] };
        for (joint, share) in [(1, 1.0), (3, 0.3)] {
            point.q_d[joint] += way * share * part;
            point.dq_d[joint] = way * share * slope;
        }
        point
    };
    (0..=n).map(point).collect()
}

/// Height of the arm's lowest point [m].
fn height(q: &[f64; MAX_JOINTS]) -> f64 {
    above(Some(0.0)).workspace.room(q) + 2e-3
}

#[test]
fn an_arm_on_its_way_into_the_table_comes_to_rest_above_it_and_near_where_it_is_slow() {
    for (seconds, near) in [(8.0, 3e-4), (2.0, 4e-3), (0.6, 3e-2)] {
        let guard = above(Some(height(&LOW) - 0.1));
        let (mut player, mut trace) = (Player::new(guard.clone(), LOW), Trace::at_rest(LOW));
        for chunk in chunks(4, &lowering(&LOW, 0.5, seconds)).iter().take(80) {
            player.take(chunk);
        }
        let (mut remarks, mut least) = (Vec::new(), f64::INFINITY);
        for _ in 0..4000 {
            remarks.extend(run(&mut player, &mut trace, 1));
            least = least.min(guard.workspace.room(&trace.q));
        }
        let why = BrakeReason::Limit(Violation::Workspace);
        assert_eq!(remarks, [Remark::Began { motion: 4 }, Remark::Braked { motion: 4, why }][1..], "{seconds} s");
        assert!((0.0..near).contains(&least), "{seconds} s: {least} m");
        assert!(least >= -1e-7 && player.is_at_rest());
    }
}

#[test]
fn an_arm_that_is_below_the_table_may_rise_and_not_sink() {
    let guard = above(Some(height(&LOW) + 0.03));
    let (mut player, mut trace) = (Player::new(guard.clone(), LOW), Trace::at_rest(LOW));
    let at_first = guard.workspace.room(&LOW);
    assert!((at_first + 0.032).abs() < 1e-9);
    for (motion, way) in [(1, 0.2), (2, 0.2), (3, 0.2)] {
        for chunk in chunks(motion, &lowering(&trace.q, way, 1.0)) {
            player.take(&chunk);
        }
        let why = BrakeReason::Limit(Violation::Workspace);
        assert_eq!(run(&mut player, &mut trace, 2000), [Remark::Braked { motion, why }]);
        assert!(guard.workspace.room(&trace.q) > at_first - 1.001e-3, "{}", guard.workspace.room(&trace.q));
    }
    for chunk in chunks(4, &lowering(&trace.q, -0.3, 1.0)) {
        player.take(&chunk);
    }
    assert_eq!(run(&mut player, &mut trace, 2000), [Remark::Done { motion: 4 }]);
    assert!(guard.workspace.room(&trace.q) > 0.0, "and it is out");
}

/// The robot goes on by itself where it is sent nothing; nobody can keep it from that, but it must not be stuck afterwards.
#[test]
fn an_arm_that_lost_set_points_on_its_way_down_is_braked_and_may_rise() {
    let guard = above(Some(height(&LOW) - 0.1));
    let (mut player, mut robot) = (Player::new(guard.clone(), LOW), Trace::at_rest(LOW));
    for chunk in chunks(1, &lowering(&LOW, 0.5, 1.0)) {
        player.take(&chunk);
    }
    let (mut periods, mut remarks) = (1, Vec::new());
    while remarks.is_empty() {
        player.reconcile(&robot.q.map(|q| f64::from(q as f32)), periods);
        let (point, remark) = player.advance();
        remarks.extend(remark);
        robot = robot.after(&point.q_d, T);
        // Shortly before it would have to be braked.
        periods = if guard.workspace.room(&robot.q) < 0.032 { 20 } else { 1 };
        robot = (1..periods).fold(robot, |trace, _| trace.onward(T));
    }
    let why = BrakeReason::Limit(Violation::Workspace);
    assert_eq!(remarks, [Remark::Braked { motion: 1, why }]);
    player.reconcile(&robot.q.map(|q| f64::from(q as f32)), periods);
    run(&mut player, &mut robot, 1000);
    let deepest = guard.workspace.room(&robot.q);
    assert!(player.is_at_rest() && (-0.05..0.0).contains(&deepest), "{deepest}");
    for chunk in chunks(2, &lowering(&robot.q, -0.3, 1.0)) {
        player.take(&chunk);
    }
    assert_eq!(run(&mut player, &mut robot, 2000), [Remark::Done { motion: 2 }]);
}

#[test]
fn an_arm_that_stopped_itself_takes_no_motion() {
    let mut player = Player::new(guard(), READY);
    let motion = chunks(4, &swing(&READY, 0.4, 2.0));
    player.take(&motion[0]);
    assert_eq!(player.halt(), Some(Remark::Braked { motion: 4, why: BrakeReason::ArmStopped }));
    let again = MotionChunk { motion_id: 5, ..motion[0] };
    assert_eq!(player.take(&again), Some(Remark::Refused { motion: 5, why: Refusal::NotCommanded }));
}

/// A player whose motion has ended, and its robot, which got nothing of the last twelve periods; the planned end.
fn beyond_the_end() -> (Player, Trace, [f64; MAX_JOINTS]) {
    let (mut player, mut robot) = (Player::new(guard(), READY), Trace::at_rest(READY));
    // Quintic, 0.2 rad in 0.6 s: decelerates until its last period.
    let points: Vec<SetPoint> = (0..=600)
        .map(|k| {
            let x = f64::from(k) / 600.0;
            let (part, slope) = (x * x * x * (10.0 - x * (15.0 - 6.0 * x)), 30.0 * (x * (1.0 - x)).powi(2) / 0.6);
            let mut point = SetPoint { q_d: READY, dq_d: [0.0; MAX_JOINTS] };
            (0..7).for_each(|i| (point.q_d[i], point.dq_d[i]) = (READY[i] + 0.2 * part, 0.2 * slope));
            point
        })
        .collect();
    for chunk in chunks(1, &points) {
        player.take(&chunk);
    }
    // The one that says it is done does not come, nor do the eleven states after it reach the player.
    let said = |robot: &Trace| robot.q.map(|q| f64::from(q as f32));
    let (end, mut done) = (points[600].q_d, None);
    while done.is_none() {
        player.reconcile(&said(&robot), 1);
        let (point, remark) = player.advance();
        (robot, done) = (if remark.is_none() { robot.after(&point.q_d, T) } else { robot.onward(T) }, remark);
    }
    assert_eq!(done, Some(Remark::Done { motion: 1 }));
    robot = (0..11).fold(robot, |trace, _| trace.onward(T));
    player.reconcile(&said(&robot), 12);
    (player, robot, end)
}

/// What follows starts where a motion was planned to end, and the arm has gone on beyond.
#[test]
fn an_arm_that_loses_its_last_set_points_comes_back_to_the_end_and_takes_the_next_motion() {
    let (mut player, mut robot, end) = beyond_the_end();
    let away = |robot: &Trace| robot.q.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(away(&robot) > 2e-6, "{:?}", robot.q);
    assert_eq!(run(&mut player, &mut robot, 1000), []);
    assert!(player.is_at_rest() && away(&robot) < 1e-9, "{:?}", robot.q);
    assert_eq!(player.take(&chunks(2, &swing(&end, 0.1, 1.0))[0]), Some(Remark::Began { motion: 2 }));
}

#[test]
fn an_arm_on_its_way_back_to_the_end_stops_when_asked() {
    let (mut player, mut robot, _) = beyond_the_end();
    assert!(!player.is_at_rest());
    assert_eq!(player.take(&MotionChunk { kind: MotionKind::Stop, ..MotionChunk::default() }), None);
    assert_eq!(run(&mut player, &mut robot, 50), [], "sooner than the way back takes");
    assert!(player.is_at_rest() && status(&player).motion == MotionStatus::Done);
    let (held, _) = player.advance();
    assert_eq!(held.q_d, robot.q);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// A robot that does not get every set point goes on by itself and objects to whoever goes on as if it had got them.
    #[test]
    fn a_motion_survives_set_points_that_come_too_late(
        losses in prop::collection::vec((20_usize..300, 1_usize..12, any::<bool>()), 1..40),
    ) {
        let mut player = Player::new(guard(), READY);
        let points = swing(&READY, 0.5, 2.0);
        for chunk in chunks(4, &points) {
            player.take(&chunk);
        }
        let (mut robot, limits) = (Trace::at_rest(READY), Limits::fr3());
        let mut lost = losses.iter().cycle();
        let (mut until_loss, mut periods, mut done) = (0, 1, false);
        for _ in 0..4000 {
            let said = robot.q.map(|q| f64::from(q as f32));
            player.reconcile(&said, periods);
            let (point, remark) = player.advance();
            done |= remark.is_some_and(|r| matches!(r, Remark::Done { .. }));
            prop_assert!(remark.is_none_or(|r| matches!(r, Remark::Done { .. })), "{:?}", remark);
            let (mut came, mut missed) = (true, 0);
            if until_loss == 0 {
                let (wait, length, first_comes) = lost.next().expect("a cycle");
                (until_loss, missed, came) = (*wait, *length, *first_comes);
            }
            until_loss -= 1;
            let next = if came { robot.after(&point.q_d, T) } else { robot.onward(T) };
            for i in 0..7 {
                prop_assert!(next.a[i].abs() <= limits.joints[i].acceleration + 0.3, "joint {}: {}", i, next.a[i]);
                let jerk = (next.a[i] - robot.a[i]) / T;
                prop_assert!(jerk.abs() <= limits.joints[i].jerk + 600.0, "joint {}: jerk {}", i, jerk);
            }
            robot = (0..missed).fold(next, |trace, _| trace.onward(T));
            periods = 1 + missed as u64;
        }
        prop_assert!(done && robot.is_at_rest(7, T));
        let end = points[points.len() - 1].q_d;
        prop_assert!(robot.q.iter().zip(&end).all(|(a, b)| (a - b).abs() < 1e-6), "{:?}", robot.q);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Swings of any size and pace, anywhere, stopped at any moment.
    #[test]
    fn any_swing_stopped_at_any_moment_stays_inside_the_limits_and_comes_to_rest(
        place in prop::array::uniform7(0.0..1.0_f64),
        amplitude in -3.0..3.0_f64,
        seconds in 0.2..4.0_f64,
        stop_at in 1_usize..3000,
    ) {
        let mut start = READY;
        for ((q, joint), share) in start.iter_mut().zip(Limits::fr3().counted()).zip(place) {
            *q = joint.q_min + share * (joint.q_max - joint.q_min);
        }
        let (mut player, mut trace) = (Player::new(guard(), start), Trace::at_rest(start));
        for chunk in chunks(1, &swing(&start, amplitude, seconds)) {
            player.take(&chunk);
        }
        run(&mut player, &mut trace, stop_at);
        player.take(&MotionChunk { kind: MotionKind::Stop, ..MotionChunk::default() });
        run(&mut player, &mut trace, 5000);
        prop_assert!(player.is_at_rest());
    }

    /// Chunks of nonsense between good ones.
    #[test]
    fn no_chunk_whatever_its_content_makes_a_command_beyond_the_limits(
        amplitude in 0.1..1.0_f64,
        noise in prop::collection::vec((0_usize..1000, 0_usize..7, prop::num::f64::ANY, any::<bool>()), 0..4),
        small in prop::collection::vec((0_usize..1000, 0_usize..7, -1e-5..1e-5_f64), 0..8),
        length in 0_u32..60,
    ) {
        let mut points = swing(&READY, amplitude, 1.0);
        for (k, joint, value, in_velocity) in noise {
            let point = &mut points[k];
            if in_velocity { point.dq_d[joint] = value } else { point.q_d[joint] = value }
        }
        for (k, joint, offset) in small {
            points[k].q_d[joint] += offset;
        }
        let (mut player, mut trace) = (Player::new(guard(), READY), Trace::at_rest(READY));
        let mut sent = chunks(1, &points);
        if let Some(third) = sent.get_mut(2) {
            third.length = length;
        }
        for chunk in sent {
            player.take(&chunk);
        }
        run(&mut player, &mut trace, 5000);
        prop_assert!(player.is_at_rest());
    }
}
