//! `calibration check`.

use super::print;
use crate::check;
use crate::report::check::{page, words};
use anyhow::ensure;
use shared_mem::console;
use shared_mem::output::Destination;
use shared_mem::recording::Session;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Before anything is explained by a recording: can the data mean what they say? Command and measurement are held
against each other (lag by cross-correlation and whether it is a delay, order, sign and unit of the joints),
velocities against the slope of the positions, torques against the model, falls against gravity, poses against the
table and the tool; and stamps, losses, jumps, second publishers, constants that look like measurements.

Every remark says which clip, channel and time, how large it is, and what to do (docs/check.md): `cannot be` is for
data that cannot mean what they say, which stop `diagnose` and `identify`; a warning costs something; a note was
mended in reading or costs little. Then what each clip is good for, verb by verb, and what is missing.

It ends with 0 whatever it finds, and with 1 where the session cannot be read.

Examples:
  calibration check session
  calibration check monday --report check.html
  calibration check session/clip_03.mcap --cell cell.toml --json")]
pub struct CheckArguments {
    /// Session folder, or one clip beside a cell.toml.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Of several objects in cell.toml the one to look at [default: the one that moves].
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Writes a page with pictures.
    #[arg(long, value_name = "CHECK.HTML")]
    report: Option<PathBuf>,
    /// Replaces the file of --report.
    #[arg(long, requires = "report")]
    force: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &CheckArguments) -> anyhow::Result<()> {
    let CheckArguments { session, cell, object, report, force, json } = arguments;
    let place = Destination::of(report.as_deref(), *force)?;
    let mut opened = Session::open_with(session, cell.as_deref())?;
    if let Some(subject) = opened.about(object.as_deref())? {
        console::line(subject);
    }
    let found = check::check(&opened);
    ensure!(
        found.clips.iter().any(|clip| clip.seconds.is_some()),
        "{}: no clip can be read: {}",
        session.display(),
        found.remarks.first().map_or_else(String::new, ToString::to_string)
    );
    if let Some(place) = place {
        place.write(page(&found))?;
    }
    print(*json, &found, words(&found))
}
