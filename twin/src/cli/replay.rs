//! `twin replay`: the recorded commands, simulated; real against simulated as a table or as JSON.

use crate::replay::{Options, replay};
use anyhow::{Context, bail};
use shared_mem::ending;
use shared_mem::parent;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use shared_mem::{answer, console};
use std::path::PathBuf;

/// Simulates the recorded commands of a session or clip: real against simulated.
#[derive(clap::Args)]
#[command(after_help = "\
The twin starts in the recorded state, gets the recorded commands at their stamps, and is not corrected on the way (but
behind a hole in the commands it starts again, with a note).
Joint errors are root mean squares over the clip; ADD and ADD-S are means over the recorded object poses. How far a gap
shrinks is what `calibration diagnose` measures, on held-out clips and in units of the noise (docs/figures.md).

A clip that cannot be replayed is named on stderr, with the reason, and the others are replayed. The exit code is 1 only
when none could be, or when one could not be written.

Examples:
  twin replay session
  twin replay session/clip_00.mcap --out simulated.mcap
  twin replay session --parameters theta.toml --json")]
pub struct Replay {
    /// Session folder (with cell.toml), or one clip.
    #[arg(value_name = "SESSION|CLIP")]
    path: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Identified parameters; what they do not name keeps the value of cell.toml.
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Of several objects in cell.toml the one that is simulated [default: the one that moves].
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Writes the recording, its simulation and the gap as a new clip; for a session, a folder of clips.
    #[arg(long, value_name = "CLIP.MCAP")]
    out: Option<PathBuf>,
    /// Replaces clips that are there already.
    #[arg(long, requires = "out")]
    force: bool,
    /// End when this process is no longer our parent.
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

impl Replay {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let mut session = Session::open_with(&self.path, self.cell.as_deref())?;
        if let Some(subject) = session.about(self.object.as_deref())? {
            console::line(subject);
        }
        let theta = self.parameters.as_deref().map(Theta::read).transpose()?.map(|theta| theta.about(&session.cell));
        if let Some(parent) = self.parent {
            parent::when_gone(parent, ending::ask)?;
        }
        ctrlc::set_handler(ending::ask).context("cannot listen for Ctrl-C")?;
        let gap = replay(&session, &Options { theta, out: self.out.clone(), force: self.force })?;
        for clip in &gap.clips {
            for warning in &clip.warnings {
                console::line(format_args!("{}: {warning}", clip.file));
            }
        }
        // The reason of a lone clip is the whole answer: `bail!` below says it, once.
        let lone = gap.clips.is_empty() && gap.failures().count() == 1;
        for (file, error) in gap.failures().filter(|_| !lone) {
            console::line(format_args!("{file}: {error}"));
        }
        if self.json {
            answer::json(&gap)?;
        } else if !gap.clips.is_empty() {
            answer::words(&gap)?;
        }
        let failed = gap.failures().count();
        if let (true, Some((file, error))) = (lone, gap.failures().next()) {
            bail!("{file}: {error}");
        }
        if let Some(error) = gap.unwritten() {
            bail!("{error}");
        }
        if gap.clips.is_empty() {
            bail!("none of the {failed} clips could be replayed; the reasons stand above");
        }
        if failed > 0 {
            console::line(format_args!(
                "{failed} of {} clips left out; the reasons stand above",
                failed + gap.clips.len()
            ));
        }
        Ok(())
    }
}
