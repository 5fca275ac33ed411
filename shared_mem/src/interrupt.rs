//! Cancellation, pause and time budget of long work: flags that it reads between steps, so that it can stop cleanly and keep
//! what it has. Where it does not read them in time, the process says its last words and ends without it.

use crate::{console, ending, output};
use signal_hook::consts::{SIGUSR1, SIGUSR2};
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often paused work looks whether to go on.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// How long work that keeps nothing beside its farewell may take until it has ended by itself.
const END_TIMEOUT: Duration = Duration::from_millis(400);

/// Whether the user (or the system, with a signal) asked to end or to pause, or the time is spent. Clones share the flags.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    end: Arc<AtomicBool>,
    /// 1 while paused.
    pause: Arc<AtomicUsize>,
    deadline: Option<Instant>,
    last: Arc<Mutex<Last>>,
}

/// What the process does and says at last where its work does not end by itself.
type Farewell = Box<dyn FnOnce() -> String + Send>;

/// Who ends the process.
#[derive(Default)]
enum Last {
    /// Nobody yet; what is said where the work takes too long.
    #[default]
    Open,
    Prepared(Farewell),
    /// The work: it has come to its end.
    Work,
}

impl std::fmt::Debug for Last {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Open => "Open",
            Self::Prepared(_) => "Prepared",
            Self::Work => "Work",
        })
    }
}

/// Work cannot be interrupted.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Ctrl-C and the like.
    #[error("cannot listen to Ctrl-C: {0}")]
    End(#[from] ctrlc::Error),
    /// Signals to pause and to go on.
    #[error("cannot listen to SIGUSR1: {0}")]
    Pause(#[from] io::Error),
}

impl Interrupt {
    /// Listens from now on: SIGINT, SIGTERM and SIGHUP end, SIGUSR1 pauses, SIGUSR2 goes on. Once a process.
    ///
    /// # Errors
    /// [`ListenError`] when a handler cannot be installed.
    pub fn listen() -> Result<Self, ListenError> {
        let interrupt = Self::default();
        let flag = interrupt.clone();
        ctrlc::set_handler(move || flag.ask())?;
        interrupt.listen_to_pauses()?;
        Ok(interrupt)
    }

    /// The same for work that says at its end what it has, and cuts short what it is doing: the end is asked of every reader and
    /// every roll-out too ([`ending`]).
    ///
    /// # Errors
    /// As [`Interrupt::listen`].
    pub fn listen_and_cut_short() -> Result<Self, ListenError> {
        let interrupt = Self::default();
        let flag = interrupt.clone();
        ctrlc::set_handler(move || {
            // In this order: what the end of a reader leaves is seen to be no result.
            flag.ask();
            ending::ask();
        })?;
        interrupt.listen_to_pauses()?;
        Ok(interrupt)
    }

    /// The same for work that ends where it is and keeps nothing that is not kept already: what does not come to look within
    /// a moment is not waited for.
    ///
    /// # Errors
    /// As [`Interrupt::listen`].
    pub fn listen_to_end_at_once() -> Result<Self, ListenError> {
        let interrupt = Self::default();
        let flag = interrupt.clone();
        ctrlc::set_handler(move || {
            flag.ask();
            ending::ask();
            std::thread::sleep(END_TIMEOUT);
            flag.leave();
        })?;
        interrupt.listen_to_pauses()?;
        Ok(interrupt)
    }

    /// What is to be done at last where the work is interrupted and does not end by itself in time; it gives the words.
    pub fn prepare(&self, farewell: impl FnOnce() -> String + Send + 'static) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if !matches!(*last, Last::Work) {
            *last = Last::Prepared(Box::new(farewell));
        }
    }

    /// The work has come to its end: from here on it is waited for, whatever it still writes.
    pub fn work_is_over(&self) {
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Last::Work;
    }

    /// Ends the process, unless its work has come to its end by itself.
    fn leave(&self) {
        // Held to the end: the work waits here, should it come to its end now.
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let words = match std::mem::take(&mut *last) {
            Last::Work => {
                *last = Last::Work;
                return;
            }
            Last::Open => "interrupted; start again".to_owned(),
            Last::Prepared(farewell) => farewell(),
        };
        output::discard_unfinished();
        console::line(words);
        console::flush();
        std::process::exit(1);
    }

    fn listen_to_pauses(&self) -> io::Result<()> {
        for (signal, value) in [(SIGUSR1, 1), (SIGUSR2, 0)] {
            signal_hook::flag::register_usize(signal, self.pause.clone(), value)?;
        }
        Ok(())
    }

    /// Asks for the end.
    pub fn ask(&self) {
        self.end.store(true, Ordering::SeqCst);
    }

    /// The same, for work that shall end once so much time is over, too.
    pub fn within(&self, budget: Option<Duration>) -> Self {
        let deadline = budget.and_then(|budget| Instant::now().checked_add(budget));
        Self { deadline, ..self.clone() }
    }

    /// Whether the end was asked for, or the time is spent.
    pub fn asked(&self) -> bool {
        self.cancelled() || self.spent()
    }

    /// Whether the end was asked for: nobody waits for an answer any more.
    pub fn cancelled(&self) -> bool {
        self.end.load(Ordering::SeqCst)
    }

    /// Whether the time is spent: the best answer so far is waited for.
    pub fn spent(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// Asks for a pause, or to go on.
    pub fn toggle_pause(&self) {
        self.pause.fetch_xor(1, Ordering::Relaxed);
    }

    /// Whether a pause was asked for.
    pub fn paused(&self) -> bool {
        self.pause.load(Ordering::Relaxed) != 0
    }

    /// Whether the work has to stop, for good or for now.
    pub fn halted(&self) -> bool {
        self.asked() || self.paused()
    }

    /// Waits while paused, and says so on standard error; at once where nobody asked for a pause.
    pub fn wait_out_pause(&self) {
        if !self.paused() || self.asked() {
            return;
        }
        console::line("paused; the arm holds its pose. p (or SIGUSR2) goes on, q (or Ctrl-C) ends");
        while self.paused() && !self.asked() {
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use signal_hook::low_level::raise;

    #[test]
    fn signals_pause_and_go_on_and_the_end_wins_over_a_pause() {
        let interrupt = Interrupt::default();
        interrupt.listen_to_pauses().expect("handlers");
        interrupt.wait_out_pause();
        raise(SIGUSR1).expect("a signal to this process");
        assert!(interrupt.paused() && interrupt.halted() && !interrupt.asked());
        raise(SIGUSR2).expect("a signal to this process");
        assert!(!interrupt.halted());
        interrupt.toggle_pause();
        interrupt.ask();
        interrupt.wait_out_pause();
        assert!(interrupt.asked());
    }

    #[test]
    fn a_budget_that_is_spent_asks_for_the_end_of_its_own_work_alone() {
        let whole = Interrupt::default();
        let (spent, ample) = (whole.within(Some(Duration::ZERO)), whole.within(Some(Duration::from_secs(3600))));
        assert!(spent.asked() && spent.spent() && !spent.cancelled());
        assert!(!ample.asked() && !whole.within(None).asked() && !whole.asked());
        whole.ask();
        assert!(ample.cancelled() && !ample.spent());
    }
}
