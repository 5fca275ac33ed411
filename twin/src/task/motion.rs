//! Where moved bodies go and what drives do, by time: a scripted demonstration of a task.

use crate::world::{STEP, World};
use nalgebra::{Isometry3, Translation3, Vector3};

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

    /// What there is to do in a step, by its number; `starts` are the poses at the beginning of the first.
    pub(super) fn act(&self, world: &mut World, starts: &[Isometry3<f64>], step: usize) {
        let (time, end) = (step as f64 * STEP, (step + 1) as f64 * STEP);
        for order in self.orders.iter().filter(|order| (order.time / STEP).round() as usize == step) {
            world.drive(order.body, order.target, order.force);
        }
        for (i, next) in self.waypoints.iter().enumerate().filter(|(_, next)| next.time > time) {
            let before = self.waypoints[..i].iter().rfind(|other| other.body == next.body);
            let (since, from) = before.map_or((0.0, starts[next.body]), |other| (other.time, other.pose));
            if since > time {
                continue;
            }
            // From rest to rest with the least jerk.
            let share = ((end - since) / (next.time - since)).min(1.0);
            let eased = share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
            world.move_to(next.body, &from.lerp_slerp(&next.pose, eased));
        }
    }
}
