//! `rt_bridge record`.

use super::stop_flag;
use crate::recorder::{Settings, record};
use anyhow::{Result, bail};
use clap::Args;
use shared_mem::cell::Cell;
use shared_mem::quantity::seconds;
use shared_mem::recording::ClipInfo;
use shared_mem::{answer, console};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use twin::description::shown_robot;

/// Record everything on shared memory to a new clip, until Ctrl-C
///
/// A process of its own: `rt_bridge run --record` starts one, and it can be started beside a bridge that runs already, or
/// before it. Where nothing is sent within --wait it ends with exit code 1 and leaves no file.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    rt_bridge record --cell fr3 --out clip.mcap --duration 10 --json\n\n\
    JSON: file, messages, bytes, lost (messages overwritten before they could be written), stopped (null, or why it\n\
    ended early).")]
pub struct RecordArguments {
    /// The new file
    #[arg(long, value_name = "CLIP.mcap")]
    out: PathBuf,
    /// Replaces a file that is there already
    #[arg(long)]
    force: bool,
    /// Rides along in the file, so that the clip explains itself and viewers show the robot
    #[arg(long, value_name = "cell.toml")]
    cell: Option<PathBuf>,
    /// Leaves the camera's pictures out
    #[arg(long)]
    no_camera: bool,
    /// How long to wait for the first message [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "30")]
    wait: Duration,
    /// Stop after this many seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// Finish when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Configuration of the program that started us
    #[arg(long, hide = true, default_value = "")]
    configuration: String,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl RecordArguments {
    pub(super) fn execute(self) -> Result<()> {
        // The recorder itself looks after the parent: it stays a moment longer.
        let stop = stop_flag(None)?;
        let cell = self.cell.as_deref().map(Cell::read).transpose()?;
        let info = ClipInfo {
            cell_toml: cell.as_ref().map(|cell| cell.at_home_anywhere().to_toml()),
            configuration: self.configuration,
            program: concat!("rt_bridge ", env!("CARGO_PKG_VERSION")).into(),
            // The arm says where it comes from.
            ..ClipInfo::default()
        };
        // The bridge that started this recorder may take its time, and answers for itself.
        let patience = self.parent.is_none().then_some(self.wait);
        let (out, force, duration, parent) = (self.out, self.force, self.duration, self.parent);
        let shown = cell.and_then(|cell| match shown_robot(&cell) {
            Ok(robot) => Some((Arc::new(robot?), cell)),
            Err(error) => {
                console::line(format_args!("warning: viewers will not see the robot in {}: {error}", out.display()));
                None
            }
        });
        let settings = Settings { out, force, duration, patience, parent, no_camera: self.no_camera, info, shown };
        let recorded = record(&settings, &stop)?;
        if self.json {
            answer::json(&recorded)?;
        } else {
            answer::words(recorded.in_words())?;
        }
        match recorded.stopped {
            Some(why) => bail!("{why}"),
            None => Ok(()),
        }
    }
}
