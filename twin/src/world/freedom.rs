//! One freedom of a tree of bodies: how it moves a point, and room for all of a tree.

use super::patch::MOST_COLUMNS;
use nalgebra::Vector3;

/// Freedoms of a tree.
pub(super) const MOST_FREEDOMS: usize = MOST_COLUMNS / 2;

/// How a freedom moves a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Screw {
    pub(super) velocity: Vector3<f64>,
    pub(super) spin: Vector3<f64>,
}

/// One number for each pair of freedoms of a tree.
pub(super) type Dense = [[f64; MOST_FREEDOMS]; MOST_FREEDOMS];
