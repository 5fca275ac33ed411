//! How the cell looks wherever it is drawn: its colours, the table top, the light.

use super::{Mesh, Model};
use crate::scene::{MeshFileError, ObjectModel};
use shared_mem::cell::Cell;
use splat::{SplatCloud, SplatError};
use std::path::Path;

/// Splats that cell.toml names cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{fault} (`{key}` in cell.toml)")]
pub struct CellSplatsError {
    key: &'static str,
    fault: SplatError,
}

/// What lies behind everything.
pub(crate) const BACKGROUND: [u8; 3] = [168, 186, 204];
/// Towards the light, base frame: above, on the side that cameras in front of the robot see.
pub(crate) const LIGHT: [f64; 3] = [0.55, 0.25, 0.8];

/// Half edges of the drawn table top and its middle in front of the robot [m]; physics knows an endless plane.
const TABLE_HALF: [f32; 2] = [0.7, 0.8];
const TABLE_MIDDLE_X: f32 = 0.3;
const TABLE: [u8; 3] = [196, 172, 140];
const OBJECT: [u8; 3] = [222, 112, 40];

/// The table top at a height [m], base frame.
pub(crate) fn table_top(height: f32) -> Mesh {
    Mesh::plate([TABLE_MIDDLE_X, 0.0, height], TABLE_HALF, TABLE)
}

/// The object of a cell, in its own frame; `None` where the cell has none.
///
/// # Errors
/// [`MeshFileError`] when its mesh cannot be used.
pub(crate) fn object(cell: &Cell) -> Result<Option<Mesh>, MeshFileError> {
    Ok(ObjectModel::new(cell, None)?.map(|model| Mesh::new(model.shape.triangles(), OBJECT)))
}

/// The splats around the robot, base frame, and those of the object in its own; `None` where the cell names none.
///
/// # Errors
/// [`CellSplatsError`] when a file cannot be used.
pub(crate) fn splats(cell: &Cell) -> Result<[Option<Model>; 2], CellSplatsError> {
    let read = |key, file: Option<&Path>| {
        let cloud = file.map(|file| SplatCloud::read(&cell.folder.join(file))).transpose();
        cloud.map(|cloud| cloud.map(Model::Splats)).map_err(|fault| CellSplatsError { key, fault })
    };
    let around = cell.background.as_ref().map(|background| background.splats.as_path());
    let object = cell.object().and_then(|object| object.splats.as_deref());
    Ok([read("background.splats", around)?, read("object.splats", object)?])
}
