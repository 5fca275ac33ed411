//! What was identified and diagnosed, as a model of the cell for another simulator: to run as it is, or to bring the user's own
//! model up to date with, joint by joint of the same name.
//!
//! cell.toml and theta.toml become one `CellModel` in numbers that every simulator means the same by. An effect says
//! itself what it changes there ([`twin::effects::Change`]); a writer for each format knows which keys hold it. What the format
//! has no key for, or no law, is left out and named.

mod base;
mod cell_model;
mod known;
mod look;
mod mjcf;
mod sdf;
mod sheet;
mod urdf;

pub use base::Base;
pub use known::{LeftOut, Line};
pub use look::Look;

use cell_model::CellModel;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use sheet::Sheet;

/// A format of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Mjcf,
    Urdf,
    Sdf,
}

/// A model file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// All of it.
    pub text: String,
    /// What stands in it.
    pub lines: Vec<Line>,
    /// What was found and is not in it.
    pub left_out: Vec<LeftOut>,
}

/// The model of `cell` with what `theta` knows; with `look` it can be seen (an SDF stays as it is).
///
/// # Errors
/// Robot, mesh or effect that cannot be used; one line with the remedy.
pub fn write(cell: &Cell, theta: &Theta, format: Format, look: Option<Look>) -> anyhow::Result<ModelFile> {
    Ok(written(CellModel { look, ..CellModel::of(cell, theta)? }, format))
}

/// The user's own model, in the same format, with what is known of the cell.
///
/// # Errors
/// As [`write`], and what of the user's model cannot be used.
pub fn write_into(cell: &Cell, theta: &Theta, format: Format, base: &Base<'_>) -> anyhow::Result<ModelFile> {
    let model = CellModel::of(cell, theta)?;
    base::merge(written(CellModel::of(cell, theta)?, format), &model, format, base)
}

fn written(model: CellModel, format: Format) -> ModelFile {
    let writer = match format {
        Format::Mjcf => mjcf::write,
        Format::Urdf => urdf::write,
        Format::Sdf => sdf::write,
    };
    let Sheet { mut xml, lines, mut left_out } = writer(&model);
    left_out.extend(model.beyond);
    if !left_out.is_empty() {
        xml.comment("Not in this file:");
    }
    for LeftOut { what, why } in &left_out {
        xml.comment(&format!("{what}: {why}"));
    }
    ModelFile { text: xml.finish(), lines, left_out }
}

#[cfg(test)]
mod tests;
