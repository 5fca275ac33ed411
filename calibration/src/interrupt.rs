//! What the user wants of long work while it runs: that it ends, or waits. Flags that the work looks at between steps, so
//! that it can stop cleanly and keep what it has.

use shared_mem::console;
use signal_hook::consts::{SIGUSR1, SIGUSR2};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// How often paused work looks whether to go on.
const LOOK: Duration = Duration::from_millis(20);

/// Whether the user (or the system, with a signal) asked to end or to pause. Clones share the flags.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    end: Arc<AtomicBool>,
    /// 1 while paused.
    pause: Arc<AtomicUsize>,
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

    /// The same for work that ends where it is and keeps nothing that is not kept already: the end is asked of every reader
    /// and every roll-out too ([`shared_mem::ending`]).
    ///
    /// # Errors
    /// As [`Interrupt::listen`].
    pub fn listen_to_end_at_once() -> Result<Self, ListenError> {
        let interrupt = Self::default();
        let flag = interrupt.clone();
        ctrlc::set_handler(move || {
            flag.ask();
            shared_mem::ending::ask();
        })?;
        interrupt.listen_to_pauses()?;
        Ok(interrupt)
    }

    fn listen_to_pauses(&self) -> io::Result<()> {
        for (signal, value) in [(SIGUSR1, 1), (SIGUSR2, 0)] {
            signal_hook::flag::register_usize(signal, self.pause.clone(), value)?;
        }
        Ok(())
    }

    /// Asks for the end.
    pub fn ask(&self) {
        self.end.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// Asks for a pause, or to go on.
    pub fn toggle_pause(&self) {
        self.pause.fetch_xor(1, Ordering::Relaxed);
    }

    /// Whether a pause was asked for.
    #[must_use]
    pub fn paused(&self) -> bool {
        self.pause.load(Ordering::Relaxed) != 0
    }

    /// Whether the work has to stop, for good or for now.
    #[must_use]
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
            std::thread::sleep(LOOK);
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
}
