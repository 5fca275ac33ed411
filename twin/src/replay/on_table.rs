//! Whether the recorded poses put the object where the table carries it. Poses in another frame, or a table at another
//! height than cell.toml says, put it inside or above; where that can be mended the object is set onto the table and
//! a remark says so. Base frame, SI. Called by [`super::object_start`].

use crate::scene::ObjectShape;
use nalgebra::Isometry3;
use shared_mem::cell::Table;

/// An object so far off the table is not there by a tracker's noise [m].
const OFF_TABLE: f64 = 5e-3;

/// How far the poses put an object's lowest point below the table [m]; negative above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Depth {
    /// Of the lowest point.
    pub(super) lowest: f64,
    /// Of the middle.
    middle: f64,
    table_height: f64,
}

/// An object that is deeper in the table than it could have been set down onto it by mistake.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the poses put the object's middle {:.0} mm below the table; check `table.height` in cell.toml ({} m) and that the poses \
     are in the base frame and in metres",
    .0.middle * 1e3,
    .0.table_height
)]
pub struct Buried(Depth);

impl Depth {
    /// Of an object at `pose`.
    pub(super) fn of(shape: &ObjectShape, pose: &Isometry3<f64>, table: &Table) -> Self {
        let lowest = shape.triangles().0.iter().map(|corner| (pose * corner).z).fold(f64::INFINITY, f64::min);
        let height = table.height;
        Self { lowest: height - lowest, middle: height - pose.translation.vector.z, table_height: height }
    }

    /// Whether the object is inside the table by more than noise.
    pub(super) fn is_inside(&self) -> bool {
        self.lowest > OFF_TABLE
    }

    /// The remark about an object that should stand on the table and was set onto it.
    ///
    /// # Errors
    /// [`Buried`] when it cannot be meant to stand there.
    pub(super) fn set_onto(&self) -> Result<Option<String>, Buried> {
        let sentence = |where_: &str| {
            format!(
                "the poses put the object {:.0} mm {where_} the table; it was set onto it: check `table.height` in \
                 cell.toml and the frame of the poses",
                self.lowest.abs() * 1e3
            )
        };
        if self.middle > OFF_TABLE {
            return Err(Buried(*self));
        }
        let remark = if self.is_inside() { Some("into") } else { (self.lowest < -OFF_TABLE).then_some("above") };
        Ok(remark.map(sentence))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn remark(height: f64) -> Result<Option<String>, Buried> {
        let shape = ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) };
        Depth::of(&shape, &Isometry3::translation(0.5, 0.0, height), &Table { height: 0.2 }).set_onto()
    }

    #[test]
    fn noise_is_not_worth_a_word() {
        assert_eq!(remark(0.248), Ok(None));
        assert_eq!(remark(0.252), Ok(None));
    }

    #[test]
    fn an_object_off_the_table_is_set_onto_it_with_a_word() {
        for (height, words) in [(0.23, "20 mm into the table"), (0.31, "60 mm above the table")] {
            let said = remark(height).expect("on the table").expect("a word");
            assert!(said.contains(words) && said.contains("set onto it") && said.contains("table.height"), "{said}");
        }
    }

    #[test]
    fn an_object_below_the_table_is_refused_in_one_line() {
        let error = remark(0.1).expect_err("buried").to_string();
        assert!(
            error.contains("100 mm below the table") && error.contains("check") && !error.contains('\n'),
            "{error}"
        );
    }
}
