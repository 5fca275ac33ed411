//! Where objects stand when the simulated cell starts: where their blocks say, else each 5 cm beside the one before it. Base frame.

use super::bodies::{CellBody, poses_in_root, start_of};
use crate::arm::UrdfJoint;
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Cell, Object};

/// Between objects that have no `start` of their own [m].
const BESIDE: f64 = 0.05;

/// Pose of each object of a cell whose table has the height `table` [m]; of one that moves in itself that of its root.
pub fn starts(cell: &Cell, bodies: &[CellBody], table: f64) -> Vec<Isometry3<f64>> {
    let mut before: Option<([f64; 2], f64)> = None;
    let start = |(number, object): (usize, &Object)| {
        let (low, around) = extent(object, number, bodies);
        let beside = match before {
            None => cell.simulation.object_position,
            Some(([x, y], reach)) => [x, y + reach + BESIDE + around],
        };
        let [x, y] = object.start.unwrap_or(beside);
        before = Some(([x, y], around));
        let own_yaw = if number == 0 { cell.simulation.object_yaw } else { 0.0 };
        Isometry3::new(Vector3::new(x, y, table - low), Vector3::z() * object.start_yaw.unwrap_or(own_yaw))
    };
    cell.objects.iter().enumerate().map(start).collect()
}

/// Lowest point of an object under its origin, negative, and how far it reaches from there to the sides [m].
fn extent(object: &Object, number: usize, bodies: &[CellBody]) -> (f64, f64) {
    let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
    let (mut low, mut around) = (0.0_f64, 0.0_f64);
    for (body, pose) in own.iter().zip(poses_in_root(&own, |link| start_of(object, link))) {
        for point in body.surface().triangles().0 {
            let place = pose * point;
            low = low.min(place.z);
            around = around.max(place.x.hypot(place.y));
        }
    }
    (low, around)
}

/// Pose of each body at the start, in the order of `bodies`.
pub fn body_starts(cell: &Cell, bodies: &[CellBody], table: f64) -> Vec<Isometry3<f64>> {
    let mut poses = Vec::with_capacity(bodies.len());
    for (number, (object, start)) in cell.objects.iter().zip(starts(cell, bodies, table)).enumerate() {
        let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
        let in_root = poses_in_root(&own, |link| start_of(object, link));
        poses.extend(in_root.into_iter().map(|pose| start * pose));
    }
    poses
}

/// Where a joint is whose parent and link have these poses [rad or m].
pub fn joint_position(joint: &UrdfJoint, parent: &Isometry3<f64>, link: &Isometry3<f64>) -> f64 {
    let moved = (parent * joint.at).inv_mul(link);
    if joint.slides { joint.axis.dot(&moved.translation.vector) } else { joint.axis.dot(&moved.rotation.scaled_axis()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Unit, UnitQuaternion};

    #[test]
    fn a_joint_is_where_its_link_stands() {
        let axis = Unit::new_normalize(Vector3::new(0.0, 0.6, 0.8));
        let at = Isometry3::new(Vector3::new(0.1, 0.0, 0.04), Vector3::new(0.2, 0.1, 0.0));
        let (name, limits) = ("hinge".to_owned(), [-1.0, 1.0]);
        let joint = UrdfJoint { name, parent: 0, at, slides: false, axis, limits, friction: 0.0, damping: 0.0 };
        let parent = Isometry3::new(Vector3::new(0.5, -0.1, 0.0), Vector3::z());
        let turned = parent * at * UnitQuaternion::from_axis_angle(&axis, -0.7);
        assert!((joint_position(&joint, &parent, &turned) + 0.7).abs() < 1e-12);
        let slid = parent * at * Translation3::from(axis.into_inner() * 0.12);
        assert!((joint_position(&UrdfJoint { slides: true, ..joint }, &parent, &slid) - 0.12).abs() < 1e-12);
    }
}
