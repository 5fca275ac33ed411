//! The server's lines on standard error, and how many of a kind there may be: a program that connects a thousand times a
//! second, or sends nothing but garbage, must not fill a disk. What is left out is counted, and the count is written.

use std::fmt::Display;
use std::time::{Duration, Instant};

/// Lines of one kind within [`WINDOW`].
const MAX_LINES: u64 = 5;
const WINDOW: Duration = Duration::from_secs(10);

/// What a line is about. Each kind has its own allowance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum About {
    /// A client that came or left.
    Client,
    /// A connection or request that was refused.
    Refusal,
    /// What the robot did by itself.
    Robot,
}

/// Writes lines, as far as their allowances go.
#[derive(Debug)]
pub(super) struct Notices([Allowance; 3]);

/// The lines of one kind.
#[derive(Debug, Clone, Copy)]
struct Allowance {
    since: Instant,
    written: u64,
    left_out: u64,
}

impl Notices {
    pub(super) fn new() -> Self {
        Self([Allowance { since: Instant::now(), written: 0, left_out: 0 }; 3])
    }

    /// Writes a line that a person should see.
    pub(super) fn warn(&mut self, about: About, line: impl Display) {
        if let Some(left_out) = self.0[about as usize].take(Instant::now()) {
            tracing::warn!("{line}{}", of_left_out(left_out));
        }
    }

    /// Writes a line about the ordinary course of things.
    pub(super) fn info(&mut self, about: About, line: impl Display) {
        if let Some(left_out) = self.0[about as usize].take(Instant::now()) {
            tracing::info!("{line}{}", of_left_out(left_out));
        }
    }

    /// Writes how many lines were left out last.
    pub(super) fn finish(&mut self) {
        for (of, allowance) in ["clients", "refused connections and requests", "the robot"].iter().zip(&mut self.0) {
            match std::mem::take(&mut allowance.left_out) {
                0 => {}
                left_out => tracing::info!("{left_out} more lines about {of} were left out"),
            }
        }
    }
}

impl Allowance {
    /// `None` where the line is one too many; else how many like it were left out before.
    fn take(&mut self, now: Instant) -> Option<u64> {
        if now.duration_since(self.since) >= WINDOW {
            (self.since, self.written) = (now, 0);
        }
        if self.written == MAX_LINES {
            self.left_out += 1;
            return None;
        }
        self.written += 1;
        Some(std::mem::take(&mut self.left_out))
    }
}

fn of_left_out(lines: u64) -> String {
    if lines == 0 { String::new() } else { format!(" ({lines} lines like this one were left out before)") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_ten_thousand_lines_five_are_written_and_the_others_are_counted_in_the_next() {
        let begin = Instant::now();
        let mut lines = Allowance { since: begin, written: 0, left_out: 0 };
        let written = (0..10_000).filter(|k| lines.take(begin + Duration::from_micros(100 * k)).is_some()).count();
        assert_eq!(written, 5);
        assert_eq!(lines.take(begin + WINDOW), Some(9_995));
        assert_eq!(lines.take(begin + WINDOW), Some(0));
    }
}
