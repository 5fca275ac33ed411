//! A session: a folder with cell.toml and clips, or a single clip beside a cell.toml.

use super::error::ReadError;
use crate::cell::{Cell, ClipEntry, ClipKind};
use crate::typed::Command;
use std::path::{Path, PathBuf};

/// Clips and the cell they were recorded in.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Folder that the clips' files are relative to.
    pub folder: PathBuf,
    /// What the laboratory knows about its cell.
    pub cell: Cell,
    /// Clips, in the order of cell.toml.
    pub clips: Vec<ClipEntry>,
    /// How it was named.
    pub files: SessionFiles,
}

/// How a person names a session: the folder or the clip, and the cell.toml where another one than the session's own counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SessionFiles {
    /// The folder or the clip.
    pub session: PathBuf,
    /// The cell.toml that was given.
    pub cell: Option<PathBuf>,
}

impl SessionFiles {
    /// A command about this session, as it is typed.
    pub fn command(&self, verb: &str) -> Command {
        Command::new(verb).path(&self.session).option_of("--cell", self.cell.as_deref())
    }
}

impl Session {
    /// Opens a session folder (with cell.toml), or a single clip: its cell.toml lies beside it, or is the one that an own
    /// clip carries.
    ///
    /// # Errors
    /// [`ReadError`] when there is no cell.toml, it cannot be used, or it lists no clips.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::open_with(path, None)
    }

    /// The same with a cell.toml that lies elsewhere.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn open_with(path: &Path, cell_toml: Option<&Path>) -> Result<Self, ReadError> {
        let metadata = std::fs::metadata(path).map_err(ReadError::io(path))?;
        let files = SessionFiles { session: path.to_owned(), cell: cell_toml.map(Path::to_owned) };
        let is_session = metadata.is_dir() && !super::twinaligner::is_clip_folder(path);
        if is_session {
            if cell_toml.is_none() && path.join("cell.toml").symlink_metadata().is_err() {
                let what = "has no cell.toml; give one with `--cell cell.toml`, or make a session of its logs with `calibration \
                            import`";
                return Err(ReadError::kind(path, what));
            }
            let cell = Cell::read(&cell_toml.map_or_else(|| path.join("cell.toml"), Path::to_owned))?;
            if cell.clips.is_empty() {
                return Err(ReadError::kind(path, "cell.toml lists no clips; add `[[clip]] file = \"...\"` blocks"));
            }
            return Ok(Self { folder: path.to_owned(), clips: cell.clips.clone(), cell, files });
        }
        if path.extension().is_some_and(|ending| ending == "toml") {
            return Err(ReadError::kind(path, "is a TOML file and no clip; give the session's folder, or a clip"));
        }
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let beside = folder.join("cell.toml");
        let cell = match cell_toml {
            Some(given) => Cell::read(given)?,
            None if beside.is_file() => Cell::read(&beside)?,
            None => carried_cell(path)?,
        };
        let file = path.file_name().map_or_else(|| path.to_owned(), PathBuf::from);
        let listed = cell.clips.iter().find(|clip| clip.file == file).cloned();
        let clip = match listed {
            Some(clip) => clip,
            None => ClipEntry { kind: kind_of(path, &cell)?, file },
        };
        Ok(Self { folder, clips: vec![clip], cell, files })
    }

    /// Reads one of the clips.
    ///
    /// # Errors
    /// As [`super::read_clip`].
    pub fn read(&self, clip: &ClipEntry) -> Result<super::Clip, ReadError> {
        super::read_clip(&self.folder.join(&clip.file), clip.kind, &self.cell)
    }

    /// Reads the arm's measured joints of a clip alone: it may lack all else that a clip of its kind has.
    ///
    /// # Errors
    /// As [`Session::read`], for the measured joints alone.
    pub fn read_measured(&self, clip: &ClipEntry) -> Result<super::Clip, ReadError> {
        super::read::read_measured(&self.folder.join(&clip.file), clip.kind, &self.cell)
    }
}

/// The cell.toml that an own clip carries.
fn carried_cell(path: &Path) -> Result<Cell, ReadError> {
    let info = if path.is_file() { super::read_clip_info(path)? } else { None };
    let text = info.and_then(|info| info.cell_toml).ok_or_else(|| {
        ReadError::kind(path, "has no cell.toml beside it and carries none; give one with `--cell cell.toml`")
    })?;
    Ok(Cell::parse(&text, path)?)
}

/// What a clip that cell.toml does not list is about: an arm may have moved alone in a cell that has an object too.
fn kind_of(path: &Path, cell: &Cell) -> Result<ClipKind, ReadError> {
    Ok(match (&cell.robot, cell.object()) {
        (None, _) => ClipKind::FreeMotion,
        (Some(_), Some(_)) if super::read::shows_object(path, cell)? => ClipKind::ControlHitSlide,
        (Some(_), _) => ClipKind::Excitation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_a_cell_and_a_cell_in_place_of_a_session_are_told_what_is_wanted() {
        let folder = tempfile::tempdir().expect("a folder");
        let why = |path: &Path| Session::open(path).expect_err("no session").to_string();
        let bare = why(folder.path());
        assert!(bare.contains("has no cell.toml") && bare.contains("`calibration import`"), "{bare}");
        let cell = folder.path().join("cell.toml");
        std::fs::write(&cell, "").expect("room");
        assert!(why(&cell).contains("give the session's folder"), "{}", why(&cell));
    }

    #[test]
    fn a_command_about_a_session_names_it_as_it_was_named() {
        let files = SessionFiles { session: "on monday".into(), cell: Some("the cell.toml".into()) };
        assert_eq!(files.command("twin replay").to_string(), "twin replay 'on monday' --cell 'the cell.toml'");
    }
}
