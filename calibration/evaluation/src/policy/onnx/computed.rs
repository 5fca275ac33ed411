//! A network on a thread of its own. A file may hold loops without end and tensors without end, at each run and already when it is
//! opened, and what computes them listens to nobody but between two of its operations: so whoever asks waits here, looks at the
//! time and at the memory of the process, asks it to end, and leaves the thread alone where it does not.

use super::super::packed::{Array, MOST_NUMBERS};
use ort::logging::LogLevel;
use ort::session::{RunOptions, Session};
use ort::value::{DynValue, Outlet, Tensor, ValueType};
use shared_mem::{ending, input};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

/// How long a file may take to be opened, and an answer to be computed.
const LIMIT: Duration = Duration::from_secs(120);
/// How often time and memory are looked at.
const LOOK: Duration = Duration::from_millis(20);
/// How long a run that was asked to end is waited for.
const ENDS: Duration = Duration::from_millis(200);
/// By how much the process may grow beside what the files of the network take, each four times: as it is read, optimised, arranged for
/// this machine, and once more [bytes].
const ROOM: u64 = 2 << 30;
const OF_THE_FILES: u64 = 4;

/// What a network takes or gives.
#[derive(Debug, Clone)]
pub(super) struct Port {
    pub(super) name: String,
    pub(super) kind: ValueType,
}

/// What an input gets.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Given {
    pub(super) name: String,
    /// Length along each axis.
    pub(super) shape: Vec<usize>,
    pub(super) numbers: Numbers,
}

/// The numbers of an input, the last axis fastest.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Numbers {
    Real(Vec<f32>),
    Bytes(Vec<u8>),
}

/// A network that is open.
pub(super) struct Computed {
    asked: Sender<Vec<Given>>,
    answers: Receiver<Result<Array, String>>,
    stop: Arc<RunOptions>,
    room: u64,
    /// Whether it was given up: an answer that comes late is none to what is asked next.
    given_up: bool,
    pub(super) inputs: Vec<Port>,
}

impl std::fmt::Debug for Computed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Computed").field("inputs", &self.inputs).finish_non_exhaustive()
    }
}

/// Nothing was computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Uncomputed {
    /// What went wrong.
    Failed(String),
    /// It took too long, or too much memory; nothing more comes of it.
    Ended(String),
    /// The end was asked for.
    Interrupted,
}

impl Computed {
    /// Opens a file; `output` chooses the one output that counts, by its names, or says why none does.
    pub(super) fn open(
        path: &Path,
        output: impl FnOnce(&[Port]) -> Result<String, String> + Send + 'static,
    ) -> Result<Self, Uncomputed> {
        let failed = |error: &dyn std::fmt::Display| Uncomputed::Failed(super::line(error));
        let room = ROOM + OF_THE_FILES * weight(path);
        let stop = Arc::new(RunOptions::new().map_err(|error| failed(&error))?);
        let (asked, asks) = channel();
        let (answer, answers) = channel();
        let (opened, opening) = channel();
        let (file, running) = (path.to_owned(), Arc::clone(&stop));
        let work = move || {
            let open = open(&file, output);
            let Some((mut session, output)) = report(&opened, open) else { return };
            for given in asks {
                if answer.send(run(&mut session, given, &output, &running)).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("policy".into()).spawn(work).map_err(|error| failed(&error))?;
        let inputs = wait(&opening, room, &Stop::Opening)?.map_err(Uncomputed::Failed)?;
        Ok(Self { asked, answers, stop, room, given_up: false, inputs })
    }

    /// What comes of these inputs.
    pub(super) fn run(&mut self, given: Vec<Given>) -> Result<Array, Uncomputed> {
        if self.given_up || self.asked.send(given).is_err() {
            return Err(Uncomputed::Ended("was given up before".into()));
        }
        let waited = wait(&self.answers, self.room, &Stop::Run(&self.stop));
        self.given_up = waited.is_err();
        waited?.map_err(Uncomputed::Failed)
    }
}

/// Tells what came of opening a file and goes on with it, unless nobody is there any more.
fn report(opened: &Sender<Result<Vec<Port>, String>>, open: Result<Opened, String>) -> Option<(Session, String)> {
    match open {
        Ok(Opened { session, output, inputs }) => opened.send(Ok(inputs)).is_ok().then_some((session, output)),
        Err(what) => {
            let _nobody_waits = opened.send(Err(what));
            None
        }
    }
}

/// A session, and what is asked of it.
struct Opened {
    session: Session,
    output: String,
    inputs: Vec<Port>,
}

fn open(file: &Path, output: impl FnOnce(&[Port]) -> Result<String, String>) -> Result<Opened, String> {
    let session = Session::builder()
        .and_then(|builder| Ok(builder.with_log_level(LogLevel::Error)?))
        .and_then(|mut builder| builder.commit_from_file(file));
    let session = session
        .map_err(|error| format!("{}; export it again, with an opset that ONNX Runtime has", super::line(&error)))?;
    let port = |outlet: &Outlet| Port { name: outlet.name().to_owned(), kind: outlet.dtype().clone() };
    let outputs: Vec<Port> = session.outputs().iter().map(port).collect();
    let inputs = session.inputs().iter().map(port).collect();
    Ok(Opened { output: output(&outputs)?, inputs, session })
}

fn run(session: &mut Session, given: Vec<Given>, output: &str, running: &RunOptions) -> Result<Array, String> {
    let value = |Given { name, shape, numbers }: Given| {
        let value = match numbers {
            Numbers::Real(values) => Tensor::from_array((shape, values)).map(Tensor::into_dyn),
            Numbers::Bytes(values) => Tensor::from_array((shape, values)).map(Tensor::into_dyn),
        };
        let value = value.map_err(|error| format!("its input {name} cannot be filled: {}", super::line(&error)));
        value.map(|value| (name, value))
    };
    let values = given.into_iter().map(value).collect::<Result<Vec<(String, DynValue)>, String>>()?;
    let found =
        session.run_with_options(values, running).map_err(|error| format!("an error: {}", super::line(&error)))?;
    let found = found.get(output).ok_or("no actions")?;
    let (shape, values) = found
        .try_extract_tensor::<f32>()
        .map_err(|_| format!("{output}, which are no float32; export it with such an output"))?;
    if values.len() > MOST_NUMBERS {
        return Err(format!("an array of the shape {shape}; {MOST_NUMBERS} numbers at most are taken"));
    }
    let shape = shape.iter().map(|length| usize::try_from(*length).unwrap_or(0)).collect();
    Ok(Array { shape, values: values.to_vec() })
}

/// How a network is asked to end.
enum Stop<'a> {
    /// Nothing asks it to.
    Opening,
    Run(&'a RunOptions),
}

impl Stop<'_> {
    fn ask(&self) {
        if let Self::Run(options) = self {
            // What cannot be asked to end is left alone all the same.
            let _asked = options.terminate();
        }
    }

    fn doing(&self) -> &'static str {
        match self {
            Self::Opening => "to be opened",
            Self::Run(_) => "for an answer",
        }
    }
}

/// Waits for what a network gives, as long as it takes neither too long nor too much memory.
fn wait<T>(given: &Receiver<T>, room: u64, stop: &Stop<'_>) -> Result<T, Uncomputed> {
    let (began, before) = (Instant::now(), resident());
    let why = loop {
        match given.recv_timeout(LOOK) {
            Ok(given) => return Ok(given),
            Err(RecvTimeoutError::Disconnected) => return Err(Uncomputed::Ended("has ended by itself".into())),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if ending::asked() {
            break Uncomputed::Interrupted;
        }
        if began.elapsed() > LIMIT {
            break Uncomputed::Ended(format!("takes more than {} s {}", LIMIT.as_secs(), stop.doing()));
        }
        if resident().saturating_sub(before) > room {
            break Uncomputed::Ended(format!("takes more than {} MiB of memory {}", room >> 20, stop.doing()));
        }
    };
    stop.ask();
    // Its memory is free then; a thread that does not end takes no part in anything any more.
    let _late = given.recv_timeout(ENDS);
    Err(why)
}

/// What the process has in memory [bytes]; 0 where the system does not say it.
fn resident() -> u64 {
    let text = input::text(Path::new("/proc/self/status"), input::Kind::Configuration).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kibibytes = line.and_then(|line| line.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok());
    kibibytes.unwrap_or(0) << 10
}

/// What the files of a network take: its own, and those beside it, where its weights may be [bytes].
fn weight(path: &Path) -> u64 {
    let folder =
        path.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or(PathBuf::from("."), Path::to_owned);
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).filter(std::fs::Metadata::is_file).map(|about| about.len()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_seen_to_grow() {
        let before = resident();
        let kept = vec![1_u8; 64 << 20];
        assert!(resident() >= before + (48 << 20) && before > 0, "{before}");
        drop(kept);
    }
}
