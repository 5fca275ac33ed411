//! Manual pages: what `clap_mangen` makes of a command, with the text below its options as it stands there. Filled into
//! paragraphs, as `clap_mangen` would have it, its examples could not be typed.

use crate::output::{self, OutputError};
use clap::Command;
use clap::builder::Resettable;
use clap_mangen::Man;
use clap_mangen::roff::{Inline, Roff, roman};
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
pub(super) fn write(command: &Command, folder: &Path) -> Result<usize, PageError> {
    let made = std::fs::create_dir_all(folder);
    made.map_err(|source| PageError::Folder { folder: folder.display().to_string(), source })?;
    let mut command = command.clone().disable_help_subcommand(true);
    command.build();
    let mut written = 0;
    let mut open = vec![command];
    while let Some(command) = open.pop() {
        open.extend(command.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned());
        let (name, text) = page(command)?;
        output::write(&folder.join(name), text)?;
        written += 1;
    }
    Ok(written)
}

/// A page's file name and its text.
fn page(command: Command) -> Result<(String, Vec<u8>), io::Error> {
    let below = command.get_after_help().map(ToString::to_string);
    let man = Man::new(command.after_help(Resettable::Reset));
    let mut text = Vec::new();
    man.render(&mut text)?;
    if let Some(below) = below {
        let mut notes = Roff::new();
        notes.control("SH", ["NOTES"]).control("nf", []);
        for line in below.lines() {
            notes.text([roman(line), Inline::LineBreak]);
        }
        notes.control("fi", []);
        notes.to_writer(&mut text)?;
    }
    Ok((man.get_filename(), text))
}
