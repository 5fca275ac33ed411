//! All clips of a session, on all cores. A clip that cannot be used is named and left out; the others are replayed.

use super::predict::{ReplayError, Replayer};
use super::report::{ClipGap, Failure, SessionGap};
use super::write::write_clip;
use rayon::prelude::*;
use shared_mem::cell::ClipEntry;
use shared_mem::ending;
use shared_mem::output::{Destination, OutputError};
use shared_mem::progress::Progress;
use shared_mem::recording::{Session, WriteError};
use shared_mem::theta::Theta;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// How a session is replayed.
#[derive(Debug, Clone, Default)]
pub struct Options {
    pub theta: Option<Theta>,
    /// Where simulated clips go: a file for a single clip, else a folder.
    pub out: Option<PathBuf>,
    /// Whether clips that are there already are replaced.
    pub force: bool,
}

/// One clip failed.
#[derive(Debug, thiserror::Error)]
enum ClipError {
    #[error(transparent)]
    Replay(#[from] ReplayError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("not replayed: interrupted")]
    Interrupted,
}

/// Replays every clip of a session; clips that are not done when the process is asked to end ([`ending`]) are left out.
///
/// # Errors
/// [`ReplayError`] when cell.toml or the parameters cannot be used for any clip, or the output has no place. What is wrong with a single clip is
/// found in [`SessionGap::failures`].
pub fn replay(session: &Session, options: &Options) -> Result<SessionGap, ReplayError> {
    let replayer = Replayer::new(&session.cell, options.theta.as_ref())?;
    let single = session.clips.len() == 1;
    let places = session.clips.iter().map(|entry| {
        let out = options.out.as_deref().map(|out| if single { out.to_owned() } else { place(out, entry) });
        out.map(|out| Destination::in_new_folder(&out, options.force)).transpose()
    });
    // All of them before the first is simulated.
    let places: Vec<Option<Destination>> = places.collect::<Result<_, OutputError>>()?;
    let (bar, done) = (Progress::new("replay", session.clips.len() as u64), AtomicU64::new(0));
    let results: Vec<_> = session
        .clips
        .par_iter()
        .zip(&places)
        .map(|(entry, place)| {
            let result = one(&replayer, session, entry, place.as_ref());
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.show(done, &format!("{done} of {} clips", session.clips.len()));
            (entry, result)
        })
        .collect();
    drop(bar);
    let (mut clips, mut failed) = (Vec::new(), Vec::new());
    for (entry, result) in results {
        match result {
            Ok(gap) => clips.push(gap),
            Err(error) => {
                let (file, unwritten) =
                    (entry.file.to_string_lossy().into_owned(), matches!(error, ClipError::Write(_)));
                failed.push(Failure { file, error: error.to_string(), unwritten });
            }
        }
    }
    Ok(SessionGap::new(clips, failed))
}

/// File of a simulated clip in the folder `out`.
fn place(out: &Path, entry: &ClipEntry) -> PathBuf {
    let name = entry.file.file_stem().unwrap_or(entry.file.as_os_str());
    out.join(name).with_extension("mcap")
}

fn one(
    replayer: &Replayer,
    session: &Session,
    entry: &ClipEntry,
    out: Option<&Destination>,
) -> Result<ClipGap, ClipError> {
    let interrupted = || if ending::asked() { Err(ClipError::Interrupted) } else { Ok(()) };
    interrupted()?;
    let clip = session.read(entry).map_err(ReplayError::from);
    // What an interrupted reading or run says is not the clip's fault.
    interrupted()?;
    let replayed = replayer.replay(clip?);
    interrupted()?;
    let (clip, prediction, mut gap) = replayed?;
    gap.file = entry.file.to_string_lossy().into_owned();
    if let Some(out) = out {
        write_clip(out, replayer, &clip, &prediction)?;
    }
    Ok(gap)
}
