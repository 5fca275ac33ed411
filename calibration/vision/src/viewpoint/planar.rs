//! Where a camera stands before a plane of which it sees known points: the homography first, then least squares on the
//! pixels, from both of the poses that a plane far away hardly tells apart (Schweighofer & Pinz 2006).

use super::lens::Lens;
use nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use twin::pose_fit::{Equations, moved, pixel_direction, slope};

/// A point of the plane, and where it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// In the plane [m].
    pub place: [f64; 2],
    /// Column and row of a picture without distortion.
    pub pixel: [f64; 2],
}

const MAX_STEPS: usize = 30;

/// The plane's frame, whose points have `z = 0`, in the camera's; `None` for fewer than four points, or points on a line.
pub fn pose(seen: &[Seen], lens: &Lens) -> Option<Isometry3<f64>> {
    let first = from_homography(seen, lens)?;
    let normal = first.rotation * Vector3::z();
    let sight = first.translation.vector.normalize();
    // The same plane tilted to the other side of the line of sight.
    let tilted = 2.0 * normal.dot(&sight) * sight - normal;
    let turn = UnitQuaternion::rotation_between(&normal, &tilted)?;
    let second = Isometry3::from_parts(first.translation, turn * first.rotation);
    let of_plane = |about: Isometry3<f64>| about * Translation3::from(-middle(seen));
    let found = [first, second].into_iter().filter_map(|start| refined(seen, lens, &of_plane(start)));
    let (_, best) = found.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    Some(best)
}

/// Middle of the points, in the plane.
fn middle(seen: &[Seen]) -> Vector3<f64> {
    let sum = seen.iter().fold([0.0; 2], |sum, s| [sum[0] + s.place[0], sum[1] + s.place[1]]);
    let count = seen.len().max(1) as f64;
    Vector3::new(sum[0] / count, sum[1] / count, 0.0)
}

/// Pose of the plane about the middle of the points, without least squares.
fn from_homography(seen: &[Seen], lens: &Lens) -> Option<Isometry3<f64>> {
    let middle = middle(seen);
    let sight = |s: &Seen| [0, 1].map(|i| (s.pixel[i] - lens.centre[i]) / lens.focal[i]);
    let pairs: Vec<_> = seen.iter().map(|s| ([s.place[0] - middle.x, s.place[1] - middle.y], sight(s))).collect();
    let mut h = homography(&pairs)?;
    if h[(2, 2)] < 0.0 {
        h = -h;
    }
    let scale = (h.column(0).norm() * h.column(1).norm()).sqrt();
    if scale < 1e-12 {
        return None;
    }
    let (x, y) = (h.column(0) / scale, h.column(1) / scale);
    let turn =
        Rotation3::from_matrix_eps(&Matrix3::from_columns(&[x, y, x.cross(&y)]), 1e-12, 100, Rotation3::identity());
    let at = h.column(2) / scale;
    Some(Isometry3::from_parts(Translation3::new(at.x, at.y, at.z), UnitQuaternion::from_rotation_matrix(&turn)))
}

/// How one plane shows in another, from points of both: the direct linear transform, both sides about the origin and of
/// unit size (Hartley 1997). `None` for fewer than four points, or points on a line.
pub fn homography(pairs: &[([f64; 2], [f64; 2])]) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let unit = |points: &[[f64; 2]]| {
        let count = points.len() as f64;
        let middle = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / count);
        let squares = points.iter().map(|p| (p[0] - middle[0]).powi(2) + (p[1] - middle[1]).powi(2));
        let size = (squares.sum::<f64>() / count).sqrt().max(f64::MIN_POSITIVE);
        Matrix3::new(1.0 / size, 0.0, -middle[0] / size, 0.0, 1.0 / size, -middle[1] / size, 0.0, 0.0, 1.0)
    };
    let (from, to): (Vec<_>, Vec<_>) = pairs.iter().copied().unzip();
    let (of_from, of_to) = (unit(&from), unit(&to));
    let mut rows = DMatrix::zeros(2 * pairs.len(), 9);
    for (number, (from, to)) in pairs.iter().enumerate() {
        let [x, y] = [0, 1].map(|i| of_from[(i, i)] * from[i] + of_from[(i, 2)]);
        let [u, v] = [0, 1].map(|i| of_to[(i, i)] * to[i] + of_to[(i, 2)]);
        rows.row_mut(2 * number).copy_from_slice(&[x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y, -u]);
        rows.row_mut(2 * number + 1).copy_from_slice(&[0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y, -v]);
    }
    let eigen = (rows.transpose() * rows).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // Points on a line leave more than one direction open.
    if eigen.eigenvalues[order[1]] < 1e-9 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let between = Matrix3::from_row_slice(eigen.eigenvectors.column(order[0]).as_slice());
    Some(of_to.try_inverse()? * between * of_from)
}

/// Least squares on the pixels: what is left [pixel²], and the pose.
fn refined(seen: &[Seen], lens: &Lens, start: &Isometry3<f64>) -> Option<(f64, Isometry3<f64>)> {
    let middle = Point3::from(middle(seen));
    let weights = vec![1.0; seen.len()];
    let at = |pose: &Isometry3<f64>| equations(seen, lens, pose, &(pose * middle), &weights);
    let mut pose = *start;
    let (mut cost, mut here) = at(&pose)?;
    let mut damping = 1e-3;
    for _ in 0..MAX_STEPS {
        let next = moved(&pose, &(pose * middle), &here.step(damping, 0.0)?);
        match at(&next) {
            Some((less, there)) if less <= cost => (pose, cost, here, damping) = (next, less, there, damping * 0.1),
            _ => damping *= 10.0,
        }
    }
    Some((cost, pose))
}

/// What is left of the pixels [pixel²] at a pose of the plane, each point with its weight, and the equations there for steps about
/// `pivot` (camera's frame); `None` where a point lies behind the camera.
pub fn equations(
    seen: &[Seen],
    lens: &Lens,
    pose: &Isometry3<f64>,
    pivot: &Point3<f64>,
    weights: &[f64],
) -> Option<(f64, Equations<6>)> {
    let (mut cost, mut equations) = (0.0, Equations::zeros());
    for (seen, weight) in seen.iter().zip(weights) {
        let p = pose * Point3::new(seen.place[0], seen.place[1], 0.0);
        if p.z <= 1e-6 {
            return None;
        }
        let there = lens.project(&p);
        for (axis, across) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            let off = there[axis] - seen.pixel[axis];
            cost += weight * off * off;
            equations.add(&slope(&pixel_direction(&p, lens.focal, across), &(p - pivot)), off, *weight);
        }
    }
    Some((cost, equations))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens { focal: [600.0, 605.0], centre: [322.0, 238.0] };

    fn views(pose: &Isometry3<f64>, off: impl Fn(usize) -> f64) -> Vec<Seen> {
        let places = (0..24).map(|i| [f64::from(i % 4) * 0.04 + 0.04, f64::from(i / 4) * 0.04 + 0.04]);
        places
            .enumerate()
            .map(|(i, place)| {
                let [u, v] = LENS.project(&(pose * Point3::new(place[0], place[1], 0.0)));
                Seen { place, pixel: [u + off(2 * i), v + off(2 * i + 1)] }
            })
            .collect()
    }

    #[test]
    fn the_pose_comes_back_exactly_from_exact_points_and_within_the_noise_of_others() {
        for (tilt, turn) in [(0.5, 0.2), (-0.4, 2.0), (0.02, -1.0), (0.9, 3.0)] {
            let rotation = UnitQuaternion::from_euler_angles(tilt, -0.3, turn);
            let truth = Isometry3::from_parts(Translation3::new(0.05, -0.08, 0.9), rotation);
            let exact = pose(&views(&truth, |_| 0.0), &LENS).expect("a pose");
            assert!((exact.translation.vector - truth.translation.vector).norm() < 1e-7);
            assert!(exact.rotation.angle_to(&truth.rotation) < 1e-6);
            // A tenth of a pixel, to and fro.
            let rough = pose(&views(&truth, |i| 0.1 * (i as f64 * 2.399).sin()), &LENS).expect("a pose");
            assert!((rough.translation.vector - truth.translation.vector).norm() < 2e-3);
            assert!(rough.rotation.angle_to(&truth.rotation) < 0.02);
        }
    }

    #[test]
    fn three_points_or_a_line_are_no_plane() {
        let truth = Isometry3::translation(0.0, 0.0, 1.0);
        let seen = views(&truth, |_| 0.0);
        assert!(pose(&seen[..3], &LENS).is_none() && pose(&seen[..4], &LENS).is_none());
    }
}
