//! Formats of other programs, one file each, all read into [`Log`]s. Which one a path is, is found out, not asked.
//!
//! | file | owns |
//! |---|---|
//! | `find` | which logs lie at a path |
//! | `found` | the logs of an import: which is read first, and which are left out |
//! | `packed` | files that are packed as a whole |
//! | `rosbag2` | ROS 2 bags of both storages |
//! | `sqlite` | the storage sqlite3 (the only SQLite code) |
//! | `ros1` | ROS 1 bags |
//! | `lerobot` | LeRobot data sets, versions 2 and 3 |
//! | `parquet_file` | columns of a parquet file (the only parquet code) |
//! | `table` | CSV, TSV and other text tables |
//! | `run` | tables of one topic each as one log |
//! | `libfranka` | what libfranka's log says about a table's columns |
//! | `sage` | SAGE's folders of a motion |
//! | `npz` | NumPy's archives (the only zip code) |
//! | `walk` | the files below a folder, each once |

mod find;
mod found;
mod lerobot;
mod libfranka;
mod npz;
mod packed;
mod parquet_file;
mod ros1;
mod rosbag2;
mod run;
mod sage;
mod sqlite;
mod table;
mod walk;

pub(crate) use found::Found;

use crate::error::ImportError;
use shared_mem::ending;
use std::path::Path;

/// Stops where the process was asked to end.
fn go_on(path: &Path) -> Result<(), ImportError> {
    if ending::asked() { Err(ImportError::Interrupted { path: path.to_owned() }) } else { Ok(()) }
}

/// Why a folder is not read.
fn failed(folder: &Path) -> impl Fn(std::io::Error) -> ImportError + '_ {
    move |e| ImportError::log(folder, format!("cannot be read ({e}); look at its permissions"))
}

/// File or folder name without extension, and without that which says how it is packed.
fn stem(path: &Path) -> String {
    packed::inner(path).file_stem().map_or_else(|| "clip".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
