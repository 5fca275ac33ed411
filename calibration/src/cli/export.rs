//! `calibration export`.

use super::print_json;
use clap::{Args, ValueEnum};
use serde::Serialize;
use shared_mem::console;
use shared_mem::msg::joints_from;
use shared_mem::recording::{Exported, Format, Session, export_session};
use std::path::PathBuf;
use twin::arm::ArmModel;

#[derive(Debug, Args)]
#[command(after_help = "\
Any session can be written as any format, and every command here reads all three. What a format cannot hold is left out
and said: a TwinAligner folder has neither velocities nor torques and one joint state a picture; an own clip wants what
the arm did and what it was told stamped alike, and is refused otherwise. The new folder gets a cell.toml of its own.

Examples:
  calibration export session --to ros2 --out bags            # then: ros2 bag play bags/clip_00.mcap
  calibration export session --to twinaligner --out folders
  calibration export bags --to own --out back --json

JSON: clips [{file, measured, desired, poses, pictures, warnings}].")]
pub(super) struct ExportArguments {
    /// Session folder, or one clip.
    #[arg(value_name = "SESSION|CLIP")]
    session: PathBuf,
    /// The format.
    #[arg(long, value_enum)]
    to: Target,
    /// New folder.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// Formats by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Target {
    /// ROS 2 bags (storage mcap).
    Ros2,
    /// TwinAligner clip folders.
    #[value(name = "twinaligner")]
    TwinAligner,
    /// Own clips.
    Own,
}

impl From<Target> for Format {
    fn from(target: Target) -> Self {
        match target {
            Target::Ros2 => Self::Ros2,
            Target::TwinAligner => Self::TwinAligner,
            Target::Own => Self::Own,
        }
    }
}

#[derive(Serialize)]
struct Answer {
    clips: Vec<Exported>,
}

pub(super) fn run(arguments: &ExportArguments) -> anyhow::Result<()> {
    let session = Session::open(&arguments.session)?;
    let model = session.cell.robot.as_ref().and_then(|_| ArmModel::from_cell(&session.cell).ok());
    let model = model.filter(ArmModel::has_geometry);
    let flange_at = |q: &[f64]| {
        let flange = model.as_ref().filter(|model| model.dof() == q.len())?.flange(&joints_from(q));
        Some((flange.position(), flange.wxyz()))
    };
    let clips = export_session(&session, arguments.to.into(), &arguments.out, &flange_at, |clip| {
        let Exported { file, measured, desired, poses, pictures, warnings } = clip;
        let file = file.display();
        console::line(format_args!(
            "{file}: {measured} states, {desired} commands, {poses} poses, {pictures} pictures"
        ));
        for warning in warnings {
            console::line(format_args!("{file}: {warning}"));
        }
    })?;
    if arguments.json { print_json(&Answer { clips }) } else { Ok(()) }
}
