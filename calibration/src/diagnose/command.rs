//! The verb `calibration diagnose`: arguments, files, and what is printed.

use super::{Diagnosis, Options, diagnose};
use crate::interrupt::Interrupt;
use crate::report;
use shared_mem::console;
use shared_mem::output;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use std::path::PathBuf;

/// Arguments of the verb.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The twin is identified first, then every known effect is tried, alone and with others, on clips that were not used to fit
it. The verdict is none, named, class (several that these clips cannot tell apart), unexplained or not_testable.

What to record next is printed as commands that can be typed, and of an effect that is named what to do about it in the
cell and in a model.

The parameters found go to --theta: `twin replay SESSION --parameters theta.toml` shows the same gap, shrunk.

Examples:
  calibration diagnose session --report report.html
  calibration diagnose session --out diagnosis.json --seed 7 --json")]
pub struct Arguments {
    /// Folder with cell.toml and at least four different clips.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Parameters that are known already; effects among them act and are no candidates.
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Where the answer goes, as JSON.
    #[arg(long, value_name = "DIAGNOSIS.JSON")]
    out: Option<PathBuf>,
    /// Where the page goes.
    #[arg(long, value_name = "REPORT.HTML")]
    report: Option<PathBuf>,
    /// Where the parameters and the effects named go [default: theta.toml beside --out, where that is given].
    #[arg(long, value_name = "THETA.TOML")]
    theta: Option<PathBuf>,
    /// Draws which clips are for what, and the intervals.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

/// Runs the verb; what was found is also on stderr.
///
/// # Errors
/// What cannot be read, diagnosed or written, in one line with the remedy.
pub fn run(arguments: &Arguments, interrupt: &Interrupt) -> anyhow::Result<Diagnosis> {
    let session = Session::open(&arguments.session)?;
    let theta = arguments.parameters.as_deref().map(Theta::read).transpose()?;
    let mut found = diagnose(&session, &Options { theta, seed: arguments.seed }, interrupt)?;
    let beside = arguments.out.as_ref().map(|out| out.with_file_name("theta.toml"));
    if let Some(file) = arguments.theta.clone().or(beside) {
        output::write(&file, found.theta.to_toml())?;
        found.theta_file = Some(file);
    }
    if let Some(file) = &arguments.out {
        output::write(file, serde_json::to_string_pretty(&found)?)?;
    }
    if let Some(file) = &arguments.report {
        output::write(file, report::diagnosis::page(&found))?;
    }
    console::block(report::terminal::diagnosis(&found));
    Ok(found)
}
