//! Normals of splats against the normal of their depth: of the plane through the points that a pixel's neighbours
//! see. Splats whose normals agree with their places lie in planes.

use super::Target;
use crate::gradient::Planes;
use crate::real::Real;

/// Neighbours whose depths differ by more than this share lie on different surfaces.
const STEP: f64 = 0.03;

/// The term, and its slope over the three planes of normals; that over the depths is added to `over_depth`. `weight` is that of
/// one pixel; it falls where the photograph has an edge, at which surfaces bend.
pub(super) fn normals<T: Real, const C: usize>(
    seen: &Planes<T, C>,
    depth: &[T],
    target: &Target<T>,
    weight: T,
    over_depth: &mut [T],
) -> (T, [Vec<T>; 3]) {
    let [width, height] = seen.size;
    let mut value = T::zero();
    let mut slopes: [Vec<T>; 3] = std::array::from_fn(|_| vec![T::zero(); depth.len()]);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = y * width + x;
            let around = [at - 1, at + 1, at - width, at + width];
            let one = depth[at];
            let near = |i: &usize| depth[*i] > T::zero() && (depth[*i] - one).abs() < one * T::of(STEP);
            if one <= T::zero() || !around.iter().all(near) {
                continue;
            }
            let [left, right, up, down] = around.map(|i| target.rays[i] * depth[i]);
            // Towards the camera: columns go right, rows down.
            let (along, across) = (right - left, down - up);
            let normal = across.cross(&along);
            let length = normal.norm();
            if length <= T::zero() {
                continue;
            }
            let normal = normal / length;
            let blended = seen.normal(at);
            let weight = weight * smooth(target, at, around);
            value += weight * (T::one() - blended.dot(&normal));
            (0..3).for_each(|i| slopes[i][at] = -weight * normal[i]);
            // Over the cross product, then over its two factors, then over the four depths.
            let over = (blended - normal * normal.dot(&blended)) * (-weight / length);
            let (over_along, over_across) = (over.cross(&across), along.cross(&over));
            let shares = [-over_along, over_along, -over_across, over_across];
            for (i, share) in around.into_iter().zip(shares) {
                over_depth[i] += share.dot(&target.rays[i]);
            }
        }
    }
    (value, slopes)
}

/// 1 where the photograph is even, 0 across an edge from black to white.
fn smooth<T: Real>(target: &Target<T>, at: usize, around: [usize; 4]) -> T {
    let edge = |plane: &Vec<T>| around.iter().fold(T::zero(), |most, i| most.max((plane[*i] - plane[at]).abs()));
    let most = target.color.iter().fold(T::zero(), |most, plane| most.max(edge(plane)));
    let left = (T::one() - most).max(T::zero());
    left * left
}
