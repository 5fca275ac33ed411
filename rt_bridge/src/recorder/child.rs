//! The recorder as a child of `rt_bridge run`: started before the first cycle, asked to finish after the last one, and
//! replaced when it dies. A replacement writes to a new file (`clip_2.mcap` beside `clip.mcap`), because the first one
//! may end in the middle of a chunk and stays as it is, to be read up to its last flush.

use super::{Recorded, announcement};
use crate::rt::process::ask_to_end;
use shared_mem::msg::event::Event;
use shared_mem::parent;
use shared_mem::transport::Subscriber;
use std::io::Read as _;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How long a recorder may take to open its file and its topics.
const START_PATIENCE: Duration = Duration::from_secs(5);
/// How long a recorder may take to write its index.
const FINISH_PATIENCE: Duration = Duration::from_secs(10);
/// Recorders that are started for one run at most: what kills five kills the sixth.
const MOST_FILES: usize = 5;

/// The recorder did not do its work.
#[derive(Debug, thiserror::Error)]
pub enum ChildError {
    /// It could not be started.
    #[error("cannot start the recorder: {0}; run without --record, or free processes and memory")]
    Spawn(std::io::Error),
    /// It refused, in its own words.
    #[error("{0}")]
    Refused(String),
    /// It did not answer.
    #[error("the recorder did not open {} within {} s; look at the disk, or run without --record", file.display(), START_PATIENCE.as_secs())]
    Slow { file: PathBuf },
}

/// What became of the recorder since the last look.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    /// It was killed, and another one writes on, to this file.
    Replaced(PathBuf),
    /// It ended, for this reason; nothing is recorded any more.
    Ended(String),
}

/// The recorder of a run.
#[derive(Debug)]
pub struct RecorderChild {
    cell: PathBuf,
    configuration: String,
    first: PathBuf,
    files: Vec<PathBuf>,
    running: Option<Child>,
    done: Vec<Recorded>,
}

impl RecorderChild {
    /// Starts a recorder for `file`, in place of one that is there where it may (`force`), and waits until it listens; `events`
    /// tells when.
    ///
    /// # Errors
    /// [`ChildError`] in the recorder's own words.
    pub fn start(
        (file, force): (&Path, bool),
        cell: &Path,
        configuration: String,
        events: &Subscriber<Event>,
    ) -> Result<Self, ChildError> {
        let mut child = spawn((file, force), cell, &configuration).map_err(ChildError::Spawn)?;
        let begin = Instant::now();
        let wanted = announcement(file);
        loop {
            while let Ok(Some(event)) = events.receive() {
                // An event's text is cut at its length; a long path is recognised by what fits.
                if !event.text().is_empty() && wanted.starts_with(event.text()) {
                    return Ok(Self {
                        cell: cell.to_owned(),
                        configuration,
                        first: file.to_owned(),
                        files: vec![file.to_owned()],
                        running: Some(child),
                        done: Vec::new(),
                    });
                }
            }
            if let Ok(Some(status)) = child.try_wait() {
                return Err(ChildError::Refused(last_words(&mut child, status)));
            }
            if begin.elapsed() > START_PATIENCE {
                let _gone = child.kill().and_then(|()| child.wait());
                return Err(ChildError::Slow { file: file.to_owned() });
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Looks after the recorder; called a few times a second.
    pub fn look(&mut self) -> Option<Change> {
        let child = self.running.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        let mut child = self.running.take()?;
        if let Some(recorded) = answer(&mut child) {
            let why = recorded.stopped.clone().unwrap_or_else(|| "the recorder was asked to stop".into());
            self.done.push(recorded);
            return Some(Change::Ended(why));
        }
        let words = last_words(&mut child, status);
        if status.signal().is_none() || self.files.len() >= MOST_FILES {
            return Some(Change::Ended(words));
        }
        let next = numbered(&self.first, self.files.len() + 1);
        match spawn((&next, false), &self.cell, &self.configuration) {
            Ok(child) => {
                self.running = Some(child);
                self.files.push(next.clone());
                Some(Change::Replaced(next))
            }
            Err(e) => Some(Change::Ended(format!("{words}, and no other could be started: {e}"))),
        }
    }

    /// Asks the recorder to finish and returns what it recorded, and what went wrong at the end. Files of recorders that were
    /// killed before are not counted: nobody knows what is in them before they are read.
    pub fn finish(mut self) -> (Option<Recorded>, Option<String>) {
        let mut fault = None;
        if let Some(mut child) = self.running.take() {
            let _ended_already = ask_to_end(child.id());
            let begin = Instant::now();
            while child.try_wait().ok().flatten().is_none() && begin.elapsed() < FINISH_PATIENCE {
                std::thread::sleep(Duration::from_millis(2));
            }
            let _ended_already = child.kill();
            let status = child.wait();
            match (answer(&mut child), status) {
                (Some(recorded), _) => {
                    fault.clone_from(&recorded.stopped);
                    self.done.push(recorded);
                }
                (None, Ok(status)) => fault = Some(last_words(&mut child, status)),
                (None, Err(error)) => fault = Some(format!("nobody knows how the recorder ended: {error}")),
            }
        }
        (self.done.pop(), fault)
    }
}

fn spawn((file, force): (&Path, bool), cell: &Path, configuration: &str) -> std::io::Result<Child> {
    Command::new(std::env::current_exe()?)
        .args(["record", "--json", "--out"])
        .arg(file)
        .args(force.then_some("--force"))
        .arg("--cell")
        .arg(cell)
        .args(["--configuration", configuration])
        .args([parent::FLAG, &std::process::id().to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        // A Ctrl-C at the terminal is for the bridge, which stops the arm before it stops the recorder.
        .process_group(0)
        .spawn()
}

/// The JSON object that a finished recorder leaves on its standard output.
fn answer(child: &mut Child) -> Option<Recorded> {
    let mut text = String::new();
    child.stdout.as_mut()?.read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

fn last_words(child: &mut Child, status: ExitStatus) -> String {
    let mut text = String::new();
    if let Some(stderr) = child.stderr.as_mut() {
        let _cut = stderr.read_to_string(&mut text);
    }
    match (status.signal(), text.lines().rfind(|line| !line.trim().is_empty())) {
        (Some(signal), _) => format!("the recorder was killed by signal {signal}"),
        (None, Some(line)) => line.trim_start_matches("error: ").to_owned(),
        (None, None) => format!("the recorder ended without a word ({status})"),
    }
}

/// `clip.mcap` and 2 make `clip_2.mcap`.
fn numbered(first: &Path, number: usize) -> PathBuf {
    let stem = first.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    first.with_file_name(format!("{stem}_{number}.mcap"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_file_of_a_run_stands_beside_the_first() {
        assert_eq!(numbered(Path::new("/data/clip_00.mcap"), 2), Path::new("/data/clip_00_2.mcap"));
    }
}
