//! A box of nodes at equal distances, x fastest, and values between them by trilinear interpolation.

use nalgebra::{Point3, RealField, Vector3};

/// Where nodes lie. Node (i, j, k) is at `origin + voxel * (i, j, k)` in the scan's frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Nodes along x, y, z.
    pub dims: [usize; 3],
    /// Place of the first node [m].
    pub origin: Point3<f64>,
    /// Distance of neighbours [m].
    pub voxel: f64,
}

/// Nodes of one cell and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cell<T> {
    /// Node with the smallest coordinates, and its index.
    pub(crate) node: [usize; 3],
    pub(crate) base: usize,
    /// Place within the cell, 0 to 1.
    pub(crate) share: [T; 3],
}

impl Grid {
    /// Nodes that fill a box, about `count` of them, with room of `margin` nodes on every side.
    pub fn filling(low: &Point3<f64>, high: &Point3<f64>, count: f64, margin: usize) -> Self {
        let size = (high - low).map(|edge| edge.max(1e-6));
        let rim = 2.0 * margin as f64;
        // So many nodes along each edge that, with the rim, the count comes out: a few rounds find the distance.
        let mut voxel = (size.product() / count).cbrt();
        for _ in 0..20 {
            let nodes = size.map(|edge| edge / voxel + 1.0 + rim).product();
            voxel *= (nodes / count).cbrt();
        }
        let dims = [0, 1, 2].map(|axis| (size[axis] / voxel).ceil() as usize + 1 + 2 * margin);
        let spare = Vector3::from_fn(|axis, _| (dims[axis] - 1) as f64 * voxel - size[axis]) * 0.5;
        Self { dims, origin: low - spare, voxel }
    }

    /// The same box with nodes twice as dense.
    pub fn refined(&self) -> Self {
        Self { dims: self.dims.map(|n| 2 * n - 1), origin: self.origin, voxel: 0.5 * self.voxel }
    }

    /// Count of nodes.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index of a node.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    /// The node of an index.
    pub fn node(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.dims;
        [index % x, index / x % y, index / (x * y)]
    }

    /// Steps from a node to the next along x, y, z.
    pub fn strides(&self) -> [usize; 3] {
        [1, self.dims[0], self.dims[0] * self.dims[1]]
    }

    /// Where a node lies [m].
    pub fn position(&self, node: [usize; 3]) -> Point3<f64> {
        self.origin + Vector3::from(node.map(|i| i as f64)) * self.voxel
    }

    /// A place in steps between nodes, from the first node on.
    pub fn steps(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from((point - self.origin) / self.voxel)
    }

    /// Whether a node is at the rim of the box.
    pub fn is_rim(&self, node: [usize; 3]) -> bool {
        (0..3).any(|axis| node[axis] == 0 || node[axis] + 1 == self.dims[axis])
    }

    /// The cell around a place [steps]; `None` outside.
    #[inline]
    pub(crate) fn cell<T: RealField + Copy>(&self, at: [T; 3]) -> Option<Cell<T>> {
        let (mut node, mut share) = ([0usize; 3], [T::zero(); 3]);
        for axis in 0..3 {
            let below = at[axis].floor();
            let whole: f64 = below.to_subset()?;
            if !(whole >= 0.0 && whole < (self.dims[axis] - 1) as f64) {
                return None;
            }
            (node[axis], share[axis]) = (whole as usize, at[axis] - below);
        }
        Some(Cell { node, base: self.index(node), share })
    }

    /// Indices of a cell's eight nodes, x fastest.
    #[inline]
    pub(crate) fn nodes(&self, base: usize) -> [usize; 8] {
        let [_, y, z] = self.strides();
        [base, base + 1, base + y, base + y + 1, base + z, base + z + 1, base + z + y, base + z + y + 1]
    }
}

impl<T: RealField + Copy> Cell<T> {
    /// Weights of the eight nodes.
    #[inline]
    pub(crate) fn weights(&self) -> [T; 8] {
        let one = T::one();
        let [x, y, z] = self.share;
        let (x0, y0, z0) = (one - x, one - y, one - z);
        let [a, b, c, d] = [y0 * z0, y * z0, y0 * z, y * z];
        [x0 * a, x * a, x0 * b, x * b, x0 * c, x * c, x0 * d, x * d]
    }

    /// Derivative of the interpolated value along x, y, z [1/step].
    #[inline]
    pub(crate) fn slope(&self, v: [T; 8]) -> [T; 3] {
        let one = T::one();
        let [x, y, z] = self.share;
        let mix = |a: T, b: T, t: T| a * (one - t) + b * t;
        [
            mix(mix(v[1] - v[0], v[3] - v[2], y), mix(v[5] - v[4], v[7] - v[6], y), z),
            mix(mix(v[2] - v[0], v[3] - v[1], x), mix(v[6] - v[4], v[7] - v[5], x), z),
            mix(mix(v[4] - v[0], v[5] - v[1], x), mix(v[6] - v[2], v[7] - v[3], x), y),
        ]
    }
}

/// Signed distance (negative inside) in voxels and colour (0 to 1) at every node.
#[derive(Debug, Clone, PartialEq)]
pub struct Field<T> {
    /// Where the nodes lie.
    pub grid: Grid,
    /// Signed distance [voxel].
    pub distance: Vec<T>,
    /// Red, green, blue.
    pub colour: Vec<[T; 3]>,
}

impl Field<f32> {
    /// The same between nodes twice as dense.
    pub fn refined(&self) -> Self {
        let grid = self.grid.refined();
        let place = |index: usize| grid.node(index).map(|i| 0.5 * i as f32);
        let sample = |index: usize| {
            let mut at = place(index);
            // The last node of an axis belongs to the cell before it.
            for (at, nodes) in at.iter_mut().zip(self.grid.dims) {
                *at = at.min((nodes - 1) as f32 - 1e-3);
            }
            let cell = self.grid.cell(at).unwrap_or(Cell { node: [0; 3], base: 0, share: [0.0; 3] });
            (self.grid.nodes(cell.base), cell.weights())
        };
        let mean = |index: usize| {
            let (nodes, weights) = sample(index);
            let (mut distance, mut colour) = (0.0, [0.0; 3]);
            for (node, weight) in nodes.into_iter().zip(weights) {
                distance += weight * self.distance[node];
                (0..3).for_each(|c| colour[c] += weight * self.colour[node][c]);
            }
            (2.0 * distance, colour)
        };
        let (distance, colour) = (0..grid.len()).map(mean).unzip();
        Self { grid, distance, colour }
    }

    /// Signed distance [m] at a place of the scan; `None` outside the box.
    pub fn distance_at(&self, point: &Point3<f64>) -> Option<f64> {
        let cell = self.grid.cell(self.grid.steps(point).coords.map(|v| v as f32).into())?;
        let nodes = self.grid.nodes(cell.base);
        let sum: f32 = nodes.iter().zip(cell.weights()).map(|(node, weight)| weight * self.distance[*node]).sum();
        Some(f64::from(sum) * self.grid.voxel)
    }

    /// Signed distance [m] at a place of the scan and its derivative by the place; `None` outside the box.
    pub fn slope_at(&self, point: &Point3<f64>) -> Option<(f64, Vector3<f64>)> {
        let cell = self.grid.cell(self.grid.steps(point).coords.into())?;
        let values = self.grid.nodes(cell.base).map(|node| f64::from(self.distance[node]));
        let distance: f64 = values.iter().zip(cell.weights()).map(|(value, weight)| weight * value).sum();
        Some((distance * self.grid.voxel, cell.slope(values).into()))
    }

    /// Colour at a place of the scan, 0 to 1; `None` outside the box.
    pub fn colour_at(&self, point: &Point3<f64>) -> Option<[f32; 3]> {
        let cell = self.grid.cell(self.grid.steps(point).coords.map(|v| v as f32).into())?;
        let mut sum = [0.0; 3];
        for (node, weight) in self.grid.nodes(cell.base).into_iter().zip(cell.weights()) {
            (0..3).for_each(|c| sum[c] += weight * self.colour[node][c]);
        }
        Some(sum.map(|c| c.clamp(0.0, 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_filled_with_about_as_many_nodes_as_asked_for() {
        let grid = Grid::filling(&Point3::origin(), &Point3::new(0.2, 0.04, 0.03), 32_768.0, 3);
        assert!((0.7..1.4).contains(&(grid.len() as f64 / 32_768.0)), "{grid:?}");
        let high = grid.position(grid.dims.map(|n| n - 1));
        assert!(high.x > 0.2 + 2.0 * grid.voxel && grid.origin.x < -2.0 * grid.voxel, "{grid:?} {high}");
        assert_eq!(grid.index(grid.node(1234)), 1234);
    }

    #[test]
    fn a_linear_field_stays_itself_between_nodes_and_when_refined() {
        let grid = Grid { dims: [4, 5, 6], origin: Point3::new(0.1, 0.2, 0.3), voxel: 0.01 };
        let value = |p: Point3<f64>| (2.0 * (p.x - 0.1) - (p.y - 0.2) + 0.5 * (p.z - 0.3)) / 0.01;
        let distance = (0..grid.len()).map(|i| value(grid.position(grid.node(i))) as f32).collect();
        let field = Field { grid, distance, colour: vec![[0.5; 3]; grid.len()] };
        let at = Point3::new(0.113, 0.227, 0.341);
        for field in [field.clone(), field.refined()] {
            let found = field.distance_at(&at).expect("inside");
            assert!((found - value(at) * 0.01).abs() < 2e-4, "{found} {}", value(at) * 0.01);
        }
        assert!(field.distance_at(&Point3::new(0.0, 0.2, 0.3)).is_none());
        let cell = grid.cell([1.3f64, 2.7, 4.1]).expect("inside");
        let nodes = grid.nodes(cell.base).map(|i| value(grid.position(grid.node(i))));
        let slope = cell.slope(nodes);
        assert!((slope[0] - 2.0).abs() < 1e-9 && (slope[1] + 1.0).abs() < 1e-9 && (slope[2] - 0.5).abs() < 1e-9);
    }
}
