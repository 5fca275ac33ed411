//! The other programs of the project as child processes: found, started, watched, ended, and quoted when they fail.
//!
//! Each child runs in a process group of its own, so that Ctrl-C on the terminal reaches only this program, which then
//! ends its children in an order that loses nothing. A child that is dropped is ended, and one whose starter is killed ends
//! by itself ([`shared_mem::parent`]). Called by capture, demo and sweep.

use rustix::process::{Pid, Signal, kill_process_group};
use shared_mem::transport::DOMAIN_VARIABLE;
use shared_mem::{child_output, parent};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Lines of a child's stderr kept for an error message.
const KEPT_STDERR_LINES: usize = 8;
/// An answer longer than this is none: the longest diagnosis is a hundred times shorter [bytes].
const LONGEST_ANSWER: u64 = 256 << 20;
/// How long a child may take to end after SIGTERM before it is killed.
const EXIT_TIMEOUT: Duration = Duration::from_secs(5);
/// The program that holds the verbs of all.
const ALL_VERBS: &str = "twinalign";
/// How often a child is looked at while it ends.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// A child process could not be used.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// The program is neither beside this one nor on the PATH.
    #[error(
        "cannot find the program `{name}`; build it with `cargo build --release -p {package}`, or put its folder on the PATH"
    )]
    Missing {
        name: &'static str,
        /// The package that builds it.
        package: &'static str,
    },
    /// The system would not start or watch it.
    #[error("cannot run {}: {source}; check that the file is executable", path.display())]
    Start {
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It ended by itself, or with a failure.
    #[error("`{name}` ended with {status}{words}")]
    Ended {
        /// The program and its verb.
        name: String,
        status: ExitStatus,
        /// Its last words on stderr in a line, after a colon; empty where there are none worth telling.
        words: String,
        /// What it wrote to stdout.
        answer: String,
    },
    /// It did not end in time and was killed.
    #[error("`{name}` did not end within {} s and was killed{words}", waited.as_secs())]
    Stuck {
        /// The program and its verb.
        name: String,
        /// How long it was waited for.
        waited: Duration,
        /// As of [`ProcessError::Ended`].
        words: String,
    },
}

/// A program of this project and the package that builds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// `rt_bridge`.
    Bridge,
    /// `twin`.
    Twin,
}

impl Program {
    /// The binary's name, which is its package's name too.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bridge => "rt_bridge",
            Self::Twin => "twin",
        }
    }

    /// The binary, or else the one that holds the verbs of all programs: beside this one, else on the PATH. Of a test, which cargo
    /// builds into `deps`, beside that folder too.
    ///
    /// # Errors
    /// [`ProcessError::Missing`], which says how to build it.
    pub fn find(self) -> Result<PathBuf, ProcessError> {
        let here = std::env::current_exe().ok();
        let folder = here.as_deref().and_then(Path::parent);
        let of_test = folder.filter(|folder| folder.ends_with("deps")).and_then(Path::parent);
        let beside = folder.into_iter().chain(of_test).map(PathBuf::from);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let on_path: Vec<PathBuf> = std::env::split_paths(&path).collect();
        let folders: Vec<PathBuf> = beside.chain(on_path).collect();
        let file = |name: &str| folders.iter().map(|folder| folder.join(name)).find(|file| file.is_file());
        file(self.name())
            .or_else(|| file(ALL_VERBS))
            .ok_or(ProcessError::Missing { name: self.name(), package: self.name() })
    }
}

/// A running child.
#[derive(Debug)]
pub struct Running {
    name: String,
    child: Child,
    answer: Option<Receiver<String>>,
    tail: Arc<Mutex<VecDeque<String>>>,
    status: Option<ExitStatus>,
}

/// Arguments from anything that is text or a path.
pub fn arguments<const N: usize>(list: [&dyn AsRef<std::ffi::OsStr>; N]) -> Vec<OsString> {
    list.iter().map(|a| a.as_ref().to_owned()).collect()
}

impl Running {
    /// Starts `program` with `arguments`, in the cell of `domain` (default: the one this process is in).
    ///
    /// # Errors
    /// [`ProcessError::Missing`] or [`ProcessError::Start`].
    pub fn start(program: Program, arguments: &[OsString], domain: Option<&str>) -> Result<Self, ProcessError> {
        let path = program.find()?;
        let mut command = Command::new(&path);
        command.args(arguments).args([parent::FLAG, &std::process::id().to_string()]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if let Some(domain) = domain {
            command.env(DOMAIN_VARIABLE, domain);
        }
        let verb = arguments.first().map_or(String::new(), |v| format!(" {}", v.to_string_lossy()));
        Self::spawn(format!("{}{verb}", program.name()), &mut command)
            .map_err(|source| ProcessError::Start { path, source })
    }

    /// Starts this program itself once more, on so many threads.
    ///
    /// # Errors
    /// [`ProcessError::Start`].
    pub fn start_itself(arguments: &[OsString], threads: usize) -> Result<Self, ProcessError> {
        let path = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("calibration"));
        let mut command = Command::new(&path);
        command.args(arguments).env("RAYON_NUM_THREADS", threads.max(1).to_string());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let verb = arguments.first().map_or(String::new(), |v| format!(" {}", v.to_string_lossy()));
        Self::spawn(format!("calibration{verb}"), &mut command).map_err(|source| ProcessError::Start { path, source })
    }

    fn spawn(name: String, command: &mut Command) -> std::io::Result<Self> {
        let mut child = command.process_group(0).spawn()?;
        let tail = Arc::new(Mutex::new(VecDeque::new()));
        if let Some(stderr) = child.stderr.take() {
            let tail = Arc::clone(&tail);
            std::thread::spawn(move || keep_tail(stderr, &tail));
        }
        let answer = child.stdout.take().map(|stdout| {
            let (sender, answer) = channel();
            std::thread::spawn(move || {
                // What cannot be read is missed by whoever parses the answer; who gave up on it hears nothing.
                let text = child_output::whole(stdout, LONGEST_ANSWER).ok().flatten();
                let _ = sender.send(text.and_then(|text| String::from_utf8(text).ok()).unwrap_or_default());
            });
            answer
        });
        tracing::debug!("started {name} as process {}", child.id());
        Ok(Self { name, child, answer, tail, status: None })
    }

    /// An error when the child ended although nobody asked it to.
    ///
    /// # Errors
    /// [`ProcessError::Ended`] with its last words.
    pub fn check(&mut self) -> Result<(), ProcessError> {
        match self.poll() {
            None => Ok(()),
            Some(status) => Err(self.ended(status, String::new())),
        }
    }

    /// Asks the child to end (SIGTERM) and returns what it wrote to stdout.
    ///
    /// # Errors
    /// [`ProcessError::Ended`] when it fails, [`ProcessError::Stuck`] when it has to be killed.
    pub fn stop(mut self) -> Result<String, ProcessError> {
        self.terminate();
        self.finish(EXIT_TIMEOUT, || false)
    }

    /// Waits until the child ends by itself and returns what it wrote to stdout. Asked to give up by `cancelled`, it ends the child first.
    ///
    /// # Errors
    /// [`ProcessError::Ended`] when it fails, [`ProcessError::Stuck`] when it takes longer than `patience`.
    pub fn finish(mut self, patience: Duration, cancelled: impl Fn() -> bool) -> Result<String, ProcessError> {
        let start = Instant::now();
        let mut asked = false;
        let status = loop {
            if let Some(status) = self.poll() {
                break status;
            }
            if !asked && cancelled() {
                self.terminate();
                asked = true;
            }
            if start.elapsed() > patience {
                self.kill();
                return Err(ProcessError::Stuck { name: self.name.clone(), waited: patience, words: self.words() });
            }
            std::thread::sleep(POLL_INTERVAL);
        };
        // Not for ever: another process may have inherited the pipe and hold it open.
        let answer = self.answer.take().and_then(|answer| answer.recv_timeout(EXIT_TIMEOUT).ok()).unwrap_or_default();
        if status.success() { Ok(answer) } else { Err(self.ended(status, answer)) }
    }

    fn poll(&mut self) -> Option<ExitStatus> {
        if self.status.is_none() {
            self.status = self.child.try_wait().ok().flatten();
        }
        self.status
    }

    fn terminate(&mut self) {
        if self.poll().is_none()
            && let Some(pid) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw)
            && let Err(error) = kill_process_group(pid, Signal::TERM)
        {
            tracing::warn!("cannot end {}: {error}", self.name);
        }
    }

    fn kill(&mut self) {
        // Fails only when it is gone already, which is what is wanted.
        if let Some(pid) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            let _ = kill_process_group(pid, Signal::KILL);
        }
        let _ = self.child.wait();
    }

    fn ended(&self, status: ExitStatus, answer: String) -> ProcessError {
        // The reader of stderr may be a moment behind the end of the process.
        std::thread::sleep(POLL_INTERVAL);
        ProcessError::Ended { name: self.name.clone(), status, words: self.words(), answer }
    }

    /// The last line that tells of trouble: a log of what went well explains no end.
    fn words(&self) -> String {
        let lines = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let is_trouble = |line: &&String| !line.trim().is_empty() && !line.contains(" INFO ");
        // Behind an error of its arguments stands how to get help.
        let last = lines.iter().rfind(|line| line.starts_with("error: ")).or_else(|| lines.iter().rfind(is_trouble));
        last.map_or(String::new(), |line| format!(": {}", line.trim().trim_start_matches("error: ")))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.terminate();
        let start = Instant::now();
        while self.poll().is_none() {
            if start.elapsed() > EXIT_TIMEOUT {
                self.kill();
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

fn keep_tail(stderr: impl Read, tail: &Mutex<VecDeque<String>>) {
    child_output::lines(stderr, |line| {
        let mut kept = tail.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() == KEPT_STDERR_LINES {
            kept.pop_front();
        }
        kept.push_back(line.to_owned());
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Running {
        let mut command = Command::new("sh");
        command.args(["-c", script]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Running::spawn("sh".into(), &mut command).expect("a shell")
    }

    /// Returns once the child has said something on stderr.
    fn said(child: &Running) {
        while child.words().is_empty() {
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    #[test]
    fn the_last_words_of_a_child_that_fails_are_quoted() {
        let error =
            shell("echo cannot open the robot >&2; exit 1").finish(EXIT_TIMEOUT, || false).unwrap_err().to_string();
        assert!(error.contains("exit status: 1") && error.contains("cannot open the robot"), "{error}");
    }

    #[test]
    fn a_child_that_fails_leaves_its_answer_and_its_trouble_in_a_line() {
        let script = "echo kept; echo '12:00 INFO all is well' >&2; echo 'error: no room' >&2; echo '12:01  INFO bye' >&2; exit 1";
        let ended = shell(script).finish(EXIT_TIMEOUT, || false).unwrap_err();
        assert!(ended.to_string().ends_with(": no room"), "{ended}");
        assert!(matches!(ended, ProcessError::Ended { answer, .. } if answer == "kept\n"));
    }

    #[test]
    fn of_a_child_with_wrong_arguments_the_error_is_quoted_and_not_the_way_to_help() {
        let script = "printf 'error: no such arm\n\nFor more information, try --help.\n' >&2; exit 2";
        let ended = shell(script).finish(EXIT_TIMEOUT, || false).unwrap_err().to_string();
        assert!(ended.ends_with(": no such arm"), "{ended}");
    }

    #[test]
    fn a_child_that_ends_unasked_is_noticed() {
        let mut child = shell("exit 0");
        let ended = loop {
            match child.check() {
                Ok(()) => std::thread::sleep(POLL_INTERVAL),
                Err(ended) => break ended,
            }
        };
        assert!(matches!(ended, ProcessError::Ended { .. }), "{ended}");
    }

    #[test]
    fn a_stopped_child_still_gives_its_answer() {
        let child = shell("trap 'echo done; exit 0' TERM; echo ready >&2; while true; do sleep 0.01; done");
        said(&child);
        assert_eq!(child.stop().expect("a clean end"), "done\n");
    }

    #[test]
    fn a_child_that_takes_too_long_is_killed_and_named() {
        let error = shell("sleep 60").finish(Duration::from_millis(50), || false).unwrap_err();
        assert!(matches!(error, ProcessError::Stuck { .. }), "{error}");
    }

    #[test]
    fn a_cancelled_child_is_ended_with_those_it_started() {
        let mut child = shell("sleep 600 & echo ready >&2; wait");
        said(&child);
        let answer = child.answer.take().expect("a pipe");
        assert!(matches!(child.finish(EXIT_TIMEOUT, || true), Err(ProcessError::Ended { .. })));
        assert!(answer.recv_timeout(EXIT_TIMEOUT).is_ok(), "a process it started still holds its stdout");
    }

    #[test]
    fn a_process_that_left_the_group_of_an_ended_child_is_not_waited_for() {
        let child = shell("setsid sleep 90 & exit 0");
        let start = Instant::now();
        assert_eq!(child.finish(2 * EXIT_TIMEOUT, || false).expect("a clean end"), "");
        assert!(start.elapsed() < 10 * EXIT_TIMEOUT, "waited for the process that holds the pipe");
    }
}
