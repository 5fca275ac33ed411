//! `calibration import`.

use super::print;
use crate::check::motion;
use clap::Args;
use import::{Arm, Gravity, Imported, Note, Order, Outcome, Rotors};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::msg::joints_from;
use shared_mem::progress::Progress;
use shared_mem::typed::Command;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use twin::arm::{ArmModel, HeldJoint, JointState};
use twin::description::{shown_robot, shown_urdf};

#[derive(Debug, Args)]
#[command(after_help = "\
Reads ROS 2 bags (mcap and sqlite3, files or folders, packed or not), ROS 1 bags, LeRobot data sets (v2 and v3), CSV and TSV
(in UTF-8, UTF-16 or Latin 1, with decimal points or commas, as `rostopic echo` prints them), npz, logs of libfranka and folders of
SAGE; of a folder, all of these in it. Which columns are q, dq and tau, their
units, the order and sign of the joints, the clock and which torque it is, is proposed from names and numbers and said with
the reason and with what else there was (--explain: with the line that takes it). It stands in import.toml of the new
session, to be changed and given back with --mapping. What cannot be known is asked once: import.toml is written here with
the open lines marked. A log without commands becomes clips without commands; one long log of many motions is cut where it
rests. Pictures are not imported. Of a log that is cut or damaged what is whole is read, and what is missing is said. Of a
folder, what is no log, or cannot be read at all, is named and left out.

Examples:
  calibration import last_week --out session          # every log in the folder
  calibration import bags --out imported --json
  calibration import run_1.csv run_2.csv --out session --mapping import.toml
  calibration import lerobot_so101 --out session      # an episode a clip
  calibration import push.bag --out strokes --cell cell.toml

Then: `twin replay session`, `calibration identify arm session`, `calibration diagnose session`.

JSON: clips [{file, source, format, measured, desired, poses, left_out [{what, why, count}], warnings}], notes [{line, why,
open, instead [line]}].")]
pub struct ImportArguments {
    /// Logs, or folders of logs.
    #[arg(value_name = "FILES", required = true)]
    files: Vec<PathBuf>,
    /// New session folder.
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
    /// What the columns mean, as an import before has written it [default: proposed from the log].
    #[arg(long, value_name = "IMPORT.TOML")]
    mapping: Option<PathBuf>,
    /// What the laboratory knows about its cell [default: what the log tells, and the rest as usual].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Replaces a session that is there already, and an import.toml with open lines.
    #[arg(long)]
    force: bool,
    /// Shows for each choice the lines of import.toml that would say otherwise.
    #[arg(long)]
    explain: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Answer {
    clips: Vec<Imported>,
    notes: Vec<Note>,
}

pub(super) fn run(arguments: &ImportArguments) -> anyhow::Result<()> {
    let ImportArguments { files, out, mapping, cell, force, explain, json } = arguments;
    let command = |mapping: &Path| command(arguments, mapping);
    let order = Order {
        files,
        out,
        mapping: mapping.as_deref(),
        cell: cell.as_deref(),
        force: *force,
        questions: Path::new("import.toml"),
        arms: &arm,
        command: &command,
    };
    let bar = Progress::new("import", 100);
    let outcome = import::import(order, |clip, (done, all)| {
        bar.show(100 * done / all.max(1), "");
        say(clip);
    })?;
    drop(bar);
    match outcome {
        Outcome::Open { file, notes } => {
            let (open, known): (Vec<&Note>, Vec<&Note>) = notes.iter().partition(|note| note.open);
            known.iter().chain(&open).for_each(|note| reason(note, *explain));
            let lines: Vec<&str> = open.iter().map(|note| note.line.as_str()).collect();
            let file = file.as_path();
            anyhow::bail!(
                "the log does not tell all; fill in {} in {}, then: {}",
                lines.join(", "),
                file.display(),
                command(file)
            );
        }
        Outcome::Done { clips, notes } => {
            notes.iter().for_each(|note| reason(note, *explain));
            let noun = if clips.len() == 1 { "clip" } else { "clips" };
            let words = format!("{} {noun} in {}", clips.len(), out.display());
            print(*json, &Answer { clips, notes }, words)
        }
    }
}

/// Why a line is as it is; `explain`: and what would say otherwise.
fn reason(note: &Note, explain: bool) {
    console::line(format_args!("{}: {}", note.line, note.why));
    for instead in note.instead.iter().filter(|_| explain) {
        console::line(format_args!("  instead: {instead}"));
    }
}

/// What there is to say about a clip.
fn say(clip: &Imported) {
    let Imported { file, source, format, measured, desired, poses, left_out, warnings } = clip;
    let file = file.display();
    let source = source.display();
    console::line(format_args!("{file}: {measured} states, {desired} commands, {poses} poses of {source} ({format})"));
    for out in left_out {
        console::line(format_args!("{file}: left out: {} ({}): {}", out.what, out.count, out.why));
    }
    for warning in warnings {
        console::line(format_args!("{file}: {warning}"));
    }
}

/// The arm of a cell, or that of a URDF's text.
fn arm(cell: &Cell, urdf: Option<&str>) -> Result<Option<Arm>, String> {
    let in_words = |error: twin::arm::ModelError| error.to_string();
    let (model, shown) = match urdf {
        Some(text) => {
            let model = ArmModel::from_urdf(text, Path::new("robot_description"), &[]).map_err(in_words)?;
            let shown = shown_urdf(text, &model).map_err(in_words)?;
            (model, Some(shown))
        }
        None if cell.robot.is_none() => return Ok(None),
        None => (ArmModel::from_cell(cell).map_err(in_words)?, shown_robot(cell).map_err(in_words)?),
    };
    let (joints, held) = (model.joint_names().to_vec(), HeldJoint::in_words(model.held_joints()));
    let without_inertia = model.joints_without_inertia().into_iter().map(str::to_owned).collect::<Vec<_>>();
    let rotor_inertia = model.rotor_inertia()[..model.dof()].to_vec();
    let rotors = (!without_inertia.is_empty()).then_some(Rotors { without_inertia, rotor_inertia });
    let fastest = model.velocity_limit()[..model.dof()].to_vec();
    let shown = shown.map(Arc::new);
    let falls = model.free_fall();
    let moving = model.clone();
    let gravity = model.has_geometry().then(|| Gravity {
        falls,
        moves: Box::new(move |q: &[f64], dq: &[f64], ddq: &[f64]| {
            let state = JointState { q: joints_from(q), dq: joints_from(dq) };
            (q.len() == moving.dof())
                .then(|| motion(&moving, &state, &joints_from(ddq)).get(..q.len()).unwrap_or(&[]).to_vec())
        }),
        holds: Box::new(move |q: &[f64], falls| {
            (q.len() == model.dof())
                .then(|| model.holding(&joints_from(q), falls).get(..q.len()).unwrap_or(&[]).to_vec())
        }),
    });
    Ok(Some(Arm { joints, fastest, held, rotors, gravity, shown }))
}

/// The same import, with a mapping.
fn command(arguments: &ImportArguments, mapping: &Path) -> String {
    let files = arguments.files.iter().fold(Command::new("calibration import"), |command, file| command.path(file));
    let command = files.option("--out", &arguments.out).option("--mapping", mapping);
    command.option_of("--cell", arguments.cell.as_deref()).words(if arguments.force { "--force" } else { "" }).into()
}
