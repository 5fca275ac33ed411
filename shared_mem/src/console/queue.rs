//! The queue in front of standard error and the thread that empties it: what waits, what was dropped and where, and the
//! status that a terminal shows below all lines.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvError, SyncSender, TryRecvError, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Entries that can wait.
const ENTRIES: usize = 1024;
/// How long to wait before writing again to a pipe that takes nothing just now and does not block.
const PAUSE: Duration = Duration::from_millis(10);
/// Back to the beginning of the terminal's line.
const BACK: &str = "\r";
/// Clears the rest of the terminal's line.
const CLEAR: &str = "\x1b[K";

/// What waits to be written.
enum Entry {
    /// Printable text, without the last line's end; `lost` lines before it found no place in the queue.
    Text { lost: u64, text: String },
    /// The status has changed.
    Status,
    /// All before this is to be written now; the sender is dropped then.
    Flush(#[expect(dead_code, reason = "being dropped is its message")] mpsc::Sender<()>),
}

/// What the queue's two ends share beside it.
#[derive(Debug, Default)]
struct Shared {
    /// Lines that found no place and that no entry has counted.
    lost: AtomicU64,
    /// The newest status; older ones are of no interest, so it needs no place in the queue.
    status: Mutex<String>,
    /// An entry says that the status has changed.
    status_waits: AtomicBool,
}

/// The queue and the thread behind it.
#[derive(Debug)]
pub(super) struct Console {
    queue: SyncSender<Entry>,
    shared: Arc<Shared>,
}

impl Console {
    /// Starts the thread that writes to `out`; `width`: where it is a terminal, how many columns it has.
    pub(super) fn start(out: impl Write + Send + 'static, width: Option<fn() -> usize>) -> Self {
        let (queue, entries) = mpsc::sync_channel(ENTRIES);
        let shared = Arc::new(Shared::default());
        let writer = Writer { out, width, shared: shared.clone(), status: String::new(), lost: 0, amid_a_line: false };
        // Without a thread all lines are lost, and everything else goes on. Nobody waits for it: it may wait for a reader
        // that never comes.
        let _thread = std::thread::Builder::new().name("console".into()).spawn(move || writer.run(&entries));
        Self { queue, shared }
    }

    pub(super) fn say(&self, text: String) {
        let lost = self.shared.lost.swap(0, Ordering::Relaxed);
        if let Err(TrySendError::Full(entry) | TrySendError::Disconnected(entry)) =
            self.queue.try_send(Entry::Text { lost, text })
            && let Entry::Text { lost, text } = entry
        {
            self.shared.lost.fetch_add(lost + count(&text), Ordering::Relaxed);
        }
    }

    pub(super) fn show(&self, status: String) {
        *self.shared.status.lock().unwrap_or_else(PoisonError::into_inner) = status;
        if !self.shared.status_waits.swap(true, Ordering::AcqRel) && self.queue.try_send(Entry::Status).is_err() {
            self.shared.status_waits.store(false, Ordering::Release);
        }
    }

    /// Waits until all that was said before is written, but no longer than `patience`.
    pub(super) fn flush(&self, patience: Duration) {
        let begin = Instant::now();
        let (end, written) = mpsc::channel();
        let mut entry = Entry::Flush(end);
        while let Err(TrySendError::Full(unsent)) = self.queue.try_send(entry) {
            if begin.elapsed() >= patience {
                return;
            }
            entry = unsent;
            std::thread::sleep(PAUSE);
        }
        // Either way there is nothing more to wait for.
        let _written_or_late = written.recv_timeout(patience.saturating_sub(begin.elapsed()));
    }
}

/// The thread's side.
struct Writer<W> {
    out: W,
    width: Option<fn() -> usize>,
    shared: Arc<Shared>,
    /// What the terminal shows below the lines.
    status: String,
    /// Lines that are missing at this point of the output.
    lost: u64,
    /// A write failed after the beginning of a line.
    amid_a_line: bool,
}

impl<W: Write> Writer<W> {
    fn run(mut self, entries: &Receiver<Entry>) {
        while let Ok(entry) = self.next(entries) {
            match entry {
                Entry::Text { lost, text } => {
                    self.lost += lost;
                    self.write_lines(&text);
                }
                Entry::Status if self.width.is_none() => self.shared.status_waits.store(false, Ordering::Release),
                Entry::Status => {
                    self.shared.status_waits.store(false, Ordering::Release);
                    self.status.clone_from(&self.shared.status.lock().unwrap_or_else(PoisonError::into_inner));
                    let drawn = format!("{BACK}{}{CLEAR}", self.fitting_status());
                    // A status that cannot be drawn is no loss: the next one comes soon.
                    let _shown = self.write(drawn.as_bytes());
                }
                Entry::Flush(_) => {
                    self.status.clear();
                    self.write_lines("");
                }
            }
        }
    }

    /// The next entry; while there is none, what was lost at the end is counted.
    fn next(&mut self, entries: &Receiver<Entry>) -> Result<Entry, RecvError> {
        match entries.try_recv() {
            Ok(entry) => Ok(entry),
            Err(TryRecvError::Disconnected) => Err(RecvError),
            Err(TryRecvError::Empty) => {
                self.lost += self.shared.lost.swap(0, Ordering::Relaxed);
                if self.lost > 0 {
                    self.write_lines("");
                }
                entries.recv()
            }
        }
    }

    /// Writes how many lines are missing here, then `text` (empty: nothing more), then the status again.
    fn write_lines(&mut self, text: &str) {
        let mut lines = String::new();
        if self.width.is_some() {
            lines += BACK;
            lines += CLEAR;
        }
        if self.amid_a_line {
            lines.push('\n');
        }
        if self.lost > 0 {
            lines += &format!("lines dropped here, because standard error took no more: {}\n", self.lost);
        }
        if !text.is_empty() {
            lines += text;
            lines.push('\n');
        }
        lines += &self.fitting_status();
        self.lost = match self.write(lines.as_bytes()) {
            Ok(()) => 0,
            Err(_) => self.lost + if text.is_empty() { 0 } else { count(text) },
        };
    }

    /// As much of the status as fits into one line of the terminal: with more, its beginning could not be overwritten.
    fn fitting_status(&self) -> String {
        let columns = self.width.map_or(0, |width| width());
        self.status.chars().take(columns.saturating_sub(1)).collect()
    }

    /// Writes all of it, however long that takes.
    fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.out.write(bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(written) => {
                    self.amid_a_line = bytes[written - 1] != b'\n' && self.width.is_none();
                    bytes = &bytes[written..];
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                // Another process with the same terminal or pipe has switched blocking off.
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => std::thread::sleep(PAUSE),
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

/// Lines of an entry.
fn count(text: &str) -> u64 {
    text.split('\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard error in a test.
    #[derive(Clone, Default)]
    struct Pipe(Arc<(Mutex<State>, std::sync::Condvar)>);

    #[derive(Default)]
    struct State {
        text: Vec<u8>,
        /// Nobody reads: writing waits.
        held: bool,
        /// A write waits for a reader.
        waits: bool,
        /// Writing fails.
        fault: Option<io::ErrorKind>,
        /// Room for so many bytes of the next write; after it, the disk is full.
        most: Option<usize>,
    }

    impl Write for Pipe {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let (state, changed) = &*self.0;
            let mut state = state.lock().expect("no panic");
            state.waits = state.held;
            changed.notify_all();
            let mut state = changed.wait_while(state, |state| state.held).expect("no panic");
            if let Some(fault) = state.fault {
                return Err(fault.into());
            }
            let taken = state.most.map_or(bytes.len(), |most| most.min(bytes.len()));
            state.text.extend(&bytes[..taken]);
            if state.most.take().is_some() {
                state.fault = Some(io::ErrorKind::StorageFull);
            }
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Pipe {
        fn set(&self, change: impl FnOnce(&mut State)) {
            change(&mut self.0.0.lock().expect("no panic"));
            self.0.1.notify_all();
        }

        /// Comes back when a write waits for a reader.
        fn wait_for_a_write(&self) {
            let (state, changed) = &*self.0;
            let _waits = changed.wait_while(state.lock().expect("no panic"), |state| !state.waits).expect("no panic");
        }

        fn text(&self) -> String {
            String::from_utf8(self.0.0.lock().expect("no panic").text.clone()).expect("text")
        }
    }

    /// Long enough for a busy machine; only a fault uses it up.
    const LONG: Duration = Duration::from_secs(60);

    fn console(width: Option<fn() -> usize>) -> (Console, Pipe) {
        let pipe = Pipe::default();
        (Console::start(pipe.clone(), width), pipe)
    }

    #[test]
    fn lines_come_out_in_their_order() {
        let (console, pipe) = console(None);
        console.say("one".into());
        console.say("two\nthree".into());
        console.show("no terminal, no status".into());
        console.flush(LONG);
        assert_eq!(pipe.text(), "one\ntwo\nthree\n");
    }

    #[test]
    fn a_reader_that_stands_still_stops_nobody_and_learns_later_what_it_missed() {
        let (console, pipe) = console(None);
        pipe.set(|state| state.held = true);
        let said = 3 * ENTRIES;
        console.say("line 0".into());
        // Else the thread may take the first line only after the queue was full, and leave one gap more in the middle.
        pipe.wait_for_a_write();
        for number in 1..said {
            console.say(format!("line {number}"));
        }
        // Comes back although nothing can be written.
        console.flush(Duration::from_millis(1));
        pipe.set(|state| state.held = false);
        console.flush(LONG);
        console.say("after".into());
        console.flush(LONG);
        let text = pipe.text();
        let shown: Vec<&str> = text.lines().collect();
        let (last, dropped) = (shown.len() - 2, said + 2 - shown.len());
        assert_eq!(last, ENTRIES + 1, "the lines that wait and the one that is being written");
        assert!((0..last).all(|number| shown[number] == format!("line {number}")), "{text}");
        assert_eq!(
            shown[last..],
            [&format!("lines dropped here, because standard error took no more: {dropped}"), "after"]
        );
    }

    #[test]
    fn what_a_full_disk_or_a_closed_pipe_refuses_is_counted_and_said_when_there_is_room() {
        for fault in [io::ErrorKind::StorageFull, io::ErrorKind::BrokenPipe] {
            let (console, pipe) = console(None);
            console.say("before".into());
            console.flush(LONG);
            pipe.set(|state| state.fault = Some(fault));
            console.say("lost".into());
            console.say("two\nmore".into());
            console.flush(LONG);
            pipe.set(|state| state.fault = None);
            console.say("after".into());
            console.flush(LONG);
            let counted = "lines dropped here, because standard error took no more: 3";
            assert_eq!(pipe.text(), format!("before\n{counted}\nafter\n"));
        }
    }

    #[test]
    fn a_line_that_was_cut_does_not_run_into_the_next() {
        let (console, pipe) = console(None);
        pipe.set(|state| state.most = Some(4));
        console.say("half a line".into());
        console.flush(LONG);
        pipe.set(|state| state.fault = None);
        console.say("after".into());
        console.flush(LONG);
        assert_eq!(pipe.text(), "half\nlines dropped here, because standard error took no more: 1\nafter\n");
    }

    #[test]
    fn a_pipe_that_does_not_block_is_tried_again() {
        let (console, pipe) = console(None);
        pipe.set(|state| state.fault = Some(io::ErrorKind::WouldBlock));
        console.say("late".into());
        console.flush(PAUSE);
        pipe.set(|state| state.fault = None);
        console.flush(LONG);
        assert_eq!(pipe.text(), "late\n");
    }

    #[test]
    fn a_status_makes_room_for_lines_and_fits_the_terminal() {
        let (console, pipe) = console(Some(|| 10));
        console.show("status 1234567".into());
        console.flush_status();
        console.say("line".into());
        console.flush(LONG);
        assert_eq!(pipe.text(), "\rstatus 12\x1b[K\r\x1b[Kline\nstatus 12\r\x1b[K");
    }

    impl Console {
        /// Waits until the status is drawn.
        fn flush_status(&self) {
            let begin = Instant::now();
            while self.shared.status_waits.load(Ordering::Acquire) && begin.elapsed() < LONG {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }
}
