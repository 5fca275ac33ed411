//! A program's answer on standard output: one JSON object, or lines for people. The only code that writes there.

use crate::printable;
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, Write};

/// The answer did not reach its reader.
#[derive(Debug, thiserror::Error)]
#[error(
    "the answer cannot be written to standard output: {0}; all else is done. Keep its reader running, or free some space, before you ask again"
)]
pub struct AnswerError(#[from] io::Error);

/// Writes `answer` as one JSON object in a line.
///
/// # Errors
/// [`AnswerError`] when standard output takes no more.
pub fn json(answer: &impl Serialize) -> Result<(), AnswerError> {
    json_to(&mut io::stdout().lock(), answer)
}

/// Writes a text for people; control characters, which file names may hold, are written out.
///
/// # Errors
/// [`AnswerError`] when standard output takes no more.
pub fn words(text: impl Display) -> Result<(), AnswerError> {
    words_to(&mut io::stdout().lock(), &text.to_string())
}

/// Writes `bytes` as they are: a script for a shell.
///
/// # Errors
/// [`AnswerError`] when standard output takes no more.
pub fn bytes(bytes: &[u8]) -> Result<(), AnswerError> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    Ok(out.flush()?)
}

fn json_to(out: &mut impl Write, answer: &impl Serialize) -> Result<(), AnswerError> {
    let mut text = serde_json::to_vec(answer).map_err(io::Error::from)?;
    text.push(b'\n');
    out.write_all(&text)?;
    Ok(out.flush()?)
}

fn words_to(out: &mut impl Write, text: &str) -> Result<(), AnswerError> {
    let text = printable::lines(text.trim_end_matches('\n'));
    out.write_all(format!("{text}\n").as_bytes())?;
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_whole_lines() {
        let mut out = Vec::new();
        json_to(&mut out, &serde_json::json!({ "file": "a\x1b.mcap" })).expect("a vector takes all");
        words_to(&mut out, "recorded to a\x1b.mcap\nand read\n").expect("a vector takes all");
        let text = String::from_utf8(out).expect("text");
        assert_eq!(text, "{\"file\":\"a\\u001b.mcap\"}\nrecorded to a\\u{1b}.mcap\nand read\n");
    }

    #[test]
    fn an_answer_that_nobody_takes_is_an_error_with_a_remedy() {
        let mut full = std::fs::File::options().write(true).open("/dev/full").expect("Linux has it");
        for error in [json_to(&mut full, &1).unwrap_err(), words_to(&mut full, "one").unwrap_err()] {
            let line = error.to_string();
            assert!(line.contains("No space left") && line.contains("free some space"), "{line}");
        }
    }
}
