//! The joint and the part as a person, or a network, has marked them in pictures of one state: where the part is seen, and two places of
//! its axis.

use super::body::Body;
use super::label::{self, Evidence};
use super::{Articulated, ArticulatedError, Joint, Moves, READ, SPLIT, STAGES, State};
use crate::mesh::{Mesh, Topology};
use crate::scan::Camera;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use shared_mem::progress::Progress;

/// Weight of what one picture shows of a place.
const OF_ONE: f64 = 2.0;
/// A surface is looked at from the side below this cosine, where masks are not exact.
const SIDEWAYS: f64 = 0.2;
/// A place is seen if nothing is before it by so many voxels.
const BEFORE: f64 = 3.0;
/// Steps of a ray, and the distance at which it has met the surface [voxel].
const RAY_STEPS: usize = 200;
const MET: f64 = 0.1;
/// Least distance of the two marks [m].
const MIN_MARK_DISTANCE: f64 = 5e-3;

/// A picture in which the part is marked.
#[derive(Debug, Clone)]
pub struct MarkedView {
    /// What it is called.
    pub name: String,
    pub camera: Camera,
    /// The camera's pose in the mesh's frame [m].
    pub mesh_from_camera: Isometry3<f64>,
    /// Whether a pixel shows the part, row by row.
    pub part: Vec<bool>,
    /// Two places of the axis, from the first to the second [pixel].
    pub axis: Option<[[f64; 2]; 2]>,
}

/// An object with marks: the part, its axis, whether it turns about it or slides along it, and the joint's limits [rad or m], of which 0 is
/// the state of the mesh.
///
/// # Errors
/// [`ArticulatedError`] in one line.
pub fn marked(
    mesh: Mesh,
    views: &[MarkedView],
    turns: bool,
    limits: [f64; 2],
) -> Result<Articulated, ArticulatedError> {
    let bar = Progress::planned("articulated", &STAGES, 1);
    Topology::of(&mesh)?;
    let body = Body::of(mesh);
    bar.show(1, READ);
    let (view, axis) = views
        .iter()
        .find_map(|view| Some((view, view.axis?)))
        .ok_or_else(|| ArticulatedError::Marks("no picture has an axis; give one of them `axis`, two pixels".into()))?;
    let lifted = |pixel: [f64; 2]| {
        view.met(&body, pixel).ok_or_else(|| {
            let [x, y] = pixel;
            ArticulatedError::Marks(format!(
                "{}: the object is not at pixel ({x}, {y}); mark the axis where the object is seen",
                view.name
            ))
        })
    };
    let [from, to] = [lifted(axis[0])?, lifted(axis[1])?];
    let direction = Unit::try_new(to - from, MIN_MARK_DISTANCE).ok_or_else(|| {
        ArticulatedError::Marks(format!("{}: the two pixels of the axis show one place; mark them apart", view.name))
    })?;
    let joint = if turns {
        Joint::Revolute { point: from, axis: direction, angle: limits[1] }
    } else {
        Joint::Prismatic { travel: direction.into_inner() * limits[1] }
    };
    bar.stage(SPLIT, 4);
    let border = label::border(&body, None, |place, normal| {
        let shown: f64 = views.iter().filter_map(|view| view.shows(&body, place, normal)).sum();
        Evidence { part: if shown > 0.0 { 1.0 } else { 0.0 }, weight: shown.abs().min(2.0 * OF_ONE) }
    });
    let states = vec![State::of(&body.mesh, &border, &Isometry3::identity())];
    Articulated::of(&body, border, Moves { joint, limits, position: 0.0, certainty: None }, states, &bar)
}

impl MarkedView {
    /// Whether the picture shows a place as the part (positive) or as the base (negative); `None` where it does not show it.
    fn shows(&self, body: &Body, place: &Point3<f64>, normal: &Vector3<f64>) -> Option<f64> {
        let eye = Point3::from(self.mesh_from_camera.translation.vector);
        let away = place - eye;
        if normal.dot(&away) > -SIDEWAYS * away.norm() {
            return None;
        }
        let [u, v] = self.camera.project(&self.mesh_from_camera.inverse_transform_point(place))?;
        if u < 0.0 || v < 0.0 || u >= f64::from(self.camera.width) || v >= f64::from(self.camera.height) {
            return None;
        }
        let met = ray(body, &eye, &Unit::new_normalize(away))?;
        if (met - eye).norm() < away.norm() - BEFORE * body.field.grid.voxel {
            return None;
        }
        let is_part = self.part[v as usize * self.camera.width as usize + u as usize];
        Some(if is_part { OF_ONE } else { -OF_ONE })
    }

    /// The place of the surface that a pixel shows.
    fn met(&self, body: &Body, pixel: [f64; 2]) -> Option<Point3<f64>> {
        let [x, y] = self.camera.direction(pixel);
        let way = self.mesh_from_camera * Vector3::new(x, y, 1.0);
        ray(body, &self.mesh_from_camera.translation.vector.into(), &Unit::new_normalize(way))
    }
}

/// Where a ray meets the surface, by steps as long as the distance allows (sphere tracing, Hart 1996).
fn ray(body: &Body, eye: &Point3<f64>, way: &Unit<Vector3<f64>>) -> Option<Point3<f64>> {
    let field = &body.field;
    let mut along = entry(body, eye, way)?;
    for _ in 0..RAY_STEPS {
        let place = eye + way.into_inner() * along;
        let distance = field.distance_at(&place)?;
        if distance < MET * field.grid.voxel {
            return Some(place);
        }
        along += distance;
    }
    None
}

/// Where a ray enters the field's box [m along the ray].
fn entry(body: &Body, eye: &Point3<f64>, way: &Unit<Vector3<f64>>) -> Option<f64> {
    let grid = &body.field.grid;
    let last = grid.position(grid.dims.map(|n| n - 1));
    let (mut from, mut to) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        // The box, a thousandth of a voxel smaller, so that rounding leaves the place inside.
        let rim = 1e-3 * grid.voxel;
        let (low, high) = (grid.origin[axis] + rim, last[axis] - rim);
        if way[axis].abs() < 1e-12 {
            if eye[axis] < low || eye[axis] > high {
                return None;
            }
            continue;
        }
        let ends = [(low - eye[axis]) / way[axis], (high - eye[axis]) / way[axis]];
        (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
    }
    (from < to).then_some(from)
}
