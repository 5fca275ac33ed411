//! A cell.toml to begin with: what flags, a URDF, a bag or recorded clips tell, and every other key as a comment with its
//! default and what it means.
//!
//! | file | owns |
//! |---|---|
//! | `facts` | what a person says, by flags or answers |
//! | `ask` | the questions on a terminal |
//! | `description` | a URDF from a file or a bag, xacro expanded |
//! | `clips` | recorded clips: their robot, topics and rates |
//! | `known` | all of it put together, with where each came from |
//! | `text` | the file's text |

mod ask;
mod clips;
mod description;
mod facts;
mod known;
#[cfg(test)]
mod tests;
mod text;

pub use ask::ask;
pub use facts::{Facts, Named, controller, edges, height, tool};

use known::Known;
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::output::Destination;
use std::path::{Path, PathBuf};
use twin::arm::{ArmModel, HeldJoint};

/// What a cell.toml is made of.
#[derive(Debug, Clone, Copy)]
pub struct Order<'a> {
    /// What a person says; it wins over what was recorded.
    pub facts: &'a Facts,
    /// A bag, or another log.
    pub bag: Option<&'a Path>,
    /// A folder of clips.
    pub clips: Option<&'a Path>,
    /// The new file.
    pub out: &'a Path,
    /// Whether a file that is there already is replaced.
    pub force: bool,
}

/// Something that the file says, and what said it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Taken {
    /// Its key: `robot.urdf`, or a block: `controller`.
    pub key: String,
    /// The flag, the file, or `usual`.
    pub from: String,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    pub file: PathBuf,
    /// The URDF beside it, where one was expanded or taken out of a bag.
    pub urdf: Option<PathBuf>,
    /// Names of the arm's joints, from base to flange; empty where no arm is known.
    pub arm: Vec<String>,
    /// Joints of its URDF that move and are none of the arm's; they are held where they are.
    pub held: Vec<HeldJoint>,
    /// What stands in it, and from where.
    pub taken: Vec<Taken>,
    /// Blocks that stand in it as comments, since nothing is known of them.
    pub not_known: Vec<&'static str>,
    /// What was odd in the sources, one sentence each.
    pub warnings: Vec<String>,
}

/// Writes a cell.toml.
///
/// # Errors
/// One line: which source cannot be used, or what is there already.
pub fn init(order: Order<'_>) -> anyhow::Result<Written> {
    let place = Destination::new(order.out, order.force)?;
    let known = Known::gather(order)?;
    let beside =
        known.urdf.as_ref().map(|(path, text)| Ok::<_, anyhow::Error>((Destination::new(path, order.force)?, text)));
    let beside = beside.transpose()?;
    let text = text::of(&known);
    // What hangs together between keys is checked in reading: gains that fit the arm, sizes that can be.
    Cell::parse(&text, order.out)?;
    if let Some((place, urdf)) = &beside {
        place.write(urdf)?;
    }
    place.write(&text)?;
    let held = known.arm.iter().flat_map(ArmModel::held_joints);
    Ok(Written {
        file: order.out.to_owned(),
        arm: known.arm.iter().flat_map(ArmModel::joint_names).cloned().collect(),
        held: held.cloned().collect(),
        urdf: beside.map(|(place, _)| place.path().to_owned()),
        not_known: text::not_known(&known.cell),
        taken: known.taken,
        warnings: known.warnings,
    })
}
