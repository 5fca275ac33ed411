//! The checkpoint of a computation: the result of every step is kept by what was asked for, so that an interruption loses
//! nothing. The same command finds it again and ends, bit by bit, where it would have ended without the interruption.
//!
//! The file is written whole, now and then and when the work is interrupted. It belongs to one question: other clips,
//! settings or another build of the program have a [`Fingerprint`] of their own and begin anew. How a session is spelt, and where it
//! lies, is no part of the question. At the file's end stands a checksum of all that is before it: what a damaged disk or a hand has
//! changed is not gone on from.

mod fingerprint;
pub mod numbers;

pub use fingerprint::Fingerprint;

use crate::interrupt::Interrupt;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use shared_mem::output::{self, OutputError};
use shared_mem::{console, input, typed};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A kill that nobody can listen to loses no more work than this (a choice).
const SAVED_EVERY: Duration = Duration::from_secs(30);

/// Results of steps, and the file in which they outlive the program.
#[derive(Debug, Default)]
pub struct Kept {
    file: Option<PathBuf>,
    question: u64,
    interrupt: Interrupt,
    results: Mutex<Results>,
}

#[derive(Debug, Default)]
struct Results {
    by_step: BTreeMap<u64, Vec<u8>>,
    /// When they were last in the file; none while nothing new is to be written.
    unsaved_since: Option<Instant>,
    failed: Option<OutputError>,
}

/// Where the steps of a piece of work are kept, and its name: pieces that are asked alike are distinguished by it.
pub type Trail<'a> = (&'a Kept, &'a str);

/// The file's content.
#[derive(Serialize, Deserialize)]
struct Stored {
    question: u64,
    by_step: BTreeMap<u64, Vec<u8>>,
}

/// Bytes of the checksum at a file's end.
const CHECKSUM_BYTES: usize = 32;

impl Stored {
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = postcard::to_allocvec(self).unwrap_or_default();
        let checksum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&checksum);
        bytes
    }

    /// `None` where this is not what was written.
    fn read(bytes: &[u8]) -> Option<Self> {
        let (content, checksum) = bytes.split_at_checked(bytes.len().checked_sub(CHECKSUM_BYTES)?)?;
        let is_whole = Sha256::digest(content).as_slice() == checksum;
        postcard::from_bytes(content).ok().filter(|_| is_whole)
    }

    /// What a file holds of a question. One that is damaged is said to be.
    fn of(question: u64, file: &Path) -> Option<Self> {
        // None is there before anything is kept.
        let bytes = input::bytes(file, input::Kind::Array).ok()?;
        let stored = Self::read(&bytes);
        if stored.is_none() {
            let file = file.display();
            console::line(format_args!("{file} is damaged: its checksum is another one; the work starts anew"));
        }
        stored.filter(|stored| stored.question == question)
    }
}

impl Kept {
    /// Nothing is kept.
    pub fn nothing() -> &'static Self {
        static NOTHING: LazyLock<Kept> = LazyLock::new(Kept::default);
        &NOTHING
    }

    /// What was kept in `file` of the same question, and will be. Results that come after `interrupt` asked for the end are
    /// those of work that was cut short, and not kept.
    pub fn in_file(file: Option<PathBuf>, question: &Fingerprint, interrupt: &Interrupt) -> Self {
        let question = question.number();
        let stored = file.as_deref().and_then(|file| Stored::of(question, file));
        let by_step = stored.map(|stored| stored.by_step).unwrap_or_default();
        let results = Mutex::new(Results { by_step, ..Results::default() });
        Self { file, question, interrupt: interrupt.clone(), results }
    }

    fn results(&self) -> MutexGuard<'_, Results> {
        self.results.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether something was found in the file, or will be found there.
    pub fn holds_something(&self) -> bool {
        !self.results().by_step.is_empty()
    }

    /// The result of a step, worked out unless it is known.
    pub fn once<T: Serialize + DeserializeOwned>(&self, step: &Fingerprint, work: impl FnOnce() -> T) -> T {
        if self.file.is_none() {
            return work();
        }
        if let Some(known) = self.known(step) {
            return known;
        }
        let result = work();
        self.keep(step, &result);
        result
    }

    /// The same of work that may fail; a failure is not kept.
    ///
    /// # Errors
    /// Those of the work.
    pub fn once_if_ok<T, E>(&self, step: &Fingerprint, work: impl FnOnce() -> Result<T, E>) -> Result<T, E>
    where
        T: Serialize + DeserializeOwned,
    {
        if let Some(known) = self.known(step) {
            return Ok(known);
        }
        let result = work()?;
        self.keep(step, &result);
        Ok(result)
    }

    /// What was kept of a step.
    pub fn known<T: DeserializeOwned>(&self, step: &Fingerprint) -> Option<T> {
        // What cannot be read as this type is not this step's, and is worked out anew.
        self.results().by_step.get(&step.number()).and_then(|bytes| postcard::from_bytes(bytes).ok())
    }

    /// Keeps the result of a step, in place of an earlier one.
    pub fn keep<T: Serialize>(&self, step: &Fingerprint, result: &T) {
        if self.file.is_none() || self.interrupt.asked() {
            return;
        }
        let Ok(bytes) = postcard::to_allocvec(result) else { return };
        let mut results = self.results();
        results.by_step.insert(step.number(), bytes);
        let since = *results.unsaved_since.get_or_insert_with(Instant::now);
        if since.elapsed() > SAVED_EVERY {
            self.save_these(&mut results);
        }
    }

    /// Takes everything to the file; the file, where one holds something now.
    ///
    /// # Errors
    /// [`OutputError`] when it cannot be written.
    pub fn save(&self) -> Result<Option<&Path>, OutputError> {
        let mut results = self.results();
        if results.unsaved_since.is_some() {
            self.save_these(&mut results);
        }
        match results.failed.take() {
            Some(error) => Err(error),
            None => Ok(self.file.as_deref().filter(|_| !results.by_step.is_empty())),
        }
    }

    fn save_these(&self, results: &mut Results) {
        let Some(file) = &self.file else { return };
        // Lent and taken back: a copy would hold all results twice.
        let stored = Stored { question: self.question, by_step: std::mem::take(&mut results.by_step) };
        let bytes = stored.bytes();
        results.by_step = stored.by_step;
        results.unsaved_since = None;
        results.failed = output::write(file, bytes).err();
    }

    /// What an interrupted program says of it, once it is in the file. `command`: what the person typed.
    pub fn farewell(&self, command: &str) -> String {
        match self.save() {
            Ok(Some(file)) => {
                format!("interrupted; what was found is in {}, and `{command}` goes on from there", file.display())
            }
            Ok(None) => format!("interrupted before anything was found; `{command}` starts again"),
            Err(error) => format!("interrupted, and what was found is lost: {error}"),
        }
    }

    /// The answer is there: removes the file, where it is of this question.
    pub fn done(&self) {
        if let (Some(file), true) = (&self.file, self.holds_something()) {
            // It may never have been written.
            let _not_there = std::fs::remove_file(file);
        }
    }
}

/// The results of a command's work: beside its answer `out`, else in the folder of the session. What is found is taken there
/// when the process has to end before the work does, too.
pub fn for_work(
    out: Option<&Path>,
    session: &Path,
    verb: &str,
    question: &Fingerprint,
    interrupt: &Interrupt,
) -> Arc<Kept> {
    let kept = Arc::new(Kept::in_file(place(out, session, verb), question, interrupt));
    let at_last = Arc::clone(&kept);
    interrupt.prepare(move || at_last.farewell(&typed::command()));
    kept
}

/// `None` for clips that lie nowhere.
fn place(out: Option<&Path>, session: &Path, verb: &str) -> Option<PathBuf> {
    if let Some(out) = out {
        let mut name = out.as_os_str().to_owned();
        name.push(".state");
        return Some(name.into());
    }
    // Of a single clip, where it lies.
    let folder = if session.is_dir() { session } else { session.parent()? };
    Some(folder.join(format!(".{verb}.state")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(number: usize) -> Fingerprint {
        Fingerprint::of("step").with(&number)
    }

    #[test]
    fn a_result_is_worked_out_once_and_found_again_by_the_same_question_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("d.json.state");
        let open =
            |question: &str| Kept::in_file(Some(file.clone()), &Fingerprint::of(question), &Interrupt::default());
        let numbers = vec![0.1_f64 + 0.2, f64::INFINITY, f64::NAN, -0.0];
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let kept = open("one");
        assert_eq!(bits(&kept.once(&step(1), || numbers.clone())), bits(&numbers));
        assert_eq!(bits(&kept.once::<Vec<f64>>(&step(1), || panic!("it is known"))), bits(&numbers));
        assert_eq!(kept.save().expect("room"), Some(&*file));
        assert_eq!(bits(&open("one").known::<Vec<f64>>(&step(1)).expect("kept")), bits(&numbers));
        assert!(open("one").known::<Vec<f64>>(&step(2)).is_none());
        assert!(!open("another").holds_something());
        open("one").done();
        assert!(!file.exists());
    }

    #[test]
    fn what_another_build_kept_is_not_gone_on_from() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("d.json.state");
        let open = |build: &str| {
            let question = Fingerprint::in_build("diagnose", build);
            Kept::in_file(Some(file.clone()), &question, &Interrupt::default())
        };
        let [before, after] =
            ["0.1.0 (commit 0123456789ab; features: none)", "0.1.0 (commit ba9876543210; features: none)"];
        let kept = open(before);
        kept.keep(&step(1), &7);
        kept.save().expect("room");
        assert_eq!(open(before).known::<i32>(&step(1)), Some(7));
        assert!(!open(after).holds_something());
    }

    #[test]
    fn what_was_cut_short_is_not_kept_and_no_damaged_file_is_believed() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, interrupt) = (folder.path().join("state"), Interrupt::default());
        let kept = Kept::in_file(Some(file.clone()), &Fingerprint::of("one"), &interrupt);
        kept.keep(&step(1), &7);
        let cut = kept.once(&step(2), || {
            interrupt.ask();
            0
        });
        let words = kept.farewell("calibration diagnose s");
        assert!(words.contains("`calibration diagnose s` goes on") && words.contains("state"), "{words}");
        let again = Kept::in_file(Some(file.clone()), &Fingerprint::of("one"), &Interrupt::default());
        assert_eq!((cut, again.known::<i32>(&step(1)), again.known::<i32>(&step(2))), (0, Some(7), None));
        let bytes = std::fs::read(&file).expect("the state");
        let holds_something = |damaged: &[u8]| {
            std::fs::write(&file, damaged).expect("room");
            Kept::in_file(Some(file.clone()), &Fingerprint::of("one"), &Interrupt::default()).holds_something()
        };
        assert!((0..bytes.len()).all(|cut| !holds_something(&bytes[..cut])));
        for (place, bit) in (0..bytes.len()).flat_map(|place| (0..8).map(move |bit| (place, bit))) {
            let mut damaged = bytes.clone();
            damaged[place] ^= 1 << bit;
            assert!(!holds_something(&damaged), "bit {bit} of byte {place}");
        }
        let longer = [&bytes[..], &[0]].concat();
        assert!(!holds_something(&longer) && holds_something(&bytes));
    }

    #[test]
    fn a_state_that_cannot_be_written_is_told() {
        let file = Path::new("/nowhere/state").to_owned();
        let kept = Kept::in_file(Some(file), &Fingerprint::of("one"), &Interrupt::default());
        kept.keep(&step(1), &7);
        let words = kept.farewell("calibration diagnose s");
        assert!(words.contains("lost") && words.contains("/nowhere"), "{words}");
    }
}
