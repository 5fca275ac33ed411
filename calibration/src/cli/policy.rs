//! `calibration policy`.

use super::evaluate::AskingArguments;
use super::print;
use crate::acting::Robot;
use anyhow::{Context as _, bail};
use capture::recorder::{Recorder, Recording};
use clap::{Args, Subcommand};
use evaluation::policy::{Named, Policy as Asked, Source};
use evaluation::rollout::{self, Asking, Outcome, RunError};
use evaluation::statistics::Share;
use inference::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::origin::Origin;
use shared_mem::output::Destination;
use shared_mem::progress::Progress;
use shared_mem::quantity::number;
use shared_mem::recording::{ClipInfo, Episode, write_episode};
use shared_mem::theta::Theta;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use twin::task::{Run, Task};

#[derive(Debug, Subcommand)]
pub enum Policy {
    /// Runs a policy on a task, in the twin or on the robot.
    Run(Box<RunArguments>),
}

#[derive(Debug, Args)]
#[command(after_help = "\
A policy at ws://HOST:PORT is asked over openpi's websocket protocol, one in FILE.onnx is computed here by ONNX Runtime: what it sees
and what its actions mean is in docs/policies.md. An episode ends
with success, the task's horizon, or whatever would stop a robot: a joint sent beyond its end, a pose out of reach, a tool
pushed into what is fast.

With --robot the policy acts through the bridge that is running: targets go to /arm/target and /gripper/target, where the bridge's limits hold.
Free bodies are not known then, and whether it was a success is for a person to see. One episode a command, so that somebody
puts things back.

Examples:
  calibration policy run --task pick_carrot --policy ws://localhost:8000 --episodes 10 --record tried
  calibration policy run --task push_milk --policy ws://localhost:8000 --cell fr3 --json
  calibration policy run --task pick_carrot --policy act.onnx --rate 20 --chunk 10
  calibration policy run --task push_milk --policy ws://localhost:8000 --robot --cell fr3 --record tried

JSON: task, policy, successes, trials, and for each of episodes start, success (null on a robot), progress, duration_s, fault, missed, clip.")]
pub struct RunArguments {
    /// Task file, or a name of those that are built in: push_milk, stack_boxes, pick_carrot, close_laptop.
    #[arg(long, value_name = "TASK.toml")]
    task: PathBuf,
    /// Who acts: ws://HOST:PORT, FILE.onnx, expert, or expert:noise=METRES.
    #[arg(long, value_name = "POLICY")]
    policy: Named,
    /// Starts; each is an episode.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
    /// The first start; the others follow it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = inference::seed::parse)]
    seed: u64,
    /// The cell whose arm carries the task out [default: the arm is where it is commanded to be].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// What was identified of that cell.
    #[arg(long, alias = "theta", value_name = "THETA.TOML", requires = "cell", conflicts_with = "robot")]
    parameters: Option<PathBuf>,
    #[command(flatten)]
    asking: AskingArguments,
    /// On the robot, through the bridge that is running.
    #[arg(long, requires = "cell", conflicts_with_all = ["episodes", "seed"])]
    robot: bool,
    /// Share of the highest speed of each joint that the robot may use.
    #[arg(long, value_name = "SHARE", default_value_t = 0.25, value_parser = |text: &str| number(text, 0.01..=1.0, ""), requires = "robot")]
    speed: f64,
    /// Records each episode into this folder: `episode_SEED.mcap`, or `robot_NUMBER.mcap`.
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// Replaces clips that are there already.
    #[arg(long, conflicts_with = "robot")]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Answer {
    task: String,
    policy: String,
    #[serde(flatten)]
    share: Share,
    episodes: Vec<One>,
}

#[derive(Debug, Serialize)]
struct One {
    start: Option<u64>,
    success: Option<bool>,
    progress: Option<f64>,
    duration_s: f64,
    fault: Option<String>,
    missed: Vec<String>,
    clip: Option<PathBuf>,
}

pub(super) fn run(policy: Policy, interrupt: &Interrupt) -> anyhow::Result<()> {
    let Policy::Run(arguments) = policy;
    let task = Task::read(&arguments.task)?;
    let asking = arguments.asking.read(std::slice::from_ref(&task))?;
    let episodes = match arguments.robot {
        true => vec![on_robot(&arguments, &task, &asking, interrupt)?],
        false => in_twin(&arguments, task.clone(), &asking, interrupt)?,
    };
    let share = Share::of(episodes.iter().filter_map(|episode| episode.success));
    let (task, policy) = (task.name().to_owned(), arguments.policy.name.clone());
    let answer = Answer { task, policy, share, episodes };
    let words = words(&answer);
    print(arguments.json, &answer, words)
}

fn in_twin(arguments: &RunArguments, task: Task, asking: &Asking, interrupt: &Interrupt) -> anyhow::Result<Vec<One>> {
    let cell = arguments.cell.as_deref().map(Cell::read).transpose()?;
    let theta = arguments.parameters.as_deref().map(Theta::read).transpose()?;
    let task = match &cell {
        Some(cell) => task.in_cell(cell, theta.as_ref())?.0,
        None => task,
    };
    let task = Arc::new(task);
    let mut policy = Asked::open(&arguments.policy.source)?;
    let bar = Progress::new("policy", arguments.episodes);
    let mut episodes = Vec::new();
    for i in 0..arguments.episodes {
        let seed = arguments.seed.checked_add(i).context("--seed is too large for so many --episodes")?;
        let clip = arguments.record.as_ref().map(|folder| folder.join(format!("episode_{seed:06}.mcap")));
        let place = clip.as_ref().map(|clip| Destination::in_new_folder(clip, arguments.force)).transpose()?;
        let ran = match (&mut policy, &arguments.policy.source) {
            (Some(policy), _) => rollout::run(&task, seed, policy, asking, || interrupt.asked()),
            (None, Source::Expert { noise }) => scripted(&task, seed, *noise),
            (None, Source::Served(_) | Source::Onnx(_)) => bail!("no policy"),
        };
        let (outcome, recorded) = ran.with_context(|| format!("start {seed}"))?;
        if let Some(place) = place {
            let info = ClipInfo {
                configuration: task.text().to_owned(),
                program: concat!("calibration ", env!("CARGO_PKG_VERSION"), " policy run").to_owned(),
                cell_toml: cell_toml(arguments, &task)?,
                origins: Origin::Simulation.into(),
                ..ClipInfo::default()
            };
            write_episode(place.begin()?, &info, &recorded)?;
        }
        let Outcome { success, progress, duration_s, fault, missed, .. } = outcome;
        let (success, progress) = (Some(success), Some(progress));
        episodes.push(One { start: Some(seed), success, progress, duration_s, fault, missed, clip });
        bar.show(i + 1, "");
    }
    Ok(episodes)
}

fn scripted(task: &Task, seed: u64, noise: f64) -> Result<(Outcome, Episode), RunError> {
    let (episode, recorded) = task.demonstration(&Run { seed, duration: task.horizon(), noise })?;
    let outcome = Outcome {
        success: episode.success,
        progress: episode.progress,
        duration_s: episode.duration_s,
        fault: episode.arm_fault,
        missed: episode.missed,
        stills: Vec::new(),
    };
    Ok((outcome, recorded))
}

/// What a clip's cell is where an arm carries something.
fn cell_toml(arguments: &RunArguments, task: &Task) -> anyhow::Result<Option<String>> {
    Ok(match &arguments.cell {
        Some(file) => Some(Cell::read(file)?.at_home_anywhere().to_toml()),
        None => (!task.arm_joints().is_empty()).then(|| "[robot]\nmodel = \"fr3\"\n".to_owned()),
    })
}

fn on_robot(arguments: &RunArguments, task: &Task, asking: &Asking, interrupt: &Interrupt) -> anyhow::Result<One> {
    let Some(mut policy) = Asked::open(&arguments.policy.source)? else {
        bail!(
            "a scripted policy needs exact poses of all objects, so it runs only in the twin; give --policy ws://HOST:PORT"
        );
    };
    let mut robot = Robot::find()?;
    // The folder stays as long as its place is held, and then for what is in it.
    let (clip, recorder, _place) = match (&arguments.record, &arguments.cell) {
        (Some(folder), Some(cell)) => {
            let place = next_clip(folder)?;
            let clip = place.path().to_owned();
            (
                Some(clip.clone()),
                Some(Recorder::start(&clip, Recording { cell, domain: None, no_camera: false }, interrupt)?),
                Some(place),
            )
        }
        _ => (None, None, None),
    };
    let acted = robot.act(task, &mut policy, (asking, arguments.speed), interrupt);
    if let Some(recorder) = recorder {
        recorder.finish()?;
    }
    let acted = acted?;
    let (duration_s, fault) = (acted.duration_s, acted.fault);
    Ok(One { start: None, success: None, progress: None, duration_s, fault, missed: Vec::new(), clip })
}

/// A place that no clip of the folder has.
fn next_clip(folder: &Path) -> anyhow::Result<Destination> {
    let clip = |number: u32| folder.join(format!("robot_{number:03}.mcap"));
    let free = (0..1000).map(clip).find(|clip| clip.symlink_metadata().is_err());
    let free = free.with_context(|| format!("{} holds a thousand clips; give another folder", folder.display()))?;
    Ok(Destination::in_new_folder(&free, false)?)
}

fn words(answer: &Answer) -> String {
    let mut text = String::new();
    for one in &answer.episodes {
        let outcome = match one.success {
            Some(true) => "success",
            Some(false) => "no success",
            None => "done",
        };
        let start = one.start.map_or_else(|| "robot".to_owned(), |start| format!("start {start}"));
        let _ = write!(text, "{start}: {outcome} after {:.2} s", one.duration_s);
        let missing: Vec<&str> = one.fault.iter().chain(&one.missed).map(String::as_str).collect();
        if !missing.is_empty() {
            let _ = write!(text, "; {}", missing.join(", "));
        }
        text.push('\n');
    }
    if answer.share.trials > 1 {
        let _ = write!(text, "{} of {} episodes are a success", answer.share.successes, answer.share.trials);
    }
    text
}
