//! Runs units: those without a result, each into one result file that is there whole or not at all.

use super::SweepError;
use super::inputs::Inputs;
use super::result::{Stored, result_of};
use super::unit::{OUT, Slice, Unit};
use capture::processes::Running;
use inference::interrupt::Interrupt;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;
use shared_mem::input;
use shared_mem::output::Destination;
use shared_mem::progress::Progress;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A unit may take a month.
const PATIENCE: Duration = Duration::from_secs(30 * 24 * 3600);

/// What was run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Ran {
    /// Units of the slice.
    pub units: usize,
    /// Of which had a result before.
    pub before: usize,
    pub now: usize,
}

/// Runs a command and gives what it prints; `None` when it was interrupted.
pub type Runner<'a> = dyn Fn(&[OsString], &Interrupt) -> Result<Option<String>, String> + Sync + 'a;

/// Runs a command as a process of this program, on so many threads.
///
/// # Errors
/// What it said when it failed.
pub fn process(command: &[OsString], threads: usize, interrupt: &Interrupt) -> Result<Option<String>, String> {
    let running = Running::start_itself(command, threads).map_err(|error| error.to_string())?;
    match running.finish(PATIENCE, || interrupt.asked()) {
        _ if interrupt.asked() => Ok(None),
        Ok(answer) => Ok(Some(answer)),
        Err(error) => Err(error.to_string()),
    }
}

/// Runs the units of a slice that have no result yet, `jobs` at once; units that fail are said at the end.
///
/// # Errors
/// [`SweepError`]; results that are there stay.
pub fn run(
    (sweep, units): (&Path, &[Unit]),
    slice: Slice,
    jobs: usize,
    runner: &Runner<'_>,
    interrupt: &Interrupt,
) -> Result<Ran, SweepError> {
    let mine: Vec<&Unit> = units.iter().filter(|unit| slice.holds(unit)).collect();
    let open: Vec<&Unit> = mine.iter().copied().filter(|unit| !result_of(sweep, unit).exists()).collect();
    let (inputs, failed) = (Mutex::new(Inputs::default()), Mutex::new(Vec::new()));
    let (bar, done) = (Progress::new("sweep", open.len() as u64), AtomicU64::new(0));
    let work = |unit: &&Unit| -> Result<(), SweepError> {
        if interrupt.asked() {
            return Ok(());
        }
        match one(sweep, unit, &inputs, runner, interrupt)? {
            Ok(true) => bar.show(done.fetch_add(1, Ordering::Relaxed) + 1, &format!("unit {}", unit.unit)),
            Ok(false) => {}
            Err(why) => failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((unit.unit, why)),
        }
        Ok(())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.max(1)).build();
    let pool =
        pool.map_err(|error| SweepError::Asked(format!("{jobs} jobs cannot be started at once: {error}; give fewer")))?;
    // One after the other off the list: a slow unit holds nobody up.
    pool.install(|| open.par_iter().with_max_len(1).try_for_each(work))?;
    drop(bar);
    let mut failed = failed.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    failed.sort();
    if let Some((number, why)) = failed.first() {
        return Err(SweepError::Failed { failed: failed.len(), units: open.len(), number: *number, why: why.clone() });
    }
    let now = usize::try_from(done.into_inner()).unwrap_or(usize::MAX);
    Ok(Ran { units: mine.len(), before: mine.len() - open.len(), now })
}

/// One unit: whether it has a result now, or why it has none.
fn one(
    sweep: &Path,
    unit: &Unit,
    inputs: &Mutex<Inputs>,
    runner: &Runner<'_>,
    interrupt: &Interrupt,
) -> Result<Result<bool, String>, SweepError> {
    let hash = inputs.lock().unwrap_or_else(std::sync::PoisonError::into_inner).hash(&unit.command, interrupt);
    let hash = match hash {
        Err(SweepError::Interrupted) => return Ok(Ok(false)),
        hash => hash?,
    };
    if hash != unit.hash {
        return Ok(Err(
            "a file that it names, or this program, is another one than when it was planned; plan the sweep again"
                .to_owned(),
        ));
    }
    let place = Destination::new(&result_of(sweep, unit), false)?;
    let scratch = tempfile::Builder::new().prefix("twinalign-unit-").tempdir();
    let scratch = match scratch {
        Ok(scratch) => scratch,
        Err(error) => return Ok(Err(format!("no temporary folder can be made ({error}); see that TMPDIR has room"))),
    };
    let folder = scratch.path().join("out");
    let out = folder.display().to_string();
    let words: Vec<OsString> = unit.command.iter().map(|word| word.replace(OUT, &out).into()).collect();
    let began = Instant::now();
    let text = match runner(&words, interrupt) {
        Ok(Some(text)) => text,
        Ok(None) => return Ok(Ok(false)),
        Err(why) => return Ok(Err(why)),
    };
    // What it was called is no part of the answer.
    let Ok(mut answer) = serde_json::from_str::<Value>(&text.replace(&out, OUT)) else {
        return Ok(Err("it printed no JSON object".to_owned()));
    };
    if let Some(object) = answer.as_object_mut() {
        object.remove("seconds");
    }
    let seconds = began.elapsed().as_secs_f64();
    let files = files(&folder)?;
    let stored = Stored { hash, command: unit.command.clone(), seconds, answer, files };
    place.write(stored.text())?;
    Ok(Ok(true))
}

/// Tables and lists of a folder.
fn files(folder: &Path) -> Result<BTreeMap<String, String>, SweepError> {
    let mut files = BTreeMap::new();
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(files) };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_text =
            path.extension().is_some_and(|ending| ["csv", "json", "toml"].iter().any(|known| ending == *known));
        if is_text && path.is_file() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            files.insert(name, input::text(&path, input::Kind::Configuration)?);
        }
    }
    Ok(files)
}
