//! Convex hull of points in the plane, without allocation.

use nalgebra::Vector2;

/// Most places of a patch, and most corners of a base.
pub const MAX_POINTS: usize = 64;

/// A convex polygon, counter-clockwise, of at most [`MAX_POINTS`] corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Polygon {
    corners: [Vector2<f64>; MAX_POINTS],
    count: usize,
}

/// Corners nearer to each other than this are one [m]: meshes carry rounding noise.
const SAME_CORNER: f64 = 1e-7;

impl Polygon {
    /// The hull; `None` when the points span no area. Of a round base, which has more corners than fit, those that lie
    /// outermost in directions all around are kept.
    pub(super) fn of(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Self> {
        Self::wrapped(points.clone()).or_else(|| Self::wrapped(outermost(points)?.into_iter()))
    }

    /// The hull by wrapping; `None` too when it has more corners than fit.
    fn wrapped(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Self> {
        let start = points.clone().min_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)))?;
        let mut hull = Self { corners: [Vector2::zeros(); MAX_POINTS], count: 0 };
        let mut corner = start;
        loop {
            *hull.corners.get_mut(hull.count)? = corner;
            hull.count += 1;
            corner = next(corner, points.clone())?;
            if (corner - start).norm() < SAME_CORNER {
                break;
            }
        }
        (hull.count >= 3 && hull.area() > SAME_CORNER * SAME_CORNER).then_some(hull)
    }

    pub(super) fn corners(&self) -> &[Vector2<f64>] {
        &self.corners[..self.count]
    }

    /// Each edge as its two ends.
    pub(super) fn edges(&self) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
        (0..self.count).map(|i| (self.corners[i], self.corners[(i + 1) % self.count]))
    }

    pub(super) fn area(&self) -> f64 {
        0.5 * self.edges().map(|(a, b)| a.perp(&b)).sum::<f64>()
    }

    pub(super) fn centroid(&self) -> Vector2<f64> {
        let weighted = self.edges().map(|(a, b)| (a + b) * a.perp(&b)).sum::<Vector2<f64>>();
        weighted / (6.0 * self.area())
    }

    pub(super) fn perimeter(&self) -> f64 {
        self.edges().map(|(a, b)| (b - a).norm()).sum()
    }

    /// Whether a point lies inside, at least `margin` away from every edge.
    pub(super) fn holds(&self, point: Vector2<f64>, margin: f64) -> bool {
        self.edges().all(|(a, b)| (b - a).normalize().perp(&(point - a)) >= margin)
    }
}

/// The point farthest in each of [`MAX_POINTS`] - 1 directions around.
fn outermost(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<[Vector2<f64>; MAX_POINTS - 1]> {
    let first = points.clone().next()?;
    Some(std::array::from_fn(|i| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / (MAX_POINTS - 1) as f64).sin_cos();
        let reach = |p: &Vector2<f64>| cos * p.x + sin * p.y;
        points.clone().max_by(|a, b| reach(a).total_cmp(&reach(b))).unwrap_or(first)
    }))
}

/// The point that has all others on the left of the line from `from`; of several on that line the farthest.
fn next(from: Vector2<f64>, points: impl Iterator<Item = Vector2<f64>>) -> Option<Vector2<f64>> {
    points.filter(|p| (p - from).norm() >= SAME_CORNER).reduce(|best, p| {
        let (to_best, to_point) = (best - from, p - from);
        let side = to_best.perp(&to_point);
        let straight = SAME_CORNER * to_best.norm().max(to_point.norm());
        let farther = side.abs() <= straight && to_point.norm() > to_best.norm() && to_best.dot(&to_point) > 0.0;
        if side < -straight || farther { p } else { best }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_keeps_the_corners_and_drops_what_lies_between() {
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.5), (0.0, 1.0), (0.0, 1.0), (0.0, 0.5)];
        let hull = Polygon::of(points.iter().map(|(x, y)| Vector2::new(*x, *y))).expect("an area");
        assert_eq!(hull.corners().len(), 4);
        assert!((hull.area() - 2.0).abs() < 1e-12 && (hull.perimeter() - 6.0).abs() < 1e-12);
        assert!((hull.centroid() - Vector2::new(1.0, 0.5)).norm() < 1e-12);
        assert!(hull.holds(Vector2::new(0.1, 0.5), 0.09) && !hull.holds(Vector2::new(0.1, 0.5), 0.11));
    }

    #[test]
    fn a_round_base_of_many_corners_is_taken_as_one_of_a_few() {
        let circle = (0..500).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 500.0).sin_cos();
            Vector2::new(cos, sin)
        });
        let hull = Polygon::of(circle).expect("an area");
        assert!(hull.corners().len() < MAX_POINTS && (hull.area() / std::f64::consts::PI - 1.0).abs() < 0.01);
    }

    #[test]
    fn points_on_a_line_have_no_hull() {
        assert!(Polygon::of((0..5).map(|i| Vector2::new(f64::from(i), 2.0 * f64::from(i)))).is_none());
    }
}
