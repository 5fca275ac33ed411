//! The recorder of one clip: `rt_bridge record` as a child, which reads shared memory beside us and never slows the arm.

use crate::processes::{ProcessError, Program, Running, arguments};
use serde::Deserialize;
use shared_mem::interrupt::Interrupt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long the recorder may take until its file is there.
const START_TIMEOUT: Duration = Duration::from_secs(10);
/// Still time recorded before and after a motion, so that a fit sees where the arm came from and how it settles.
const STILL_TIME: Duration = Duration::from_millis(300);

/// A clip could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The recorder failed. The file it has written stays, readable up to its last half second.
    #[error("{0}; to go on, start the same command again: the session is continued")]
    Process(#[from] ProcessError),
    /// The recorder runs but writes nothing.
    #[error("the recorder did not open {} within {} s; check that the disk has room", file.display(), START_TIMEOUT.as_secs())]
    NoFile { file: PathBuf },
    /// Its answer is not what was agreed.
    #[error(
        "`rt_bridge record` answered {answer:?}, which holds no file, messages and bytes; build all programs from the same version"
    )]
    Answer {
        /// What it wrote.
        answer: String,
    },
}

/// What is recorded.
#[derive(Debug, Clone, Copy)]
pub struct Recording<'a> {
    /// The cell.toml that is copied into the clip.
    pub cell: &'a Path,
    /// Shared-memory domain; default: the one this process was started in.
    pub domain: Option<&'a str>,
    /// Whether pictures are left out.
    pub no_camera: bool,
}

/// A recording that runs.
#[derive(Debug)]
pub struct Recorder {
    running: Running,
}

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Recorded {
    /// Messages in the file.
    pub messages: u64,
    /// Size of the file [bytes].
    pub bytes: u64,
    /// Why recording ended before it was asked to, if it did.
    #[serde(default)]
    pub stopped: Option<String>,
}

impl Recorder {
    /// Starts recording into `clip` and waits until the file is open.
    ///
    /// # Errors
    /// [`RecordError`] when the recorder cannot be started or opens no file.
    pub fn start(clip: &Path, recording: Recording<'_>, interrupt: &Interrupt) -> Result<Self, RecordError> {
        let mut list = arguments([&"record", &"--json", &"--out", &clip, &"--cell", &recording.cell]);
        list.extend(recording.no_camera.then(|| "--no-camera".into()));
        let mut running = Running::start(Program::Bridge, &list, recording.domain)?;
        let start = Instant::now();
        while !clip.exists() && !interrupt.asked() {
            running.check()?;
            if start.elapsed() > START_TIMEOUT {
                return Err(RecordError::NoFile { file: clip.to_owned() });
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(STILL_TIME);
        Ok(Self { running })
    }

    /// Records a moment longer, then closes the file. A recorder that had to stop early, because the disk is full, says so in
    /// [`Recorded::stopped`].
    ///
    /// # Errors
    /// [`RecordError`] when the recorder failed or its answer cannot be read.
    pub fn finish(self) -> Result<Recorded, RecordError> {
        std::thread::sleep(STILL_TIME);
        understood(self.running.stop())
    }
}

/// What a recorder that has ended recorded; one that had to stop early ends as a failure, and answers all the same.
fn understood(ended: Result<String, ProcessError>) -> Result<Recorded, RecordError> {
    let error = match ended {
        Ok(answer) => return serde_json::from_str(&answer).map_err(|_| RecordError::Answer { answer }),
        Err(error) => error,
    };
    match &error {
        ProcessError::Ended { answer, .. } => serde_json::from_str(answer).map_err(|_| error.into()),
        _ => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt as _;
    use std::process::ExitStatus;

    fn failed(answer: &str) -> Result<String, ProcessError> {
        let (name, words) = ("rt_bridge record".to_owned(), ": the disk is full".to_owned());
        Err(ProcessError::Ended { name, status: ExitStatus::from_raw(1 << 8), words, answer: answer.to_owned() })
    }

    #[test]
    fn a_recorder_that_a_full_disk_stopped_still_tells_what_it_kept() {
        let kept =
            failed("{\"file\": \"clip_00.mcap\", \"messages\": 7, \"bytes\": 900, \"stopped\": \"the disk is full\"}");
        let expected = Recorded { messages: 7, bytes: 900, stopped: Some("the disk is full".into()) };
        assert_eq!(understood(kept).expect("what was recorded"), expected);
        let killed = understood(failed("")).expect_err("it said nothing").to_string();
        assert!(killed.contains("the disk is full") && killed.contains("session is continued"), "{killed}");
        assert_eq!(killed.lines().count(), 1);
    }
}
