//! Which logs lie at a path: a file, a folder that is one log, or a folder of logs.

use super::walk::{self, Seen};
use super::{lerobot, npz, packed, ros1, rosbag2, run, sage, sqlite, table};
use crate::error::ImportError;
use crate::log::Log;
use shared_mem::budget::Budget;
use shared_mem::input::Packing;
use std::path::{Path, PathBuf};

/// A folder of logs is searched to this depth.
const DEPTH: usize = 3;

/// A log, or a data set of some, by its kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    /// A ROS 2 bag: its files in order.
    Rosbag2(PathBuf, Vec<PathBuf>),
    Ros1(PathBuf),
    LeRobot(PathBuf),
    Sage(PathBuf),
    Table(PathBuf),
    /// Tables of a folder that may be topics of one run.
    Run(PathBuf, Vec<PathBuf>),
    Npz(PathBuf),
}

impl Source {
    /// Reads it, within a budget that goes by its bytes: one log, or one an episode.
    pub(super) fn read(&self) -> Result<Vec<Log>, ImportError> {
        let budget = &Budget::of(self.bytes()?);
        match self {
            Self::Rosbag2(path, files) => Ok(vec![rosbag2::read(path, files, budget)?]),
            Self::Ros1(path) => Ok(vec![packed::log(path, budget, ros1::read)?]),
            Self::LeRobot(path) => lerobot::read(path, budget),
            Self::Sage(path) => Ok(vec![sage::read(path, budget)?]),
            Self::Table(path) => Ok(vec![packed::log(path, budget, table::read).map_err(|error| notes(error, path))?]),
            Self::Run(path, files) => run::read(path, files, budget),
            Self::Npz(path) => Ok(vec![packed::log(path, budget, npz::read)?]),
        }
    }

    /// How many bytes of it are read: pictures beside a data set are not.
    pub(super) fn bytes(&self) -> Result<u64, ImportError> {
        let files = match self {
            Self::Rosbag2(_, files) | Self::Run(_, files) => files.clone(),
            Self::LeRobot(path) => lerobot::files(path)?,
            Self::Sage(path) => walk::files(path)?,
            Self::Ros1(path) | Self::Table(path) | Self::Npz(path) => vec![path.clone()],
        };
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
        Ok(files.iter().map(|file| size(file) + size(&sqlite::journal(file))).sum())
    }

    /// File or folder.
    pub(super) fn path(&self) -> &Path {
        match self {
            Self::Rosbag2(path, _)
            | Self::Ros1(path)
            | Self::LeRobot(path)
            | Self::Sage(path)
            | Self::Table(path)
            | Self::Run(path, _)
            | Self::Npz(path) => path,
        }
    }

    /// Whether it is text, which may be anything.
    pub(super) fn is_text(&self) -> bool {
        matches!(self, Self::Table(_))
    }
}

/// An error about a text that need not be a table: a person's notes, a program's log.
fn notes(error: ImportError, path: &Path) -> ImportError {
    let is_echoed = |start: Vec<u8>| {
        let text = String::from_utf8_lossy(&start).into_owned();
        text.starts_with("header:") || text.starts_with("---") || text.lines().any(|line| line.trim() == "stamp:")
    };
    match error {
        ImportError::Log { .. } if packed::start(path).is_ok_and(is_echoed) => ImportError::log(
            path,
            "is what `ros2 topic echo` or `rostopic echo` prints for people; record with `ros2 bag record`, or print with \
             `ros2 topic echo --csv`, `rostopic echo -p`",
        ),
        ImportError::Log { what, .. } if matches!(extension(path).as_str(), "txt" | "log") => {
            ImportError::log(path, format!("is no table of numbers: {what}"))
        }
        other => other,
    }
}

/// The log that a file is.
pub(super) fn file(path: &Path) -> Result<Source, ImportError> {
    of_file(path)?.ok_or_else(|| ImportError::log(path, unknown(path)))
}

/// What a folder holds.
#[derive(Debug, Default)]
pub(super) struct Folder {
    pub(super) sources: Vec<Source>,
    /// Files that are none.
    pub(super) others: Vec<PathBuf>,
    /// Files that should be logs by their names, and are none.
    pub(super) refused: Vec<ImportError>,
}

/// The logs in a folder, which may be one itself.
pub(super) fn folder(path: &Path) -> Result<Folder, ImportError> {
    let mut found = Folder::default();
    in_folder(path, DEPTH, (&mut Seen::default(), &mut found))?;
    Ok(found)
}

/// Why a file cannot be imported, by what it is called.
fn unknown(path: &Path) -> String {
    match extension(path).as_str() {
        "h5" | "hdf5" => "is an HDF5 file; make an .npz of it: `python3 -c \"import sys, h5py, numpy; d = {}; \
                          h5py.File(sys.argv[1]).visititems(lambda k, v: d.update({k.replace('/', '.'): v[()]}) if hasattr(v, \
                          'shape') else None); numpy.savez(sys.argv[2], **d)\" FILE.h5 FILE.npz`"
            .into(),
        "mat" => "is a MATLAB file; save its vectors with `writetable` as .csv".into(),
        "xls" | "xlsx" | "ods" => "is a spreadsheet; save its sheet as .csv".into(),
        "tar" | "tgz" => "is an archive; unpack it with `tar -xf`".into(),
        "parquet" => "is one file of a data set; give the folder that holds its meta/info.json".into(),
        _ => match packed::start(path).ok().and_then(|start| Packing::of(&start)) {
            Some(packing) => format!("is packed with {}; {}", packing.name(), packing.remedy()),
            None => "is no log that is known: .mcap, .db3, .bag, .csv, .tsv, .npz, a LeRobot data set or a SAGE folder".into(),
        },
    }
}

fn in_folder(folder: &Path, depth: usize, (seen, found): (&mut Seen, &mut Folder)) -> Result<(), ImportError> {
    if lerobot::is_data_set(folder) {
        found.sources.push(Source::LeRobot(folder.to_owned()));
        return Ok(());
    }
    if sage::is_motion(folder) {
        found.sources.push(Source::Sage(folder.to_owned()));
        return Ok(());
    }
    let mut entries = seen.entries(folder)?;
    entries.retain(|path| !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')));
    entries.sort_by_key(|path| natural(&path.file_name().unwrap_or_default().to_string_lossy()));
    if folder.join("metadata.yaml").is_file() {
        let mut files: Vec<PathBuf> =
            entries.iter().filter(|path| matches!(extension(path).as_str(), "mcap" | "db3")).cloned().collect();
        // `ros2 bag play` leaves what it has unpacked beside the packed file.
        files.dedup_by(|packed, plain| packed::inner(packed) == *plain);
        if !files.is_empty() {
            found.sources.push(Source::Rosbag2(folder.to_owned(), files));
            return Ok(());
        }
    }
    for path in entries {
        if path.is_dir() {
            if depth > 1 {
                in_folder(&path, depth - 1, (seen, found))?;
            }
        } else {
            match of_file(&path) {
                Ok(Some(source)) => found.sources.push(source),
                Ok(None) if is_companion(&path) => {}
                Ok(None) => found.others.push(path),
                Err(_) if !KNOWN.contains(&extension(&path).as_str()) => found.others.push(path),
                Err(error) => found.refused.push(error.about_a_log()?),
            }
        }
    }
    Ok(())
}

/// Extensions of logs.
const KNOWN: [&str; 8] = ["mcap", "db3", "bag", "csv", "tsv", "txt", "log", "npz"];

/// Whether a file belongs to a bag beside it.
fn is_companion(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    name == "metadata.yaml" || ["db3-wal", "db3-shm", "db3-journal"].contains(&extension(path).as_str())
}

fn of_file(path: &Path) -> Result<Option<Source>, ImportError> {
    let own = path.to_owned();
    let inside = extension(path);
    Ok(Some(match packed::start(path)?.as_slice() {
        [] if std::fs::metadata(path).is_ok_and(|about| about.len() > 0) => {
            return Err(ImportError::log(
                path,
                "is packed, and nothing comes out of it: it is cut or damaged; copy it from its source again",
            ));
        }
        [] => {
            return Err(ImportError::log(path, "is empty: its recorder ended before it wrote anything; leave it out"));
        }
        s if s.starts_with(b"\x89MCAP0\r\n") => Source::Rosbag2(own.clone(), vec![own]),
        s if s.starts_with(sqlite::MAGIC) => Source::Rosbag2(own.clone(), vec![own]),
        s if s.starts_with(b"#ROSBAG V") => Source::Ros1(own),
        s if inside == "npz" && s.starts_with(b"PK\x03\x04") => Source::Npz(own),
        s => match (Packing::of(s), inside.as_str()) {
            (Some(packing), kind) if KNOWN.contains(&kind) => {
                let what = format!("is packed with {}; {}", packing.name(), packing.remedy());
                return Err(ImportError::log(path, what));
            }
            (_, "csv" | "tsv" | "txt" | "log") => Source::Table(own),
            (_, "mcap" | "db3" | "bag" | "npz") => {
                let what = format!("does not begin like a .{inside}: it is damaged; copy it from its source again");
                return Err(ImportError::log(path, what));
            }
            _ => return Ok(None),
        },
    }))
}

/// The extension of what is in a file.
fn extension(path: &Path) -> String {
    packed::inner(path).extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
}

/// A key by which `run_10` stands behind `run_9`.
fn natural(name: &str) -> Vec<(u64, String)> {
    let mut parts: Vec<(u64, String)> = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (head, tail) = rest.split_at(text);
        let digits = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        let (number, after) = tail.split_at(digits);
        parts.push((0, head.to_owned()));
        parts.push((number.parse().unwrap_or(u64::MAX), String::new()));
        rest = after;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tenth_file_comes_behind_the_ninth() {
        let mut names = vec!["bag_10.db3", "bag_9.db3", "bag_1.db3", "a.db3"];
        names.sort_by_key(|name| natural(name));
        assert_eq!(names, ["a.db3", "bag_1.db3", "bag_9.db3", "bag_10.db3"]);
    }

    #[test]
    fn what_is_no_log_is_named_with_a_way_out() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes, hint) in [
            ("a.h5", &b"\x89HDF\r\n\x1a\n"[..], "numpy.savez"),
            ("a.pdf", b"%PDF", "no log that is known"),
            ("a.bag", b"garbage", "damaged"),
            ("a.csv", b"", "empty"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("room");
            let line = file(&path).expect_err("no log").to_string();
            assert!(line.contains(hint) && line.lines().count() == 1, "{line}");
        }
    }
}
