//! Where moved bodies go and what drives do, by time: a scripted demonstration of a task.

use crate::world::{STEP, World};
use nalgebra::{Isometry3, Translation3, Vector3};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

/// A pose that a moved body reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Waypoint {
    pub(super) body: usize,
    pub(super) time: f64,
    pub(super) pose: Isometry3<f64>,
    /// In the frame in which this body starts: its origin, turned by the yaw that was drawn for it.
    pub(super) relative_to: Option<usize>,
}

/// A drive's order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Order {
    pub(super) body: usize,
    pub(super) time: f64,
    pub(super) target: f64,
    pub(super) force: f64,
}

/// All of them, each list by time.
#[derive(Debug, Clone, Default)]
pub(super) struct Motions {
    pub(super) waypoints: Vec<Waypoint>,
    pub(super) orders: Vec<Order>,
}

impl Motions {
    /// In the world, now that it is known where the bodies start: `yaws` were drawn for them.
    pub(super) fn placed(&self, world: &World, yaws: &[f64]) -> Self {
        let mut placed = self.clone();
        for waypoint in &mut placed.waypoints {
            if let Some(body) = waypoint.relative_to {
                let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaws[body]);
                let frame = Isometry3::from_parts(Translation3::from(world.pose(body).translation.vector), turn);
                (waypoint.pose, waypoint.relative_to) = (frame * waypoint.pose, None);
            }
        }
        placed
    }

    /// The same with way points that lie off by normal deviates of one sigma `noise` along each axis [m]; where a body waits,
    /// it waits in one place.
    pub(super) fn off_by(mut self, noise: f64, generator: &mut Pcg64) -> Self {
        let nominal: Vec<Waypoint> = self.waypoints.clone();
        for i in 0..nominal.len() {
            let waits_at = (0..i).rfind(|other| nominal[*other].body == nominal[i].body);
            let waits_at = waits_at.filter(|other| nominal[*other].pose == nominal[i].pose);
            self.waypoints[i].pose.translation = match waits_at {
                Some(other) => self.waypoints[other].pose.translation,
                None => {
                    let off = Vector3::from_fn(|_, _| StandardNormal.sample(generator));
                    Translation3::from(nominal[i].pose.translation.vector + noise * off)
                }
            };
        }
        self
    }

    /// What there is to do in a step, by its number; `starts` are the poses at the beginning of the first.
    pub(super) fn act(&self, world: &mut World, starts: &[Isometry3<f64>], step: usize) {
        for order in self.orders.iter().filter(|order| (order.time / STEP).round() as usize == step) {
            world.drive(order.body, order.target, order.force);
        }
        for (body, start) in starts.iter().enumerate() {
            if let Some((goal, true)) = self.goal(body, start, step) {
                world.move_to(body, &goal);
            }
        }
    }

    /// Where a moved body is commanded to be at the end of a step, by its number, and whether it is on its way there; `start` is
    /// its pose at the beginning of the first. `None`: nothing moves it up to then.
    pub(super) fn goal(&self, body: usize, start: &Isometry3<f64>, step: usize) -> Option<(Isometry3<f64>, bool)> {
        let (time, end) = (step as f64 * STEP, (step + 1) as f64 * STEP);
        let mut before = None;
        for next in self.waypoints.iter().filter(|next| next.body == body) {
            if next.time > time {
                let (since, from) = before.map_or((0.0, *start), |other: &Waypoint| (other.time, other.pose));
                // From rest to rest with the least jerk.
                let share = ((end - since) / (next.time - since)).min(1.0);
                let eased = share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
                return Some((from.lerp_slerp(&next.pose, eased), true));
            }
            before = Some(next);
        }
        before.map(|last| (last.pose, false))
    }
}
