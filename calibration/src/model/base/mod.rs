//! What was found, in a model of the user's own: its names, its order and its places stay, and only what is known of the cell changes.
//!
//! | file | owns |
//! |---|---|
//! | `source` | the user's file with what it includes, and where its meshes lie from the new file |
//! | `classes` | default classes of an MJCF: what an element has that does not say it itself |
//! | `places` | where bodies and joints are |
//! | `alike` | where the user's arm stands, and why one is not built as the cell's |
//! | `names` | other names for what the cell brings along, where the user's model has them already |
//! | `arms` | which of the user's joints are the cell's |
//! | `controls` | actuators, replaced where they stand |
//! | `keyframes` | states that the user keeps, in the new order |
//! | `mjcf`, `urdf` | each format from end to end |

mod alike;
mod arms;
mod classes;
mod controls;
mod keyframes;
mod mjcf;
mod names;
mod places;
mod source;
#[cfg(test)]
mod test_clashes;
#[cfg(test)]
mod tests;
mod urdf;

use super::cell_model::CellModel;
use super::{Format, LeftOut, ModelFile};
use anyhow::bail;
use std::path::Path;
use twin::xml::Element;

/// The user's model.
#[derive(Debug, Clone, Copy)]
pub struct Base<'a> {
    pub file: &'a Path,
    /// Its joints that are the cell's, from base to flange; empty where the names tell.
    pub joints: &'a [String],
    /// Where the new file goes; `None`: to standard output.
    pub out: Option<&'a Path>,
}

/// A model that grows, and what of the cell is not in it.
struct Merging {
    root: Element,
    left_out: Vec<LeftOut>,
}

impl Merging {
    fn lacks(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }
}

/// The user's model with what `written`, the model of the cell in the same format, knows.
///
/// # Errors
/// One line: what of the user's model cannot be used, and the remedy.
pub(super) fn merge(
    written: ModelFile,
    model: &CellModel,
    format: Format,
    base: &Base<'_>,
) -> anyhow::Result<ModelFile> {
    let ModelFile { text, lines, mut left_out } = written;
    let cell = Element::read(&text).map_err(anyhow::Error::msg)?;
    let (text, more) = match format {
        Format::Mjcf => mjcf::merge(&cell, base)?,
        Format::Urdf => urdf::merge(model, base)?,
        Format::Sdf => bail!("--base goes with --to mjcf and --to urdf; without it an SDF is written to copy from"),
    };
    left_out.extend(more);
    Ok(ModelFile { text, lines, left_out })
}
