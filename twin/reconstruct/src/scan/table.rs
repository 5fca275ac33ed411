//! The plane on which an object stands, as a scan or a person states it.

use nalgebra::{Point3, Vector3};

/// The points p with `normal · p = offset`, in the frame of the poses; the object is on the side that the normal points to.
///
/// # Example
/// ```
/// use nalgebra::{Point3, Vector3};
/// use reconstruct::scan::Table;
///
/// let table = Table::at_height(0.1);
/// assert_eq!(Table::plane([0.0, 0.0, 2.0, 0.2]), Some(table)); // a normal of any length
/// assert!((table.height(&Point3::new(0.5, 0.5, 0.13)) - 0.03).abs() < 1e-12);
/// assert_eq!(Table::plane([0.0, 0.0, 0.0, 0.2]), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Up, of length 1.
    pub normal: Vector3<f64>,
    /// Along the normal from the origin [unit of the poses; m once the scan is in metres].
    pub offset: f64,
}

impl Table {
    /// Level in a frame whose z points up, so high.
    pub fn at_height(z: f64) -> Self {
        Self { normal: Vector3::z(), offset: z }
    }

    /// From x, y and z of a normal of any length, and the offset along it as it stands; `None` where that is no plane.
    pub fn plane([x, y, z, offset]: [f64; 4]) -> Option<Self> {
        let normal = Vector3::new(x, y, z);
        let length = normal.norm();
        let (normal, offset) = (normal / length, offset / length);
        (normal.iter().all(|v| v.is_finite()) && offset.is_finite()).then_some(Self { normal, offset })
    }

    /// How far above the table a place is, negative below.
    pub fn height(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }

    /// The same where one unit of the poses is so many metres.
    #[must_use]
    pub(crate) fn scaled(self, metres: f64) -> Self {
        Self { offset: self.offset * metres, ..self }
    }
}
