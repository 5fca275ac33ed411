//! The box that holds an object, and which places in it may be the object's.

use crate::scan::Table;
use nalgebra::Point3;

/// A box that holds the object [m], and which places in it may be the object's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: Point3<f64>,
    pub(crate) high: Point3<f64>,
    /// Of places about which fewer views say something nothing is known.
    pub(crate) fewest: usize,
    /// Below it nothing is.
    pub(crate) table: Option<Table>,
}

impl Bounds {
    pub(crate) fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    /// Half the diagonal [m].
    pub(crate) fn radius(&self) -> f64 {
        0.5 * (self.high - self.low).norm()
    }

    /// How far below the table a place is [m], negative above.
    pub(crate) fn below(&self, point: &Point3<f64>) -> f64 {
        self.table.map_or(f64::NEG_INFINITY, |table| -table.height(point))
    }
}
