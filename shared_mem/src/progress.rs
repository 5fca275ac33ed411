//! How far a piece of work is, on standard error: a bar with the time left on a terminal, a line every ten seconds elsewhere. A search
//! shows the stage that is at work and the time that it took so far instead.

mod estimate;
mod stages;

pub use estimate::Planned;

use crate::console;
use estimate::Estimate;
use stages::{Place, Stages};
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
    course: Course,
    note: String,
    shown: Option<Instant>,
    next_line: Duration,
}

#[derive(Debug)]
enum Course {
    /// Of work that is known.
    Planned(Estimate),
    /// Of a search.
    Open(Stages),
}

/// What is shown of a course.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shown {
    /// The share that is done, and the time left where it is known.
    Promised(f64, Option<Duration>),
    /// The stage at work, and the time that the search took so far.
    SoFar(Place, Duration),
}

impl Progress {
    /// Work of `length` steps that take about as long as each other.
    #[must_use]
    pub fn new(title: &str, length: u64) -> Self {
        Self::begun(title, Course::Planned(Estimate::new(&[("", 1.0)], length)))
    }

    /// Work in stages, in the order of the plan; the first, of so many steps, has begun.
    #[must_use]
    pub fn planned(title: &str, plan: &[Planned], steps: u64) -> Self {
        Self::begun(title, Course::Planned(Estimate::new(plan, steps)))
    }

    /// A search in stages, in their order; the first, of so many steps, has begun. How long it takes is found on the way, and so no end
    /// is promised.
    #[must_use]
    pub fn searching(title: &str, stages: &[&'static str], steps: u64) -> Self {
        Self::begun(title, Course::Open(Stages::new(stages, steps)))
    }

    fn begun(title: &str, course: Course) -> Self {
        let state = State { course, note: String::new(), shown: None, next_line: LINES };
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
        match &mut state.course {
            Course::Planned(estimate) => estimate.done(done, self.shared.begun.elapsed()),
            Course::Open(stages) => stages.done(done),
        }
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
        match &mut state.course {
            Course::Planned(estimate) => estimate.begin(name, steps, self.shared.begun.elapsed()),
            Course::Open(stages) => stages.begin(name, steps),
        }
        name.clone_into(&mut state.note);
        drop(state);
        self.shared.draw();
    }

    /// Stages of a search come next that were not expected.
    pub fn insert(&self, names: &[&'static str]) {
        if let Course::Open(stages) = &mut self.shared.state().course {
            stages.insert(names);
        }
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
        let shown = match &mut state.course {
            Course::Planned(estimate) => {
                let (share, left) = estimate.at(now);
                Shown::Promised(share, left)
            }
            Course::Open(stages) => Shown::SoFar(stages.at(), now),
        };
        if console::is_terminal() {
            state.shown = Some(Instant::now());
            console::status(&bar(&self.title, shown, &state.note));
        } else if now >= state.next_line {
            state.next_line = now + LINES;
            console::line(words(&self.title, shown, &state.note));
        }
    }
}

/// `identify [===>      ]  40 %, 2 min 10 s left, 120 clips simulated`
fn bar(title: &str, shown: Shown, note: &str) -> String {
    let (Shown::Promised(share, _) | Shown::SoFar(Place { share, .. }, _)) = shown;
    let done = (share * SIGNS as f64) as usize;
    let head = if done < SIGNS { ">" } else { "" };
    let signs = format!("{}{head}", "=".repeat(done));
    let line = format!("{title} [{signs:SIGNS$}] {}", state(shown, note));
    // A line that a terminal breaks is not overwritten by the next one.
    line.chars().take(COLUMNS).collect()
}

/// `identify: 40 %, 2 min 10 s left, 120 clips simulated`, `diagnose: stage 3 of 6, 50 s so far, fits: payload`
fn words(title: &str, shown: Shown, note: &str) -> String {
    format!("{title}: {}", state(shown, note).trim_start())
}

fn state(shown: Shown, note: &str) -> String {
    let how_far = match shown {
        Shown::Promised(share, left) => {
            let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
            format!("{:>3} %{left}", (share * 100.0) as u64)
        }
        Shown::SoFar(Place { stage, of, .. }, now) => format!("stage {stage} of {of}, {} so far", duration(now)),
    };
    let note = if note.is_empty() { String::new() } else { format!(", {note}") };
    format!("{how_far}{note}")
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
        let promised = |share, s: Option<u64>| Shown::Promised(share, s.map(Duration::from_secs));
        assert_eq!(bar("fit", promised(0.0, None), ""), format!("fit [>{}]   0 %", " ".repeat(19)));
        let half = format!("fit [{}>{}]  50 %, 2 min 10 s left, half", "=".repeat(10), " ".repeat(9));
        assert_eq!(bar("fit", promised(0.5, Some(130)), "half"), half);
        assert_eq!(words("fit", promised(0.5, Some(130)), "half"), "fit: 50 %, 2 min 10 s left, half");
        assert_eq!(bar("fit", promised(1.0, Some(0)), ""), format!("fit [{}] 100 %, 0 s left", "=".repeat(20)));
    }

    #[test]
    fn a_search_promises_no_end() {
        let so_far = Shown::SoFar(Place { stage: 3, of: 6, share: 0.5 }, Duration::from_secs(130));
        assert_eq!(words("diagnose", so_far, "fits"), "diagnose: stage 3 of 6, 2 min 10 s so far, fits");
        let line = bar("diagnose", so_far, "fits: velocity dependent friction");
        assert!(line.chars().count() < 80 && line.contains("[==========>"), "{line}");
    }

    #[test]
    fn the_time_left_has_the_digits_that_an_estimate_deserves() {
        let shown = |s| duration(Duration::from_secs_f64(s));
        assert_eq!([0.2, 59.0, 61.0, 138.0].map(shown), ["1 s", "59 s", "1 min", "2 min 10 s"]);
        assert_eq!([659.0, 3900.0].map(shown), ["10 min", "1 h 5 min"]);
    }
}
