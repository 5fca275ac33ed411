//! One process of an engine: asked and waited for, no longer than the limit, and killed with what it started (`started`).

use super::fault::EngineError;
use super::frame::{self, Frame, FrameError};
use super::message::Reply;
use super::started::{self, Traces};
use rustix::process::Pid;
use shared_mem::{child_output, ending};
use std::io::{BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often a wait looks whether the user asked for the end (a choice).
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// How long a process may take to end once its input has ended, before it is killed (a choice).
const EXIT_TIMEOUT: Duration = Duration::from_millis(400);

/// The processes that run, for whoever has to end them all.
#[derive(Debug, Default)]
pub(super) struct Running(Mutex<Vec<Traces>>);

impl Running {
    fn list(&self) -> std::sync::MutexGuard<'_, Vec<Traces>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Kills all of them with all that they started.
    pub(super) fn kill(&self) {
        started::kill(&self.list());
    }
}

/// A message to a process.
#[derive(Debug, Clone)]
pub(super) struct Asked {
    pub(super) message: Vec<u8>,
    /// Its answer has at most so many numbers.
    pub(super) most: usize,
}

#[derive(Debug)]
pub(super) struct Process {
    command: String,
    child: Child,
    traces: Option<Traces>,
    running: Arc<Running>,
    requests: Option<Sender<Asked>>,
    answers: Receiver<Result<Frame, FrameError>>,
    last_words: Arc<Mutex<String>>,
}

impl Process {
    /// Starts `command` in a shell.
    pub(super) fn start(command: &str, running: &Arc<Running>) -> Result<Self, EngineError> {
        let fail = |why: String| EngineError::Start { command: command.into(), why };
        let mut shell = Command::new("sh");
        shell.args(["-c", command]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mark = started::mark();
        shell.env(started::VARIABLE, &mark);
        // Ctrl-C on the terminal reaches this program alone, which then ends its children.
        let mut child = shell.process_group(0).spawn().map_err(|error| fail(error.to_string()))?;
        let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        let traces = group.map(|group| Traces { group, mark });
        running.list().extend(traces.clone());
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else { return Err(fail("it has no pipes".into())) };
        let (requests, asked) = channel();
        let (answered, answers) = channel();
        std::thread::spawn(move || serve(stdin, stdout, &asked, &answered));
        let last_words = Arc::default();
        let words = Arc::clone(&last_words);
        std::thread::spawn(move || listen(stderr, &words));
        let (command, running, requests) = (command.to_owned(), Arc::clone(running), Some(requests));
        Ok(Self { command, child, traces, running, requests, answers, last_words })
    }

    /// Sends a message and waits for the answer. After an error the process is of no use any more.
    pub(super) fn ask(&mut self, asked: Asked, limit: Duration) -> Result<(Reply, Vec<f64>), EngineError> {
        let began = Instant::now();
        // Where nobody takes it, the answer says why.
        let _ended = self.requests.as_ref().map(|requests| requests.send(asked));
        let answer = loop {
            match self.answers.recv_timeout(POLL_INTERVAL) {
                Err(RecvTimeoutError::Timeout) if ending::asked() => return Err(EngineError::Ending),
                Err(RecvTimeoutError::Timeout) if began.elapsed() > limit => {
                    let (command, seconds) = (self.command.clone(), limit.as_secs());
                    return Err(EngineError::Silent { command, seconds, words: self.words() });
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break Err(FrameError::Ended),
                Ok(answer) => break answer,
            }
        };
        let Frame { text, numbers } = answer.map_err(|error| self.broken(&error))?;
        let reply = serde_json::from_slice(&text);
        reply.map(|reply| (reply, numbers)).map_err(|error| {
            let what = format!("sent a message that cannot be read ({error}): {}", String::from_utf8_lossy(&text));
            EngineError::Wrong { command: self.command.clone(), what: what.chars().take(300).collect() }
        })
    }

    fn broken(&mut self, error: &FrameError) -> EngineError {
        let command = self.command.clone();
        match error {
            FrameError::NoMessage(bytes) => {
                EngineError::NoMessage { command, bytes: String::from_utf8_lossy(bytes).into_owned() }
            }
            FrameError::TooMany(numbers) => {
                let what = format!("begins an answer of {numbers} numbers where fewer are asked for");
                EngineError::Wrong { command, what }
            }
            // The process killed by Ctrl-C is no fault of the engine.
            FrameError::Ended if ending::asked() => EngineError::Ending,
            FrameError::Ended => {
                let status = self.end();
                EngineError::Ended { command, status, words: self.words() }
            }
        }
    }

    /// Ends its input, and kills it where it does not end by that.
    fn end(&mut self) -> ExitStatus {
        // The thread that serves it ends with its requests, and closes the pipe that it owns.
        self.requests = None;
        let began = Instant::now();
        while began.elapsed() < EXIT_TIMEOUT && !ending::asked() {
            if let Ok(Some(status)) = self.child.try_wait() {
                // What it started may run on.
                self.kill();
                return status;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        self.kill();
        self.child.wait().unwrap_or_default()
    }

    fn kill(&mut self) {
        if let Some(traces) = self.traces.take() {
            started::kill(std::slice::from_ref(&traces));
            self.running.list().retain(|other| *other != traces);
        }
    }

    /// Its last line on standard error, after a colon.
    fn words(&self) -> String {
        // The listener may be a moment behind the end of the process.
        std::thread::sleep(POLL_INTERVAL);
        let last = self.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_empty() { String::new() } else { format!(": {last}") }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
    }
}

/// Takes each message to the process and its answer back, until one side has ended.
fn serve(
    mut stdin: ChildStdin,
    stdout: ChildStdout,
    asked: &Receiver<Asked>,
    answered: &Sender<Result<Frame, FrameError>>,
) {
    let mut stdout = BufReader::with_capacity(1 << 16, stdout);
    while let Ok(Asked { message, most }) = asked.recv() {
        // A process that does not read it may have written why.
        let sent = stdin.write_all(&message).and_then(|()| stdin.flush());
        let answer = frame::read(&mut stdout, most);
        let ended = sent.is_err() || answer.is_err();
        if answered.send(answer).is_err() || ended {
            return;
        }
    }
}

fn listen(stderr: ChildStderr, last_words: &Mutex<String>) {
    child_output::lines(stderr, |line| {
        let line = line.trim();
        if !line.is_empty() {
            tracing::debug!("engine: {line}");
            *last_words.lock().unwrap_or_else(PoisonError::into_inner) = line.chars().take(300).collect();
        }
    });
}
