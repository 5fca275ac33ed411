//! What is there after a trial: each output as it was, new and whole, or something in between; files and processes that
//! should not be there.

use shared_mem::cell::Cell;
use shared_mem::recording::{Session, SessionFiles, read_picture};
use shared_mem::theta::Theta;
use std::fmt;
use std::path::{Path, PathBuf};

/// Content of the outputs of before.
pub(crate) const OLD: &[u8] = b"of before";

/// What became of an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Found {
    Absent,
    Old,
    /// New and whole.
    New,
    Half(String),
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Absent => "absent",
            Self::Old => "old",
            Self::New => "new",
            Self::Half(_) => "HALF",
        })
    }
}

/// Looks at an output: a file by its ending, a folder as a session.
pub(crate) fn look(path: &Path) -> Found {
    if path.is_dir() && names_nothing(path) {
        return Found::Absent;
    }
    if path.is_dir() {
        return session(path).map_or_else(Found::Half, |()| Found::New);
    }
    let Ok(bytes) = std::fs::read(path) else { return Found::Absent };
    if bytes == OLD {
        return Found::Old;
    }
    if bytes.is_empty() {
        return Found::Half("it is empty".into());
    }
    let text = String::from_utf8_lossy(&bytes);
    let ends =
        |end: &str| if text.trim_end().ends_with(end) { Ok(()) } else { Err(format!("it does not end with {end}")) };
    let whole = match path.extension().and_then(|e| e.to_str()).unwrap_or("") {
        "toml" if path.ends_with("cell.toml") => Cell::read(path).map(drop).map_err(|e| e.to_string()),
        "toml" => Theta::read(path).map(drop).map_err(|e| e.to_string()),
        "json" => serde_json::from_slice::<serde_json::Value>(&bytes).map(drop).map_err(|e| e.to_string()),
        "html" => ends("</html>"),
        "svg" => ends("</svg>"),
        "png" => read_picture(path).map(drop).map_err(|e| e.to_string()),
        "ply" => ply(&bytes),
        "mcap" => clip(path),
        // What a search had found: one that is not whole is not believed.
        "state" => Ok(()),
        other => Err(format!("nobody knows what a whole .{other} is")),
    };
    whole.map_or_else(Found::Half, |()| Found::New)
}

/// Whether a folder holds nothing but temporary files: somebody began to write into it.
fn names_nothing(folder: &Path) -> bool {
    paths(folder).iter().all(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')))
}

/// A session whose clips are all whole.
fn session(folder: &Path) -> Result<(), String> {
    let cell = Cell::read(&folder.join("cell.toml")).map_err(|e| e.to_string())?;
    let files = SessionFiles::default();
    let session = Session { folder: folder.to_owned(), clips: cell.clips.clone(), cell, files };
    session.clips.iter().try_for_each(|entry| undamaged(&session, entry))
}

/// A recording is written while it is made. One that ended before the arm had sent anything holds what had come until then.
fn clip(path: &Path) -> Result<(), String> {
    let session = Session::open(path).map_err(|e| e.to_string())?;
    let ended_early = |why: &String| why.contains("`/arm/state`: no messages");
    undamaged(&session, &session.clips[0]).or_else(|why| if ended_early(&why) { Ok(()) } else { Err(why) })
}

fn undamaged(session: &Session, entry: &shared_mem::cell::ClipEntry) -> Result<(), String> {
    let clip = session.read(entry).map_err(|e| e.to_string())?;
    match clip.damage {
        Some(damage) => Err(damage),
        None if clip.measured.is_empty() => Err("a clip without rows".into()),
        None => Ok(()),
    }
}

/// As many bytes as the head of a binary PLY of single-precision numbers says.
fn ply(bytes: &[u8]) -> Result<(), String> {
    const END: &[u8] = b"end_header\n";
    let head = bytes.windows(END.len()).position(|part| part == END).ok_or("no head")? + END.len();
    let text = String::from_utf8_lossy(&bytes[..head]);
    let count = text.lines().find_map(|line| line.strip_prefix("element vertex ")?.trim().parse::<usize>().ok());
    let numbers = text.lines().filter(|line| line.starts_with("property float ")).count();
    let wanted = head + 4 * numbers * count.ok_or("no count of its vertices")?;
    if bytes.len() == wanted { Ok(()) } else { Err(format!("{} of {wanted} bytes", bytes.len())) }
}

/// Size of a file, or of all files in a folder [bytes].
pub(crate) fn size(path: &Path) -> u64 {
    if !path.is_dir() {
        return path.metadata().map_or(0, |file| file.len());
    }
    std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| size(&entry.path())).sum()
}

/// Temporary files and folders of writers in the folder, at any depth.
pub(crate) fn unfinished(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for path in paths(folder) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with(".unfinished-") {
            found.push(name);
        } else if path.is_dir() {
            found.extend(unfinished(&path));
        }
    }
    found
}

/// Visible files and sessions that are neither as before nor whole, with the reason. Clips of a session that its cell.toml
/// does not name are live recordings: they may be cut.
pub(crate) fn halves(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for path in paths(folder) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        match look(&path) {
            Found::Half(_) if path.is_dir() && !path.join("cell.toml").exists() => found.extend(halves(&path)),
            Found::Half(why) => found.push((name, why)),
            _ => {}
        }
    }
    found
}

fn paths(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

/// Command lines of the processes that live in one of these domains of shared memory.
pub(crate) fn processes_of(domains: &[String]) -> Vec<String> {
    let wanted: Vec<String> = domains.iter().map(|domain| format!("TWINALIGN_DOMAIN={domain}")).collect();
    let lives = |process: &Path| {
        // The environment of a process that has ended is empty.
        let variables = std::fs::read(process.join("environ")).unwrap_or_default();
        variables.split(|byte| *byte == 0).any(|variable| wanted.iter().any(|wanted| wanted.as_bytes() == variable))
    };
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten().map(|entry| entry.path());
    let found = processes.filter(|process| lives(process));
    found
        .map(|process| std::fs::read_to_string(process.join("cmdline")).unwrap_or_default().replace('\0', " "))
        .collect()
}
