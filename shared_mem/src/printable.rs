//! Text as a terminal may show it. File names, robot messages and arguments can hold control characters, with which a
//! terminal would be made to recolour, overwrite or retitle itself; they are shown as what they are instead.

use std::fmt::Write as _;

/// The text in one line: every control character, line breaks too, is written out, as `\u{1b}` or `\n`.
pub fn one_line(text: &str) -> String {
    written_out(text, |_| false)
}

/// The text with its line breaks; every other control character is written out.
pub fn lines(text: &str) -> String {
    written_out(text, |c| c == '\n')
}

fn written_out(text: &str, kept: fn(char) -> bool) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if kept(c) || !(c.is_control() || turns_the_line(c)) {
            shown.push(c);
        } else {
            // Writing to a string does not fail.
            let _written = write!(shown, "{}", c.escape_default());
        }
    }
    shown
}

/// Marks that change the direction in which a line is read: with them `cod.exe` is shown as `exe.doc`.
fn turns_the_line(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn control_characters_are_written_out() {
        assert_eq!(one_line("a\x1b[31mb\u{9b}2Jc\r\n\td\x7f"), "a\\u{1b}[31mb\\u{9b}2Jc\\r\\n\\td\\u{7f}");
        assert_eq!(lines("a\x1b[2J\nb\r\n"), "a\\u{1b}[2J\nb\\r\n");
        assert_eq!(one_line("exe.\u{202e}cod"), "exe.\\u{202e}cod");
    }

    #[test]
    fn what_can_be_read_stays_as_it_is() {
        assert_eq!(one_line("12.3 µrad, Prüfung \"é\" \\ 漢字"), "12.3 µrad, Prüfung \"é\" \\ 漢字");
    }

    proptest! {
        #[test]
        fn nothing_steers_a_terminal(text: String) {
            prop_assert!(!one_line(&text).contains(char::is_control));
            prop_assert!(!lines(&text).contains(|c: char| c.is_control() && c != '\n'));
        }
    }
}
