//! `rt_bridge record`: everything on shared memory into one clip, as a process of its own, so that neither a slow disk
//! nor a crash here can touch the control loop, and a killed bridge leaves a finished file behind.

pub mod child;
mod disk;
mod sources;

use disk::{Room, room};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::output::Destination;
use shared_mem::parent;
use shared_mem::recording::{ClipInfo, ClipWriter, RobotModel, WriteError, WriteSummary};
use shared_mem::transport::{Node, Publisher, TransportError};
use shared_mem::{time::now_ns, topics};
use sources::Sources;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A killed recorder loses what came after its last flush.
const FLUSH_EVERY_NS: u64 = 500_000_000;
/// How long the recorder goes on after whoever started it has died, for what the others have to say: how the arm brakes,
/// for one [ns].
const ORPHAN_PATIENCE_NS: u64 = 1_500_000_000;

/// What to record, and until when.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// The new file.
    pub out: PathBuf,
    /// Whether it is replaced where it is there already.
    pub force: bool,
    /// Stop after this long.
    pub duration: Option<Duration>,
    /// How long to wait for the first message; `None`: as long as it takes.
    pub patience: Option<Duration>,
    /// The bridge that started this recorder: when it is gone, the file is finished.
    pub parent: Option<u32>,
    /// Whether pictures are left out: they are most of a clip, and fits do not read them.
    pub no_camera: bool,
    /// What rides along.
    pub info: ClipInfo,
    /// The robot that viewers of the file are shown, and the cell it stands in.
    pub shown: Option<(Arc<RobotModel>, Cell)>,
}

/// What was recorded: the JSON answer of `rt_bridge record` and the `recorded` of `rt_bridge run`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, serde::Deserialize)]
pub struct Recorded {
    pub file: PathBuf,
    /// Messages in it.
    pub messages: u64,
    pub bytes: u64,
    /// Messages that were overwritten before they could be recorded.
    pub lost: u64,
    /// Why recording ended before it was asked to, if it did.
    pub stopped: Option<String>,
}

impl Recorded {
    /// One line for people.
    pub fn in_words(&self) -> String {
        let (megabytes, file) = (self.bytes as f64 * 1e-6, self.file.display());
        format!("recorded {} messages, {megabytes:.1} MB in {file}", self.messages)
    }
}

/// Recording cannot begin, or nothing could be kept.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// Too little room to begin with.
    #[error(
        "only {megabytes} MB are free where {} is to be written, less than the {} MB that recording starts with; free some space or record to another disk",
        path.display(), disk::NEEDED_TO_START / 1_000_000
    )]
    NoRoom { path: PathBuf, megabytes: u64 },
    /// Nobody sent anything, so there is no recording.
    #[error(
        "nothing was sent within {:.1} s, so nothing was recorded and {} was removed; start a bridge with `rt_bridge run --cell cell.toml --arm sim` (a robot: --arm fci://HOST)",
        waited.as_secs_f64(), path.display()
    )]
    Nothing {
        path: PathBuf,
        /// How long it was waited.
        waited: Duration,
    },
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error(transparent)]
    Transport(#[from] TransportError),
}

/// Records until `stop` is set, the duration is over, the parent is gone, the disk fills up, or nothing came within the
/// patience.
///
/// # Errors
/// [`RecordError`] when it cannot begin, shared memory fails, or nobody sent anything: then the new file is removed, unless a
/// bridge started this recorder, whose own answer says what it did. A disk that fills up is no error: what was kept is reported,
/// with the reason in `stopped`.
pub fn record(settings: &Settings, stop: &AtomicBool) -> Result<Recorded, RecordError> {
    let out = &settings.out;
    let place = Destination::new(out, settings.force).map_err(WriteError::from)?;
    if let Room::TooLittleToStart { megabytes } | Room::TooLittleToGoOn { megabytes } = room(out) {
        return Err(RecordError::NoRoom { path: out.clone(), megabytes });
    }
    let node = Node::open("rt_bridge_recorder")?;
    let mut sources = Sources::open(&node, !settings.no_camera)?;
    let events = node.publisher(topics::EVENTS)?;
    place.clear().map_err(WriteError::from)?;
    let mut writer = ClipWriter::create(out, &settings.info)?;
    if let Some((robot, cell)) = &settings.shown {
        writer.show(robot, &robot.joints, cell);
    }
    events.send(&Event::new(EventLevel::Info, EventSource::Recorder, &announcement(out)))?;

    let begin_ns = now_ns();
    let reason = keep_writing(settings, stop, (&node, &events), &mut sources, &mut writer)?;
    if !sources.heard() && settings.parent.is_none() && matches!(reason, Reason::Asked) {
        drop(writer);
        std::fs::remove_file(out).map_err(|source| WriteError::Create { path: out.clone(), source })?;
        return Err(RecordError::Nothing { path: out.clone(), waited: Duration::from_nanos(now_ns() - begin_ns) });
    }
    let stopped = match reason {
        Reason::Asked => None,
        Reason::Failed(what) => {
            events.send(&Event::new(EventLevel::Error, EventSource::Recorder, &what))?;
            Some(what)
        }
    };
    let bytes = writer.bytes_written();
    let WriteSummary { messages, bytes } = match writer.finish() {
        Ok(summary) => summary,
        // The file is readable without its index; say how far it got.
        Err(e) if stopped.is_none() => return Err(e.into()),
        Err(_) => WriteSummary { messages: sources.taken(), bytes },
    };
    Ok(Recorded { file: out.clone(), messages, bytes, lost: sources.lost(), stopped })
}

/// The event by which others know that `file` is being written.
fn announcement(file: &Path) -> String {
    format!("recording to {}", file.display())
}

/// The remark that a clip holds of what is missing in it.
fn loss(messages: u64) -> String {
    format!(
        "{messages} messages of the last half second are missing in the clip: this machine was too busy to hand them on; take other load off its disk and processors"
    )
}

enum Reason {
    Asked,
    Failed(String),
}

fn keep_writing(
    settings: &Settings,
    stop: &AtomicBool,
    (node, events): (&Node, &Publisher<Event>),
    sources: &mut Sources,
    writer: &mut ClipWriter,
) -> Result<Reason, RecordError> {
    let begin_ns = now_ns();
    let mut flushed_ns = begin_ns;
    let mut orphan_since = None;
    loop {
        // Read before draining: what is sent before a stop was asked for is still recorded.
        let silent = settings
            .patience
            .is_some_and(|patience| !sources.heard() && u128::from(now_ns() - begin_ns) >= patience.as_nanos());
        let ends = silent || stop.load(Ordering::Relaxed) || over(settings, begin_ns, &mut orphan_since);
        if let Err(e) = sources.drain_into(writer)? {
            return Ok(Reason::Failed(e.to_string()));
        }
        let flushes = now_ns() - flushed_ns >= FLUSH_EVERY_NS;
        if (ends || flushes)
            && let Some(lost) = sources.newly_lost()
        {
            events.send(&Event::new(EventLevel::Warning, EventSource::Recorder, &loss(lost)))?;
        }
        if ends {
            // The remark on what was lost belongs into the file as well.
            return Ok(match sources.drain_into(writer)? {
                Ok(()) => Reason::Asked,
                Err(e) => Reason::Failed(e.to_string()),
            });
        }
        if flushes {
            flushed_ns = now_ns();
            for ignored in node.newly_ignored() {
                events.send(&Event::new(EventLevel::Warning, EventSource::Recorder, &ignored.to_string()))?;
            }
            if let Err(e) = writer.flush() {
                return Ok(Reason::Failed(e.to_string()));
            }
            if let Room::TooLittleToGoOn { megabytes } = room(&settings.out) {
                return Ok(Reason::Failed(format!(
                    "recording stopped: only {megabytes} MB are left on the disk of {}; what was recorded is kept, free some space",
                    settings.out.display()
                )));
            }
        }
        sources.sleep()?;
    }
}

fn over(settings: &Settings, begin_ns: u64, orphan_since: &mut Option<u64>) -> bool {
    let now = now_ns();
    if settings.duration.is_some_and(|d| u128::from(now - begin_ns) >= d.as_nanos()) {
        return true;
    }
    if settings.parent.is_some_and(parent::is_gone) {
        return now - *orphan_since.get_or_insert(now) >= ORPHAN_PATIENCE_NS;
    }
    false
}
