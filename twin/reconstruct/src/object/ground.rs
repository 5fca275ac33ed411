//! What is known before the optimisation begins: depth, which is computed where none was measured, and the table on which the object
//! stands, which depth may show.

use super::ObjectError;
use super::extent::Bounds;
use super::pictures::Pictures;
use super::table::{self, Support};
use crate::computed::{self, Computed, Wanted};
use crate::scan::{Frame, Scan, Table};
use crate::views;
use shared_mem::progress::Progress;

/// What pictures without depth show lies no nearer than this [of their distance from the object], and no farther behind it than so many
/// halves of its diagonal: the table.
const NEAREST: f64 = 0.3;
const BEHIND: f64 = 4.0;
/// So far around its mask depth of an object is computed finely [pixel].
const RIM: i16 = 4;
/// Standard deviation at one metre of depth that is computed, at least [m]: what neighbours differ by says less, since they are of one
/// window. That of the cameras in `tests/peers/scan.py`.
const SPREAD: f64 = 5e-3;

/// The table, and the depth that was computed.
pub(super) struct Ground {
    pub(super) support: Option<Support>,
    pub(super) computed: Option<Computed>,
}

impl Ground {
    /// Of a scan that is being read; depth goes to the views that learn, and the bounds end at the table.
    ///
    /// # Errors
    /// [`ObjectError`] where a table that is stated cannot be, or once the end was asked for.
    pub(super) fn find(
        (bar, scan): (&Progress, &Scan),
        given: Option<Table>,
        pictures: &mut Pictures,
        bounds: &mut Bounds,
    ) -> Result<Self, ObjectError> {
        // A table that is stated is looked at first: depth takes minutes.
        let is_stated = given.or(scan.table).is_some();
        let stated = if is_stated { table::find(scan, given, pictures, bounds)? } else { None };
        let computed = if scan.has_depth() { None } else { Some(compute(bar, pictures, bounds)?) };
        let support = if is_stated { stated } else { table::find(scan, given, pictures, bounds)? };
        Ok(Self { support, computed })
    }
}

/// Computes depth of the views that learn, of which none was measured; where they say hardly any, they stay without.
fn compute(bar: &Progress, pictures: &mut Pictures, bounds: &Bounds) -> Result<Computed, ObjectError> {
    let (centre, radius) = (bounds.centre(), bounds.radius());
    let wanted = |frame: &Frame| {
        let away = frame.scan_from_camera.inverse_transform_point(&centre).coords.norm();
        let range = [(away - radius).max(NEAREST * away), away + BEHIND * radius];
        let fine = frame.border_distance(RIM + 1).into_iter().map(|steps| steps >= -RIM).collect();
        Wanted { range, fine }
    };
    let computed =
        computed::fill(bar, &mut pictures.train, wanted).ok_or(ObjectError::Interrupted(0.0, "optimisation"))?;
    pictures.depth_spread = views::spread(&pictures.train).map(|spread| spread.max(SPREAD));
    if pictures.depth_spread.is_none() {
        pictures.train.iter_mut().for_each(|frame| frame.depth.clear());
    }
    Ok(computed)
}
