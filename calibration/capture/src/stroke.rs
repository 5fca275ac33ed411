//! Plans one Control-Hit-Slide stroke: the tool comes to rest beside the object, runs up along a straight line, hits, follows
//! through and stops, while the object slides on. Pure: no clock, no shared memory. Base frame; m, s, rad.
//!
//! The tool's end moves along `s(t)`: rest, a smooth rise to the speed of the hit, that speed over the hit, a smooth fall,
//! rest. Rise and fall follow the quintic `10 x³ - 15 x⁴ + 6 x⁵`, whose acceleration starts and ends at zero.

use super::body::Body;
use super::excess::Excess;
use super::limits::first_excess;
use super::line;
use super::rate::RATE;
use super::way::upright;
use nalgebra::Vector3;
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use twin::arm::JointLimits;

/// Way at full speed before the object's bounding circle, so that the controller has settled when it hits [m].
const SETTLING_DISTANCE: f64 = 0.02;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Where the object stands: x, y of its geometric centre [m].
    pub object: [f64; 2],
    /// Radius around there that the object and the tool's radius keep within [m].
    pub clearance: f64,
    /// Direction of the stroke, from the base frame's x axis [rad].
    pub heading: f64,
    /// How far the line passes to the left of the object's centre [m].
    pub offset: f64,
    /// Speed of the hit [m/s].
    pub speed: f64,
    /// Height of the tool's end [m].
    pub height: f64,
    /// Duration of rise and fall each [s].
    pub rise: f64,
    /// How far the tool follows through at full speed, from the object's centre on [m].
    pub follow_through: f64,
    /// Rest before the motion and after it [s].
    pub rest: [f64; 2],
    /// How far the tool is turned about its own axis [rad].
    pub turn: f64,
}

/// A stroke's motion, one set point a control cycle; the first and the last are at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokePlan {
    /// The set points.
    pub set_points: Vec<SetPoint>,
}

/// The stroke cannot be done.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StrokeError {
    /// The line leaves the working space.
    #[error(
        "the tool cannot get to x {x:.3} m, y {y:.3} m upright; move the object nearer or hit it from another side"
    )]
    OutOfReach {
        /// Where [m].
        x: f64,
        /// Where [m].
        y: f64,
    },
    /// A limit is broken on the way.
    #[error("the stroke breaks a limit ({0}); make it slower, its rise longer, or hit from another side")]
    Limit(Excess),
}

/// Plans the stroke from the pose nearest to `near`.
///
/// # Errors
/// [`StrokeError`] with the place, or the joint, its value and the limit.
pub fn plan(stroke: &Stroke, near: &Joints, limits: &[JointLimits], body: &Body) -> Result<StrokePlan, StrokeError> {
    let profile = Profile::of(stroke);
    let along = Vector3::new(stroke.heading.cos(), stroke.heading.sin(), 0.0);
    let aside = Vector3::new(-along.y, along.x, 0.0);
    let middle = Vector3::new(stroke.object[0], stroke.object[1], stroke.height) + aside * stroke.offset;
    let start = middle - along * profile.to_middle;
    let out = |place: &Vector3<f64>| StrokeError::OutOfReach { x: place.x, y: place.y };
    let mut q = line::reach_turned(body, near, &upright(start, 0.0), stroke.turn).ok_or_else(|| out(&start))?;
    let mut set_points = Vec::with_capacity(profile.samples());
    for i in 0..profile.samples() {
        let (way, speed) = profile.at(i as f64 / RATE);
        let place = start + along * way;
        // From the joints before, so that the arm does not turn over to another solution.
        q = line::reach(body, &q, &upright(place, stroke.turn)).ok_or_else(|| out(&place))?;
        set_points.push(SetPoint { q_d: q, dq_d: line::joint_velocity(body, &q, &(along * speed)) });
    }
    match first_excess(&set_points, limits, Some(body)) {
        None => Ok(StrokePlan { set_points }),
        Some(excess) => Err(StrokeError::Limit(excess)),
    }
}

/// `s(t)` of the tool's end.
struct Profile {
    speed: f64,
    rise: f64,
    cruise: f64,
    rest: [f64; 2],
    /// From the start to the object's middle [m].
    to_middle: f64,
}

impl Profile {
    fn of(stroke: &Stroke) -> Self {
        let Stroke { speed, rise, rest, .. } = *stroke;
        let before = stroke.clearance + SETTLING_DISTANCE;
        // Over the rise the mean speed is half of the final one.
        let cruise = (before + stroke.follow_through) / speed;
        Self { speed, rise, cruise, rest, to_middle: 0.5 * speed * rise + before }
    }

    fn samples(&self) -> usize {
        // One more than the intervals: both ends have a set point.
        ((self.rest[0] + 2.0 * self.rise + self.cruise + self.rest[1]) * RATE).ceil() as usize + 1
    }

    /// Way [m] and speed [m/s] at time `t` [s].
    fn at(&self, t: f64) -> (f64, f64) {
        let since = t - self.rest[0];
        let rising = (since / self.rise).clamp(0.0, 1.0);
        let cruising = (since - self.rise).clamp(0.0, self.cruise);
        let falling = ((since - self.rise - self.cruise) / self.rise).clamp(0.0, 1.0);
        let way = self.rise * (swept(rising) + falling - swept(falling)) + cruising;
        (self.speed * way, self.speed * (risen(rising) - risen(falling)))
    }
}

fn risen(x: f64) -> f64 {
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// Integral of [`risen`] from 0.
fn swept(x: f64) -> f64 {
    x.powi(4) * (2.5 + x * (x - 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits;
    use shared_mem::cell::{Cell, Robot, Tool};

    fn cell() -> Cell {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let tool = Tool { mass: 0.25, length: 0.16, radius: 0.012 };
        Cell { robot: Some(robot), tool: Some(tool), ..Cell::default() }
    }

    const STROKE: Stroke = Stroke {
        object: [0.5, 0.0],
        clearance: 0.062,
        heading: 0.7,
        offset: 0.01,
        speed: 0.5,
        height: 0.03,
        rise: 0.4,
        follow_through: 0.02,
        rest: [0.25, 0.5],
        turn: 0.0,
    };

    fn planned(stroke: &Stroke) -> Result<(StrokePlan, Body), StrokeError> {
        let body = Body::of(&cell()).expect("an FR3");
        let limits = limits::of(&cell(), &body);
        plan(stroke, body.model().ready(), &limits, &body).map(|plan| (plan, body))
    }

    #[test]
    fn the_tool_passes_the_object_at_the_offset_asked_for_with_the_speed_asked_for() {
        let (plan, body) = planned(&STROKE).expect("an easy stroke");
        let tips: Vec<_> =
            plan.set_points.iter().map(|p| body.model().tip(&p.q_d).isometry().translation.vector).collect();
        let (along, aside) = ([0.7_f64.cos(), 0.7_f64.sin()], [-(0.7_f64.sin()), 0.7_f64.cos()]);
        let from_object = |tip: &Vector3<f64>, axis: [f64; 2]| (tip.x - 0.5) * axis[0] + tip.y * axis[1];
        assert!(tips.iter().all(|tip| (from_object(tip, aside) - 0.01).abs() < 1e-5 && (tip.z - 0.03).abs() < 1e-5));
        let hit = tips.iter().position(|tip| from_object(tip, along) > -0.05).expect("it gets there");
        let speed = (tips[hit] - tips[hit - 1]).norm() * RATE;
        assert!((speed - 0.5).abs() < 1e-3, "{speed}");
    }

    #[test]
    fn the_motion_starts_and_ends_at_rest_and_velocities_are_those_of_the_positions() {
        let (StrokePlan { set_points }, _) = planned(&STROKE).expect("an easy stroke");
        let still = |point: &SetPoint| point.dq_d.iter().all(|dq| dq.abs() < 1e-9);
        assert!(still(&set_points[0]) && still(&set_points[set_points.len() - 1]));
        for w in set_points.windows(3) {
            for joint in 0..7 {
                let difference = 0.5 * RATE * (w[2].q_d[joint] - w[0].q_d[joint]);
                assert!((difference - w[1].dq_d[joint]).abs() < 5e-3, "{difference} {}", w[1].dq_d[joint]);
            }
        }
    }

    #[test]
    fn a_turned_tool_follows_the_same_line_turned_about_its_own_axis() {
        let (straight, body) = planned(&STROKE).expect("an easy stroke");
        let (turned, _) = planned(&Stroke { turn: -1.5, ..STROKE }).expect("one with the tool turned");
        assert_eq!(straight.set_points.len(), turned.set_points.len());
        for (a, b) in straight.set_points.iter().zip(&turned.set_points).step_by(50) {
            let [a, b] = [a, b].map(|point| body.model().tip(&point.q_d).isometry());
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-6);
            assert!(((a.rotation.inverse() * b.rotation).scaled_axis().z + 1.5).abs() < 1e-6);
        }
    }

    #[test]
    fn a_stroke_out_of_reach_and_one_too_fast_are_refused_with_the_reason() {
        let far = planned(&Stroke { object: [1.2, 0.0], ..STROKE }).map(|_| ()).expect_err("too far");
        assert!(matches!(far, StrokeError::OutOfReach { .. }), "{far}");
        let fast = planned(&Stroke { speed: 2.5, rise: 0.05, ..STROKE }).map(|_| ()).expect_err("too fast");
        assert!(fast.to_string().contains("joint"), "{fast}");
    }
}
