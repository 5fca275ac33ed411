//! Points by distance. The tree is rstar's.

use nalgebra::Point3;
use rstar::primitives::GeomWithData;
use rstar::{RStarInsertionStrategy, RTree, RTreeParams};

/// Points that can be asked for the nearest.
pub(super) struct Nearest {
    points: RTree<GeomWithData<[f64; 3], usize>, Broad>,
}

/// Three children along each axis: asked a fifth quicker than rstar's own two.
struct Broad;

impl RTreeParams for Broad {
    const MIN_SIZE: usize = 9;
    const MAX_SIZE: usize = 27;
    const REINSERTION_COUNT: usize = 1;
    type DefaultInsertionStrategy = RStarInsertionStrategy;
}

impl Nearest {
    /// Numbers the points as they come. They are finite, and so is what is asked: rstar orders no NaN.
    pub(super) fn new(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let points = points.into_iter().zip(0..).map(|(point, number)| GeomWithData::new(point.into(), number));
        Self { points: RTree::bulk_load_with_params(points.collect()) }
    }

    /// The nearest point within a distance: the distance and its number.
    pub(super) fn one(&self, at: &Point3<f64>, within: f64) -> Option<(f64, usize)> {
        let (point, square) = self.points.nearest_neighbor_with_distance_2((*at).into())?;
        Some((square.sqrt(), point.data)).filter(|found| found.0 < within)
    }

    /// The `count` nearest points within a distance, nearest first: distances and numbers.
    pub(super) fn some(&self, at: &Point3<f64>, within: f64, count: usize, found: &mut Vec<(f64, usize)>) {
        let ordered = self.points.nearest_neighbor_iter_with_distance_2((*at).into());
        found.clear();
        found.extend(
            ordered.take(count).map(|(point, square)| (square.sqrt(), point.data)).take_while(|f| f.0 < within),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_nearest_are_those_of_a_search_through_all(
            points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 0..300),
            at in prop::array::uniform3(-1.2f64..1.2), within in 0.0f64..2.0, count in 1usize..9,
        ) {
            let points: Vec<Point3<f64>> = points.into_iter().map(Point3::from).collect();
            let at = Point3::from(at);
            let mut wanted: Vec<f64> = points.iter().map(|p| (p - at).norm()).filter(|d| *d < within).collect();
            wanted.sort_by(f64::total_cmp);
            wanted.truncate(count);
            let mut found = Vec::new();
            let tree = Nearest::new(points.iter().copied());
            tree.some(&at, within, count, &mut found);
            prop_assert_eq!(tree.one(&at, within).map(|f| f.0), wanted.first().copied());
            prop_assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), wanted);
            prop_assert!(found.iter().all(|(d, n)| ((points[*n] - at).norm() - d).abs() < 1e-12));
        }
    }
}
