//! Where an output is to go, looked at before the work that makes it: an hour of computing does not end at a name that is
//! taken, or at a folder that is not there. What is there already is kept unless its replacement was asked for.

use super::error::folder_of;
use super::unfinished::MadeFolders;
use super::{Output, OutputError, Target, target_of};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A place that an output may take.
#[derive(Debug, Clone)]
pub struct Destination {
    path: PathBuf,
    replaces: bool,
    /// Folders on the way that were made for it: those that stay empty go with this.
    _made: Arc<MadeFolders>,
}

impl Destination {
    /// Looks at `path` and leaves it as it is. `force`: a file that is there will be replaced.
    ///
    /// # Errors
    /// [`OutputError`] when there is a file and `force` is not given, or when the folder or that file cannot be written.
    pub fn new(path: &Path, force: bool) -> Result<Self, OutputError> {
        Self::looked_at(path, force, MadeFolders::default())
    }

    /// The same where folders on the way may be made; they go again where nothing comes to lie in them.
    ///
    /// # Errors
    /// As [`Destination::new`].
    pub fn in_new_folder(path: &Path, force: bool) -> Result<Self, OutputError> {
        let made = MadeFolders::make(folder_of(path)).map_err(|error| OutputError::new(path, &error, 0, 0))?;
        Self::looked_at(path, force, made)
    }

    fn looked_at(path: &Path, force: bool, made: MadeFolders) -> Result<Self, OutputError> {
        match target_of(path).map_err(|error| OutputError::new(path, &error, 0, 0))? {
            // Nothing of before could be lost in a device, and opening a pipe would tell its reader of an end.
            Target::Straight => {}
            Target::File { exists: true, .. } if !force => return Err(OutputError::kept(path)),
            Target::File { .. } => drop(Output::create(path)?),
        }
        Ok(Self { path: path.to_owned(), replaces: force, _made: Arc::new(made) })
    }

    /// The same of an output that need not be asked for.
    ///
    /// # Errors
    /// As [`Destination::new`].
    pub fn of(path: Option<&Path>, force: bool) -> Result<Option<Self>, OutputError> {
        path.map(|path| Self::new(path, force)).transpose()
    }

    /// Refuses outputs of one command that would take each other's place.
    ///
    /// # Errors
    /// [`OutputError`] with the second of two that are one file.
    pub fn apart(outputs: &[Option<&Path>]) -> Result<(), OutputError> {
        let mut taken = Vec::new();
        for path in outputs.iter().flatten() {
            let target = target_of(path).map_err(|error| OutputError::new(path, &error, 0, 0))?;
            // Into a device all of them may go.
            let Target::File { path: target, .. } = target else { continue };
            let folder = folder_of(&target).canonicalize();
            let place = folder.map(|folder| folder.join(target.file_name().unwrap_or_default()));
            let place = place.map_err(|error| OutputError::new(path, &error, 0, 0))?;
            if taken.contains(&place) {
                let kind = io::ErrorKind::InvalidInput;
                return Err(OutputError::refused(
                    path,
                    kind,
                    "it is another output's place",
                    "give each a name of its own",
                ));
            }
            taken.push(place);
        }
        Ok(())
    }

    /// The name that was asked for.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Begins the output. A file that appeared in the meantime is kept, too.
    ///
    /// # Errors
    /// As [`Destination::new`].
    pub fn begin(&self) -> Result<Output, OutputError> {
        match target_of(&self.path).map_err(|error| OutputError::new(&self.path, &error, 0, 0))? {
            Target::File { exists: true, .. } if !self.replaces => Err(OutputError::kept(&self.path)),
            Target::File { path: target, exists: false } => Output::beside(&self.path, target, !self.replaces),
            Target::File { .. } | Target::Straight => Output::create(&self.path),
        }
    }

    /// Removes the file that is to be replaced, for an output that is there from its beginning and grows.
    ///
    /// # Errors
    /// [`OutputError`] when it cannot be removed.
    pub fn clear(&self) -> Result<(), OutputError> {
        match std::fs::remove_file(&self.path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(OutputError::new(&self.path, &error, 0, 0)),
            _ => Ok(()),
        }
    }

    /// Writes the output, whole or not at all.
    ///
    /// # Errors
    /// [`OutputError`]; what was there before is unchanged.
    pub fn write(&self, bytes: impl AsRef<[u8]>) -> Result<(), OutputError> {
        let bytes = bytes.as_ref();
        let mut output = self.begin()?;
        output.needed = bytes.len() as u64;
        output.write_all(bytes).map_err(|error: io::Error| OutputError::of(&self.path, error))?;
        output.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_that_is_there_is_kept_and_named_with_the_way_to_replace_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("d.json");
        fs::write(&path, "of before").expect("room");
        let line = Destination::new(&path, false).expect_err("it is there").to_string();
        assert!(line.contains("d.json") && line.contains("--force") && line.lines().count() == 1, "{line}");
        assert_eq!(fs::read(&path).expect("the file"), b"of before");
        Destination::new(&path, true).and_then(|place| place.write("new")).expect("asked for");
        assert_eq!(fs::read(&path).expect("the file"), b"new");
    }

    #[test]
    fn two_outputs_of_one_place_are_refused_however_they_are_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let apart = |a: &str, b: &str| Destination::apart(&[Some(&path(a)), None, Some(&path(b))]);
        apart("a.json", "b.json").expect("two places");
        for other in ["a.json", "./a.json"] {
            let line = apart("a.json", other).expect_err("one place").to_string();
            assert!(line.contains("another output's place; give each a name of its own"), "{line}");
        }
        Destination::apart(&[Some(Path::new("/dev/null")); 2]).expect("a device takes both");
    }

    #[test]
    fn a_file_that_appears_while_the_work_is_done_is_kept_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("d.json");
        let place = Destination::new(&path, false).expect("nothing is there");
        assert!(!path.exists(), "looking leaves nothing");
        fs::write(&path, "of another").expect("room");
        assert!(place.write("mine").is_err());
        assert_eq!(fs::read(&path).expect("the file"), b"of another");
    }

    #[test]
    fn a_folder_that_is_not_there_or_takes_nothing_is_told_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let line = Destination::new(&folder.path().join("nowhere/d.json"), true).expect_err("no folder").to_string();
        assert!(line.contains("there is no folder") && line.contains("nowhere"), "{line}");
        let line = Destination::new(Path::new("/sys/d.json"), false).expect_err("no files there").to_string();
        assert!(line.contains("/sys/d.json"), "{line}");
        assert!(Destination::new(folder.path(), true).expect_err("a folder").to_string().contains("it is a folder"));
    }

    #[test]
    fn folders_on_the_way_stay_only_where_something_comes_to_lie_in_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("made/deep/clip.mcap");
        let place = Destination::in_new_folder(&path, false).expect("a place");
        assert!(path.parent().is_some_and(Path::is_dir));
        drop(place);
        assert!(!folder.path().join("made").exists());
        Destination::in_new_folder(&path, false).and_then(|place| place.write("bytes")).expect("a place");
        assert_eq!(fs::read(&path).expect("the file"), b"bytes");
    }

    #[test]
    fn devices_take_outputs_without_being_forced() {
        Destination::new(Path::new("/dev/null"), false).and_then(|place| place.write("gone")).expect("a device");
    }
}
