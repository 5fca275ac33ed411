//! Standard error: the only code that writes there. Logs, notes, progress and the last error line all pass through here.
//!
//! A terminal that is held with Ctrl-S, a pipe that nobody reads or a full disk must not stop a robot's bridge, so whoever
//! has something to say only puts it into a queue; one thread writes it out and may wait as long as it likes. What finds
//! the queue full, or cannot be written, is dropped and counted, and the count is written in its place as soon as
//! something can be written again. A program ends without waiting longer than half a second for its last lines.
//!
//! On a terminal there may be a status below all lines: it is overwritten in place and makes room for each line.

mod queue;

use crate::printable;
use queue::Console;
use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write};
use std::sync::OnceLock;
use std::time::Duration;

/// How long a program that ends waits for its last lines.
const PATIENCE: Duration = Duration::from_millis(500);

/// Says one line.
pub fn line(text: impl Display) {
    console().say(printable::one_line(&text.to_string()));
}

/// Says a text of several lines in one piece, as a table needs it.
pub fn block(text: impl Display) {
    console().say(printable::lines(text.to_string().trim_end_matches('\n')));
}

/// Shows `text` below all lines until the next status; empty: none. Does nothing where standard error is no terminal.
pub fn status(text: &str) {
    if is_terminal() {
        console().show(printable::one_line(text));
    }
}

/// `true` where a person may be reading.
pub fn is_terminal() -> bool {
    static IS_TERMINAL: OnceLock<bool> = OnceLock::new();
    *IS_TERMINAL.get_or_init(|| io::stderr().is_terminal())
}

/// Begins writing, from a thread with this one's priority; a panic anywhere is then said like any other line. Called
/// first in a program; the answer is kept until its end.
#[must_use = "the last lines are written when it is dropped"]
pub fn start() -> LastLines {
    let console = console();
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        line(format_args!("the thread `{}` {panic}; please report this", thread.name().unwrap_or("without a name")));
        let trace = std::backtrace::Backtrace::capture();
        if trace.status() == std::backtrace::BacktraceStatus::Captured {
            block(trace);
        }
    }));
    LastLines(console)
}

/// Gives the lines that wait a last chance, before the program is ended where nothing is dropped.
pub fn flush() {
    console().flush(PATIENCE);
}

/// Dropping it gives the lines that wait a last chance.
#[derive(Debug)]
pub struct LastLines(&'static Console);

impl Drop for LastLines {
    fn drop(&mut self) {
        self.0.flush(PATIENCE);
    }
}

/// Where a log writes its lines: each call says one. It never fails, because a log that fails complains elsewhere.
#[derive(Debug, Clone, Copy, Default)]
pub struct Log;

impl Write for Log {
    fn write(&mut self, logged: &[u8]) -> io::Result<usize> {
        line(String::from_utf8_lossy(logged).trim_end_matches('\n'));
        Ok(logged.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn console() -> &'static Console {
    static CONSOLE: OnceLock<Console> = OnceLock::new();
    CONSOLE.get_or_init(|| {
        let width: Option<fn() -> usize> = is_terminal().then_some(width);
        Console::start(io::stderr(), width)
    })
}

/// Columns of the terminal; 80 where it does not know.
fn width() -> usize {
    let known = rustix::termios::tcgetwinsize(io::stderr()).map_or(0, |size| usize::from(size.ws_col));
    if known == 0 { 80 } else { known }
}
