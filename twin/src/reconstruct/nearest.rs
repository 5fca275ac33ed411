//! Points by distance: a k-d tree (Bentley 1975) that is an array, its middle the root.

use nalgebra::Point3;

/// Points that can be asked for the nearest.
pub(super) struct Nearest {
    /// The middle of every range parts it along one axis after the other.
    points: Vec<(Point3<f64>, usize)>,
}

impl Nearest {
    /// Numbers the points as they come.
    pub(super) fn new(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let mut points: Vec<_> = points.into_iter().zip(0..).collect();
        arrange(&mut points, 0);
        Self { points }
    }

    /// The nearest point within a distance: the distance and its number.
    pub(super) fn one(&self, at: &Point3<f64>, within: f64) -> Option<(f64, usize)> {
        let mut found = Vec::with_capacity(1);
        self.some(at, within, 1, &mut found);
        found.pop()
    }

    /// The `count` nearest points within a distance, nearest first: distances and numbers.
    pub(super) fn some(&self, at: &Point3<f64>, within: f64, count: usize, found: &mut Vec<(f64, usize)>) {
        found.clear();
        search(&self.points, 0, at, within, count, found);
    }
}

fn arrange(points: &mut [(Point3<f64>, usize)], axis: usize) {
    if points.len() > 1 {
        let middle = points.len() / 2;
        points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
        let (low, high) = points.split_at_mut(middle);
        arrange(low, (axis + 1) % 3);
        arrange(&mut high[1..], (axis + 1) % 3);
    }
}

fn search(
    points: &[(Point3<f64>, usize)],
    axis: usize,
    at: &Point3<f64>,
    within: f64,
    count: usize,
    found: &mut Vec<(f64, usize)>,
) {
    if points.is_empty() {
        return;
    }
    let middle = points.len() / 2;
    let (point, number) = points[middle];
    let reach = |found: &[(f64, usize)]| if found.len() == count { found[count - 1].0.min(within) } else { within };
    let distance = (point - at).norm();
    if distance < reach(found) {
        let place = found.partition_point(|known| known.0 <= distance);
        found.insert(place, (distance, number));
        found.truncate(count);
    }
    let beyond = at[axis] - point[axis];
    let (low, high) = (&points[..middle], &points[middle + 1..]);
    let (near, far) = if beyond < 0.0 { (low, high) } else { (high, low) };
    search(near, (axis + 1) % 3, at, within, count, found);
    if beyond.abs() < reach(found) {
        search(far, (axis + 1) % 3, at, within, count, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_nearest_are_those_of_a_search_through_all(
            points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 0..80),
            at in prop::array::uniform3(-1.2f64..1.2), within in 0.0f64..2.0, count in 1usize..9,
        ) {
            let points: Vec<Point3<f64>> = points.into_iter().map(Point3::from).collect();
            let at = Point3::from(at);
            let mut wanted: Vec<f64> = points.iter().map(|p| (p - at).norm()).filter(|d| *d < within).collect();
            wanted.sort_by(f64::total_cmp);
            wanted.truncate(count);
            let mut found = Vec::new();
            Nearest::new(points.iter().copied()).some(&at, within, count, &mut found);
            prop_assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), wanted);
            prop_assert!(found.iter().all(|(d, n)| ((points[*n] - at).norm() - d).abs() < 1e-12));
        }
    }
}
