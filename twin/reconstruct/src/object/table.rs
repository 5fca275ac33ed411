//! The table on which an object stands: nothing of the object lies below it. Pictures from above leave open what is hidden beneath the
//! edges of the object. A person or the scan says where the table is, or it is the plane through what lies around the object, where depth
//! was measured or COLMAP has placed points.

use super::bounds::Misplaced;
use super::extent::Bounds;
use super::pictures::Pictures;
use crate::field::Field;
use crate::remark::Remark;
use crate::scan::{Frame, Scan, ScanError, Table};
use fusion::plane::{Plane, Wanted};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// What lies farther from the object's middle is of other things [half the object's diagonal].
const AROUND: f64 = 3.0;
/// So near to a mask's border a pixel may still show the object [pixel].
const CLEAR: i16 = 4;
/// Depths that are looked at, of all pictures together.
const DEPTHS: usize = 40_000;
/// Fewer places say nothing of a plane: of depth, and of a COLMAP model, whose points are in corners of prints.
const FEWEST_DEPTHS: usize = 500;
const FEWEST_POINTS: usize = 30;
/// Places lie on a plane that are nearer to it [half the object's diagonal], or than so many standard deviations of depth.
const NEAR: f64 = 0.03;
const DEVIATIONS: f64 = 3.0;
/// A table is a plane through so many of the places around an object at least [1].
const MOST: f64 = 0.5;
/// Its normal differs by less from the mean direction of the cameras [rad]: those of half a round at 14 degrees stand 1 rad from it.
const TILTED: f64 = 1.0;

/// Who says where the table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TableSource {
    /// A person gave it.
    Given,
    /// The file of the poses says it.
    Scan,
    /// Depth was measured on it.
    Depth,
    /// Points of the COLMAP model lie on it.
    Points,
}

impl TableSource {
    /// Who says it, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Given => "given on the command line",
            Self::Scan => "the scan says where it is",
            Self::Depth => "the plane of the depths around the object",
            Self::Points => "the plane of COLMAP's points around the object",
        }
    }
}

/// The table under an object, at which its base is closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Its plane in the scan's frame [m].
    pub table: Table,
    /// Who says so.
    pub source: TableSource,
}

/// The table that is stated, or else the one that the pictures show, within `bounds`, which then end at it.
///
/// # Errors
/// [`ScanError::Missing`] where one that is stated lies through the object, or on its other side.
pub(super) fn find(
    scan: &Scan,
    given: Option<Table>,
    pictures: &mut Pictures,
    bounds: &mut Bounds,
) -> Result<Option<Support>, ScanError> {
    let stated = given.map(|table| (table, TableSource::Given)).or(scan.table.map(|table| (table, TableSource::Scan)));
    if let Some((table, source)) = stated {
        let name = if given.is_some() { "--table" } else { "the scan's `table`" };
        *bounds = above_stated(name, table, &pictures.train, bounds)?;
        return Ok(Some(Support { table, source }));
    }
    let shown = match shown(scan, pictures, bounds) {
        Ok(shown) => shown,
        Err(remark) => {
            pictures.remarks.push(remark);
            return Ok(None);
        }
    };
    Ok(shown.map(|(support, above)| {
        *bounds = above;
        support
    }))
}

/// The table that the pictures show, and the bounds above it; `None` where they show nothing around the object, or its underside.
///
/// # Errors
/// What is to be said where the object stands on none of the planes around it.
fn shown(scan: &Scan, pictures: &Pictures, bounds: &Bounds) -> Result<Option<(Support, Bounds)>, Remark> {
    let frames = &pictures.train;
    let (places, source, fewest) = match depths_around(frames, bounds) {
        depths if depths.len() >= FEWEST_DEPTHS => (depths, TableSource::Depth, FEWEST_DEPTHS),
        _ => (points_around(scan, frames, bounds), TableSource::Points, FEWEST_POINTS),
    };
    let away = |frame: &Frame| frame.scan_from_camera * Point3::origin() - bounds.centre();
    let up = frames.iter().map(|frame| away(frame).normalize()).sum::<Vector3<f64>>().try_normalize(1e-6);
    let Some(up) = up.filter(|_| places.len() >= fewest) else { return Ok(None) };
    let square = frames.iter().map(|frame| away(frame).norm_squared()).sum::<f64>() / frames.len() as f64;
    let noise = DEVIATIONS * pictures.depth_spread.unwrap_or(0.0) * square;
    let wanted = Wanted { tolerance: (NEAR * bounds.radius()).max(noise), normal: Some((up, TILTED)) };
    let plane = Plane::largest(&places, &[], &wanted).filter(|p| p.points as f64 >= MOST * places.len() as f64);
    let Some(Plane { normal, offset, .. }) = plane else {
        return Err(Remark("what lies around the object is no plane on which it could stand: give --table".into()));
    };
    let table = Table { normal, offset };
    // Who looks from below shows the underside, and no table stands in the way.
    if below(&table, frames) > 0 {
        return Ok(None);
    }
    let above = bounds.above(frames, table).map_err(|misplaced| {
        Remark(format!(
            "the plane through what lies around the object was not used: {}; give --table",
            words(misplaced)
        ))
    })?;
    Ok(Some((Support { table, source }, above)))
}

/// How many cameras are below a table.
fn below(table: &Table, frames: &[Frame]) -> usize {
    frames.iter().filter(|frame| table.height(&(frame.scan_from_camera * Point3::origin())) < 0.0).count()
}

/// The bounds above a table that somebody has stated.
fn above_stated(name: &str, table: Table, frames: &[Frame], bounds: &Bounds) -> Result<Bounds, ScanError> {
    let below = below(&table, frames);
    if 2 * below > frames.len() {
        return Err(ScanError::Missing(format!(
            "{name}: {below} of {} cameras are below the table; its normal points from it to the object: as four numbers nx,ny,nz,d change \
             the sign of each, and of a frame whose z points down give 0,0,-1,-HEIGHT",
            frames.len()
        )));
    }
    bounds.above(frames, table).map_err(|misplaced| {
        ScanError::Missing(format!(
            "{name}: {}; it counts in the frame and the unit of the poses, and in metres what the masks show lies from {:.4} to {:.4} along its \
             normal, the lowest centimetre or two of which is what the outlines leave open",
            words(misplaced),
            lowest(bounds, &table) + table.offset,
            -lowest(bounds, &Table { normal: -table.normal, offset: 0.0 })
        ))
    })
}

fn words(misplaced: Misplaced) -> String {
    match misplaced {
        Misplaced::CutsOff(share) => format!("{:.0} % of what the masks show lies below it", share * 100.0),
        Misplaced::Beneath(height) => format!("all of the object lies {:.1} mm and more above it", height * 1e3),
    }
}

/// Height of a box's lowest corner above a table [m].
fn lowest(bounds: &Bounds, table: &Table) -> f64 {
    let half = 0.5 * (bounds.high - bounds.low);
    table.height(&bounds.centre()) - half.component_mul(&table.normal).abs().sum()
}

/// Places around the object at which depth was measured.
fn depths_around(frames: &[Frame], bounds: &Bounds) -> Vec<Point3<f64>> {
    let all: usize = frames.iter().map(|frame| frame.depth.len()).sum();
    let every = all.div_ceil(DEPTHS).max(1);
    let mut places = Vec::new();
    for frame in frames.iter().filter(|frame| !frame.depth.is_empty()) {
        let (width, border) = (frame.camera.width as usize, frame.border_distance(CLEAR + 1));
        for at in (0..frame.depth.len()).step_by(every).filter(|at| border[*at] < -CLEAR && frame.depth[*at] > 0.0) {
            let [x, y] = frame.camera.direction([(at % width) as f64 + 0.5, (at / width) as f64 + 0.5]);
            let z = f64::from(frame.depth[at]);
            places.push(frame.scan_from_camera * Point3::new(x * z, y * z, z));
        }
    }
    places.retain(|place| is_around(bounds, place));
    places
}

/// Points of a COLMAP model around the object, once for each view that shows one outside of its mask.
fn points_around(scan: &Scan, frames: &[Frame], bounds: &Bounds) -> Vec<Point3<f64>> {
    let borders: Vec<(&Frame, Vec<i16>)> = frames.iter().map(|f| (f, f.border_distance(CLEAR + 1))).collect();
    let is_outside = |name: &str, full: [u32; 2], pixel: [f64; 2]| {
        borders.iter().find(|(frame, _)| frame.name == name).is_some_and(|(frame, border)| {
            let size = [frame.camera.width, frame.camera.height];
            let [u, v] = [0, 1].map(|i| pixel[i] * f64::from(size[i]) / f64::from(full[i]));
            let inside = u >= 0.0 && v >= 0.0 && u < f64::from(size[0]) && v < f64::from(size[1]);
            inside && border[v as usize * size[0] as usize + u as usize] < -CLEAR
        })
    };
    let outside = scan.model_points().filter(|(view, pixel, place)| {
        is_around(bounds, place) && is_outside(&view.name, [view.camera.width, view.camera.height], *pixel)
    });
    outside.map(|(_, _, place)| place).collect()
}

fn is_around(bounds: &Bounds, place: &Point3<f64>) -> bool {
    (place - bounds.centre()).norm() < AROUND * bounds.radius()
}

/// Cuts a field off below a table.
pub(super) fn cut(field: &mut Field<f32>, table: &Table) {
    let grid = &field.grid;
    for (index, distance) in field.distance.iter_mut().enumerate() {
        let height = table.height(&grid.position(grid.node(index)));
        *distance = distance.max((-height / grid.voxel) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use crate::mesh::surface;

    #[test]
    fn what_is_below_the_table_is_cut_off_flat() {
        let grid = Grid { dims: [33; 3], origin: Point3::new(0.4, 0.1, -0.02), voxel: 2e-3 };
        let middle = Point3::new(0.4315, 0.1325, 0.01);
        let distance = |index: usize| {
            let node = Point3::from(grid.node(index).map(|i| i as f64)) * grid.voxel + grid.origin.coords;
            (((node - middle).norm() - 0.02) / grid.voxel) as f32
        };
        let distance: Vec<f32> = (0..grid.len()).map(distance).collect();
        let mut ball = Field { grid, colour: vec![[0.5; 3]; distance.len()], distance };
        cut(&mut ball, &Table::at_height(0.0013));
        let (mesh, _) = surface(&ball).expect("most of a ball");
        let low = mesh.points.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        let high = mesh.points.iter().map(|point| point.z).fold(f64::NEG_INFINITY, f64::max);
        assert!((low - 0.0013).abs() < 2e-4 && (high - 0.03).abs() < 2e-4, "{low} to {high}");
    }
}
