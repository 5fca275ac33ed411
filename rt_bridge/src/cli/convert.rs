//! `rt_bridge convert`.

use crate::camera::{Converted, convert};
use anyhow::Result;
use clap::Args;
use shared_mem::cell::Cell;
use shared_mem::origin::Origin;
use shared_mem::output::discard_unfinished;
use shared_mem::recording::ClipInfo;
use shared_mem::{answer, console, input};
use std::path::PathBuf;

/// Turn a recording of a RealSense camera into a clip
///
/// Colour, depth aligned to it, and intrinsics, with the camera's own stamps. Needs a program built with the feature
/// realsense. The recording is played at its own pace, again for the frames that this machine was too slow for.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    rt_bridge convert table.bag --cell fr3 --out table.mcap\n\n\
    JSON: file, frames (pairs of colour and depth), missing (frame numbers between the first and the last that are not\n\
    there), unpaired (depth pictures in the recording that it gives no colour picture for), passes.")]
pub struct ConvertArguments {
    /// A .bag recorded by librealsense or the RealSense Viewer
    #[arg(value_name = "FILE.bag")]
    bag: PathBuf,
    /// The new file
    #[arg(long, value_name = "CLIP.mcap")]
    out: PathBuf,
    /// Replaces a file that is there already
    #[arg(long)]
    force: bool,
    /// Says where the camera stands, and rides along in the file
    #[arg(long, value_name = "cell.toml")]
    cell: Option<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl ConvertArguments {
    pub(super) fn execute(self) -> Result<()> {
        ctrlc::set_handler(|| {
            discard_unfinished();
            console::line("error: interrupted; nothing was written");
            console::flush();
            std::process::exit(1);
        })?;
        // A program that cannot read recordings says that of those that are there.
        drop(input::open(&self.bag)?);
        let cell = self.cell.as_deref().map(Cell::read).transpose()?;
        let info = ClipInfo {
            cell_toml: cell.as_ref().map(|cell| cell.at_home_anywhere().to_toml()),
            configuration: format!("bag = {:?}\n", self.bag.display().to_string()),
            program: concat!("rt_bridge ", env!("CARGO_PKG_VERSION")).into(),
            torques_begin_at_rows: false,
            origins: Origin::import(&self.bag.to_string_lossy(), "RealSense bag").into(),
        };
        let camera = cell.and_then(|cell| cell.camera).unwrap_or_default();
        let converted = convert(&self.bag, &camera, (&self.out, self.force), &info)?;
        if self.json {
            answer::json(&converted)?;
        } else {
            answer::words(in_words(&converted))?;
        }
        Ok(())
    }
}

fn in_words(converted: &Converted) -> String {
    let Converted { file, frames, missing, unpaired, .. } = converted;
    let mut text = format!("{frames} pictures with depth in {}", file.display());
    if !missing.is_empty() {
        text += &format!("; {} frame numbers on the way are missing", missing.len());
    }
    if *unpaired > 0 {
        text += &format!("; {unpaired} depth pictures of the recording have no colour picture beside them");
    }
    text
}
