//! What a capture does when the robot stops itself on the way: it ends, unless it was given how often to go on by itself. Then it
//! waits, has the reflex cleared and goes on. A stop that a person pressed is never lifted.

use super::link::{Link, LinkError};
use super::stream::Outcome;
use shared_mem::console;
use shared_mem::interrupt::Interrupt;
use std::time::{Duration, Instant};

/// Wait before a reflex is cleared: an object comes to rest, a person sees what happened and can end it.
const RECOVERY_PAUSE: Duration = Duration::from_secs(2);
/// How often the wait looks whether to end.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The robot will not be recovered by this run.
#[derive(Debug, thiserror::Error)]
pub enum RecoveryError {
    /// It stopped itself more often than this run was to recover it.
    #[error(
        "{reason}; look at what the arm runs into, free it, restart the bridge and start the same command again: the session \
         is continued (recovered by itself {most} times, as --recover allows)"
    )]
    TooOften {
        /// What the bridge said.
        reason: String,
        /// How often it was recovered.
        most: u32,
    },
    /// The bridge could not recover it, or a person stopped it.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// The reflexes of one run.
#[derive(Debug)]
pub struct Recovery {
    most: u32,
    pending: Option<String>,
    done: u32,
}

impl Recovery {
    /// Recovers by itself at most so often: an arm that stops itself more often is in trouble that a person has to look at.
    pub fn new(most: u32) -> Self {
        Self { most, pending: None, done: 0 }
    }

    /// Takes note of how a motion ended.
    ///
    /// # Errors
    /// [`LinkError`] when shared memory fails.
    pub fn note(&mut self, outcome: Outcome, link: &mut Link) -> Result<(), LinkError> {
        if outcome == Outcome::Reflex {
            // Without the bridge's advice, which is for those who capture nothing.
            self.pending = link.reason()?.split(';').next().map(str::to_owned);
        }
        Ok(())
    }

    /// Why the robot stopped itself, until that is settled.
    pub fn reason(&self) -> Option<String> {
        self.pending.clone()
    }

    /// Recovers the robot if it stopped itself since the last call. `true`: it did, and holds where it stands; `false`: there
    /// was nothing to recover from, or the user ended the run meanwhile.
    ///
    /// # Errors
    /// [`RecoveryError`] with the remedy.
    pub fn settle(&mut self, link: &mut Link, interrupt: &Interrupt) -> Result<bool, RecoveryError> {
        let Some(reason) = self.pending.take() else { return Ok(false) };
        if self.done == self.most {
            return Err(RecoveryError::TooOften { reason, most: self.most });
        }
        self.done += 1;
        let wait = RECOVERY_PAUSE.as_secs();
        console::line(format_args!(
            "{reason}; it is recovered in {wait} s ({} of {} times, Ctrl-C ends)",
            self.done, self.most
        ));
        let begin = Instant::now();
        while begin.elapsed() < RECOVERY_PAUSE && !interrupt.asked() {
            std::thread::sleep(POLL_INTERVAL);
        }
        interrupt.wait_out_pause();
        if interrupt.asked() {
            return Ok(false);
        }
        link.recover()?;
        Ok(true)
    }
}
