//! Where the object was and how it moved when a clip began, from noisy poses. Base frame, SI.

use super::first_motion::first_motion;
use super::on_table::{Buried, Depth};
use crate::rollout::ObjectState;
use crate::scene::ObjectModel;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::ObjectSeries;

/// Noise of the tracker where cell.toml does not tell it, one sigma [m].
const POSITION_NOISE: f64 = 1e-3;
/// An object has begun to move when it is this many sigmas away: 1 of 100 000 resting poses is.
const MOVED_SIGMAS: f64 = 5.0;
/// Poses before that one which may show the first of the motion already: at 0.2 m/s it takes two of 60 Hz to be noticed.
const SLOW_START: usize = 2;
/// A face that looks down within this angle [rad] is what a resting object stands on.
const UPRIGHT: f64 = 0.1;
/// Below this clearance the table may have touched the object already [m].
const CLEARANCE: f64 = 3e-3;

/// Mean of the poses before the object first moves, set down flat on the table. `None` without poses.
pub fn resting(series: &ObjectSeries, object: &ObjectModel, cell: &Cell) -> Option<Pose<Base, Object>> {
    let mut pose = upright(series, cell)?;
    if let Some(table) = cell.table {
        pose.translation.z += Depth::of(&object.shape, &pose, &table).lowest;
    }
    Some(Pose::from_isometry(pose))
}

/// What there is to tell about where the poses of a clip put the object at its start; nothing without poses or a table.
///
/// # Errors
/// [`Buried`] when it cannot have been there.
pub fn remark(
    series: &ObjectSeries,
    kind: ClipKind,
    object: &ObjectModel,
    cell: &Cell,
) -> Result<Option<String>, Buried> {
    let first = match kind {
        ClipKind::FreeMotion => series.poses.first().map(Pose::isometry),
        ClipKind::ControlHitSlide | ClipKind::Excitation => upright(series, cell),
    };
    let Some((pose, table)) = first.zip(cell.table) else { return Ok(None) };
    let depth = Depth::of(&object.shape, &pose, &table);
    // What somebody lets go may begin anywhere above.
    let stands = kind != ClipKind::FreeMotion || depth.is_inside();
    if stands { depth.set_onto() } else { Ok(None) }
}

/// Mean of the poses before the object first moves, upright where there is a table.
fn upright(series: &ObjectSeries, cell: &Cell) -> Option<Isometry3<f64>> {
    let noise = cell.object().and_then(|o| o.pose_noise).map_or(POSITION_NOISE, |n| n.position);
    let mean = mean_pose(&series.poses[..still(series, noise)])?;
    let rotation = if cell.table.is_some() { set_upright(&mean.rotation) } else { mean.rotation };
    Some(Isometry3::from_parts(mean.translation, rotation))
}

/// Number of poses, at least one, until the object first leaves the mean of those before.
fn still(series: &ObjectSeries, noise: f64) -> usize {
    let place = |pose: &Pose<Base, Object>| Vector3::from(pose.position());
    let mut sum = Vector3::zeros();
    for (n, pose) in series.poses.iter().enumerate() {
        if n > 0 && (place(pose) - sum / n as f64).norm() > MOVED_SIGMAS * noise * 3.0_f64.sqrt() {
            return n.saturating_sub(SLOW_START).max(1);
        }
        sum += place(pose);
    }
    series.poses.len()
}

fn mean_pose(poses: &[Pose<Base, Object>]) -> Option<Isometry3<f64>> {
    let first = poses.first()?.isometry().rotation;
    let (mut place, mut turn) = (Vector3::zeros(), Quaternion::new(0.0, 0.0, 0.0, 0.0));
    for pose in poses.iter().map(Pose::isometry) {
        place += pose.translation.vector / poses.len() as f64;
        // A quaternion and its negative are one rotation; near each other their mean is the mean rotation.
        let sign = if first.coords.dot(&pose.rotation.coords) < 0.0 { -1.0 } else { 1.0 };
        turn += pose.rotation.into_inner() * sign;
    }
    Some(Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_quaternion(turn)))
}

/// Turns the object by the small angle that makes the axis nearest to the vertical exactly vertical.
fn set_upright(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rotation * axis);
    let [x, y, z] = axes;
    let axis = [y, z].into_iter().fold(x, |best, axis| if axis.z.abs() > best.z.abs() { axis } else { best });
    let vertical = Vector3::z() * axis.z.signum();
    match UnitQuaternion::rotation_between(&axis, &vertical) {
        Some(small) if small.angle() < UPRIGHT => small * rotation,
        _ => *rotation,
    }
}

/// Pose and velocities at the first pose, from the first poses of its motion (`first_motion`); one that begins inside
/// the table begins on it. `None` with fewer than three poses.
pub fn moving(series: &ObjectSeries, object: &ObjectModel, cell: &Cell) -> Option<ObjectState> {
    let depth = |pose: &Isometry3<f64>| cell.table.map(|table| Depth::of(&object.shape, pose, &table));
    let gap = |pose: &Pose<Base, Object>| depth(&pose.isometry()).map_or(f64::INFINITY, |depth| -depth.lowest);
    // An object that comes so near that it meets the table before the next pose is not looked at any further: it may be above
    // the table again by then.
    let mut meets = false;
    let mut before = f64::INFINITY;
    let flying = series.poses.iter().map(gap).take_while(|gap| {
        let flies = *gap > CLEARANCE && !meets;
        (meets, before) = (2.0 * gap < before && before.is_finite(), *gap);
        flies
    });
    let mut state = first_motion(series, flying.count(), object)?;
    let mut pose = state.pose.isometry();
    if let Some(depth) = depth(&pose).filter(Depth::is_inside) {
        pose.translation.z += depth.lowest;
    }
    state.pose = Pose::from_isometry(pose);
    Some(state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ObjectShape;
    use shared_mem::cell::Table;

    fn box_on_table() -> (ObjectModel, Cell) {
        let shape = ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) };
        let object = ObjectModel {
            shape,
            mass: 0.3,
            centre_of_mass: Vector3::zeros(),
            friction: 0.3,
            tip_friction: 0.2,
            restitution: 0.0,
            support: shared_mem::cell::Support::Corners,
        };
        (object, Cell { table: Some(Table { height: 0.1 }), ..Cell::default() })
    }

    fn series(poses: impl Iterator<Item = Isometry3<f64>>) -> ObjectSeries {
        let poses: Vec<_> = poses.map(Pose::from_isometry).collect();
        ObjectSeries { stamps_ns: (0..poses.len() as u64).map(|i| 5 + i * 10_000_000).collect(), poses }
    }

    #[test]
    fn a_resting_object_stands_flat_on_the_table_where_the_poses_before_its_motion_put_it() {
        let (object, cell) = box_on_table();
        let noise = |i: usize| 1e-3 * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let poses = (0..40).map(|i| {
            let gone = if i < 20 { 0.0 } else { 0.02 * (i - 19) as f64 };
            let turn = UnitQuaternion::from_euler_angles(5.0 * noise(i), 0.0, 0.4);
            Isometry3::from_parts(Translation3::new(0.5 + gone + noise(i), 0.0, 0.15 + noise(i)), turn)
        });
        let start = resting(&series(poses), &object, &cell).expect("poses").isometry();
        assert!((start.translation.vector - Vector3::new(0.5, 0.0, 0.15)).norm() < 1e-6, "{start}");
        assert!(start.rotation.angle_to(&UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4)) < 1e-6);
    }

    #[test]
    fn an_object_inside_the_table_begins_on_it_and_that_is_said() {
        let (object, cell) = box_on_table();
        let sunk = series((0..20).map(|_| Isometry3::translation(0.5, 0.0, 0.13)));
        for kind in [ClipKind::ControlHitSlide, ClipKind::FreeMotion] {
            let said = remark(&sunk, kind, &object, &cell).expect("not buried").expect("a remark");
            assert!(said.contains("20 mm into the table"), "{said}");
        }
        let starts = [resting(&sunk, &object, &cell), moving(&sunk, &object, &cell).map(|state| state.pose)];
        for start in starts.map(|start| start.expect("poses")) {
            assert!((start.position()[2] - 0.15).abs() < 1e-9, "{start:?}");
        }
        let dropped = series((0..20).map(|_| Isometry3::translation(0.5, 0.0, 0.4)));
        assert_eq!(remark(&dropped, ClipKind::FreeMotion, &object, &cell), Ok(None));
        let buried = series((0..20).map(|_| Isometry3::translation(0.5, 0.0, 0.05)));
        assert!(remark(&buried, ClipKind::ControlHitSlide, &object, &cell).is_err());
    }

    #[test]
    fn two_poses_are_no_motion() {
        let (object, cell) = box_on_table();
        assert_eq!(moving(&series((0..2).map(|_| Isometry3::translation(0.0, 0.0, 1.0))), &object, &cell), None);
    }
}
