//! Joint motions that lead the tool's end along a straight line, the tool's direction held. Base frame; m, s, rad.
//!
//! Pure kinematics of the nominal arm; called by the stroke planner.

use super::body::Body;
use super::rate::RATE;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;

/// Peak speed of the quintic rest-to-rest course over its mean.
const QUINTIC_PEAK_SPEED: f64 = 1.875;
/// How fast the tool turns on a way at most [rad/s].
const MAX_TURN_SPEED: f64 = 0.5;
/// How far the tool is turned about its own axis between two looks at the joints [rad].
const TURN_STEP: f64 = 0.15;
/// No way takes less time [s].
const MIN_DURATION: f64 = 0.2;

/// Joints that bring the tool's end to `target`, the nearest ones to `from`; `None` out of reach.
pub fn reach(body: &Body, from: &Joints, target: &Isometry3<f64>) -> Option<Joints> {
    let tip = Isometry3::translation(0.0, 0.0, body.model().tool_length());
    body.model().reach(from, &tip, target, None)
}

/// Joints that bring the tool's end to `target` after turning it about its own axis by `turn` [rad], step by step, so that
/// the arm goes round the shorter way and no other; `None` out of reach.
pub fn reach_turned(body: &Body, from: &Joints, target: &Isometry3<f64>, turn: f64) -> Option<Joints> {
    let steps = (turn.abs() / TURN_STEP).ceil() as u32;
    let turned = |k: u32| {
        let mut target = *target;
        target.rotation *= about_itself(turn * f64::from(k) / f64::from(steps));
        target
    };
    (1..=steps).try_fold(reach(body, from, target)?, |q, k| reach(body, &q, &turned(k)))
}

/// A turn about the tool's own axis [rad].
pub fn about_itself(turn: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn)
}

/// Joint velocities that move the tool's end with `velocity` [m/s] and turn it nowhere.
pub fn joint_velocity(body: &Body, q: &Joints, velocity: &Vector3<f64>) -> Joints {
    joints_for(body, q, &Vector6::new(velocity.x, velocity.y, velocity.z, 0.0, 0.0, 0.0))
}

/// Smallest joint motion that moves the tool's end by `motion`.
fn joints_for(body: &Body, q: &Joints, motion: &Vector6<f64>) -> Joints {
    body.model().joints_for(q, body.model().tip(q).isometry().translation.vector.into(), motion)
}

/// A straight way of the tool's end to `end` from rest to rest at most at `speed` [m/s], the tool's direction turning on the
/// way; `None` when it leaves the working space.
pub fn travel(body: &Body, from: &Joints, end: &Isometry3<f64>, speed: f64) -> Option<Vec<SetPoint>> {
    let start = body.model().tip(from).isometry();
    let shift = end.translation.vector - start.translation.vector;
    let turn = (end.rotation * start.rotation.inverse()).scaled_axis();
    let duration = (QUINTIC_PEAK_SPEED * (shift.norm() / speed).max(turn.norm() / MAX_TURN_SPEED)).max(MIN_DURATION);
    let cycles = (duration * RATE).ceil() as usize;
    let mut q = *from;
    let mut points = Vec::with_capacity(cycles + 1);
    for k in 0..=cycles {
        let x = k as f64 / cycles as f64;
        let share = x * x * x * (10.0 + x * (6.0 * x - 15.0));
        let rate = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration;
        let rotation = UnitQuaternion::from_scaled_axis(turn * share) * start.rotation;
        let place = Translation3::from(start.translation.vector + shift * share);
        q = reach(body, &q, &Isometry3::from_parts(place, rotation))?;
        let motion = Vector6::from_iterator(shift.iter().chain(turn.iter()).map(|way| way * rate));
        points.push(SetPoint { q_d: q, dq_d: joints_for(body, &q, &motion) });
    }
    points[0].q_d = *from;
    Some(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use shared_mem::cell::{Cell, Robot};

    fn fr3() -> Body {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        Body::of(&Cell { robot: Some(robot), ..Cell::default() }).expect("an FR3")
    }

    fn pointing_down(x: f64, y: f64, z: f64) -> Isometry3<f64> {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts(Translation3::new(x, y, z), down)
    }

    #[test]
    fn a_pose_in_the_working_space_is_reached() {
        let body = fr3();
        let target = pointing_down(0.45, 0.2, 0.15);
        let q = reach(&body, body.model().ready(), &target).expect("in reach");
        let tip = body.model().tip(&q).isometry();
        assert!((tip.translation.vector - target.translation.vector).norm() < 2e-6);
        assert!(tip.rotation.angle_to(&target.rotation) < 2e-6);
    }

    #[test]
    fn a_pose_two_metres_away_is_out_of_reach() {
        let body = fr3();
        assert_eq!(reach(&body, body.model().ready(), &pointing_down(2.0, 0.0, 0.2)), None);
    }

    #[test]
    fn a_way_straight_up_ends_above_its_start_at_rest_and_stays_on_the_line() {
        let body = fr3();
        let from = reach(&body, body.model().ready(), &pointing_down(0.45, 0.1, 0.05)).expect("in reach");
        let points = travel(&body, &from, &pointing_down(0.45, 0.1, 0.25), 0.1).expect("in reach");
        let tips: Vec<_> = points.iter().map(|p| body.model().tip(&p.q_d).isometry().translation.vector).collect();
        assert!(tips.iter().all(|tip| (tip.x - 0.45).abs() < 1e-5 && (tip.y - 0.1).abs() < 1e-5));
        assert!((tips[tips.len() - 1].z - 0.25).abs() < 1e-5 && points.len() as f64 > 0.2 / 0.1 * RATE);
        let fastest = tips.windows(2).map(|w| (w[1] - w[0]).norm() * RATE).fold(0.0, f64::max);
        assert!((fastest - 0.1).abs() < 2e-3, "{fastest}");
        assert!(points[points.len() - 1].dq_d.iter().all(|dq| dq.abs() < 1e-9));
    }

    #[test]
    fn joint_velocities_move_the_tool_as_asked() {
        let body = fr3();
        let (q, asked) = (*body.model().ready(), Vector3::new(0.3, -0.2, 0.0));
        let dq = joint_velocity(&body, &q, &asked);
        let later: Joints = std::array::from_fn(|i| q[i] + dq[i] * 1e-5);
        let place = |q: &Joints| body.model().tip(q).isometry();
        let moved = (place(&later).translation.vector - place(&q).translation.vector) / 1e-5;
        assert!((moved - asked).norm() < 1e-4, "{moved}");
    }
}
