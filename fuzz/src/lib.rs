//! What the fuzz targets share: seeds, and files for readers that take a path.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Writes well-formed inputs into the corpus folder that libFuzzer was started with, before it reads the folder: from there
/// it finds more in a minute than from nothing in a day. A run over a single file gets none.
pub fn seeds(of_this_target: impl IntoIterator<Item = Vec<u8>>) {
    let folder = std::env::args().skip(1).find(|argument| !argument.starts_with('-') && Path::new(argument).is_dir());
    let Some(folder) = folder else { return };
    for (i, bytes) in of_this_target.into_iter().enumerate() {
        std::fs::write(Path::new(&folder).join(format!("seed_{i}")), bytes)
            .expect("a corpus folder that can be written");
    }
}

/// A folder of this process, beside the program: `cargo clean` takes it away.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let program = std::env::current_exe().expect("a program has a path");
        let folder = program.with_file_name("inputs").join(std::process::id().to_string());
        std::fs::create_dir_all(&folder).expect("a folder beside the program");
        folder
    })
}

/// Writes an input as a file of this name.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    std::fs::write(&path, bytes).expect("room for a file");
    path
}

/// The value, or nothing once the error has been written out as a person would read it.
pub fn accepted<T, E: std::fmt::Display>(result: Result<T, E>) -> Option<T> {
    result.map_err(|error| drop(std::hint::black_box(error.to_string()))).ok()
}
