//! `calibration export-episodes`.

use super::print;
use crate::demonstrations::{self, Exported, Order, Target};
use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use serde::Serialize;
use shared_mem::output::OutputFolder;
use shared_mem::progress::Progress;
use std::path::{Path, PathBuf};
use twin::task::{ROWS_A_SECOND, Task};

#[derive(Debug, Args)]
#[command(after_help = "\
Episodes are clips that `twin task --record` has written. A LeRobot data set (version 3.0) holds observation.state (poses of
moved bodies, the gripper's opening, driven joints, joints of the arm), action (the same as commanded for the moment of the next
frame), observation.environment_state (poses of free bodies, joints without a drive) and for each [[camera]] of the task a
picture in colour and one of depth, drawn now. Episodes that were no success are left out. The new folder is there when all of
it is.

Examples:
  twin task pick_carrot --episodes 50 --record carrot
  calibration export-episodes pick_carrot carrot --to lerobot --out carrot_lerobot
  calibration export-episodes pick_carrot carrot --to png --every 50 --out pictures

JSON: to, out, episodes, frames, rate, features, left_out (clips).")]
pub struct ExportEpisodesArguments {
    /// The task that they were recorded with: its file, or its name where it is built in.
    #[arg(value_name = "TASK.toml")]
    task: PathBuf,
    /// Clips, or folders of clips.
    #[arg(value_name = "EPISODES", required = true)]
    episodes: Vec<PathBuf>,
    /// The format.
    #[arg(long, value_enum)]
    to: To,
    /// Every so many of the 100 rows a second become a frame.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
    every: u32,
    /// New folder.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Replaces what an export before has written there.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// Formats by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum To {
    /// A LeRobot data set, pictures inside.
    #[value(name = "lerobot")]
    LeRobot,
    /// The pictures alone, a folder for each episode.
    Png,
}

#[derive(Serialize)]
struct Answer<'a> {
    to: To,
    out: &'a Path,
    #[serde(flatten)]
    exported: Exported,
}

pub(super) fn run(arguments: &ExportEpisodesArguments) -> anyhow::Result<()> {
    let ExportEpisodesArguments { task, episodes, to, every, out, force, json } = arguments;
    if !ROWS_A_SECOND.is_multiple_of(*every) {
        bail!("--every {every} makes no whole number of frames a second; give 1, 2, 4, 5, 10, 20, 25, 50 or 100");
    }
    let task = Task::read(task)?;
    let clips = clips(episodes)?;
    let folder = folder(out, *force)?;
    let (bar, mut done) = (Progress::new("export", clips.len() as u64), 0);
    let target = match to {
        To::LeRobot => Target::LeRobot,
        To::Png => Target::Png,
    };
    let order = Order { task: &task, clips: &clips, to: target, every: *every, folder };
    let exported = demonstrations::export(order, || {
        done += 1;
        bar.show(done, "");
    })?;
    drop(bar);
    let Exported { episodes, frames, rate, left_out, .. } = &exported;
    let out_of = if left_out.is_empty() {
        String::new()
    } else {
        format!("; {} that were no success are left out", left_out.len())
    };
    let words = format!("{episodes} episodes, {frames} frames, {rate} a second, in {}{out_of}", out.display());
    print(*json, &Answer { to: *to, out, exported }, words)
}

/// The clips themselves, of folders all that are in them, by name.
fn clips(given: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut clips = Vec::new();
    for path in given {
        if !path.is_dir() {
            clips.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path).with_context(|| format!("{}; give a folder of clips", path.display()))?;
        let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        inside.retain(|file| file.extension().is_some_and(|ending| ending == "mcap"));
        if inside.is_empty() {
            bail!("{} holds no clips; record some with `twin task --record`", path.display());
        }
        inside.sort();
        clips.extend(inside);
    }
    Ok(clips)
}

/// The new folder; in place of another one only where that was asked for and an export has written all of that.
fn folder(out: &Path, force: bool) -> anyhow::Result<OutputFolder> {
    let names: Vec<String> = match std::fs::read_dir(out) {
        Ok(entries) if force => entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect(),
        _ => Vec::new(),
    };
    let is_foreign = |name: &&String| {
        !(*name == "data" || *name == "meta" || name.starts_with("episode_") && !name.ends_with(".mcap"))
    };
    if let Some(other) = names.iter().find(is_foreign) {
        bail!("{} is not replaced: it holds {other}, which no export has written; give a new folder", out.display());
    }
    Ok(if names.is_empty() { OutputFolder::create(out)? } else { OutputFolder::replacing(out)? })
}
