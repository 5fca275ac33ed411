//! Boxes seen by cameras around them.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use splat::{Camera, Distortion, Lens};

/// A box: its frame, and half its edges [m].
#[derive(Clone, Copy)]
pub(crate) struct Solid {
    pub(crate) pose: Isometry3<f64>,
    pub(crate) half: [f64; 3],
}

pub(crate) const SIZE: [usize; 2] = [96, 72];
pub(crate) const LENS: Lens = Lens { focal: [95.0; 2], centre: [47.5, 35.5], distortion: Distortion::NONE };

/// Cameras above and around a point, all looking there.
pub(crate) fn cameras(count: usize, far: f64) -> Vec<Camera> {
    (0..count)
        .map(|i| {
            let (around, up) = (i as f64 * 2.399_963_229_728_653, 0.15 + 0.75 * (i as f64 + 0.5) / count as f64);
            let level = (1.0 - up * up).sqrt();
            let eye = Point3::from(Vector3::new(level * around.cos(), level * around.sin(), up) * far);
            let flip = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
            let camera_from_world = flip * Isometry3::look_at_rh(&eye, &Point3::origin(), &-Vector3::z());
            Camera { lens: LENS, camera_from_world }
        })
        .collect()
}

/// Where a ray meets a box first: how far, and the outward normal.
fn meets(solid: &Solid, from: &Point3<f64>, way: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
    let (from, way) = (solid.pose.inverse() * from, solid.pose.rotation.inverse() * way);
    let (mut near, mut far, mut face) = (0.0, f64::INFINITY, None);
    for i in 0..3 {
        let ends = [-solid.half[i], solid.half[i]].map(|end| (end - from[i]) / way[i]);
        let (enters, leaves) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        if enters > near {
            (near, face) = (enters, Some((i, -way[i].signum())));
        }
        far = f64::min(far, leaves);
    }
    let (axis, sign) = face.filter(|_| near < far)?;
    let mut normal = Vector3::zeros();
    normal[axis] = sign;
    Some((near, solid.pose.rotation * normal))
}

/// What a pixel sees: depth, point, normal, and the number of the box.
type Seen = Option<(f64, Point3<f64>, Vector3<f64>, usize)>;

pub(crate) fn seen(solids: &[Solid], camera: &Camera) -> Vec<Seen> {
    let world_from_camera = camera.camera_from_world.inverse();
    let from = Point3::from(world_from_camera.translation.vector);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let way = world_from_camera.rotation * camera.lens.ray([(i % SIZE[0]) as f64, (i / SIZE[0]) as f64]);
            let hits = solids.iter().enumerate().filter_map(|(n, solid)| Some((meets(solid, &from, &way)?, n)));
            let ((depth, normal), number) = hits.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
            Some((depth, from + way * depth, normal, number))
        })
        .collect()
}

pub(crate) fn solid(middle: [f64; 3], edges: [f64; 3]) -> Solid {
    let pose = Translation3::from(Vector3::from(middle)).into();
    Solid { pose, half: edges.map(|edge| edge / 2.0) }
}

/// A cell's corner: a table, and things on it.
pub(crate) fn table() -> Vec<Solid> {
    let turned = Isometry3::from_parts(
        Translation3::new(0.12, -0.05, 0.06),
        Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5).into(),
    );
    vec![
        solid([0.0, 0.0, -0.02], [1.2, 1.0, 0.04]),
        Solid { pose: turned, half: [0.05, 0.08, 0.06] },
        solid([-0.15, 0.1, 0.05], [0.1, 0.1, 0.1]),
    ]
}
