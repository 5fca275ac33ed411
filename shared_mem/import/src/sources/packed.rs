//! Logs that are packed as a whole, as `ros2 bag record --compression-mode file` does it and as people do before they send one:
//! unpacked into a temporary file, which is gone once it is read.

use super::{failed, stem};
use crate::error::ImportError;
use crate::log::Log;
use shared_mem::budget::{Budget, BudgetError};
use shared_mem::input::{self, Packing};
use std::fs::File;
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

/// Endings of packed files.
const ENDINGS: [&str; 8] = ["gz", "zst", "zstd", "bz2", "lz4", "xz", "7z", "zip"];
/// How much of a file tells what it is [bytes].
const START: usize = 64;
/// Bytes that are unpacked between two looks at the budget, and in a step of it.
const BLOCK: usize = 1 << 20;
const BYTES_OF_A_STEP: usize = 8;

/// A path as it would be without the ending that says how the file is packed.
pub(super) fn inner(path: &Path) -> PathBuf {
    let is_packed = path.extension().is_some_and(|e| ENDINGS.iter().any(|ending| e.eq_ignore_ascii_case(ending)));
    if is_packed { path.with_extension("") } else { path.to_owned() }
}

/// The first bytes of what is in a file, be it packed or not; as they are where it is not unpacked here.
pub(super) fn start(path: &Path) -> Result<Vec<u8>, ImportError> {
    let mut file = input::open(path)?;
    let mut bytes = Vec::new();
    (&file).take(START as u64).read_to_end(&mut bytes).map_err(failed(path))?;
    let Some(packing) = Packing::of(&bytes) else { return Ok(bytes) };
    file.rewind().map_err(failed(path))?;
    let Some(inside) = packing.reader(file).map_err(failed(path))? else { return Ok(bytes) };
    let mut unpacked = Vec::new();
    // What came out before it breaks off is there.
    let _broken = inside.take(START as u64).read_to_end(&mut unpacked);
    Ok(unpacked)
}

/// The log that is in a file, packed or not.
pub(super) fn log(
    path: &Path,
    budget: &Budget,
    read: impl FnOnce(&Path, &Budget) -> Result<Log, ImportError>,
) -> Result<Log, ImportError> {
    let Unpacked { read: mut log, damage } = unpacked(path, budget, |place| read(place, budget))?;
    path.clone_into(&mut log.file);
    log.name = stem(path);
    log.warnings.extend(damage);
    Ok(log)
}

/// What came of a file, and what is wrong with how it is packed.
pub(super) struct Unpacked<T> {
    pub(super) read: T,
    pub(super) damage: Option<String>,
}

/// Reads a file that may be packed: `read` gets the path of one that is not.
pub(super) fn unpacked<T>(
    path: &Path,
    budget: &Budget,
    read: impl FnOnce(&Path) -> Result<T, ImportError>,
) -> Result<Unpacked<T>, ImportError> {
    let mut file = input::open(path)?;
    let mut start = Vec::new();
    (&file).take(Packing::TOLD_BY as u64).read_to_end(&mut start).map_err(failed(path))?;
    let packing = Packing::of(&start).filter(|packing| *packing != Packing::Zip);
    let Some(packing) = packing else { return Ok(Unpacked { read: read(path)?, damage: None }) };
    file.rewind().map_err(failed(path))?;
    let (place, damage) = unpack(path, packing, file, budget)?;
    let read = read(place.path()).map_err(|error| named(error, place.path(), path))?;
    Ok(Unpacked { read, damage })
}

/// A temporary file with what is in `packed`, and what is wrong with it where it breaks off.
fn unpack(
    path: &Path,
    packing: Packing,
    packed: File,
    budget: &Budget,
) -> Result<(tempfile::NamedTempFile, Option<String>), ImportError> {
    let refused = |what: String| ImportError::log(path, what);
    let no_room = |e: std::io::Error| {
        let place = std::env::temp_dir();
        refused(format!("is not unpacked into {} ({e}); make room there, or {}", place.display(), packing.remedy()))
    };
    let Some(mut inside) = packing.reader(packed).map_err(failed(path))? else {
        return Err(refused(format!("is packed with {}; {}", packing.name(), packing.remedy())));
    };
    let mut place = tempfile::Builder::new().prefix("twinalign-").tempfile().map_err(no_room)?;
    let (mut block, mut written, most) = (vec![0; BLOCK], 0_u64, budget.left());
    loop {
        let count = match inside.read(&mut block) {
            Ok(0) => return Ok((place, None)),
            Ok(count) => count,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(_) if written > 0 => {
                let what = format!("the file is cut or damaged: {written} bytes could be unpacked, and are read");
                return Ok((place, Some(what)));
            }
            Err(e) => {
                let what = format!("is cut or damaged ({} does not unpack it: {e}); copy it again", packing.name());
                return Err(refused(what));
            }
        };
        written += count as u64;
        // On the disk, and not in memory: the room is looked at, and not taken.
        if written > most {
            return Err(ImportError::budget(path)(BudgetError::Memory(most)));
        }
        budget.step(count / BYTES_OF_A_STEP).map_err(ImportError::budget(path))?;
        place.write_all(block.get(..count).unwrap_or(&[])).map_err(no_room)?;
    }
}

/// An error about the temporary file, as one about the packed one.
fn named(error: ImportError, place: &Path, path: &Path) -> ImportError {
    match error {
        ImportError::Log { what, .. } => ImportError::log(path, what),
        ImportError::Budget { source, .. } => ImportError::Budget { path: path.to_owned(), source },
        ImportError::Interrupted { .. } => ImportError::Interrupted { path: path.to_owned() },
        other => {
            let place = place.display().to_string();
            ImportError::log(path, other.to_string().replace(&format!("{place}: "), "").replace(&place, "it"))
        }
    }
}
