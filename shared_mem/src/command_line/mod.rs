//! What the command lines of all programs have in common: help that fits into 80 columns, a version that says what was
//! built, completions for shells and manual pages. The programs' own arguments are theirs.
//!
//! | file | owns |
//! |---|---|
//! | `layout` | texts below the options: paragraphs, rows, and examples that can be typed as they stand |
//! | `mistakes` | what is said of a command line that is wrong |
//! | `numbers` | that numbers below zero are values |
//! | `pages` | manual pages |
//! | `placeholders` | what stands for a value, spelled alike |

mod layout;
mod mistakes;
mod numbers;
mod pages;
mod placeholders;

use crate::{answer, console, error_line, usage};
use clap::{Arg, ArgMatches, Command, Parser, value_parser};
use clap_complete::Shell;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::time::SystemTime;

/// Columns of a help text, whatever the terminal has: a narrower one folds lines itself, and what is copied stays whole.
const WIDTH: usize = 80;

/// What was built.
#[derive(Debug, Clone, Copy)]
pub struct Build {
    /// Version of the program.
    pub version: &'static str,
    /// The commit it was built from, `-modified` where there was more than that; empty where nobody knows.
    pub commit: &'static str,
    /// Its optional features, and whether each was built in.
    pub features: &'static [(&'static str, bool)],
}

impl Build {
    /// `0.1.0 (commit 0123456789ab; features: viewer)`.
    fn line(&self) -> String {
        let commit = if self.commit.is_empty() { "unknown" } else { self.commit };
        let built: Vec<&str> = self.features.iter().filter(|(_, in_it)| *in_it).map(|(name, _)| *name).collect();
        let features = if built.is_empty() { "none".to_owned() } else { built.join(", ") };
        format!("{} (commit {commit}; features: {features})", self.version)
    }

    /// The line; where builds that differ have the same one, with size and time of the program's file behind it.
    fn fingerprint(&self) -> String {
        let line = self.line();
        if !self.commit.is_empty() && !self.commit.ends_with(MODIFIED) {
            return line;
        }
        let file = std::env::current_exe().and_then(std::fs::metadata);
        let since = |time: SystemTime| time.duration_since(SystemTime::UNIX_EPOCH).ok().map(|since| since.as_nanos());
        let written = file.as_ref().ok().and_then(|file| since(file.modified().ok()?));
        format!("{line} {:?}", (file.as_ref().map(std::fs::Metadata::len).ok(), written))
    }
}

/// Behind the commit of sources that hold more than that.
const MODIFIED: &str = "-modified";
/// Of the program that runs.
static FINGERPRINT: OnceLock<String> = OnceLock::new();

/// What tells this build of the program from others: what `--version` says. Empty in a process that called no [`parse`].
pub fn fingerprint() -> &'static str {
    FINGERPRINT.get().map_or("", String::as_str)
}

/// Reads the program's command line.
///
/// # Errors
/// The exit code of a program that has nothing more to do: its help, its version, completions or manual pages were asked for
/// and said, or its arguments are wrong and that was said.
pub fn parse<A: Parser>(build: &Build) -> Result<A, ExitCode> {
    let _fingerprint = FINGERPRINT.get_or_init(|| build.fingerprint());
    let mut command = command::<A>(build);
    let words: Vec<OsString> = std::env::args_os().collect();
    let matches = command.try_get_matches_from_mut(&words).map_err(|error| refused(&error, &command, &words))?;
    match matches.subcommand() {
        Some((COMPLETIONS, asked)) => Err(completions(&mut command, asked)),
        Some((MANPAGES, asked)) => Err(manpages(self::command::<A>(build), asked)),
        _ => A::from_arg_matches(&matches).map_err(|error| refused(&error, &command, &words)),
    }
}

fn refused(error: &clap::Error, command: &Command, words: &[OsString]) -> ExitCode {
    if !error.use_stderr() {
        return usage::say(false, error.render());
    }
    let words: Vec<String> = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    usage::say(true, mistakes::text(error, command, &words))
}

/// A whole program: reads its command line and does what that says. What was said last is out when it ends.
pub fn program<A: Parser>(build: &Build, run: impl FnOnce(A) -> ExitCode) -> ExitCode {
    let _last_lines = console::start();
    match parse(build) {
        Ok(arguments) => run(arguments),
        Err(code) => code,
    }
}

const COMPLETIONS: &str = "completions";
const MANPAGES: &str = "manpages";

/// The whole command line of a program.
pub fn command<A: Parser>(build: &Build) -> Command {
    let command = A::command().version(build.line());
    let name = command.get_name().to_owned();
    let completions = Command::new(COMPLETIONS)
        .about("Print completions for a shell")
        .arg(Arg::new("shell").value_name("SHELL").required(true).value_parser(value_parser!(Shell)).help("The shell"))
        .after_help(format!(
            "Examples:\n  {name} completions bash > ~/.local/share/bash-completion/completions/{name}\n  \
             {name} completions zsh > ~/.zfunc/_{name}\n  \
             {name} completions fish > ~/.config/fish/completions/{name}.fish"
        ));
    let manpages = Command::new(MANPAGES)
        .about("Write a manual page for the program and for each of its verbs")
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("FOLDER")
                .required(true)
                .value_parser(value_parser!(PathBuf))
                .help("Folder for the pages; it is made where it is missing"),
        )
        .after_help(format!(
            "Examples:\n  {name} manpages --out ~/.local/share/man/man1\n  man {name}    the page of a verb: man {name}-VERB"
        ));
    let whole = command.subcommand(completions).subcommand(manpages);
    layout::fitted(placeholders::spelled(numbers::below_zero(whole)), WIDTH)
}

fn completions(command: &mut Command, asked: &ArgMatches) -> ExitCode {
    let Some(shell) = asked.get_one::<Shell>("shell") else { return ExitCode::FAILURE };
    let (name, mut script) = (command.get_name().to_owned(), Vec::new());
    clap_complete::generate(*shell, command, name, &mut script);
    ended(answer::bytes(&script))
}

fn manpages(command: Command, asked: &ArgMatches) -> ExitCode {
    let Some(folder) = asked.get_one::<PathBuf>("out") else { return ExitCode::FAILURE };
    match pages::write(command, folder) {
        Ok(count) => ended(answer::words(format!("{count} manual pages in {}", folder.display()))),
        Err(error) => ended(Err(error)),
    }
}

fn ended(outcome: Result<(), impl std::error::Error + 'static>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::line(format_args!("error: {}", error_line(&error)));
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_says_what_was_built() {
        let built = |commit, features| Build { version: "0.1.0", commit, features }.line();
        assert_eq!(
            built("0123456789ab", &[("viewer", true), ("render", false)]),
            "0.1.0 (commit 0123456789ab; features: viewer)"
        );
        assert_eq!(built("", &[("render", false)]), "0.1.0 (commit unknown; features: none)");
    }

    #[test]
    fn builds_of_sources_that_no_commit_holds_are_told_apart_by_the_programs_file() {
        let of = |commit| Build { version: "0.1.0", commit, features: &[] };
        assert_eq!(of("0123456789ab").fingerprint(), of("0123456789ab").line());
        for commit in ["", "0123456789ab-modified"] {
            let (line, fingerprint) = (of(commit).line(), of(commit).fingerprint());
            let file = fingerprint.strip_prefix(&line).expect("the line first");
            assert!(file.contains("(Some(") && !file.contains("None"), "{fingerprint}");
        }
    }
}
