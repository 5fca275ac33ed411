//! Reads recorded sessions of real robots and of other simulators, where their folder is given:
//! `TWINALIGN_DATA=<folder> cargo test --release -p shared_mem --test files recording_data -- --ignored --nocapture`

use shared_mem::cell::ClipKind;
use shared_mem::recording::Session;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Folders below `root` that hold a cell.toml.
fn sessions(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root).expect("a readable folder").flatten() {
        let path = entry.path();
        if path.join("cell.toml").is_file() {
            found.push(path);
        } else if path.is_dir() {
            found.extend(sessions(&path));
        }
    }
    found.sort();
    found
}

#[test]
#[ignore = "needs recorded sessions: TWINALIGN_DATA=FOLDER cargo test --release -p shared_mem --test files recording_data -- --ignored --nocapture"]
fn every_clip_of_every_session_loads() {
    let root = std::env::var_os("TWINALIGN_DATA").expect("TWINALIGN_DATA names a folder of recorded sessions");
    let folders = sessions(Path::new(&root));
    assert!(!folders.is_empty(), "no session below {}", Path::new(&root).display());
    for folder in folders {
        let session = Session::open(&folder).unwrap_or_else(|e| panic!("{e}"));
        let (mut milliseconds, mut bytes) = (0.0, 0);
        for entry in &session.clips {
            let start = Instant::now();
            let clip = session.read(entry).unwrap_or_else(|e| panic!("{e}"));
            milliseconds += start.elapsed().as_secs_f64() * 1e3;
            bytes += std::fs::metadata(&clip.file).map_or(0, |m| m.len());
            eprintln!(
                "  {}: {} joints, {} measured, {} desired, {} poses, {:.2} s{}",
                entry.file.display(),
                clip.joint_names.len(),
                clip.measured.len(),
                clip.desired.len(),
                clip.object.len(),
                clip.measured.duration().max(clip.object.duration()),
                clip.damage.as_ref().map_or(String::new(), |d| format!(", damage: {d}")),
            );
            for warning in &clip.warnings {
                eprintln!("    {warning}");
            }
            assert!(clip.damage.is_none(), "{:?}", clip.damage);
            let moved = if clip.kind == ClipKind::FreeMotion { clip.object.len() } else { clip.measured.len() };
            assert!(moved > 10, "{} holds {moved} rows", clip.file.display());
        }
        eprintln!(
            "{}: {} clips, {:.1} MB in {milliseconds:.1} ms",
            folder.display(),
            session.clips.len(),
            bytes as f64 * 1e-6
        );
    }
}
