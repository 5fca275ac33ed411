//! The session folder: `cell.toml` and numbered clips. It is valid after every clip: a clip is entered into cell.toml
//! only once it is complete, and nothing that is there is ever overwritten.

use shared_mem::cell::{Cell, CellError, ClipEntry, ClipKind};
use shared_mem::input::{self, InputError};
use shared_mem::output::{self, OutputError};
use std::io;
use std::path::{Path, PathBuf};

/// A session folder that clips are added to. One that was created here and holds no file but its cell.toml when this is dropped
/// is removed again: a capture that failed before its first clip leaves nothing behind.
#[derive(Debug, PartialEq)]
pub struct Session {
    folder: PathBuf,
    /// Whether the folder did not exist before.
    new: bool,
}

/// A session folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    #[error("cannot use {}: {source}; choose another folder with --out or free space there", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Its cell.toml cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Its cell.toml cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Its cell.toml is broken.
    #[error(transparent)]
    Cell(#[from] CellError),
    /// It was recorded in another cell.
    #[error("{} belongs to another cell: [{block}] differs from --cell; choose a new folder with --out", folder.display())]
    OtherCell {
        folder: PathBuf,
        /// Block of cell.toml that differs.
        block: &'static str,
    },
}

impl Session {
    /// Opens `folder`, or creates it with a copy of `cell` without clips: with the comments of the file `from` which that was read.
    ///
    /// # Errors
    /// [`SessionError`] when it cannot be written, or belongs to another cell.
    pub fn open(folder: &Path, cell: &Cell, from: &Path) -> Result<Self, SessionError> {
        let session = Self { folder: folder.to_owned(), new: !folder.exists() };
        let text = Cell::text(from).ok().and_then(|text| cell.text_elsewhere(&text));
        let cell = cell.at_home_anywhere();
        if session.cell_file().exists() {
            let known = Cell::read(&session.cell_file())?.at_home_anywhere();
            return match differing_block(&known, &cell) {
                None => Ok(session),
                Some(block) => Err(SessionError::OtherCell { folder: folder.to_owned(), block }),
            };
        }
        std::fs::create_dir_all(folder).map_err(|source| SessionError::Write { path: folder.to_owned(), source })?;
        session.write(&text.unwrap_or_else(|| Cell { clips: Vec::new(), ..cell }.to_toml()))?;
        Ok(session)
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The session's own cell.toml.
    pub fn cell_file(&self) -> PathBuf {
        self.folder.join("cell.toml")
    }

    /// Name of the next clip, one above the highest number that is on disk or entered, and the number itself.
    ///
    /// # Errors
    /// [`SessionError`] when folder or cell.toml cannot be read.
    pub fn next_clip(&self) -> Result<(usize, PathBuf), SessionError> {
        let unreadable = |source| SessionError::Write { path: self.folder.clone(), source };
        let mut names: Vec<PathBuf> = Cell::read(&self.cell_file())?.clips.into_iter().map(|clip| clip.file).collect();
        for entry in std::fs::read_dir(&self.folder).map_err(unreadable)? {
            names.push(entry.map_err(unreadable)?.file_name().into());
        }
        let number = names.iter().filter_map(|name| number_of(name)).max().map_or(0, |highest| highest + 1);
        Ok((number, PathBuf::from(format!("clip_{number:02}.mcap"))))
    }

    /// Enters a complete clip. What stands in cell.toml, comments included, is kept.
    ///
    /// # Errors
    /// [`SessionError`] when cell.toml cannot be read or written.
    pub fn enter(&self, file: &Path, kind: ClipKind) -> Result<(), SessionError> {
        let path = self.cell_file();
        let mut text = input::text(&path, input::Kind::Configuration)?;
        let entry = Cell { clips: vec![ClipEntry { file: file.to_owned(), kind }], ..Cell::default() };
        text.push('\n');
        text.push_str(&entry.to_toml());
        self.write(&text)
    }

    /// Replaces cell.toml in one step, so that no reader and no crash ever sees half of it.
    fn write(&self, text: &str) -> Result<(), SessionError> {
        Ok(output::write(&self.cell_file(), text)?)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let empty = |folder: &Path| {
            std::fs::read_dir(folder)
                .is_ok_and(|entries| entries.flatten().all(|entry| entry.file_name() == "cell.toml"))
        };
        if self.new && empty(&self.folder) {
            // What cannot be removed stays, and is a session without clips that a later capture goes on with.
            let _ = std::fs::remove_file(self.cell_file()).and_then(|()| std::fs::remove_dir(&self.folder));
        }
    }
}

/// `7` of `clip_07.mcap`.
pub fn number_of(file: &Path) -> Option<usize> {
    file.to_str()?.strip_prefix("clip_")?.strip_suffix(".mcap")?.parse().ok()
}

/// First block that says something else. Clips, and where a simulated cell starts, may differ.
fn differing_block(a: &Cell, b: &Cell) -> Option<&'static str> {
    let blocks = [
        ("robot", a.robot == b.robot),
        ("controller", a.controller == b.controller),
        ("tool", a.tool == b.tool),
        ("table", a.table == b.table),
        ("object", a.objects == b.objects),
        ("camera", a.camera == b.camera),
    ];
    blocks.into_iter().find_map(|(name, same)| (!same).then_some(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::{Robot, Table};

    fn cell() -> Cell {
        Cell {
            robot: Some(Robot { model: Some("fr3".into()), ..Robot::default() }),
            table: Some(Table { height: 0.0 }),
            ..Cell::default()
        }
    }

    #[test]
    fn clips_are_numbered_on_and_each_is_entered_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("session");
        let session = Session::open(&path, &cell(), Path::new("no_file")).expect("a new session");
        assert_eq!(session.next_clip().expect("a name"), (0, "clip_00.mcap".into()));
        session.enter(Path::new("clip_00.mcap"), ClipKind::Excitation).expect("entered");
        let again = Session::open(&path, &cell(), Path::new("no_file")).expect("the same session");
        assert_eq!(again.next_clip().expect("a name"), (1, "clip_01.mcap".into()));
        again.enter(Path::new("clip_01.mcap"), ClipKind::ControlHitSlide).expect("entered");
        let read = Cell::read(&again.cell_file()).expect("a valid cell.toml");
        let clips: Vec<_> = read.clips.iter().map(|c| (c.file.to_str(), c.kind)).collect();
        let expected =
            [(Some("clip_00.mcap"), ClipKind::Excitation), (Some("clip_01.mcap"), ClipKind::ControlHitSlide)];
        assert_eq!(clips, expected);
    }

    #[test]
    fn a_clip_left_by_an_aborted_capture_is_not_overwritten() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = Session::open(folder.path(), &cell(), Path::new("no_file")).expect("a session");
        std::fs::write(folder.path().join("clip_04.mcap"), "half a clip").expect("a file");
        assert_eq!(session.next_clip().expect("a name").1, PathBuf::from("clip_05.mcap"));
    }

    #[test]
    fn a_capture_that_failed_before_its_first_clip_leaves_no_folder() {
        let base = tempfile::tempdir().expect("a folder");
        let folder = base.path().join("session");
        drop(Session::open(&folder, &cell(), Path::new("no_file")).expect("a session"));
        assert!(!folder.exists());
        let session = Session::open(&folder, &cell(), Path::new("no_file")).expect("a session");
        std::fs::write(folder.join("clip_00.mcap"), "half a clip").expect("a file");
        drop(session);
        assert!(folder.join("cell.toml").exists() && folder.join("clip_00.mcap").exists());
        // It was there before this capture.
        std::fs::remove_file(folder.join("clip_00.mcap")).expect("removed");
        drop(Session::open(&folder, &cell(), Path::new("no_file")).expect("a session"));
        assert!(folder.join("cell.toml").exists());
    }

    #[test]
    fn comments_in_an_existing_session_survive() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "# our best cell\n[robot]\nmodel = \"fr3\"\n[table]\nheight = 0.0\n";
        std::fs::write(folder.path().join("cell.toml"), text).expect("a file");
        let session = Session::open(folder.path(), &cell(), Path::new("no_file")).expect("the session");
        session.enter(Path::new("clip_00.mcap"), ClipKind::Excitation).expect("entered");
        let after = std::fs::read_to_string(session.cell_file()).expect("text");
        assert!(after.starts_with(text) && after.contains("[[clip]]"), "{after}");
    }

    #[test]
    fn comments_of_the_laboratorys_file_come_along() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("lab.toml");
        let text = "# our best cell\n[robot]\nmodel = \"fr3\"\n[table]\nheight = 0.0 # measured\n";
        std::fs::write(&file, text).expect("a file");
        let session = folder.path().join("session");
        let session = Session::open(&session, &Cell::read(&file).expect("a cell"), &file).expect("a session");
        assert_eq!(std::fs::read_to_string(session.cell_file()).expect("text"), text);
    }

    #[test]
    fn a_session_of_another_cell_is_refused_by_block() {
        let folder = tempfile::tempdir().expect("a folder");
        Session::open(folder.path(), &cell(), Path::new("no_file")).expect("a session");
        let other = Cell { table: Some(Table { height: 0.1 }), ..cell() };
        let error = Session::open(folder.path(), &other, Path::new("no_file")).unwrap_err().to_string();
        assert!(error.contains("[table]") && error.contains("--out"), "{error}");
    }

    #[test]
    fn a_urdf_beside_the_laboratorys_file_is_found_from_the_session() {
        let folder = tempfile::tempdir().expect("a folder");
        let robot = Robot { urdf: Some("arm.urdf".into()), ..Robot::default() };
        let lab = Cell { robot: Some(robot), folder: "/lab".into(), ..Cell::default() };
        let session = Session::open(folder.path(), &lab, Path::new("no_file")).expect("a session");
        let read = Cell::read(&session.cell_file()).expect("a valid cell.toml");
        assert_eq!(read.robot.and_then(|r| r.urdf), Some("/lab/arm.urdf".into()));
        Session::open(folder.path(), &lab, Path::new("no_file")).expect("still the same cell");
    }
}
