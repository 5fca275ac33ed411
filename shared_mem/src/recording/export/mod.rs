//! A session in another format: ROS 2 bags, TwinAligner clip folders, own clips; each from each.
//!
//! What a format cannot hold is left out and told, one sentence each, and what would have to be guessed is refused.
//! Joints, poses, pictures and what devices measured keep their stamps, put onto the robot's clock as every reader here
//! does; stamps of bags are Unix time, of TwinAligner folders seconds since the clip's start.
//!
//! | file | owns |
//! |---|---|
//! | `source` | a clip of any kind with everything beside its joints and poses |
//! | `rosbag`, `encode`, `definitions` | a ROS 2 bag |
//! | `folder`, `npz` | a TwinAligner clip folder |
//! | `native` | an own clip |

mod definitions;
mod encode;
mod folder;
mod native;
mod npz;
mod rosbag;
mod source;

use super::{ReadError, Session, WriteError};
use crate::cell::ClipEntry;
use crate::output::{OutputError, OutputFolder};
use serde::Serialize;
use source::Source;
use std::path::{Path, PathBuf};

/// What a session can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// ROS 2 bags (storage mcap, messages in CDR).
    Ros2,
    /// TwinAligner clip folders.
    TwinAligner,
    /// Own clips.
    Own,
}

/// Position [m] and orientation `w, x, y, z` of the flange in the base frame at joint positions [rad].
pub type FlangeAt<'a> = &'a dyn Fn(&[f64]) -> Option<([f64; 3], [f64; 4])>;

/// A clip that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Exported {
    /// File or folder, relative to the new session.
    pub file: PathBuf,
    /// Joint rows of what the arm did.
    pub measured: usize,
    /// Joint rows of what the arm was told.
    pub desired: usize,
    /// Poses of the object.
    pub poses: usize,
    /// Pictures.
    pub pictures: usize,
    /// What was odd in it, or found no room in the format.
    pub warnings: Vec<String>,
}

/// A session cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A clip cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// An own clip cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file or the folder cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The clip does not fit into the format.
    #[error("{}: {what}", path.display())]
    Unfit {
        /// The clip.
        path: PathBuf,
        /// Why, and what to do.
        what: String,
    },
}

/// Writes all clips of `session` and its cell.toml into the new folder `out`, which is there when all of it is written.
/// `flange_at` is asked where a format wants to know it. `told` hears of each clip as it is done.
///
/// # Errors
/// [`ExportError`]; nothing is there then.
pub fn export_session(
    session: &Session,
    to: Format,
    out: &Path,
    flange_at: FlangeAt<'_>,
    mut told: impl FnMut(&Exported),
) -> Result<Vec<Exported>, ExportError> {
    let folder = OutputFolder::create(out)?;
    let mut cell = session.cell.at_home_anywhere();
    cell.clips.clear();
    let mut done = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        let file = name(&entry.file, to, number);
        let source = Source::open(session, entry)?;
        let exported = match to {
            Format::Ros2 => rosbag::write(&source, &cell, folder.file(&file)?)?,
            Format::TwinAligner => folder::write(&source, &cell, (&folder, &file), flange_at)?,
            Format::Own => native::write(&source, &cell, folder.file(&file)?, flange_at)?,
        };
        cell.clips.push(ClipEntry { file, kind: entry.kind });
        told(&exported);
        done.push(exported);
    }
    folder.write(Path::new(CELL_TOML), cell.to_toml().as_bytes())?;
    folder.finish(CELL_TOML)?;
    Ok(done)
}

/// What makes a folder a session.
const CELL_TOML: &str = "cell.toml";

/// Name of a clip in the new session.
fn name(file: &Path, to: Format, number: usize) -> PathBuf {
    match to {
        Format::TwinAligner => format!("traj_{number:05}").into(),
        Format::Ros2 | Format::Own => {
            let stem =
                file.file_stem().map_or_else(|| format!("clip_{number:02}"), |s| s.to_string_lossy().into_owned());
            format!("{stem}.mcap").into()
        }
    }
}

impl Exported {
    fn of(source: &Source, target: &Path) -> Self {
        let clip = &source.clip;
        let mut warnings = clip.warnings.clone();
        warnings.extend(clip.damage.clone());
        Self {
            file: target.file_name().map_or_else(PathBuf::new, PathBuf::from),
            measured: clip.measured.len(),
            desired: clip.desired.len(),
            poses: clip.object.len(),
            pictures: 0,
            warnings,
        }
    }
}
