//! Manual pages: what `clap_mangen` makes of a command, with the text below its options as it stands there. Filled into
//! paragraphs, as `clap_mangen` would have it, its examples could not be typed.

use crate::output::{self, OutputError};
use clap::Command;
use clap::builder::Resettable;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use std::io;
use std::path::Path;

/// A page cannot be written.
#[derive(Debug, thiserror::Error)]
pub(super) enum PageError {
    /// Its folder.
    #[error("{folder}: {source}; give --out a place that can be written")]
    Folder {
        /// The folder.
        folder: String,
        /// What the system said.
        source: io::Error,
    },
    /// Its text: a writer into memory does not fail.
    #[error(transparent)]
    Text(#[from] io::Error),
    /// The file.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Writes a page for the command and for each verb below it; how many.
pub(super) fn write(command: Command, folder: &Path) -> Result<usize, PageError> {
    let made = std::fs::create_dir_all(folder);
    made.map_err(|source| PageError::Folder { folder: folder.display().to_string(), source })?;
    let source = format!("{} {}", command.get_name(), command.get_version().unwrap_or_default());
    let mut command = without_help(command);
    command.build();
    let mut written = 0;
    let mut open = vec![command];
    while let Some(command) = open.pop() {
        open.extend(command.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned());
        let (name, text) = page(command, &source)?;
        output::write(&folder.join(name), text)?;
        written += 1;
    }
    Ok(written)
}

/// The verb `help` says nothing that the pages do not.
fn without_help(command: Command) -> Command {
    command.disable_help_subcommand(true).mut_subcommands(without_help)
}

/// A page's file name and its text; `source`: what it is a page of.
fn page(command: Command, source: &str) -> Result<(String, Vec<u8>), io::Error> {
    let below = command.get_after_help().map(ToString::to_string);
    let man = Man::new(command.after_help(Resettable::Reset)).source(source);
    let mut text = Vec::new();
    man.render(&mut text)?;
    if let Some(below) = below {
        let mut notes = Roff::new();
        notes.control("SH", ["NOTES"]).control("nf", []);
        for line in below.lines() {
            notes.text([roman(line)]);
        }
        notes.control("fi", []);
        notes.to_writer(&mut text)?;
    }
    Ok((man.get_filename(), text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    #[test]
    fn every_verb_has_a_page_whose_examples_stand_as_they_are_typed() {
        let folder = tempfile::tempdir().expect("a folder");
        let verb = Command::new("render")
            .about("Draws")
            .arg(Arg::new("out").long("out").value_name("FOLDER"))
            .after_help("Examples:\n  twin render session \\\n      --out frames\n  twin render clip.mcap");
        let command = Command::new("twin").version("0.1.0").subcommand(Command::new("group").subcommand(verb));
        let pages = folder.path().join("man/man1");
        assert_eq!(write(command, &pages).expect("room"), 3);
        let page = std::fs::read_to_string(pages.join("twin-group-render.1")).expect("a page");
        let expected = "Examples:\n  twin render session \\\\\n      \\-\\-out frames\n  twin render clip.mcap\n.fi";
        assert!(page.contains(expected) && page.contains("twin 0.1.0"), "{page}");
        assert!(pages.join("twin.1").is_file() && !pages.join("twin-help.1").exists());
        let error = write(Command::new("twin"), &pages.join("twin.1")).expect_err("a file is no folder").to_string();
        assert!(error.contains("twin.1") && error.contains("--out"), "{error}");
    }
}
