//! Commands as they are typed: the one that this program was started with, those that it advises, and words that a shell takes
//! for one.

use std::fmt;
use std::path::Path;

/// A command that a person is advised to type: what it names is one word for a shell, whatever is in it.
///
/// ```
/// use shared_mem::typed::Command;
/// use std::path::Path;
///
/// let command = Command::new("calibration diagnose").path(Path::new("my session")).words("--seed 3");
/// assert_eq!(command.to_string(), "calibration diagnose 'my session' --seed 3");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command(String);

impl Command {
    /// A program with its verbs, and options that need no quoting: `twin replay`.
    pub fn new(verb: &str) -> Self {
        Self(verb.to_owned())
    }

    /// With a file or a folder.
    pub fn path(self, path: &Path) -> Self {
        self.words(&quoted(path))
    }

    /// With an option whose value is a file or a folder.
    pub fn option(self, flag: &str, path: &Path) -> Self {
        self.words(flag).path(path)
    }

    /// With the option where there is a value.
    pub fn option_of(self, flag: &str, path: Option<&Path>) -> Self {
        match path {
            Some(path) => self.option(flag, path),
            None => self,
        }
    }

    /// With words as they stand; nothing where there are none.
    pub fn words(mut self, words: &str) -> Self {
        if !words.is_empty() {
            self.0.push(' ');
            self.0.push_str(words);
        }
        self
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<Command> for String {
    fn from(command: Command) -> Self {
        command.0
    }
}

/// The command that this program was started with, to be typed again.
pub fn command() -> String {
    let words = std::env::args_os().map(|word| word_of(&word.to_string_lossy()));
    words.collect::<Vec<_>>().join(" ")
}

/// The same with one more word at its end, unless it is there already.
pub fn with(word: &str, is_there: bool) -> String {
    if is_there { command() } else { format!("{} {word}", command()) }
}

/// A path as a shell takes it for one word that is no option.
pub fn quoted(path: &Path) -> String {
    let text = path.to_string_lossy();
    if text.starts_with('-') { word_of(&format!("./{text}")) } else { word_of(&text) }
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
                .args(["-c", &format!("printf '[%s]' {}", quoted(Path::new(name)))])
                .output()
                .expect("a shell");
            let expected = if name == "-x" { "[./-x]".to_owned() } else { format!("[{name}]") };
            assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
        }
    }

    #[test]
    fn what_a_command_names_is_quoted_and_what_is_not_given_is_left_out() {
        let command = |cell| {
            Command::new("twin replay")
                .path(Path::new("my clips"))
                .option_of("--cell", cell)
                .words("--json")
                .to_string()
        };
        assert_eq!(command(None), "twin replay 'my clips' --json");
        assert_eq!(command(Some(Path::new("the cell.toml"))), "twin replay 'my clips' --cell 'the cell.toml' --json");
    }
}
