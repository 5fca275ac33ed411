//! Keys of the terminal while the arm moves: single ones, without Enter. Nothing is read where standard input is no
//! terminal, or another program is in front of it.

use inference::interrupt::Interrupt;
use rustix::process::getpgrp;
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, isatty, tcgetattr, tcgetpgrp, tcsetattr,
};
use shared_mem::console;
use std::io::{self, Read as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// Longest wait for a key, in tenths of a second: how soon listening ends.
const TENTHS: u8 = 2;

/// Listens until it is dropped; the terminal is then as it was.
#[derive(Debug)]
pub struct Keys {
    stop: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
    before: Termios,
}

/// What a key asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wish {
    Pause,
    End,
}

/// Space and p pause or go on, q and Escape end.
fn wish(key: u8) -> Option<Wish> {
    match key {
        b' ' | b'p' | b'P' => Some(Wish::Pause),
        b'q' | b'Q' | 0x1B => Some(Wish::End),
        _ => None,
    }
}

impl Keys {
    /// Begins to listen, and says on standard error what for. `None` where there is no keyboard to listen to.
    #[must_use]
    pub fn listen(interrupt: &Interrupt) -> Option<Self> {
        let input = io::stdin();
        if !isatty(&input) || tcgetpgrp(&input).ok()? != getpgrp() {
            return None;
        }
        let before = tcgetattr(&input).ok()?;
        let mut raw = before.clone();
        // Ctrl-C stays a signal.
        raw.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        raw.special_codes[SpecialCodeIndex::VMIN] = 0;
        raw.special_codes[SpecialCodeIndex::VTIME] = TENTHS;
        tcsetattr(&input, OptionalActions::Now, &raw).ok()?;
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, interrupt) = (stop.clone(), interrupt.clone());
        let body = move || {
            let mut key = [0];
            while !stopped.load(Ordering::Relaxed) {
                match io::stdin().read(&mut key).map(|read| (read, wish(key[0]))) {
                    Ok((1, Some(Wish::Pause))) => interrupt.toggle_pause(),
                    Ok((1, Some(Wish::End))) => interrupt.ask(),
                    Ok(_) => {}
                    Err(_) => return,
                }
            }
        };
        let listener = thread::Builder::new().name("keys".into()).spawn(body).ok();
        console::line("p pauses and goes on, q ends; the arm stops inside its limits at any moment");
        Some(Self { stop, listener, before })
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(listener) = self.listener.take() {
            let _panicked = listener.join();
        }
        let _hung_up = tcsetattr(io::stdin(), OptionalActions::Now, &self.before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_mean_nothing_do_nothing() {
        assert_eq!(
            [b'p', b' ', b'q', 0x1B].map(wish),
            [Some(Wish::Pause), Some(Wish::Pause), Some(Wish::End), Some(Wish::End)]
        );
        assert!((0..=255).filter(|key| wish(*key).is_some()).count() == 6);
    }
}
