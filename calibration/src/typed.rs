//! Commands as they are typed: the one that this program was started with, and words that a shell takes for one.

/// The command that this program was started with, to be typed again.
#[must_use]
pub fn command() -> String {
    let words = std::env::args_os().map(|word| word_of(&word.to_string_lossy()));
    words.collect::<Vec<_>>().join(" ")
}

/// The same with one more word at its end, unless it is there already.
#[must_use]
pub fn with(word: &str, is_there: bool) -> String {
    if is_there { command() } else { format!("{} {word}", command()) }
}

/// A path as a shell takes it for one word that is no option.
#[must_use]
pub fn quoted(path: &str) -> String {
    if path.starts_with('-') { word_of(&format!("./{path}")) } else { word_of(path) }
}

/// Anything as a shell takes it for one word.
fn word_of(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./+=:@%,".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_any_name_is_one_word_for_the_shell() {
        for name in ["plain/session_1", "two words", "it's", "-x", "$HOME", "a;b", "ü"] {
            let output = std::process::Command::new("sh")
                .args(["-c", &format!("printf '[%s]' {}", quoted(name))])
                .output()
                .expect("a shell");
            let expected = if name == "-x" { "[./-x]".to_owned() } else { format!("[{name}]") };
            assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
        }
    }
}
