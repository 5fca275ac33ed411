//! Files of splats: which kind one is, read whole and checked, and written as a 3DGS PLY.

use super::cloud::SplatCloud;
use super::{compressed, ply};
use shared_mem::console;
use shared_mem::input::{self, InputError};
use shared_mem::output::{self, Output, OutputError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A splat file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SplatError {
    /// Missing, no file, or too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A folder that cannot be listed.
    #[error("cannot list the splats in {}: {source}; give the path of a folder", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not what its name says.
    #[error("{}: {what}; export it again as a 3DGS PLY or a SuperSplat compressed PLY", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// A folder of a robot's splats without any.
    #[error("{} holds no splats of links: name them like `link3.ply`", folder.display())]
    NoLinks {
        /// The folder.
        folder: PathBuf,
    },
}

impl SplatCloud {
    /// Reads a PLY file of either kind, and says on standard error what was left out of it.
    ///
    /// # Errors
    /// [`SplatError`] when it is missing, most of its splats are cut off or hold values that are no numbers, or it is another kind of
    /// file.
    pub fn read(path: &Path) -> Result<Self, SplatError> {
        let bytes = input::bytes(path, input::Kind::Splats)?;
        let read = parsed(&bytes).map_err(|what| SplatError::Content { path: path.to_owned(), what })?;
        for remark in &read.remarks {
            console::line(format_args!("{}: {remark}", path.display()));
        }
        Ok(read.cloud)
    }

    /// The same from a file's bytes.
    ///
    /// # Errors
    /// A sentence that says what is wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        Ok(parsed(bytes)?.cloud)
    }

    /// A 3DGS PLY.
    pub fn ply(&self) -> Vec<u8> {
        ply::write(self)
    }

    /// Writes the file `path` as a 3DGS PLY.
    ///
    /// # Errors
    /// [`OutputError`] where it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        output::write(path, self.ply())
    }

    /// Writes a 3DGS PLY into an output, which the caller finishes.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_to(&self, output: &mut Output) -> Result<(), OutputError> {
        output.write_all(&self.ply()).map_err(|error| OutputError::of(output.path(), error))
    }
}

/// The splats of a file whose values are numbers. Trainers leave a few in a million that are none.
fn parsed(bytes: &[u8]) -> Result<ply::Read, String> {
    let file = ply::File::parse(bytes)?;
    if let Some(cut) = file.cut.as_ref().filter(|_| !file.is_half_there()) {
        return Err(cut.clone());
    }
    let mut read = if file.element("chunk").is_some() { compressed::read(&file)? } else { ply::read(&file)? };
    read.remarks.extend(file.cut.map(|cut| format!("{cut}, which were read")));
    let (all, fine) = (read.cloud.splats.len(), read.cloud.finite());
    let left_out = fine.iter().filter(|fine| !**fine).count();
    if 2 * left_out > all {
        return Err(format!("{left_out} of {all} splats hold a value that is no finite number"));
    }
    if left_out > 0 {
        read.cloud = read.cloud.only(|number| fine[number]);
        read.remarks.push(format!("{left_out} of {all} splats left out: they hold a value that is no finite number"));
    }
    Ok(read)
}
