//! `calibration init`.

use super::print;
use crate::init::{self, Facts, Named, Order, Written};
use anyhow::{Context as _, bail};
use clap::Args;
use rustix::termios::isatty;
use shared_mem::answer;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::console;
use std::io::{self, BufRead as _};
use std::path::PathBuf;
use twin::arm::HeldJoint;

#[derive(Debug, Args)]
#[command(after_help = "\
Says what it can: the robot from a URDF (xacro expanded where the program xacro is installed), from the robot_description,
the joint names and the topics of a ROS 2 bag, or from clips that were recorded. Everything else stands in the file as a
comment with its meaning, its unit and what holds without it. Without a flag it asks, where there is a terminal.

Examples:
  calibration init --urdf arm.urdf --tool 0.25,0.16,0.012 --table 0
  calibration init --urdf two_arms.urdf --joints left_1,left_2,left_3,left_4,left_5,left_6
  calibration init --bag last_week.mcap --out cell.toml
  calibration init --clips session --out session/cell.toml
  calibration init --model fr3 --object 0.08,0.06,0.10 --out cell.toml --json
  calibration init --schema > cell.schema.json      # for an editor

Which of a URDF's joints are the arm's is found by names, limits and where the tool's frame hangs; what else moves, fingers, wheels, a
base that drives, is held where it is and named. --joints says it where the URDF does not tell.

JSON: file, urdf, arm [joints], held [{joint, why}], taken [{key, from}], not_known [blocks], warnings.")]
pub struct InitArguments {
    /// A built-in model: fr3.
    #[arg(long, group = "robot", value_parser = ["fr3"])]
    model: Option<String>,
    /// The robot's URDF, or a .xacro file.
    #[arg(long, group = "robot", value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Alone, the names of the joints in the order of the recordings, where no model is known. With --urdf, which of its joints are the
    /// arm's, from base to flange; other names than its own are what recordings call them.
    #[arg(long, conflicts_with = "model", value_name = "NAME,...", value_delimiter = ',')]
    joints: Vec<String>,
    /// A ROS 2 bag, or another log that `calibration import` reads: its robot_description, joints and topics.
    #[arg(long, value_name = "FILE")]
    bag: Option<PathBuf>,
    /// A folder of clips, which are listed with their rates.
    #[arg(long, visible_alias = "session", value_name = "FOLDER", conflicts_with = "bag")]
    clips: Option<PathBuf>,
    /// The law between command and torque: joint_impedance, or joint_pd for a servo [default: as usual for the arm].
    #[arg(long, value_name = "KIND", value_parser = init::controller)]
    controller: Option<ControllerKind>,
    /// Nominal stiffness [N m/rad], one a joint [default: not known].
    #[arg(long, value_name = "K,...", value_parser = gain, value_delimiter = ',')]
    stiffness: Vec<f64>,
    /// Nominal damping [N m s/rad], one a joint [default: not known].
    #[arg(long, value_name = "D,...", value_parser = gain, value_delimiter = ',')]
    damping: Vec<f64>,
    /// The tool: mass [kg], length to the tip [m], radius [m].
    #[arg(long, value_name = "MASS,LENGTH,RADIUS", value_parser = init::tool)]
    tool: Option<[f64; 3]>,
    /// Height of the table in the base frame [m].
    #[arg(long, value_name = "HEIGHT", value_parser = init::height)]
    table: Option<f64>,
    /// The object, a box: edge lengths along its x, y, z [m].
    #[arg(long, value_name = "X,Y,Z", value_parser = init::edges)]
    object: Option<[f64; 3]>,
    /// Where it goes.
    #[arg(long, value_name = "CELL.TOML", default_value = "cell.toml")]
    out: PathBuf,
    /// Replaces a file that is there already.
    #[arg(long)]
    force: bool,
    /// Prints the JSON schema of cell.toml instead, and writes nothing.
    #[arg(long, exclusive = true)]
    schema: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

fn gain(text: &str) -> Result<f64, String> {
    shared_mem::quantity::number(text, 0.0..=1e6, "")
}

pub(super) fn run(arguments: InitArguments) -> anyhow::Result<()> {
    if arguments.schema {
        let text = serde_json::to_string_pretty(&Cell::schema())? + "\n";
        return Ok(answer::bytes(text.as_bytes())?);
    }
    let InitArguments { model, urdf, joints, bag, clips, out, force, json, .. } = arguments;
    let robot = model.map(Named::Model).or(urdf.map(Named::Urdf));
    let (robot, joints) = match robot {
        None if !joints.is_empty() => (Some(Named::Joints(joints)), Vec::new()),
        robot => (robot, joints),
    };
    let said = Facts {
        robot,
        joints,
        controller: arguments.controller,
        stiffness: arguments.stiffness,
        damping: arguments.damping,
        tool: arguments.tool,
        table: arguments.table,
        object: arguments.object,
    };
    let facts = if said == Facts::default() && bag.is_none() && clips.is_none() { asked()? } else { said };
    let order = Order { facts: &facts, bag: bag.as_deref(), clips: clips.as_deref(), out: &out, force };
    let written = init::init(order)?;
    if !written.held.is_empty() {
        let (arm, held) = (written.arm.join(", "), HeldJoint::in_words(&written.held));
        console::line(format_args!("the arm's joints are {arm}; held where they are: {held}"));
    }
    for warning in &written.warnings {
        console::line(warning);
    }
    print(json, &written, in_words(&written))
}

/// What a person answers.
fn asked() -> anyhow::Result<Facts> {
    if !isatty(io::stdin()) || !console::is_terminal() {
        bail!(
            "nothing says which robot it is, and there is no terminal to ask; give --urdf FILE, --model fr3, --joints NAME,..., \
             --bag FILE or --clips FOLDER"
        );
    }
    init::ask(&mut |question| {
        console::line(question);
        let mut line = String::new();
        let read = io::stdin().lock().read_line(&mut line)?;
        Ok((read > 0).then_some(line))
    })
    .context("a cell.toml needs its robot; start again, or give flags")
}

fn in_words(written: &Written) -> String {
    let mut lines = vec![format!("wrote {}", written.file.display())];
    lines.extend(written.urdf.as_ref().map(|urdf| format!("wrote {}", urdf.display())));
    lines.extend(written.taken.iter().map(|taken| format!("{}: from {}", taken.key, taken.from)));
    if !written.not_known.is_empty() {
        lines.push(format!("as comments, not known: {}", written.not_known.join(", ")));
    }
    lines.join("\n")
}
