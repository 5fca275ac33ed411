//! `calibration export`.

use super::print;
use clap::{Args, ValueEnum};
use serde::Serialize;
use shared_mem::console;
use shared_mem::msg::joints_from;
use shared_mem::progress::Progress;
use shared_mem::recording::{Exported, Format, Order, Session, export_session};
use std::path::PathBuf;
use std::sync::Arc;
use twin::arm::ArmModel;
use twin::description::shown_robot;

#[derive(Debug, Args)]
#[command(after_help = "\
Any session can be written as any format, and every command here reads all of them. What a format cannot hold is left out
and said, topic by topic: no format but twinalign's own holds what a twin said, and a TwinAligner folder has neither
velocities nor torques and one joint state a picture. The new folder gets a cell.toml of its own. It is there when all of it
is; a folder that is there already is kept, and with --force a session that nothing else lies in is replaced.
A bag of an arm whose shape is known holds /joint_states, /tf, /tf_static and /robot_description, too, so that RViz, Foxglove
and Rerun show the robot; an own clip holds the last three.

Examples:
  calibration export session --to rosbag2 --out bags         # then: ros2 bag play bags/clip_00
  calibration export session --to ros2 --out bags            # then: ros2 bag play bags/clip_00.mcap
  calibration export session --to twinaligner --out folders
  calibration export bags --to own --out back --json

JSON: clips [{file, measured, desired, poses, pictures, left_out [{topic, messages}], warnings}].")]
pub struct ExportArguments {
    /// Session folder, or one clip.
    #[arg(value_name = "SESSION|CLIP")]
    session: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// The format.
    #[arg(long, value_enum)]
    to: Target,
    /// New folder.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Replaces a session that is there already.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// Formats by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Target {
    /// ROS 2 bags (storage mcap), a file a clip.
    Ros2,
    /// ROS 2 bags (storage mcap), a folder with metadata.yaml a clip, as `ros2 bag record` writes them.
    Rosbag2,
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
            Target::Rosbag2 => Self::Rosbag2,
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
    let session = Session::open_with(&arguments.session, arguments.cell.as_deref())?;
    let model = session.cell.robot.as_ref().and_then(|_| ArmModel::from_cell(&session.cell).ok());
    let model = model.filter(ArmModel::has_geometry);
    let flange_at = |q: &[f64]| {
        let flange = model.as_ref().filter(|model| model.dof() == q.len())?.flange(&joints_from(q));
        Some((flange.position(), flange.wxyz()))
    };
    let ExportArguments { to, out, force, json, .. } = arguments;
    let robot = shown_robot(&session.cell)?.map(Arc::new);
    let order = Order { to: (*to).into(), out, force: *force, flange_at: &flange_at, robot: robot.as_ref() };
    let (bar, mut done) = (Progress::new("export", session.clips.len() as u64), 0);
    let clips = export_session(&session, order, |clip| {
        done += 1;
        bar.show(done, "");
        let Exported { file, measured, desired, poses, pictures, left_out, warnings } = clip;
        let file = file.display();
        console::line(format_args!(
            "{file}: {measured} states, {desired} commands, {poses} poses, {pictures} pictures"
        ));
        if !left_out.is_empty() {
            let topics: Vec<String> =
                left_out.iter().map(|left| format!("{} ({})", left.topic, left.messages)).collect();
            console::line(format_args!("{file}: left out: {}", topics.join(", ")));
        }
        for warning in warnings {
            console::line(format_args!("{file}: {warning}"));
        }
    })?;
    drop(bar);
    let noun = if clips.len() == 1 { "clip" } else { "clips" };
    let words = format!("{} {noun} in {}", clips.len(), out.display());
    print(*json, &Answer { clips }, words)
}
