//! Which parts of the grid a surface may be in: rays pass the rest without looking.

use crate::field::Grid;

/// Nodes along the edge of a block.
const EDGE: usize = 4;

/// Blocks of nodes that hold or touch the surface.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Band {
    blocks: [usize; 3],
    active: Vec<bool>,
}

impl Band {
    /// Blocks with a node nearer to the surface than `reach` [voxel].
    pub(crate) fn new(grid: &Grid, distance: &[f32], reach: f32) -> Self {
        let blocks = grid.dims.map(|n| n.div_ceil(EDGE));
        let mut active = vec![false; blocks.iter().product()];
        for (row, distances) in distance.chunks_exact(grid.dims[0]).enumerate() {
            let (y, z) = (row % grid.dims[1], row / grid.dims[1]);
            let first = ((z / EDGE) * blocks[1] + y / EDGE) * blocks[0];
            for (x, distance) in distances.iter().enumerate() {
                if distance.abs() < reach {
                    active[first + x / EDGE] = true;
                }
            }
        }
        Self { blocks, active }
    }

    /// Which blocks these are, x fastest.
    pub(crate) fn active(&self) -> &[bool] {
        &self.active
    }

    /// From [`Band::active`] of the same grid; `None` where the count is another one.
    pub(crate) fn of(grid: &Grid, active: Vec<bool>) -> Option<Self> {
        let blocks = grid.dims.map(|n| n.div_ceil(EDGE));
        (active.len() == blocks.iter().product::<usize>()).then_some(Self { blocks, active })
    }

    /// Whether a place [steps] lies in such a block.
    #[inline]
    pub(crate) fn holds(&self, node: [usize; 3]) -> bool {
        let [x, y, z] = node.map(|n| n / EDGE);
        self.active.get((z * self.blocks[1] + y) * self.blocks[0] + x).copied().unwrap_or(false)
    }

    /// The nodes of all such blocks that have neighbours on all sides.
    pub(crate) fn nodes(&self, grid: &Grid) -> Vec<u32> {
        let inner = |index: usize| {
            let node = grid.node(index);
            (self.holds(node) && !grid.is_rim(node)).then_some(index as u32)
        };
        (0..grid.len()).filter_map(inner).collect()
    }
}
