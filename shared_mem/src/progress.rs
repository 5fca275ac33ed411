//! How far a piece of work is, on standard error: a bar with the time left on a terminal, a line every ten seconds elsewhere.

mod estimate;

pub use estimate::Planned;

use crate::console;
use estimate::Estimate;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A bar and what stands behind it are at most so many columns wide.
const COLUMNS: usize = 79;
/// Signs of a full bar.
const SIGNS: usize = 20;
/// How often a bar is drawn at most.
const PAUSE: Duration = Duration::from_millis(100);
/// How often the time left is brought up to date while no step is done.
const TICK: Duration = Duration::from_secs(1);
/// How often a line is written where there is no terminal.
const LINES: Duration = Duration::from_secs(10);

/// Whether a piece of work is shown: of one within another, only the outer one is.
static SHOWN: AtomicBool = AtomicBool::new(false);

/// The bar of one piece of work; it disappears when dropped.
#[derive(Debug)]
pub struct Progress {
    shared: Arc<Shared>,
    /// Ends the thread that keeps the time left up to date; none where this work is not shown.
    end: Option<(Sender<()>, JoinHandle<()>)>,
}

#[derive(Debug)]
struct Shared {
    title: String,
    is_shown: bool,
    begun: Instant,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    estimate: Estimate,
    note: String,
    shown: Option<Instant>,
    next_line: Duration,
}

impl Progress {
    /// Work of `length` steps that take about as long as each other.
    #[must_use]
    pub fn new(title: &str, length: u64) -> Self {
        Self::begun(title, Estimate::new(&[("", 1.0)], length))
    }

    /// Work in stages, in the order of the plan; the first, of so many steps, has begun.
    #[must_use]
    pub fn planned(title: &str, plan: &[Planned], steps: u64) -> Self {
        Self::begun(title, Estimate::new(plan, steps))
    }

    fn begun(title: &str, estimate: Estimate) -> Self {
        let state = State { estimate, note: String::new(), shown: None, next_line: LINES };
        let is_shown = !SHOWN.swap(true, Ordering::Relaxed);
        let (title, state) = (title.to_owned(), Mutex::new(state));
        let shared = Arc::new(Shared { title, is_shown, begun: Instant::now(), state });
        let (end, ended) = mpsc::channel();
        let ticking = Arc::clone(&shared);
        let tick = move || {
            while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                ticking.draw();
            }
        };
        // Without a thread the time left stands still between the steps.
        let thread = if is_shown { thread::Builder::new().name("progress".into()).spawn(tick).ok() } else { None };
        Self { shared, end: thread.map(|thread| (end, thread)) }
    }

    /// So many steps of the stage at work are done; `note` stands behind the bar.
    pub fn show(&self, done: u64, note: &str) {
        let mut state = self.shared.state();
        state.estimate.done(done, self.shared.begun.elapsed());
        note.clone_into(&mut state.note);
        let soon = state.shown.is_some_and(|at| at.elapsed() < PAUSE);
        drop(state);
        if !soon {
            self.shared.draw();
        }
    }

    /// The next stage begins: of so many steps, with a note.
    pub fn stage(&self, name: &'static str, steps: u64) {
        let mut state = self.shared.state();
        state.estimate.begin(name, steps, self.shared.begun.elapsed());
        name.clone_into(&mut state.note);
        drop(state);
        self.shared.draw();
    }

    /// Stages come next that were not planned.
    pub fn insert(&self, stages: &[Planned]) {
        self.shared.state().estimate.insert(stages);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.end.take() {
            drop(end);
            let _drawn_or_crashed = thread.join();
        }
        if self.shared.state().shown.is_some() {
            console::status("");
        }
        if self.shared.is_shown {
            SHOWN.store(false, Ordering::Relaxed);
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Draws the bar, or writes a line where there is no terminal and one is due.
    fn draw(&self) {
        if !self.is_shown {
            return;
        }
        let (mut state, now) = (self.state(), self.begun.elapsed());
        let (share, left) = state.estimate.at(now);
        if console::is_terminal() {
            state.shown = Some(Instant::now());
            console::status(&bar(&self.title, share, left, &state.note));
        } else if now >= state.next_line {
            state.next_line = now + LINES;
            console::line(words(&self.title, share, left, &state.note));
        }
    }
}

/// `identify [===>      ]  40 %, 2 min 10 s left, 120 clips simulated`
fn bar(title: &str, share: f64, left: Option<Duration>, note: &str) -> String {
    let done = (share * SIGNS as f64) as usize;
    let head = if done < SIGNS { ">" } else { "" };
    let signs = format!("{}{head}", "=".repeat(done));
    let line = format!("{title} [{signs:SIGNS$}] {}", state(share, left, note));
    // A line that a terminal breaks is not overwritten by the next one.
    line.chars().take(COLUMNS).collect()
}

/// `identify: 40 %, 2 min 10 s left, 120 clips simulated`
fn words(title: &str, share: f64, left: Option<Duration>, note: &str) -> String {
    format!("{title}: {}", state(share, left, note).trim_start())
}

fn state(share: f64, left: Option<Duration>, note: &str) -> String {
    let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
    let note = if note.is_empty() { String::new() } else { format!(", {note}") };
    format!("{:>3} %{left}{note}", (share * 100.0) as u64)
}

/// `45 s`, `2 min 10 s`, `1 h 5 min`; no more digits than an estimate deserves.
fn duration(left: Duration) -> String {
    match left.as_secs_f64().ceil() as u64 {
        s @ 0..60 => format!("{s} s"),
        s @ 60..600 => match (s / 60, s % 60 / 10 * 10) {
            (minutes, 0) => format!("{minutes} min"),
            (minutes, seconds) => format!("{minutes} min {seconds} s"),
        },
        s @ 600..3600 => format!("{} min", s / 60),
        s => format!("{} h {} min", s / 3600, s % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_grows_from_nothing_to_its_length() {
        assert_eq!(bar("fit", 0.0, None, ""), format!("fit [>{}]   0 %", " ".repeat(19)));
        let left = Some(Duration::from_secs(130));
        let half = format!("fit [{}>{}]  50 %, 2 min 10 s left, half", "=".repeat(10), " ".repeat(9));
        assert_eq!(bar("fit", 0.5, left, "half"), half);
        assert!(bar("diagnose", 0.5, left, "fits: velocity dependent friction").chars().count() < 80);
        assert_eq!(words("fit", 0.5, left, "half"), "fit: 50 %, 2 min 10 s left, half");
        assert_eq!(bar("fit", 1.0, Some(Duration::ZERO), ""), format!("fit [{}] 100 %, 0 s left", "=".repeat(20)));
    }

    #[test]
    fn the_time_left_has_the_digits_that_an_estimate_deserves() {
        let shown = |s| duration(Duration::from_secs_f64(s));
        assert_eq!([0.2, 59.0, 61.0, 138.0].map(shown), ["1 s", "59 s", "1 min", "2 min 10 s"]);
        assert_eq!([659.0, 3900.0].map(shown), ["10 min", "1 h 5 min"]);
    }
}
