//! How the cell looks wherever it is drawn: its colours, the table top, the light.

use super::{Mesh, Model};
use crate::scene::{CellBody, MeshFileError, cell_bodies};
use shared_mem::cell::Cell;
use shared_mem::msg::object::ObjectName;
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
/// Of the objects one after the other, and again from the first on.
const OBJECTS: [[u8; 3]; 6] =
    [[222, 112, 40], [52, 120, 190], [92, 160, 70], [180, 70, 150], [214, 186, 60], [70, 160, 160]];

/// The table top at a height [m], base frame.
pub(crate) fn table_top(height: f32) -> Mesh {
    Mesh::plate([TABLE_MIDDLE_X, 0.0, height], TABLE_HALF, TABLE)
}

/// What of the objects is drawn: a body with a name, in its own frame.
#[derive(Debug, Clone)]
pub(crate) struct DrawnBody {
    /// Empty where the cell has one object without a name.
    pub(crate) name: ObjectName,
    pub(crate) mesh: Mesh,
    /// Place of its object among those of the cell.
    pub(crate) object: usize,
}

/// The objects of a cell, the one in question first, then the others in the order of the file.
///
/// # Errors
/// [`MeshFileError`] when a mesh cannot be used.
pub(crate) fn objects(cell: &Cell) -> Result<Vec<DrawnBody>, MeshFileError> {
    let drawn = |body: &CellBody| {
        let color = OBJECTS[body.object % OBJECTS.len()];
        DrawnBody { name: body.name, mesh: Mesh::new(body.surface().triangles(), color), object: body.object }
    };
    let (first, others): (Vec<_>, Vec<_>) =
        cell_bodies(cell)?.iter().map(drawn).partition(|body| body.object == cell.in_question);
    Ok(first.into_iter().chain(others).collect())
}

/// The splats around the robot, base frame; `None` where the cell names none.
///
/// # Errors
/// [`CellSplatsError`] when a file cannot be used.
pub(crate) fn background(cell: &Cell) -> Result<Option<Model>, CellSplatsError> {
    read_splats(cell, "background.splats", cell.background.as_ref().map(|background| background.splats.as_path()))
}

/// Bodies as they are shown: of splats where the cell names some, else their surfaces.
///
/// # Errors
/// [`CellSplatsError`] when a file cannot be used.
pub(crate) fn models(cell: &Cell, bodies: &[DrawnBody]) -> Result<Vec<Model>, CellSplatsError> {
    let model = |body: &DrawnBody| {
        let file = cell.objects.get(body.object).and_then(|object| object.splats.as_deref());
        Ok(read_splats(cell, "object.splats", file)?.unwrap_or_else(|| Model::Mesh(body.mesh.clone())))
    };
    bodies.iter().map(model).collect()
}

fn read_splats(cell: &Cell, key: &'static str, file: Option<&Path>) -> Result<Option<Model>, CellSplatsError> {
    let cloud = file.map(|file| SplatCloud::read(&cell.folder.join(file))).transpose();
    cloud.map(|cloud| cloud.map(Model::Splats)).map_err(|fault| CellSplatsError { key, fault })
}
