//! Which logs lie at a path: a file, a folder that is one log, or a folder of logs.

use super::walk::{self, Seen};
use super::{lerobot, npz, ros1, rosbag2, sage, sqlite, table};
use crate::error::ImportError;
use crate::log::Log;
use shared_mem::budget::Budget;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// A folder of logs is searched to this depth.
const DEPTH: usize = 3;

/// A log, or a data set of some, by its kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Source {
    /// A ROS 2 bag: its files in order.
    Rosbag2(PathBuf, Vec<PathBuf>),
    Ros1(PathBuf),
    LeRobot(PathBuf),
    Sage(PathBuf),
    Table(PathBuf),
    Npz(PathBuf),
}

impl Source {
    /// Reads it, within a budget that goes by its bytes: one log, or one an episode.
    pub(crate) fn read(&self) -> Result<Vec<Log>, ImportError> {
        let budget = &Budget::of(self.bytes()?);
        match self {
            Self::Rosbag2(path, files) => Ok(vec![rosbag2::read(path, files, budget)?]),
            Self::Ros1(path) => Ok(vec![ros1::read(path, budget)?]),
            Self::LeRobot(path) => lerobot::read(path, budget),
            Self::Sage(path) => Ok(vec![sage::read(path, budget)?]),
            Self::Table(path) => Ok(vec![table::read(path, budget)?]),
            Self::Npz(path) => Ok(vec![npz::read(path, budget)?]),
        }
    }

    /// How many bytes of it are read: pictures beside a data set are not.
    pub(crate) fn bytes(&self) -> Result<u64, ImportError> {
        let files = match self {
            Self::Rosbag2(_, files) => files.clone(),
            Self::LeRobot(path) => lerobot::files(path)?,
            Self::Sage(path) => walk::files(path)?,
            Self::Ros1(path) | Self::Table(path) | Self::Npz(path) => vec![path.clone()],
        };
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
        Ok(files.iter().map(|file| size(file) + size(&sqlite::journal(file))).sum())
    }

    /// File or folder.
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Rosbag2(path, _)
            | Self::Ros1(path)
            | Self::LeRobot(path)
            | Self::Sage(path)
            | Self::Table(path)
            | Self::Npz(path) => path,
        }
    }
}

/// All logs at `path`.
pub(crate) fn find(path: &Path) -> Result<Vec<Source>, ImportError> {
    let metadata = std::fs::metadata(path).map_err(|e| {
        ImportError::log(
            path,
            format!("cannot be read ({e}); give the path of an existing log, or of a folder of logs"),
        )
    })?;
    if metadata.is_dir() {
        let mut found = Vec::new();
        in_folder(path, DEPTH, (&mut Seen::default(), &mut found))?;
        if found.is_empty() {
            let what = "holds no log that is known: .mcap, .db3, .bag, .csv, .tsv, .npz, a LeRobot data set or SAGE folders; \
                        what is there as HDF5 or .mat becomes .npz with numpy.savez";
            return Err(ImportError::log(path, what));
        }
        return Ok(found);
    }
    match of_file(path)? {
        Some(source) => Ok(vec![source]),
        None => Err(ImportError::log(path, unknown(path))),
    }
}

/// Why a file cannot be imported, by what it is called.
fn unknown(path: &Path) -> String {
    match extension(path).as_str() {
        "h5" | "hdf5" => "is an HDF5 file; make an .npz of it: `python3 -c \"import sys, h5py, numpy; d = {}; \
                          h5py.File(sys.argv[1]).visititems(lambda k, v: d.update({k.replace('/', '.'): v[()]}) if hasattr(v, \
                          'shape') else None); numpy.savez(sys.argv[2], **d)\" FILE.h5 FILE.npz`"
            .into(),
        "mat" => "is a MATLAB file; save its vectors with `writetable` as .csv".into(),
        "zstd" | "zst" => "is compressed as a whole; unpack it with `zstd -d`".into(),
        "gz" => "is compressed as a whole; unpack it with `gunzip`".into(),
        "active" => "is a bag that its recorder did not close; mend it with `rosbag reindex`".into(),
        "parquet" => "is one file of a data set; give the folder that holds its meta/info.json".into(),
        _ => "is no log that is known: .mcap, .db3, .bag, .csv, .tsv, .npz, a LeRobot data set or a SAGE folder".into(),
    }
}

fn in_folder(folder: &Path, depth: usize, (seen, found): (&mut Seen, &mut Vec<Source>)) -> Result<(), ImportError> {
    if lerobot::is_data_set(folder) {
        found.push(Source::LeRobot(folder.to_owned()));
        return Ok(());
    }
    if sage::is_motion(folder) {
        found.push(Source::Sage(folder.to_owned()));
        return Ok(());
    }
    let mut entries = seen.entries(folder)?;
    entries.retain(|path| !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')));
    entries.sort_by_key(|path| natural(&path.file_name().unwrap_or_default().to_string_lossy()));
    if folder.join("metadata.yaml").is_file() {
        let files: Vec<PathBuf> =
            entries.iter().filter(|path| matches!(extension(path).as_str(), "mcap" | "db3")).cloned().collect();
        if !files.is_empty() {
            found.push(Source::Rosbag2(folder.to_owned(), files));
            return Ok(());
        }
    }
    for path in entries {
        if path.is_dir() {
            if depth > 1 {
                in_folder(&path, depth - 1, (seen, found))?;
            }
        } else if KNOWN.contains(&extension(&path).as_str())
            && let Some(source) = of_file(&path)?
        {
            found.push(source);
        }
    }
    Ok(())
}

/// Extensions that are taken out of a folder.
const KNOWN: [&str; 8] = ["mcap", "db3", "bag", "csv", "tsv", "txt", "log", "npz"];

fn of_file(path: &Path) -> Result<Option<Source>, ImportError> {
    let mut start = Vec::new();
    let file: File = shared_mem::input::open(path)?;
    let read = file.take(64).read_to_end(&mut start);
    read.map_err(|e| ImportError::log(path, format!("cannot be read ({e}); copy it again")))?;
    let own = path.to_owned();
    Ok(Some(match start.as_slice() {
        [] => {
            return Err(ImportError::log(path, "is empty: its recorder ended before it wrote anything; leave it out"));
        }
        s if s.starts_with(b"\x89MCAP0\r\n") => Source::Rosbag2(own.clone(), vec![own]),
        s if s.starts_with(b"SQLite format 3\0") => Source::Rosbag2(own.clone(), vec![own]),
        s if s.starts_with(b"#ROSBAG V") => Source::Ros1(own),
        s if s.starts_with(b"PK\x03\x04") => Source::Npz(own),
        _ => match extension(path).as_str() {
            "csv" | "tsv" | "txt" | "log" => Source::Table(own),
            "mcap" | "db3" | "bag" | "npz" => {
                let what =
                    format!("does not begin like a .{}: it is damaged; copy it from its source again", extension(path));
                return Err(ImportError::log(path, what));
            }
            _ => return Ok(None),
        },
    }))
}

fn extension(path: &Path) -> String {
    path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase())
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
            let line = find(&path).expect_err("no log").to_string();
            assert!(line.contains(hint) && line.lines().count() == 1, "{line}");
        }
    }
}
