//! How far apart two runs are: joints as root mean square, objects as ADD and ADD-S (Hinterstoisser et al. 2012, the
//! measures of 6-DoF pose estimation). Called by replay, shadow and identification. Metres and radians.

use crate::arm::{JointState, Joints, MAX_JOINTS};
use crate::physics::Surface;
use crate::scene::ObjectShape;
use nalgebra::Point3;
use shared_mem::frames::{Base, Object, Pose};

/// Points on an object's surface: about a centimetre apart on a box of a hand's size.
const POINTS: u32 = 400;

/// Root mean square over the rows of `predicted - measured`, per joint [rad].
///
/// `measured` is row-major with `dof` columns; rows beyond the shorter of the two do not count.
///
/// ```
/// use twin::arm::{ArmModel, JointState};
/// use twin::metrics::joint_rms;
///
/// let ready = *ArmModel::fr3().ready();
/// let mut measured = [&ready[..7], &ready[..7]].concat(); // rad, row by row
/// measured[0] += 0.01;
/// let rms = joint_rms(&[JointState::at_rest(ready); 2], &measured, 7);
/// assert!((rms[0] - 0.01 / 2f64.sqrt()).abs() < 1e-12 && rms[1] == 0.0);
/// ```
pub fn joint_rms(predicted: &[JointState], measured: &[f64], dof: usize) -> Joints {
    let mut sum = [0.0; MAX_JOINTS];
    let rows = predicted.iter().zip(measured.chunks_exact(dof.max(1)));
    let count = rows.len().max(1) as f64;
    for (state, row) in rows {
        for ((sum, q), measured) in sum.iter_mut().zip(state.q).zip(row) {
            *sum += (q - measured).powi(2);
        }
    }
    sum.map(|s| (s / count).sqrt())
}

/// Points spread evenly over an object's surface, in the object's frame, and the surface itself.
///
/// ```
/// use nalgebra::Vector3;
/// use shared_mem::frames::{Base, Object, Pose};
/// use twin::metrics::SurfacePoints;
/// use twin::scene::ObjectShape;
///
/// let points = SurfacePoints::new(&ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) });
/// let at = |x: f64, wxyz| Pose::<Base, Object>::from_parts([x, 0.0, 0.05], wxyz).expect("a direction");
/// let (here, shifted) = (at(0.5, [1.0, 0.0, 0.0, 0.0]), at(0.51, [1.0, 0.0, 0.0, 0.0]));
/// let turned = at(0.5, [0.0, 0.0, 0.0, 1.0]);
/// assert!((points.add(&here, &shifted) - 0.01).abs() < 1e-9); // m
/// // Turned by half a turn about its axis a box looks the same.
/// assert!(points.add_s(&here, &turned) < 5e-3 && points.add(&here, &turned) > 0.03);
/// ```
#[derive(Clone)]
pub struct SurfacePoints {
    points: Vec<Point3<f64>>,
    /// `None` where there are no points either.
    surface: Option<Surface>,
}

impl SurfacePoints {
    /// The same points every time for the same shape.
    pub fn new(shape: &ObjectShape) -> Self {
        let (corners, triangles) = shape.triangles();
        let corner = |i: u32| corners[i as usize];
        let areas: Vec<f64> = triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (corner(b) - corner(a)).cross(&(corner(c) - corner(a))).norm())
            .collect();
        let step = areas.iter().sum::<f64>() / f64::from(POINTS);
        // Each triangle gets its share of equal steps along the summed area, and within it points of the additive
        // recurrence by the powers of the plastic number, folded into the triangle: even without being a lattice.
        let (mut points, mut behind) = (Vec::new(), 0.0);
        for (&[a, b, c], area) in triangles.iter().zip(areas) {
            behind += area;
            while (points.len() as f64 + 0.5) * step < behind {
                let n = points.len() as f64;
                let (mut u, mut v) = ((0.754_877_666_246_693 * n).fract(), (0.569_840_290_998_053 * n).fract());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                points.push(corner(a) + (corner(b) - corner(a)) * u + (corner(c) - corner(a)) * v);
            }
        }
        Self { points, surface: Surface::new(shape) }
    }

    /// ADD: mean distance between the same surface points under two poses [m].
    pub fn add(&self, a: &Pose<Base, Object>, b: &Pose<Base, Object>) -> f64 {
        self.mean(a, b, |moved, own| (moved - own).norm())
    }

    /// ADD-S: mean distance from each surface point to the closest one under the other pose, for objects that look the
    /// same from several sides [m].
    ///
    /// The closest one of the whole surface, not of a sample: between points a centimetre apart a slip of some
    /// millimetres finds no nearer neighbour than its own, and ADD-S would be ADD over again.
    pub fn add_s(&self, a: &Pose<Base, Object>, b: &Pose<Base, Object>) -> f64 {
        let Some(surface) = &self.surface else { return 0.0 };
        self.mean(a, b, |moved, _| surface.distance(&moved))
    }

    /// Mean of `distance(point moved from pose b's object frame into pose a's, the same point in a's)`.
    fn mean(
        &self,
        a: &Pose<Base, Object>,
        b: &Pose<Base, Object>,
        distance: impl Fn(Point3<f64>, &Point3<f64>) -> f64,
    ) -> f64 {
        let a_from_b = a.isometry().inverse() * b.isometry();
        let sum: f64 = self.points.iter().map(|own| distance(a_from_b * own, own)).sum();
        sum / self.points.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};
    use std::f64::consts::PI;

    fn pose(x: f64, turn: f64) -> Pose<Base, Object> {
        Pose::from_isometry(Isometry3::new(Vector3::new(x, 0.3, 0.0), Vector3::z() * turn))
    }

    /// As wide as it is deep.
    fn square() -> SurfacePoints {
        SurfacePoints::new(&ObjectShape::Box { half_extents: Vector3::new(0.04, 0.04, 0.1) })
    }

    #[test]
    fn a_shift_along_x_counts_fully_in_add_and_on_the_two_faces_across_it_in_add_s() {
        let (before, after) = (pose(0.0, 0.0), pose(0.002, 0.0));
        assert!((square().add(&before, &after) - 0.002).abs() < 1e-12);
        // Those two faces have 32 of 76.8 thousandths of the area; of the others a strip at the end sticks out.
        let across = 0.032 / 0.0768;
        let add_s = square().add_s(&before, &after);
        assert!((add_s / 0.002 - across).abs() < 0.03, "{add_s}");
        let (far, wide) =
            (pose(0.25, 0.0), SurfacePoints::new(&ObjectShape::Box { half_extents: Vector3::repeat(1e-3) }));
        assert!((wide.add_s(&before, &far) - 0.249).abs() < 1e-3, "an object far away is as far as its near face");
    }

    #[test]
    fn a_quarter_turn_of_a_square_counts_in_add_and_not_in_add_s() {
        let (before, after) = (pose(0.0, 0.0), pose(0.0, PI / 2.0));
        // A point moves along the chord of 90 degrees, at least 1.41 times its distance from the axis.
        assert!(square().add(&before, &after) > 0.04);
        assert!(square().add_s(&before, &after) < 1e-12);
    }

    #[test]
    fn surface_points_lie_evenly_on_the_faces_of_a_box() {
        let half = Vector3::new(0.04, 0.03, 0.05);
        let points = SurfacePoints::new(&ObjectShape::Box { half_extents: half });
        assert_eq!(points.points.len(), POINTS as usize);
        let on_face = |p: &Point3<f64>, axis: usize| (p[axis].abs() - half[axis]).abs() < 1e-12;
        assert!(points.points.iter().all(|p| (0..3).any(|axis| on_face(p, axis))));
        // Faces across z are 8 x 6 of 2 (8 x 6 + 6 x 10 + 8 x 10) cm².
        let top = points.points.iter().filter(|p| on_face(p, 2) && p.z > 0.0).count();
        assert!((top as f64 - 400.0 * 48.0 / 376.0).abs() < 2.0, "{top}");
        // Turned about its centre, the box's mean point moves by about the mean distance from the axis.
        let moved = points.add(&pose(0.0, 0.0), &pose(0.0, 0.01));
        let mean_radius = points.points.iter().map(|p| p.x.hypot(p.y)).sum::<f64>() / 400.0;
        assert!((moved / (0.01 * mean_radius) - 1.0).abs() < 1e-4, "{moved}");
    }

    #[test]
    fn joint_rms_is_taken_per_joint_over_the_rows() {
        let row = |a, b| JointState::at_rest(shared_mem::msg::joints_from(&[a, b]));
        let rms = joint_rms(&[row(1.0, 0.0), row(2.0, 0.0)], &[1.0, 3.0, 4.0, -4.0], 2);
        assert!((rms[0] - 2.0_f64.sqrt()).abs() < 1e-12 && (rms[1] - 12.5_f64.sqrt()).abs() < 1e-12, "{rms:?}");
    }
}
