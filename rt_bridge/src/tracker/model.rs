//! The object as the tracker knows it: a surface to draw, corners to stand on, and the turns under which it looks the
//! same. Object frame, metres.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use twin::render::Mesh;
use twin::scene::ObjectShape;

/// Edges that differ by less count as equal [m]: a depth camera at a metre cannot tell them apart.
const EQUAL_EDGES: f64 = 0.002;
/// Corners that are asked whether they touch the table, at most.
const CORNERS: usize = 64;
/// Corners of a mesh that are compared to find its symmetries, at most.
const COMPARED: usize = 400;

/// What is tracked.
#[derive(Debug, Clone)]
pub struct Model {
    pub(super) mesh: Mesh,
    /// The outermost points.
    pub(super) corners: Vec<Vector3<f64>>,
    /// Radius around the geometric centre that holds everything.
    pub(super) radius: f64,
    /// Mean of half the edges of its bounding box: within so much of its centre there is nothing else [m].
    pub(super) own_radius: f64,
    /// Turns of the object, in its own frame, that change nothing an eye could see. The first is none at all.
    symmetries: Vec<UnitQuaternion<f64>>,
    /// The axis of a body of revolution: the turn about it cannot be seen.
    pub(super) spins_about: Option<Vector3<f64>>,
    /// Ways to stand on the table: which direction of the object points up, and after what turn about the vertical it
    /// looks the same again [rad].
    pub(super) stances: Vec<Stance>,
}

/// One way to stand on the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stance {
    /// From the object's frame to one whose z axis points up.
    pub(super) upright: UnitQuaternion<f64>,
    /// After this turn about the vertical it looks the same [rad].
    pub(super) period: f64,
}

impl Model {
    /// Of a box or a mesh. A mesh is taken to stand with one of its own axes upright.
    pub fn new(shape: &ObjectShape) -> Self {
        let (points, triangles) = shape.triangles();
        let symmetries: Vec<_> = turns_of_a_cube().filter(|turn| looks_the_same(shape, turn)).collect();
        let corners = outermost(&points);
        let mut model = Self {
            radius: shape.bounding_radius(),
            own_radius: shape.half_extents().mean(),
            mesh: Mesh::new((points, triangles), [255; 3]),
            corners,
            symmetries,
            spins_about: axis_of_revolution(shape),
            stances: Vec::new(),
        };
        model.stances = model.ways_to_stand();
        model
    }

    /// The turns about the vertical that leave the object as it is in `pose` looking the same, the first 0 [rad].
    pub fn equivalent_yaws(&self, pose: &Isometry3<f64>) -> Vec<f64> {
        let mut yaws: Vec<f64> = self
            .symmetries
            .iter()
            .filter_map(|symmetry| {
                let turn = pose.rotation * symmetry * pose.rotation.inverse();
                let [x, y, z, w] = [turn.i, turn.j, turn.k, turn.w];
                (x.hypot(y) < 0.1).then(|| (2.0 * z.atan2(w)).rem_euclid(std::f64::consts::TAU))
            })
            .map(|yaw| if std::f64::consts::TAU - yaw < 1e-6 { 0.0 } else { yaw })
            .collect();
        yaws.sort_by(f64::total_cmp);
        yaws
    }

    /// Of all poses that look the same as `pose`, the one turned least from `reference`.
    pub fn nearest(&self, pose: &Isometry3<f64>, reference: &UnitQuaternion<f64>) -> Isometry3<f64> {
        let turned = self.symmetries.iter().map(|s| pose.rotation * s);
        let rotation = turned.min_by(|a, b| a.angle_to(reference).total_cmp(&b.angle_to(reference)));
        Isometry3::from_parts(pose.translation, rotation.unwrap_or(pose.rotation))
    }

    /// How far below its geometric centre the object reaches when turned so [m].
    pub(super) fn depth_below_centre(&self, rotation: &UnitQuaternion<f64>) -> f64 {
        self.corners.iter().map(|corner| -(rotation * corner).z).fold(0.0, f64::max)
    }

    fn ways_to_stand(&self) -> Vec<Stance> {
        let axes = [Vector3::z(), Vector3::y(), Vector3::x(), -Vector3::z(), -Vector3::y(), -Vector3::x()];
        let mut kept: Vec<Vector3<f64>> = Vec::new();
        for up in axes {
            let known = |other: &Vector3<f64>| self.symmetries.iter().any(|s| (s * up - other).norm() < 1e-6);
            if !kept.iter().any(known) {
                kept.push(up);
            }
        }
        kept.into_iter()
            .map(|up| {
                let fixed = self.symmetries.iter().filter(|s| (*s * up - up).norm() < 1e-6).count();
                let upright = UnitQuaternion::rotation_between(&up, &Vector3::z())
                    .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
                Stance { upright, period: std::f64::consts::TAU / fixed.max(1) as f64 }
            })
            .collect()
    }
}

/// The 24 turns that bring a cube onto itself, the identity first.
fn turns_of_a_cube() -> impl Iterator<Item = UnitQuaternion<f64>> {
    let axes = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
    let pairs = axes.into_iter().flat_map(move |x| axes.into_iter().map(move |y| (x, y)));
    pairs.filter(|(x, y)| x.dot(y) == 0.0).map(|(x, y)| {
        let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
    })
}

fn looks_the_same(shape: &ObjectShape, turn: &UnitQuaternion<f64>) -> bool {
    match shape {
        ObjectShape::Box { half_extents } => ((turn * half_extents).abs() - half_extents).amax() < EQUAL_EDGES / 2.0,
        ObjectShape::Mesh { points, .. } => {
            let every = points.len().div_ceil(COMPARED);
            points.iter().step_by(every).all(|p| {
                let turned = turn * p;
                points.iter().any(|other| (other - turned).norm_squared() < EQUAL_EDGES * EQUAL_EDGES)
            })
        }
    }
}

/// The coordinate axis about which a mesh is round: wherever it has a corner, it has others as high and as far out all
/// around.
fn axis_of_revolution(shape: &ObjectShape) -> Option<Vector3<f64>> {
    const SECTORS: usize = 12;
    let ObjectShape::Mesh { points, .. } = shape else { return None };
    (0..3)
        .find(|axis| {
            let place = |p: &Point3<f64>| {
                let (x, y) = (p[(axis + 1) % 3], p[(axis + 2) % 3]);
                (p[*axis], x.hypot(y), y.atan2(x))
            };
            let every = points.len().div_ceil(COMPARED);
            points.iter().step_by(every).all(|p| {
                let (height, out, _) = place(p);
                let mut met = [out < EQUAL_EDGES; SECTORS];
                for (other_height, other_out, angle) in points.iter().map(place) {
                    if (other_height - height).abs() < EQUAL_EDGES && (other_out - out).abs() < EQUAL_EDGES {
                        let turn = (angle / std::f64::consts::TAU).rem_euclid(1.0);
                        met[((turn * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
                    }
                }
                met.iter().all(|met| *met)
            })
        })
        .map(|axis| Vector3::ith(axis, 1.0))
}

/// Those points that lie farthest in one of many directions.
fn outermost(points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    if points.len() <= CORNERS {
        return points.iter().map(|p| p.coords).collect();
    }
    let mut kept: Vec<usize> = (0..CORNERS)
        .filter_map(|i| {
            // Directions spread evenly over the sphere along a golden spiral.
            let height = 1.0 - (2 * i + 1) as f64 / CORNERS as f64;
            let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let direction = Vector3::new(across * cos, across * sin, height);
            let farthest = points
                .iter()
                .enumerate()
                .max_by(|(_, a), (_, b)| direction.dot(&a.coords).total_cmp(&direction.dot(&b.coords)));
            farthest.map(|(index, _)| index)
        })
        .collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|index| points[index].coords).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(size: [f64; 3]) -> Model {
        Model::new(&ObjectShape::Box { half_extents: Vector3::from(size) * 0.5 })
    }

    #[test]
    fn a_box_looks_the_same_after_as_many_turns_as_its_edges_allow() {
        let count = |size| boxed(size).symmetries.len();
        assert_eq!([count([0.08, 0.06, 0.10]), count([0.06, 0.06, 0.10]), count([0.05; 3])], [4, 8, 24]);
        let stances = |size| boxed(size).stances.len();
        assert_eq!([stances([0.08, 0.06, 0.10]), stances([0.06, 0.06, 0.10]), stances([0.05; 3])], [3, 2, 1]);
        let lying = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
        assert_eq!(boxed([0.06, 0.06, 0.10]).equivalent_yaws(&lying).len(), 2);
        let yaws = boxed([0.06, 0.06, 0.10]).equivalent_yaws(&Isometry3::rotation(Vector3::z() * 0.3));
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(yaws.len() == 4 && yaws.iter().enumerate().all(|(i, yaw)| (yaw - i as f64 * quarter).abs() < 1e-9));
    }

    #[test]
    fn a_wedge_of_triangles_looks_the_same_only_as_it_is() {
        let points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.06, 0.0], [0.0, 0.0, 0.04]].map(Point3::from);
        let wedge =
            ObjectShape::Mesh { points: points.to_vec(), triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] };
        let model = Model::new(&wedge);
        assert_eq!((model.symmetries.len(), model.stances.len()), (1, 6));
    }

    #[test]
    fn continuity_chooses_among_what_looks_the_same() {
        let model = boxed([0.08, 0.06, 0.10]);
        let seen = Isometry3::rotation(Vector3::z() * 3.0);
        let kept = model.nearest(&seen, &UnitQuaternion::identity());
        assert!((kept.rotation.angle() - (std::f64::consts::PI - 3.0)).abs() < 1e-9);
        let upright = model.depth_below_centre(&kept.rotation);
        assert!((upright - 0.05).abs() < 1e-12);
    }
}
