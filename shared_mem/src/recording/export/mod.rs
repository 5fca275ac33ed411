//! A session in another format: ROS 2 bags, TwinAligner clip folders, own clips; each from each.
//!
//! What a format cannot hold is left out and told, one sentence each, and what would have to be guessed is refused.
//! Joints, poses, pictures and what devices measured keep their stamps, put onto the robot's clock as every reader here
//! does; stamps of bags are Unix time, of TwinAligner folders seconds since the clip's start.
//!
//! | file | owns |
//! |---|---|
//! | `source` | a clip of any kind with everything beside its joints and poses |
//! | `rosbag`, `bag`, `encode` | a ROS 2 bag |
//! | `robot` | the robot's description, joints and frames in it |
//! | `metadata` | the `metadata.yaml` of a bag that is a folder |
//! | `folder`, `npz` | a TwinAligner clip folder |
//! | `native` | an own clip |
//! | `left_out` | what of the source is not in it |

mod bag;
mod encode;
mod folder;
mod left_out;
mod metadata;
mod native;
mod npz;
mod robot;
mod rosbag;
mod source;

pub use left_out::LeftOut;
pub use native::write_clip;

use super::{ReadError, RobotModel, Session, WriteError};
use crate::cell::ClipEntry;
use crate::output::{OutputError, OutputFolder};
use left_out::{Carried, left_out};
use serde::Serialize;
use source::Source;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a session can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// ROS 2 bags (storage mcap, messages in CDR), each one file.
    Ros2,
    /// The same, each a folder with a `metadata.yaml` as `ros2 bag record` writes it.
    Rosbag2,
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
    /// Poses of objects.
    pub poses: usize,
    /// Pictures.
    pub pictures: usize,
    /// Topics of the source that were left out, wholly or in part.
    pub left_out: Vec<LeftOut>,
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
    /// The folder that is to be replaced is no session that nothing else lies in.
    #[error("cannot replace {}: {what}; choose a new folder", path.display())]
    NotReplaced {
        /// The folder.
        path: PathBuf,
        /// Why.
        what: String,
    },
}

/// How a session is exported.
#[derive(Clone, Copy)]
pub struct Order<'a> {
    /// The format.
    pub to: Format,
    /// The new folder, which is there when all of it is written.
    pub out: &'a Path,
    /// Whether a session that is there already is replaced.
    pub force: bool,
    /// Asked where a format wants to know where the flange is.
    pub flange_at: FlangeAt<'a>,
    /// The robot, where its kinematics are known: bags and own clips then hold its description and frames, bags its joint states, too.
    pub robot: Option<&'a Arc<RobotModel>>,
}

/// Writes all clips of `session` and its cell.toml into a new folder. `told` hears of each clip as it is done.
///
/// # Errors
/// [`ExportError`]; nothing is there then, and what was there before is unchanged.
pub fn export_session(
    session: &Session,
    order: Order<'_>,
    mut told: impl FnMut(&Exported),
) -> Result<Vec<Exported>, ExportError> {
    let Order { to, flange_at, robot, .. } = order;
    let folder = begin(session, order)?;
    let mut cell = session.cell.at_home_anywhere();
    cell.clips.clear();
    let mut done = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        let file = name(&entry.file, to, number);
        let source = Source::open(session, entry)?;
        let mut carried = Carried::default();
        let into = (&cell, &mut carried);
        let shown = robot.map(Arc::as_ref);
        let mut exported = match to {
            Format::Ros2 => rosbag::write(&source, into, folder.file(&file)?, shown)?.0,
            Format::Rosbag2 => {
                let (exported, contents) = rosbag::write(&source, into, folder.file(&file)?, shown)?;
                let text = metadata::text(&exported.file.to_string_lossy(), &contents);
                folder.write(&file.with_file_name(METADATA_YAML), text.as_bytes())?;
                exported
            }
            Format::TwinAligner => folder::write(&source, into, (&folder, &file), flange_at)?,
            Format::Own => native::write(&source, into, folder.file(&file)?, (flange_at, robot))?,
        };
        if !(to == Format::Own && source.is_own()) {
            exported.left_out = left_out(&source, &cell, to, (&exported, &carried))?;
        }
        exported.file.clone_from(&file);
        cell.clips.push(ClipEntry { file, kind: entry.kind });
        told(&exported);
        done.push(exported);
    }
    folder.write(Path::new(CELL_TOML), cell.to_toml().as_bytes())?;
    folder.finish(CELL_TOML)?;
    Ok(done)
}

/// The new folder; in place of another session only where that was asked for.
fn begin(session: &Session, Order { out, force, .. }: Order<'_>) -> Result<OutputFolder, ExportError> {
    let clips = session.clips.iter().map(|entry| session.folder.join(&entry.file));
    let sources: Vec<PathBuf> = clips.chain([session.folder.clone()]).collect();
    session_folder(out, force, &sources)
}

/// Begins a folder for a new session. With `force` it takes the place of another session that nothing else lies in, and none of
/// the `sources` that it is made of.
///
/// # Errors
/// [`ExportError`] when there is something that is kept, or the folder cannot be written.
pub fn session_folder(out: &Path, force: bool, sources: &[PathBuf]) -> Result<OutputFolder, ExportError> {
    let is_full = std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
    if !force || !is_full {
        return Ok(OutputFolder::create(out)?);
    }
    let refused = |what: String| Err(ExportError::NotReplaced { path: out.to_owned(), what });
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if sources.iter().any(|source| whole(source).starts_with(whole(out))) {
        return refused("it holds what is exported or imported".into());
    }
    for entry in std::fs::read_dir(out).map_err(ReadError::io(out))? {
        let name = entry.map_err(ReadError::io(out))?.file_name().to_string_lossy().into_owned();
        let of_session = [CELL_TOML, IMPORT_TOML, ROBOT_URDF].contains(&name.as_str())
            || name.ends_with(".mcap")
            || name.starts_with("traj_");
        let of_session = of_session || out.join(&name).join(METADATA_YAML).is_file();
        if !of_session {
            return refused(format!("it holds {name}, which is no part of a session"));
        }
    }
    Ok(OutputFolder::replacing(out)?)
}

/// What makes a folder a session.
const CELL_TOML: &str = "cell.toml";
/// What makes a folder a ROS 2 bag.
const METADATA_YAML: &str = "metadata.yaml";
/// What a session that was imported keeps beside it.
const IMPORT_TOML: &str = "import.toml";
const ROBOT_URDF: &str = "robot.urdf";

/// Name of a clip in the new session.
fn name(file: &Path, to: Format, number: usize) -> PathBuf {
    match to {
        Format::TwinAligner => format!("traj_{number:05}").into(),
        Format::Ros2 | Format::Own => format!("{}.mcap", stem(file, number)).into(),
        Format::Rosbag2 => {
            let stem = stem(file, number);
            format!("{stem}/{stem}_0.mcap").into()
        }
    }
}

/// Name of a clip without extension; of the first file of a bag's folder that of the folder.
fn stem(file: &Path, number: usize) -> String {
    let stem = file.file_stem().map_or_else(|| format!("clip_{number:02}"), |stem| stem.to_string_lossy().into_owned());
    let folder = file.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    folder.filter(|folder| stem == format!("{folder}_0")).unwrap_or(stem)
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
            poses: clip.object.len() + clip.others.iter().map(|other| other.series.len()).sum::<usize>(),
            pictures: 0,
            left_out: Vec::new(),
            warnings,
        }
    }
}
