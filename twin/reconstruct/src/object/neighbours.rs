//! Which corners of a closed surface are beside each other, and values that take the mean with those beside them.

use crate::mesh::Mesh;
use rayon::prelude::*;

/// Rounds in which a corner takes the mean with its neighbours: pixels at the edge of a print differ anywhere.
const SMOOTHINGS: usize = 8;

/// The neighbours of each corner, one list behind the other.
#[derive(Debug)]
pub(super) struct Neighbours {
    starts: Vec<u32>,
    all: Vec<u32>,
}

impl Neighbours {
    /// Of a closed, oriented surface: each edge leads from one of its ends to the other in one of its two triangles and back in the other.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut starts = vec![0u32; mesh.points.len() + 1];
        mesh.triangles.iter().flatten().for_each(|corner| starts[*corner as usize + 1] += 1);
        for corner in 0..mesh.points.len() {
            starts[corner + 1] += starts[corner];
        }
        let (mut free, mut all) = (starts.clone(), vec![0; 3 * mesh.triangles.len()]);
        for [a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                all[free[*from as usize] as usize] = *to;
                free[*from as usize] += 1;
            }
        }
        Self { starts, all }
    }

    /// Mean value of each corner and its neighbours; `None` where none of them has one.
    pub(super) fn means(&self, values: &[Option<f64>]) -> Vec<Option<f64>> {
        let mean = |corner: usize| {
            let beside = &self.all[self.starts[corner] as usize..self.starts[corner + 1] as usize];
            let known = beside.iter().map(|other| values[*other as usize]).chain([values[corner]]).flatten();
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        (0..values.len()).into_par_iter().with_min_len(1024).map(mean).collect()
    }

    /// Values that take the mean with their neighbours' again and again.
    pub(super) fn smoothed(&self, mut values: Vec<Option<f64>>) -> Vec<Option<f64>> {
        (0..SMOOTHINGS).for_each(|_| values = self.means(&values));
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn each_corner_takes_the_mean_with_those_beside_it_that_have_a_value() {
        // A double pyramid: the corners 0 and 4 are not beside each other.
        let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [4, 2, 1], [4, 3, 2], [4, 1, 3]];
        let mesh = Mesh { points: vec![Point3::origin(); 5], triangles };
        let neighbours = Neighbours::of(&mesh);
        let means = neighbours.means(&[Some(8.0), Some(0.0), None, None, None]);
        assert_eq!(means, [Some(4.0), Some(4.0), Some(4.0), Some(4.0), Some(0.0)]);
        assert_eq!(neighbours.means(&[None; 5]), [None; 5]);
        assert!(neighbours.smoothed(vec![Some(3.0); 5]).into_iter().flatten().all(|value| (value - 3.0).abs() < 1e-12));
    }
}
