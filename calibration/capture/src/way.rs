//! The motions around a stroke: over to its start without touching anything, and away from its end. Pure. Base frame; m, s,
//! rad.
//!
//! Everything travels above the object; only beside it, where the stroke begins and ends, the tool goes straight down or up.
//! Past other objects it travels as low; where one is in the way, above all of them.

use super::body::Body;
use super::excess::{Excess, Quantity};
use super::limits::first_excess;
use super::line::{self, about_itself};
use super::obstacle::{self, Blocked, Obstacle};
use super::transit;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use twin::arm::JointLimits;

/// Speed straight up and down [m/s].
const VERTICAL_SPEED: f64 = 0.15;
/// Shares of the usual speed that are tried: near a joint's stop it may move only slowly towards it.
const PACES: [f64; 4] = [1.0, 0.5, 0.25, 0.12];
/// How far the tool backs off from what it pushed before it rises [m].
const RETREAT_DISTANCE: f64 = 0.02;

/// No safe way was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WayError {
    /// A place on the way cannot be reached.
    #[error(
        "the tool cannot get to x {x:.3} m, y {y:.3} m, z {z:.3} m; move the arm to its ready pose, then start again"
    )]
    OutOfReach {
        /// Where [m].
        x: f64,
        /// Where [m].
        y: f64,
        /// Where [m].
        z: f64,
    },
    /// A limit is broken on the way.
    #[error("the way to or from the stroke breaks a limit ({0}); move the arm to its ready pose, then start again")]
    Limit(Excess),
    /// Another object stands there.
    #[error(transparent)]
    Blocked(#[from] Blocked),
}

/// How ways are judged.
#[derive(Debug, Clone, Copy)]
pub struct Ways<'a> {
    pub body: &'a Body,
    pub limits: &'a [JointLimits],
    /// Height of the tool's end while it travels [m].
    pub height: f64,
    /// Height that flange and tool stay above while they travel [m].
    pub floor: f64,
    /// What it keeps clear of.
    pub obstacles: &'a [Obstacle],
}

impl Ways<'_> {
    /// From rest at `from` to rest at `to`, a pose beside the object: up, over, down.
    ///
    /// # Errors
    /// [`WayError`] with the place, or the joint and the limit, or the object in the way.
    pub fn over(&self, from: &Joints, to: &Joints) -> Result<Vec<SetPoint>, WayError> {
        let low = self.over_at_height(from, to);
        let (Err(WayError::Blocked(_)), Some(higher)) = (&low, self.above_all()) else { return low };
        higher.over_at_height(from, to).or(low)
    }

    /// The same ways above every obstacle; `None` where they are that already.
    fn above_all(&self) -> Option<Self> {
        let (above, top) = (self.height - self.floor, obstacle::highest(self.obstacles)?);
        (top + above > self.floor).then_some(Self { height: top + 2.0 * above, floor: top + above, ..*self })
    }

    fn over_at_height(&self, from: &Joints, to: &Joints) -> Result<Vec<SetPoint>, WayError> {
        self.paced(|pace| {
            let mut points = self.up(from, pace)?;
            let above = last(&points, from);
            let end = self.place(to);
            let descent = self.straight(to, &raised(&end, self.height), pace)?;
            let reached = last(&descent, to);
            let across = transit::plan(&above, &reached, self.limits, pace).ok_or_else(|| self.unreachable(&end))?;
            self.check_height(&across)?;
            points.extend(across);
            // The way down is the way up from there, played backwards.
            points.extend(descent.iter().rev().map(|p| SetPoint { q_d: p.q_d, dq_d: p.dq_d.map(|dq| -dq) }));
            Ok(points)
        })
    }

    /// From rest at the end of a stroke along `heading` [rad]: back a little, then up.
    ///
    /// # Errors
    /// [`WayError`].
    pub fn away(&self, from: &Joints, heading: f64) -> Result<Vec<SetPoint>, WayError> {
        let back = Translation3::new(-RETREAT_DISTANCE * heading.cos(), -RETREAT_DISTANCE * heading.sin(), 0.0);
        self.paced(|pace| {
            let mut points = self.straight(from, &(back * self.place(from)), pace)?;
            points.extend(self.up(&last(&points, from), pace)?);
            Ok(points)
        })
    }

    /// The way at the first pace that breaks no limit; what the slowest breaks where none does.
    fn paced(&self, way: impl Fn(f64) -> Result<Vec<SetPoint>, WayError>) -> Result<Vec<SetPoint>, WayError> {
        let [usual, slower @ ..] = PACES;
        let first = way(usual).and_then(|points| self.checked(points));
        slower.into_iter().fold(first, |tried, pace| match tried {
            Err(WayError::Limit(excess)) if excess.quantity.eases() => {
                way(pace).and_then(|points| self.checked(points))
            }
            settled => settled,
        })
    }

    fn up(&self, from: &Joints, pace: f64) -> Result<Vec<SetPoint>, WayError> {
        let place = self.place(from);
        if place.translation.z >= self.height {
            return Ok(Vec::new());
        }
        self.straight(from, &raised(&place, self.height), pace)
    }

    fn straight(&self, from: &Joints, to: &Isometry3<f64>, pace: f64) -> Result<Vec<SetPoint>, WayError> {
        line::travel(self.body, from, to, pace * VERTICAL_SPEED).ok_or_else(|| self.unreachable(to))
    }

    fn place(&self, q: &Joints) -> Isometry3<f64> {
        self.body.model().tip(q).isometry().to_owned()
    }

    fn unreachable(&self, to: &Isometry3<f64>) -> WayError {
        let place = to.translation;
        WayError::OutOfReach { x: place.x, y: place.y, z: place.z }
    }

    fn check_height(&self, points: &[SetPoint]) -> Result<(), WayError> {
        let lowest = points.iter().map(|p| self.body.lowest_point(&p.q_d)).fold(f64::INFINITY, f64::min);
        let excess = Excess { joint: None, quantity: Quantity::Height, value: lowest, limit: self.floor };
        if lowest < self.floor { Err(WayError::Limit(excess)) } else { Ok(()) }
    }

    fn checked(&self, points: Vec<SetPoint>) -> Result<Vec<SetPoint>, WayError> {
        if let Some(excess) = first_excess(&points, self.limits, Some(self.body)) {
            return Err(WayError::Limit(excess));
        }
        match obstacle::on_motion(self.obstacles, self.body, &points, true) {
            None => Ok(points),
            Some(blocked) => Err(WayError::Blocked(blocked)),
        }
    }
}

/// The tool's end pointing straight down at a place, turned about its own axis by `turn` [rad].
pub fn upright(place: Vector3<f64>, turn: f64) -> Isometry3<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::from(place), down * about_itself(turn))
}

fn raised(place: &Isometry3<f64>, height: f64) -> Isometry3<f64> {
    let mut raised = *place;
    raised.translation.z = height;
    raised
}

fn last(points: &[SetPoint], otherwise: &Joints) -> Joints {
    points.last().map_or(*otherwise, |point| point.q_d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::shipped;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_way_over_travels_above_the_object_and_comes_down_only_at_its_end(
            (x, y) in (0.35..0.6_f64, -0.25..0.25_f64),
            (x_from, y_from) in (0.35..0.6_f64, -0.25..0.25_f64),
        ) {
            let (body, limits) = shipped();
            let ways = Ways { body: &body, limits: &limits, height: 0.2, floor: 0.12, obstacles: &[] };
            let at = |x, y, z| line::reach(&body, body.model().ready(), &upright(Vector3::new(x, y, z), 0.0)).expect("in reach");
            let (from, to) = (at(x_from, y_from, 0.03), at(x, y, 0.03));
            let points = ways.over(&from, &to).expect("a way");
            let joined = points.windows(2).all(|w| w[0].q_d.iter().zip(&w[1].q_d).all(|(a, b)| (a - b).abs() < 2e-3));
            prop_assert!(joined, "no leaps");
            let last = points[points.len() - 1].q_d;
            prop_assert!(last.iter().zip(&to).all(|(a, b)| (a - b).abs() < 1e-9));
            for point in &points {
                let tip = body.model().tip(&point.q_d).isometry().translation.vector;
                let beside = |x: f64, y: f64| (tip.x - x).hypot(tip.y - y) < 1e-3;
                prop_assert!(tip.z > 0.12 || beside(x, y) || beside(x_from, y_from), "low at {tip}");
            }
        }
    }

    /// A box of 8 by 8 cm.
    fn block(name: &str, [x, y]: [f64; 2], height: f64) -> Obstacle {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            nalgebra::Point3::new(0.04 * sign(0), 0.04 * sign(1), 0.5 * height * sign(2))
        };
        let corners: Vec<_> = (0..8).map(corner).collect();
        Obstacle::at(name, &corners, &Isometry3::translation(x, y, 0.5 * height))
    }

    #[test]
    fn past_low_objects_the_tool_travels_low_above_a_tall_one_higher_and_not_down_beside_one() {
        let (body, limits) = shipped();
        let at =
            |x, y| line::reach(&body, body.model().ready(), &upright(Vector3::new(x, y, 0.03), 0.0)).expect("in reach");
        let (from, to) = (at(0.5, -0.25), at(0.5, 0.25));
        let over = |obstacles: &[Obstacle]| {
            Ways { body: &body, limits: &limits, height: 0.2, floor: 0.12, obstacles }.over(&from, &to)
        };
        let highest = |points: &[SetPoint]| {
            points.iter().map(|p| body.model().tip(&p.q_d).isometry().translation.z).fold(0.0, f64::max)
        };
        let low = over(&[]).expect("a way");
        assert_eq!(over(&[block("cup", [0.5, 0.0], 0.1), block("tall", [0.2, -0.6], 0.5)]).expect("a way"), low);
        let tall = [block("tall", [0.5, 0.0], 0.2)];
        let high = over(&tall).expect("a way above it");
        assert!(highest(&high) > 0.35 && highest(&low) < 0.3, "{} and {}", highest(&high), highest(&low));
        assert_eq!(obstacle::on_motion(&tall, &body, &high, false), None);
        let error = over(&[block("cup", [0.5, 0.32], 0.1)]).expect_err("no room to come down").to_string();
        assert!(error.contains("the arm would come within") && error.contains("move `cup` away by about"), "{error}");
    }

    #[test]
    fn after_a_stroke_the_tool_backs_off_and_rises() {
        let (body, limits) = shipped();
        let ways = Ways { body: &body, limits: &limits, height: 0.2, floor: 0.12, obstacles: &[] };
        let from =
            line::reach(&body, body.model().ready(), &upright(Vector3::new(0.5, 0.0, 0.03), 0.0)).expect("in reach");
        let points = ways.away(&from, 0.0).expect("a way");
        let end = body.model().tip(&points[points.len() - 1].q_d).isometry().translation.vector;
        assert!((end - Vector3::new(0.48, 0.0, 0.2)).norm() < 1e-4, "{end}");
    }

    #[test]
    fn near_a_stop_the_way_down_is_taken_more_slowly() {
        let (body, mut limits) = shipped();
        let to =
            line::reach(&body, body.model().ready(), &upright(Vector3::new(0.5, 0.0, 0.03), 0.0)).expect("in reach");
        let over = |limits: &[JointLimits]| {
            Ways { body: &body, limits, height: 0.2, floor: 0.12, obstacles: &[] }.over(body.model().ready(), &to)
        };
        let usual = over(&limits).expect("a way").len();
        // The shoulder's stop so near that it may still creep there.
        limits[1].q_max = to[1] + 0.014;
        let slower = over(&limits).expect("a way");
        assert!(slower.len() > usual, "{} cycles instead of {usual}", slower.len());
        limits[1].q_max = to[1] - 0.01;
        let error = over(&limits).expect_err("beyond the stop");
        assert!(matches!(error, WayError::Limit(excess) if excess.joint == Some(1)), "{error}");
    }
}
