//! What another program says on its pipes, read so that it never waits for a reader, and kept only as far as it is passed on: a program may
//! write without end, and without the end of a line.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Command, ExitStatus, Stdio};

/// Of a line so much is passed on at most [bytes]; what follows up to its end is thrown away.
const MAX_LINE_BYTES: usize = 4096;

/// Tells each line, without its end, until the pipe ends. Bytes that are no UTF-8 are replaced.
pub fn lines(from: impl Read, mut take: impl FnMut(&str)) {
    let mut from = BufReader::new(from);
    let mut line = Vec::new();
    loop {
        line.clear();
        let begun = (&mut from).take(MAX_LINE_BYTES as u64).read_until(b'\n', &mut line);
        if begun.is_err() || line.is_empty() {
            return;
        }
        let ended = line.last() == Some(&b'\n');
        take(String::from_utf8_lossy(line.strip_suffix(b"\n").unwrap_or(&line)).trim_end_matches('\r'));
        if !ended && from.skip_until(b'\n').is_err() {
            return;
        }
    }
}

/// All that comes up to so many bytes, until the pipe ends; what comes behind them is thrown away. `None` where there was more.
pub fn whole(mut from: impl Read, most: u64) -> io::Result<Option<Vec<u8>>> {
    let mut kept = Vec::new();
    (&mut from).take(most).read_to_end(&mut kept)?;
    let more = io::copy(&mut from, &mut io::sink())?;
    Ok((more == 0).then_some(kept))
}

/// What a program leaves that was run to its end.
pub struct Ended {
    /// How it ended.
    pub status: ExitStatus,
    /// Its standard output; `None` where that was longer than it may be.
    pub answer: Option<Vec<u8>>,
    /// The last line of its standard error that is not empty.
    pub last_words: String,
}

/// Runs a program without input to its end; its answer may have so many bytes.
///
/// # Errors
/// The system's, where it does not start or its pipes break.
pub fn of(command: &mut Command, most: u64) -> io::Result<Ended> {
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let (Some(stdout), Some(stderr)) = (child.stdout.take(), child.stderr.take()) else {
        return Err(io::Error::other("it has no pipes"));
    };
    let mut last_words = String::new();
    let answer = std::thread::scope(|scope| {
        scope.spawn(|| {
            lines(stderr, |line| {
                if !line.trim().is_empty() {
                    line.trim().clone_into(&mut last_words);
                }
            });
        });
        whole(stdout, most)
    })?;
    Ok(Ended { status: child.wait()?, answer, last_words })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(bytes: &[u8]) -> Vec<String> {
        let mut all = Vec::new();
        lines(bytes, |line| all.push(line.to_owned()));
        all
    }

    /// Says the same for so many bytes, and counts the largest piece that it was asked for.
    struct Endless {
        left: usize,
        largest: usize,
    }

    impl Read for Endless {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.largest = self.largest.max(into.len());
            let count = into.len().min(self.left);
            into[..count].fill(b'x');
            self.left -= count;
            Ok(count)
        }
    }

    #[test]
    fn lines_come_one_by_one_whatever_their_end_and_their_letters() {
        assert_eq!(told(b"one\n\ntwo\r\nthree"), ["one", "", "two", "three"]);
        assert_eq!(told(b""), [""; 0]);
        assert_eq!(told(b"\xff\n"), ["\u{fffd}"]);
    }

    #[test]
    fn a_line_without_an_end_is_told_once_and_takes_no_more_memory_than_a_long_one() {
        let mut endless = Endless { left: 100 << 20, largest: 0 };
        let mut lengths = Vec::new();
        lines(&mut endless, |line| lengths.push(line.len()));
        assert_eq!((lengths, endless.left), (vec![MAX_LINE_BYTES], 0));
        assert!(endless.largest <= 1 << 16, "{}", endless.largest);
        let long = [vec![b'x'; 3 * MAX_LINE_BYTES], b"\nlast\n".to_vec()].concat();
        let told = told(&long);
        assert_eq!((told.len(), told[0].len(), &told[1][..]), (2, MAX_LINE_BYTES, "last"));
    }

    #[test]
    fn what_is_longer_than_it_may_be_is_read_to_its_end_and_not_kept() {
        assert_eq!(whole(&b"answer"[..], 6).expect("a pipe"), Some(b"answer".to_vec()));
        let mut endless = Endless { left: 10 << 20, largest: 0 };
        assert_eq!(whole(&mut endless, 1 << 10).expect("a pipe"), None);
        assert_eq!(endless.left, 0);
    }

    #[test]
    fn of_a_program_that_was_run_to_its_end_answer_and_last_words_are_kept() {
        let run = |script: &str| of(Command::new("sh").args(["-c", script]), 6).expect("a shell");
        let ended = run("echo first >&2; echo 'no such file' >&2; echo >&2; echo half; exit 3");
        assert_eq!((ended.status.code(), ended.last_words.as_str()), (Some(3), "no such file"));
        assert_eq!(ended.answer.as_deref(), Some(&b"half\n"[..]));
        assert_eq!(run("echo too much").answer, None);
    }
}
