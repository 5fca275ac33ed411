//! A progress bar on the terminal; where standard error is no terminal, no bar.

use crate::console;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Signs of a full bar.
const SIGNS: usize = 30;
/// How often it is drawn at most.
const PAUSE: Duration = Duration::from_millis(100);

/// The bar of one piece of work; it disappears when dropped.
#[derive(Debug)]
pub struct Progress {
    title: String,
    length: u64,
    drawn: Mutex<Option<Instant>>,
}

impl Progress {
    /// A bar of `length` steps.
    #[must_use]
    pub fn new(title: &str, length: u64) -> Self {
        Self { title: title.to_owned(), length, drawn: Mutex::new(None) }
    }

    /// Moves the bar to so many steps and changes the note behind it.
    pub fn show(&self, position: u64, note: &str) {
        let mut drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        if drawn.is_some_and(|at| at.elapsed() < PAUSE) {
            return;
        }
        *drawn = Some(Instant::now());
        console::status(&line(&self.title, position, self.length, note));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.drawn.get_mut().unwrap_or_else(PoisonError::into_inner).is_some() {
            console::status("");
        }
    }
}

/// `identify [===>      ]  40 % 120 clips simulated`
fn line(title: &str, position: u64, length: u64, note: &str) -> String {
    let share = if length == 0 { 1.0 } else { position.min(length) as f64 / length as f64 };
    let done = (share * SIGNS as f64) as usize;
    let head = if done < SIGNS { ">" } else { "" };
    let signs = format!("{}{head}", "=".repeat(done));
    format!("{title} [{signs:SIGNS$}] {:>3} % {note}", (share * 100.0) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_grows_from_nothing_to_its_length_and_no_further() {
        assert_eq!(line("fit", 0, 4, ""), format!("fit [>{}]   0 % ", " ".repeat(29)));
        assert_eq!(line("fit", 2, 4, "half"), format!("fit [{}>{}]  50 % half", "=".repeat(15), " ".repeat(14)));
        let full = format!("fit [{}] 100 % ", "=".repeat(30));
        assert_eq!(
            [line("fit", 4, 4, ""), line("fit", 9, 4, ""), line("fit", 0, 0, "")],
            [(); 3].map(|()| full.clone())
        );
    }
}
