//! The objects beside the one that is struck: what the arm and what slides keep clear of. Each is an upright prism over the
//! outline of its box, from the table up to its highest point, where it was measured. Pure. Base frame; m.

use super::body::Body;
use nalgebra::{Isometry3, Point2, Point3, Vector2};
use shared_mem::msg::motion::SetPoint;
use std::fmt;
use twin::scene::CellBody;

/// Arm, tool and a sliding object keep this far away from other objects [m]: more than an arm under control deviates and a
/// tracker errs.
pub const OBJECT_CLEARANCE: f64 = 0.03;
/// For each metre that an object slides it may come so far aside [m]: it is hit obliquely and beside its centre.
const SIDEWAYS_PER_METRE: f64 = 0.3;
/// A way that begins nearer to an object than [`OBJECT_CLEARANCE`] may come nearer by this [m]: what a tracker errs between two looks.
const TRACKER_ERROR: f64 = 2e-3;
/// Set points between two looks at how near the arm is.
const CHECKED_EVERY: usize = 5;
/// Between two looks at how near what slides is [m].
const SLIDE_STEP: f64 = 5e-3;
/// A remedy is given in steps of this [m].
const REMEDY_STEP: f64 = 5e-3;

/// An object that nothing may touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    name: String,
    /// Corners of its convex outline from above, counter-clockwise.
    outline: Vec<Point2<f64>>,
    /// Height of its highest point.
    top: f64,
}

/// Something would come too near to an obstacle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct Blocked {
    pub what: String,
    /// The obstacle's name.
    pub name: String,
    /// How near [m]; negative where one would run into the other.
    pub gap: f64,
    /// How far apart they have to be [m].
    pub kept: f64,
    /// Horizontal direction in which moving the obstacle helps; of length 1.
    pub away: Vector2<f64>,
}

/// Corners of the box around a body along its own axes.
pub fn corners(body: &CellBody) -> [Point3<f64>; 8] {
    let (points, _) = body.surface().triangles();
    let bound = |axis: usize, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0);
    std::array::from_fn(|i| {
        let at = |axis: usize| bound(axis, if i >> axis & 1 == 1 { f64::max } else { f64::min });
        Point3::new(at(0), at(1), at(2))
    })
}

impl Obstacle {
    /// The obstacle of this name whose box has `corners` in its own axes, at `pose`.
    pub fn at(name: &str, corners: &[Point3<f64>], pose: &Isometry3<f64>) -> Self {
        let corners: Vec<Point3<f64>> = corners.iter().map(|corner| pose * corner).collect();
        let top = corners.iter().map(|corner| corner.z).fold(f64::NEG_INFINITY, f64::max);
        Self { name: name.to_owned(), outline: outline(corners.iter().map(Point3::xy).collect()), top }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Corners of its outline from above, counter-clockwise.
    pub fn outline(&self) -> &[Point2<f64>] {
        &self.outline
    }

    /// From a point on the table to its outline, negative inside; and the direction in which the outline has to go to get away
    /// from the point.
    fn beside(&self, point: &Point2<f64>) -> (f64, Vector2<f64>) {
        let (mut inside, mut deepest) = (true, (f64::NEG_INFINITY, Vector2::x()));
        let mut nearest = (f64::INFINITY, Vector2::x());
        for (i, from) in self.outline.iter().enumerate() {
            let to = self.outline[(i + 1) % self.outline.len()];
            let (along, way) = (to - from, point - from);
            let outwards = Vector2::new(along.y, -along.x).try_normalize(0.0).unwrap_or_else(Vector2::x);
            let beyond = way.dot(&outwards);
            inside &= beyond <= 0.0;
            if beyond > deepest.0 {
                deepest = (beyond, -outwards);
            }
            let share = (way.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let to_edge = from + along * share - point;
            if to_edge.norm() < nearest.0 {
                nearest = (to_edge.norm(), to_edge.try_normalize(1e-9).unwrap_or(-outwards));
            }
        }
        if inside { deepest } else { nearest }
    }

    /// Gap between the obstacle and a ball, negative where they overlap [m]; and the direction that leads away from it.
    pub fn gap(&self, centre: &Point3<f64>, radius: f64) -> (f64, Vector2<f64>) {
        let ((beside, away), above) = (self.beside(&centre.xy()), centre.z - self.top);
        let gap = if above <= 0.0 {
            beside
        } else if beside <= 0.0 {
            above
        } else {
            beside.hypot(above)
        };
        (gap - radius, away)
    }

    /// The same for the whole arm in a pose.
    fn gap_to_arm(&self, balls: &[(Point3<f64>, f64)]) -> (f64, Vector2<f64>) {
        let gaps = balls.iter().map(|(centre, radius)| self.gap(centre, *radius));
        gaps.fold((f64::INFINITY, Vector2::x()), |nearest, gap| if gap.0 < nearest.0 { gap } else { nearest })
    }
}

/// Height of the highest obstacle; `None` without any.
pub fn highest(obstacles: &[Obstacle]) -> Option<f64> {
    obstacles.iter().map(|obstacle| obstacle.top).reduce(f64::max)
}

/// Where arm or tool come too near to an obstacle on a motion; the worst place. `leaves`: where the motion begins too near, it
/// may go away from there.
pub fn on_motion(obstacles: &[Obstacle], body: &Body, points: &[SetPoint], leaves: bool) -> Option<Blocked> {
    let first = body.balls(&points.first().filter(|_| !obstacles.is_empty())?.q_d);
    let kept = |obstacle: &Obstacle| {
        if leaves { OBJECT_CLEARANCE.min(obstacle.gap_to_arm(&first).0 - TRACKER_ERROR) } else { OBJECT_CLEARANCE }
    };
    let kept: Vec<f64> = obstacles.iter().map(kept).collect();
    let poses = points.iter().step_by(CHECKED_EVERY).chain(points.last()).map(|point| body.balls(&point.q_d));
    let found = poses.flat_map(|balls| {
        let near = |(obstacle, kept): (&Obstacle, &f64)| {
            let (gap, away) = obstacle.gap_to_arm(&balls);
            (gap < *kept).then(|| Blocked {
                what: "the arm".to_owned(),
                name: obstacle.name.clone(),
                gap,
                kept: *kept,
                away,
            })
        };
        obstacles.iter().zip(&kept).filter_map(near).collect::<Vec<_>>()
    });
    found.reduce(worse)
}

/// Where something of this radius that slides straight on comes too near to an obstacle; the worst place. `what`: its name.
pub fn on_slide(obstacles: &[Obstacle], what: &str, [from, to]: [[f64; 2]; 2], radius: f64) -> Option<Blocked> {
    let (from, to) = (Point2::from(from), Point2::from(to));
    let length = (to - from).norm();
    let steps = (length / SLIDE_STEP).ceil().max(1.0) as usize;
    let places = (0..=steps).map(|k| k as f64 / steps as f64);
    let found = places.flat_map(|share| {
        let (place, kept) = (from + (to - from) * share, OBJECT_CLEARANCE + SIDEWAYS_PER_METRE * length * share);
        obstacles.iter().filter_map(move |obstacle| {
            let (beside, away) = obstacle.beside(&place);
            let gap = beside - radius;
            (gap < kept).then(|| Blocked { what: what.to_owned(), name: obstacle.name.clone(), gap, kept, away })
        })
    });
    found.reduce(worse)
}

/// What stands between a camera and the ball of `radius` [m] around the point that it looks at; the worst. What reaches into that
/// ball is a part of what is looked at.
pub fn on_sight(obstacles: &[Obstacle], camera: &Point3<f64>, at: &Point3<f64>, radius: f64) -> Option<Blocked> {
    let way = at - camera;
    let steps = (way.norm() / SLIDE_STEP).ceil().max(1.0) as usize;
    let found = obstacles.iter().filter(|obstacle| obstacle.gap(at, radius).0 >= 0.0).filter_map(|obstacle| {
        let shares = (0..=steps).map(|k| k as f64 / steps as f64);
        let gaps = shares.map(|share| obstacle.gap(&(camera + way * share), radius * share));
        let (gap, away) = gaps.reduce(|nearest, gap| if gap.0 < nearest.0 { gap } else { nearest })?;
        (gap < 0.0).then(|| Blocked {
            what: "the camera's sight".to_owned(),
            name: obstacle.name.clone(),
            gap,
            kept: 0.0,
            away,
        })
    });
    found.reduce(worse)
}

/// The one that lacks more.
pub fn worse(a: Blocked, b: Blocked) -> Blocked {
    if b.lacks() > a.lacks() { b } else { a }
}

impl Blocked {
    /// How much farther away the obstacle would have to be [m].
    pub fn lacks(&self) -> f64 {
        self.kept - self.gap
    }
}

impl fmt::Display for Blocked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, name, gap, kept, away } = self;
        let mm = |metres: f64| 1e3 * metres;
        match *gap > 0.0 {
            true => {
                write!(f, "{what} would come within {:.0} mm of `{name}`, and {:.0} mm are kept", mm(*gap), mm(*kept))?
            }
            false => write!(f, "{what} would run into `{name}`")?,
        }
        let by = (self.lacks() / REMEDY_STEP).ceil() * REMEDY_STEP;
        // What rounds to 0 has no sign.
        let [x, y] = [away.x, away.y].map(|share| mm(by * share).round() + 0.0);
        write!(f, "; move `{name}` away by about {:.0} mm ({x:+.0} mm along x, {y:+.0} mm along y)", mm(by))
    }
}

/// Corners of the convex outline of points, counter-clockwise. Source: Andrew's monotone chain (1979).
fn outline(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = &Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp(&(point - b)) > 1e-12 {
                    break;
                }
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut all = half(&mut points.iter());
    all.extend(half(&mut points.iter().rev()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::shipped;
    use crate::line;
    use crate::way::upright;
    use nalgebra::Vector3;

    fn block(name: &str, [x, y]: [f64; 2], [a, b, c]: [f64; 3], yaw: f64) -> Obstacle {
        let corner = |i: usize| {
            let at = |bit: usize, size: f64| if i >> bit & 1 == 1 { 0.5 * size } else { -0.5 * size };
            Point3::new(at(0, a), at(1, b), at(2, c))
        };
        let corners: Vec<_> = (0..8).map(corner).collect();
        Obstacle::at(name, &corners, &Isometry3::new(Vector3::new(x, y, 0.5 * c), Vector3::z() * yaw))
    }

    #[test]
    fn a_turned_box_is_where_its_corners_are_and_what_is_inside_has_a_negative_gap() {
        let cup = block("cup", [0.5, 0.0], [0.1, 0.1, 0.2], std::f64::consts::FRAC_PI_4);
        assert_eq!(cup.outline().len(), 4);
        let (beside, away) = cup.beside(&Point2::new(0.3, 0.0));
        assert!((beside - (0.2 - 0.05 * 2.0_f64.sqrt())).abs() < 1e-9 && (away - Vector2::x()).norm() < 1e-9);
        assert!((cup.beside(&Point2::new(0.5, 0.0)).0 + 0.05).abs() < 1e-9);
        let above = Point3::new(0.5, 0.0, 0.26);
        assert!((cup.gap(&above, 0.01).0 - 0.05).abs() < 1e-9 && highest(&[cup]) == Some(0.2));
    }

    #[test]
    fn what_slides_past_is_free_and_what_slides_into_it_is_not() {
        let cup = [block("cup", [0.5, 0.3], [0.08, 0.08, 0.1], 0.0)];
        let along = |to: [f64; 2]| on_slide(&cup, "`milk`", [[0.5, 0.0], to], 0.05);
        assert_eq!(along([0.5, -0.2]), None);
        assert_eq!(along([0.7, 0.0]), None);
        let blocked = along([0.5, 0.2]).expect("in the way");
        // 0.26 m to the cup, of which 0.2 m and the radius are used up: 10 mm are left of 30 mm and three tenths of the way.
        assert!((blocked.gap - 0.01).abs() < 1e-9 && (blocked.kept - 0.09).abs() < 1e-9, "{blocked:?}");
        let line = blocked.to_string();
        assert!(
            line.contains(
                "`milk` would come within 10 mm of `cup`, and 90 mm are kept; move `cup` away by about 80 mm"
            ),
            "{line}"
        );
        assert!(line.ends_with("(+0 mm along x, +80 mm along y)"), "{line}");
        assert!(along([0.5, 0.25]).expect("in the way").to_string().contains("would run into `cup`"));
    }

    #[test]
    fn the_tool_is_seen_beside_an_object_over_its_whole_length_and_the_arm_above_it() {
        let (body, _) = shipped();
        let down = |x: f64, y: f64, z: f64| {
            let q_d = line::reach(&body, body.model().ready(), &upright(Vector3::new(x, y, z), 0.0)).expect("in reach");
            [SetPoint { q_d, ..SetPoint::default() }]
        };
        let low = [block("low", [0.5, 0.0], [0.08, 0.06, 0.1], 0.0)];
        assert_eq!(on_motion(&low, &body, &down(0.5, 0.1, 0.03), false), None);
        // 30 mm from the axis to the face's plane, 12 mm of it the tool's.
        let near = on_motion(&low, &body, &down(0.5, 0.06, 0.03), false).expect("too near");
        assert!((near.gap - 0.018).abs() < 2e-3 && near.away.y < -0.99, "{near:?}");
        // Above a tall one the tool is free, but not the hand beside it.
        let tall = [block("tall", [0.5, 0.0], [0.08, 0.06, 0.25], 0.0)];
        assert_eq!(on_motion(&tall, &body, &down(0.5, 0.0, 0.29), false), None);
        assert!(on_motion(&tall, &body, &down(0.5, 0.09, 0.03), false).is_some());
        assert_eq!(on_motion(&tall, &body, &down(0.5, 0.20, 0.03), false), None);
        // What stands there already may leave.
        assert_eq!(on_motion(&low, &body, &down(0.5, 0.06, 0.03), true), None);
    }
}
