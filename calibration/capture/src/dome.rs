//! Views of a point from a dome above it, by a camera on the arm: where the camera stands, which joints bring it there, and calm
//! ways between, clear of other objects. Pure. Base frame; m, rad.

use super::body::Body;
use super::limits::first_excess;
use super::obstacle::{self, Blocked, Obstacle};
use super::transit;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use std::f64::consts::TAU;
use twin::arm::JointLimits;

/// What is looked at, and from how far.
#[derive(Debug, Clone, Copy)]
pub struct Dome<'a> {
    /// The point [m].
    pub at: Point3<f64>,
    /// From the camera to it [m].
    pub distance: f64,
    /// How the camera is mounted on the flange.
    pub flange_from_camera: Isometry3<f64>,
    /// Height that flange, tool and camera stay above [m].
    pub floor: f64,
    /// What is further from the point is no part of what is looked at [m].
    pub radius: f64,
    /// What the arm keeps clear of, and what may stand in the camera's sight.
    pub obstacles: &'a [Obstacle],
}

/// Views of a dome.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Views {
    /// Joints of those that can be taken.
    pub free: Vec<Joints>,
    /// What is in the way of each other one.
    pub blocked: Vec<Blocked>,
}

/// No straight way.
#[derive(Debug, Clone, PartialEq)]
pub enum NoWay {
    /// It leaves the limits, or comes too low or too near to the point.
    Outside,
    /// Another object is in the way.
    Blocked(Blocked),
}

/// Lowest and highest elevation of the camera above the point's level [rad].
const ELEVATIONS: [f64; 2] = [0.2, 1.45];
/// Places that are tried for each that is wanted: most lie behind the object or too low.
const CANDIDATES_PER_VIEW: usize = 6;
/// Turns of the camera about its own axis that are tried.
const ROLLS: usize = 12;
/// Joints stay this far inside their stops [rad].
const JOINT_MARGIN: f64 = 0.05;
/// Flange, tool and camera stay this share of the distance away from the point.
const MIN_DISTANCE_SHARE: f64 = 0.5;
/// Set points between two looks at how near the arm is.
const CHECKED_EVERY: usize = 20;

/// A camera at `from` that looks at `at`, its rows level but for a `roll` about its own axis.
pub fn looking(from: &Point3<f64>, at: &Point3<f64>, roll: f64) -> Isometry3<f64> {
    let forwards = (at - from).normalize();
    let right = forwards.cross(&Vector3::z());
    // Straight down no row is level: any will do.
    let right = if right.norm() > 1e-6 { right.normalize() } else { Vector3::y() };
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, forwards.cross(&right), forwards]));
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    Isometry3::from_parts((*from).into(), UnitQuaternion::from_rotation_matrix(&turn) * roll)
}

impl Dome<'_> {
    /// At most `wanted` views spread over the dome, of those to which a straight way leads from `start` inside every limit: from any
    /// of them that is free each other one is reached over there.
    pub fn views(&self, body: &Body, limits: &[JointLimits], start: &Joints, wanted: usize) -> Views {
        let reached = self.places(CANDIDATES_PER_VIEW * wanted).filter_map(|place| {
            let view = self.view(body, limits, start, &place)?;
            Some((place, view))
        });
        let mut reached: Vec<(Point3<f64>, Result<Joints, Blocked>)> = reached.collect();
        let mut chosen: Vec<Point3<f64>> = Vec::new();
        let mut views = Views::default();
        // One after the other the place that is furthest from all before.
        while chosen.len() < wanted && !reached.is_empty() {
            let clearance =
                |place: &Point3<f64>| chosen.iter().map(|c| (c - place).norm()).fold(f64::INFINITY, f64::min);
            let furthest =
                (0..reached.len()).max_by(|a, b| clearance(&reached[*a].0).total_cmp(&clearance(&reached[*b].0)));
            let Some(furthest) = furthest else { break };
            let (place, view) = reached.swap_remove(furthest);
            chosen.push(place);
            match view {
                Ok(joints) => views.free.push(joints),
                Err(blocked) => views.blocked.push(blocked),
            }
        }
        views
    }

    /// Joints of the view from a place, or what is in its way; `None` where it is out of reach.
    fn view(
        &self,
        body: &Body,
        limits: &[JointLimits],
        start: &Joints,
        place: &Point3<f64>,
    ) -> Option<Result<Joints, Blocked>> {
        let roll = |k: usize| TAU * k as f64 / ROLLS as f64;
        let mut joints: Vec<Joints> =
            (0..ROLLS).filter_map(|k| self.reach(body, limits, start, place, roll(k))).collect();
        // The shortest way first: it is the likeliest to be free.
        joints.sort_by(|a, b| apart(a, start).total_cmp(&apart(b, start)));
        let hidden = obstacle::on_sight(self.obstacles, place, &self.at, self.radius);
        let mut least: Option<Blocked> = None;
        for joints in joints {
            let stands = [SetPoint { q_d: joints, ..SetPoint::default() }];
            let in_way = match self.way(body, limits, start, &joints) {
                Err(NoWay::Outside) => continue,
                Err(NoWay::Blocked(blocked)) => Some(blocked),
                Ok(_) if hidden.is_some() => return hidden.map(|blocked| Err(self.outwards(blocked))),
                Ok(_) => obstacle::on_motion(self.obstacles, body, &stands, false),
            };
            let Some(in_way) = in_way else { return Some(Ok(joints)) };
            least =
                Some(least.map_or(in_way.clone(), |least| if in_way.lacks() < least.lacks() { in_way } else { least }));
        }
        least.map(|blocked| Err(self.outwards(blocked)))
    }

    /// The same with the remedy that moves the obstacle away from the point: away from the arm may be towards what is scanned.
    fn outwards(&self, blocked: Blocked) -> Blocked {
        let obstacle = self.obstacles.iter().find(|obstacle| obstacle.name() == blocked.name);
        let away = obstacle.map_or(blocked.away, |obstacle| obstacle.gap(&self.at, 0.0).1);
        Blocked { away, ..blocked }
    }

    /// Places spread evenly over the dome, along a spiral.
    fn places(&self, count: usize) -> impl Iterator<Item = Point3<f64>> + '_ {
        let [low, high] = ELEVATIONS.map(f64::sin);
        (0..count).map(move |k| {
            // Even steps in height are even steps in area on a sphere.
            let z = low + (high - low) * (k as f64 + 0.5) / count as f64;
            // The golden angle: no two turns of the spiral line up.
            let (sin, cos) = (k as f64 * TAU * 0.381_966_011_250_105).sin_cos();
            let level = (1.0 - z * z).sqrt();
            self.at + self.distance * Vector3::new(level * cos, level * sin, z)
        })
    }

    fn reach(
        &self,
        body: &Body,
        limits: &[JointLimits],
        start: &Joints,
        place: &Point3<f64>,
        roll: f64,
    ) -> Option<Joints> {
        let target = looking(place, &self.at, roll);
        let joints = body.model().reach(start, &self.flange_from_camera, &target, None)?;
        let inside =
            limits.iter().zip(&joints).all(|(l, q)| (l.q_min + JOINT_MARGIN..=l.q_max - JOINT_MARGIN).contains(q));
        (inside && self.is_free(body, &joints)).then_some(joints)
    }

    /// Whether flange, tool and camera are above the floor and away from the object.
    fn is_free(&self, body: &Body, q: &Joints) -> bool {
        let flange = body.model().flange(q).isometry();
        let camera = flange * Point3::from(self.flange_from_camera.translation.vector);
        let tool = body.model().tool_length();
        let away = [0.0, 0.5, 1.0].map(|share| (flange * Point3::new(0.0, 0.0, share * tool) - self.at).norm());
        let away = away.into_iter().fold((camera - self.at).norm(), f64::min);
        body.lowest_point(q) >= self.floor && camera.z >= self.floor && away >= MIN_DISTANCE_SHARE * self.distance
    }

    /// From rest to rest inside every limit, above the floor, away from the point and clear of other objects; a way that begins near
    /// one may leave it.
    ///
    /// # Errors
    /// [`NoWay`] where the straight way is none.
    pub fn way(&self, body: &Body, limits: &[JointLimits], from: &Joints, to: &Joints) -> Result<Vec<SetPoint>, NoWay> {
        let way = transit::plan(from, to, limits, 1.0).ok_or(NoWay::Outside)?;
        let free = way.iter().step_by(CHECKED_EVERY).chain(way.last()).all(|point| self.is_free(body, &point.q_d));
        if !free || first_excess(&way, limits, Some(body)).is_some() {
            return Err(NoWay::Outside);
        }
        match obstacle::on_motion(self.obstacles, body, &way, true) {
            None => Ok(way),
            Some(blocked) => Err(NoWay::Blocked(blocked)),
        }
    }
}

/// How far joints are from one another [rad].
pub fn apart(a: &Joints, b: &Joints) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::shipped;

    #[test]
    fn views_look_at_the_point_from_all_sides_that_the_arm_reaches() {
        let (body, limits) = shipped();
        let mount = Isometry3::new(Vector3::new(0.06, 0.0, 0.03), Vector3::new(0.0, 0.0, 1.57));
        let at = Point3::new(0.5, 0.0, 0.05);
        let dome = Dome { at, distance: 0.35, flange_from_camera: mount, floor: 0.05, radius: 0.12, obstacles: &[] };
        let start = *body.model().ready();
        let views = dome.views(&body, &limits, &start, 20).free;
        assert!(views.len() >= 12, "{} views", views.len());
        let mut headings = Vec::new();
        for q in &views {
            let camera = body.model().flange(q).isometry() * mount;
            let seen = camera.inverse() * at;
            assert!(seen.x.abs() < 1e-6 && seen.y.abs() < 1e-6 && (seen.z - 0.35).abs() < 1e-6, "{seen}");
            assert!(limits.iter().zip(q).all(|(limit, q)| limit.q_min < *q && *q < limit.q_max));
            assert!(body.lowest_point(q) >= 0.05);
            headings.push((camera.translation.y - at.y).atan2(camera.translation.x - at.x));
        }
        headings.sort_by(f64::total_cmp);
        assert!(headings[headings.len() - 1] - headings[0] > 2.0, "{headings:?}");
        let ways = views.windows(2).filter(|pair| dome.way(&body, &limits, &pair[0], &pair[1]).is_ok()).count();
        assert!(ways > 0, "no two of them are joined");
        // A point behind the base's back, and out of reach.
        let far = Dome { at: Point3::new(3.0, 0.0, 0.0), ..dome };
        assert_eq!(far.views(&body, &limits, &start, 5), Views::default());
    }

    #[test]
    fn a_way_leads_from_the_start_to_every_view_and_back() {
        let (body, limits) = shipped();
        let mount = Isometry3::new(Vector3::new(0.06, 0.0, 0.03), Vector3::new(0.0, 0.0, 1.57));
        let at = Point3::new(0.55, 0.0, 0.05);
        let dome = Dome { at, distance: 0.5, flange_from_camera: mount, floor: 0.05, radius: 0.12, obstacles: &[] };
        let start = *body.model().ready();
        let views = dome.views(&body, &limits, &start, 10).free;
        assert_eq!(views.len(), 10);
        for view in &views {
            let ways = [[&start, view], [view, &start]].map(|[from, to]| dome.way(&body, &limits, from, to));
            assert!(ways.iter().all(Result::is_ok), "{view:?}");
        }
    }

    /// An upright box of 10 by 10 cm.
    fn block(name: &str, [x, y]: [f64; 2], height: f64) -> Obstacle {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Point3::new(0.05 * sign(0), 0.05 * sign(1), 0.5 * height * sign(2))
        };
        let corners: Vec<_> = (0..8).map(corner).collect();
        Obstacle::at(name, &corners, &Isometry3::translation(x, y, 0.5 * height))
    }

    #[test]
    fn a_box_on_the_way_takes_the_views_and_ways_that_would_touch_it_and_no_others() {
        let (body, limits) = shipped();
        let mount = Isometry3::new(Vector3::new(0.06, 0.0, 0.03), Vector3::new(0.0, 0.0, 1.57));
        let body = body.with_camera(mount);
        let (at, start) = (Point3::new(0.5, 0.0, 0.05), *body.model().ready());
        let bare = Dome { at, distance: 0.35, flange_from_camera: mount, floor: 0.05, radius: 0.12, obstacles: &[] };
        let before = bare.views(&body, &limits, &start, 20);
        let tall = [block("tall", [0.5, 0.28], 0.45)];
        let dome = Dome { obstacles: &tall, ..bare };
        let ways = |dome: &Dome<'_>, to: &[Joints]| -> Vec<Vec<SetPoint>> {
            to.iter().filter_map(|view| dome.way(&body, &limits, &start, view).ok()).collect()
        };
        let touches = |way: &Vec<SetPoint>| obstacle::on_motion(&tall, &body, way, false).is_some();
        assert!(ways(&bare, &before.free).iter().any(touches), "nothing was in the way before");
        let views = dome.views(&body, &limits, &start, 20);
        assert!(!views.free.is_empty() && !views.blocked.is_empty(), "{views:?}");
        assert_eq!(views.free.len() + views.blocked.len(), before.free.len());
        let free = ways(&dome, &views.free);
        assert!(free.len() == views.free.len() && !free.iter().any(touches));
        let said = views.blocked[0].to_string();
        assert!(said.contains("`tall`") && said.contains("move `tall` away by about"), "{said}");
        assert!(views.blocked.iter().all(|blocked| blocked.away.y > 0.9), "towards what is scanned: {views:?}");
        // Beside the dome it is in nobody's way.
        let far = Dome { obstacles: &[block("far", [0.5, 0.9], 0.45)], ..bare };
        assert_eq!(far.views(&body, &limits, &start, 20), before);
    }

    #[test]
    fn what_stands_before_the_point_hides_it_and_what_stands_behind_or_within_the_radius_does_not() {
        let (camera, at) = (Point3::new(0.9, 0.0, 0.15), Point3::new(0.5, 0.0, 0.05));
        let hidden = |place: [f64; 2], radius: f64| {
            obstacle::on_sight(&[block("cup", place, 0.12)], &camera, &at, radius).map(|blocked| blocked.to_string())
        };
        let before = hidden([0.72, 0.0], 0.1).expect("hidden");
        assert!(before.starts_with("the camera's sight would run into `cup`; move `cup` away by"), "{before}");
        assert_eq!(hidden([0.3, 0.0], 0.1), None);
        assert_eq!(hidden([0.72, 0.2], 0.1), None);
        assert_eq!(hidden([0.62, 0.0], 0.1), None, "a part of what is looked at");
    }
}
