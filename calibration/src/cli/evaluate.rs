//! `calibration evaluate`.

use super::print;
use crate::report::evaluation::{self as report, Sheet};
use crate::study::{self, Plan, World};
use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use evaluation::findings::findings;
use evaluation::policy::{ActionKind, Keys, Named};
use evaluation::rollout::Asking;
use evaluation::trial::{self, Trial};
use inference::interrupt::Interrupt;
use inference::kept::{Fingerprint, for_work};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::output::OutputFolder;
use shared_mem::theta::Theta;
use shared_mem::typed;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use twin::task::{ROWS_A_SECOND, Task};

#[derive(Debug, Args)]
#[command(after_help = "\
Every policy meets the same starts of every task, so that what differs is seen start by start. A policy is `expert` (the task's script),
`expert:noise=METRES` (the same, way points off by so much), `ws://HOST:PORT` (served by openpi's protocol), or `FILE.onnx`
(computed here; docs/policies.md); `NAME=` before it gives it a name of its own.

Worlds: `twin` is the task file's; with --cell its arm moves under that cell's controller, with --parameters as it was identified, and the
task's object is what was identified. `nominal` is the same without --parameters: does alignment matter, and by how much? FILE.csv
holds trials of another world, a robot or another simulator, in columns policy, task, start, success and progress.

DIR gets trials.csv, findings.json and report.html: shares with intervals, policies against each other, how far each world
predicts those of files (Pearson's correlation, mean maximum rank violation), success there out of few trials of its own and
many simulated ones, and films of failures. After Ctrl-C the same command goes on.

Examples:
  calibration evaluate --policies expert expert:noise=0.005 --tasks pick_carrot --out carrot
  calibration evaluate --policies mine=ws://localhost:8000 --tasks push_milk --episodes 200 --out mine
  calibration evaluate --policies mine=ws://localhost:8000 --tasks push_milk --worlds twin,nominal,robot.csv \\
    --cell fr3 --parameters theta.toml --episodes 200 --out mine

JSON: that of findings.json: level, cells (world, policy, task, successes, trials, success, interval, progress, smallest_difference),
policies and worlds (pairs with difference and interval; agreement, powered), out.")]
pub struct EvaluateArguments {
    /// Who acts: expert, expert:noise=METRES, ws://HOST:PORT, FILE.onnx, each also as NAME=...
    #[arg(long, value_name = "POLICY", num_args = 1.., required = true)]
    policies: Vec<Named>,
    /// Task files, or names of those that are built in: push_milk, stack_boxes, pick_carrot, close_laptop.
    #[arg(long, value_name = "TASK.toml", num_args = 1.., required = true)]
    tasks: Vec<PathBuf>,
    /// Where: twin, nominal, FILE.csv.
    #[arg(long, value_name = "WORLD", value_delimiter = ',', default_value = "twin")]
    worlds: Vec<String>,
    /// The cell whose arm carries the tasks out [default: arms are where they are commanded to be].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// What was identified of that cell.
    #[arg(long, alias = "theta", value_name = "THETA.TOML", requires = "cell")]
    parameters: Option<PathBuf>,
    /// Starts of each task.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
    /// The first start; the others follow it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = inference::seed::parse)]
    seed: u64,
    #[command(flatten)]
    asking: AskingArguments,
    /// New folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replaces the folder of an evaluation.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// How a served policy is asked.
#[derive(Debug, Args)]
pub(super) struct AskingArguments {
    /// What an action's numbers mean.
    #[arg(long, value_enum, default_value_t = Actions::Recorded)]
    actions: Actions,
    /// Actions a second: 1, 2, 4, 5, 10, 20, 25, 50 or 100.
    #[arg(long, value_name = "HZ", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100))]
    rate: u32,
    /// Actions of each answer that are carried out before it is asked again [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    chunk: Option<u32>,
    /// Another name for what a policy sees, as OURS=THEIRS; again for others.
    #[arg(long, value_name = "NAMES")]
    key: Vec<String>,
}

/// [`ActionKind`] by its names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Actions {
    /// The `action` of exported demonstrations.
    Recorded,
    /// Joints of the arm [rad], then the gripper: 0 open, 1 closed.
    Joints,
}

impl AskingArguments {
    /// The same, once tasks are known.
    pub(super) fn read(&self, tasks: &[Task]) -> anyhow::Result<Asking> {
        if !ROWS_A_SECOND.is_multiple_of(self.rate) {
            bail!("--rate {} does not divide 100 a second; give 1, 2, 4, 5, 10, 20, 25, 50 or 100", self.rate);
        }
        let mut keys = Keys::default();
        for task in tasks {
            keys = Keys::read(&self.key, task).map_err(|what| anyhow::anyhow!("--key: {what}"))?;
        }
        let actions = match self.actions {
            Actions::Recorded => ActionKind::Recorded,
            Actions::Joints => ActionKind::Joints,
        };
        Ok(Asking { keys, actions, rate: self.rate, chunk: self.chunk.map(|chunk| chunk as usize) })
    }
}

/// Findings, and where they are.
#[derive(Serialize)]
struct Answer<'a> {
    out: &'a Path,
    #[serde(flatten)]
    findings: &'a evaluation::findings::Findings,
}

pub(super) fn run(arguments: &EvaluateArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let folder = folder(&arguments.out, arguments.force)?;
    let tasks = arguments.tasks.iter().map(|file| Ok(Task::read(file)?)).collect::<anyhow::Result<Vec<_>>>()?;
    apart("tasks", tasks.iter().map(Task::name))?;
    apart("policies", arguments.policies.iter().map(|policy| policy.name.as_str()))?;
    let asking = arguments.asking.read(&tasks)?;
    let (worlds, elsewhere) = worlds(arguments, &tasks)?;
    let of = |trials: &Vec<Trial>| trials.iter().map(|trial| trial.world.clone()).collect::<BTreeSet<String>>();
    let real: Vec<String> = elsewhere.iter().flat_map(of).collect();
    apart("worlds", worlds.iter().map(|world| world.name.as_str()).chain(real.iter().map(String::as_str)))?;
    let question = Fingerprint::of("evaluate");
    let kept = for_work(Some(&arguments.out), &arguments.out, "evaluate", &question, interrupt);
    let (episodes, seed) = (arguments.episodes, arguments.seed);
    let plan = Plan { policies: arguments.policies.clone(), worlds, episodes, seed, asking };
    let done = study::run(&plan, &kept, interrupt);
    if interrupt.asked() {
        bail!("{}", kept.farewell(&typed::command()));
    }
    let done = done.inspect_err(|_| {
        // What was done stays for the next time; that this fails is said then.
        let _saved = kept.save();
    })?;
    let trials: Vec<Trial> =
        done.iter().map(|done| done.trial.clone()).chain(elsewhere.into_iter().flatten()).collect();
    let found = findings(&trials, &real, seed);
    let sheet = Sheet { findings: &found, done: &done, plan: &plan };
    folder.write(Path::new("trials.csv"), trial::table(&trials).as_bytes())?;
    folder.write(Path::new("findings.json"), &serde_json::to_vec_pretty(&found)?)?;
    folder.write(Path::new("report.html"), sheet.page().as_bytes())?;
    folder.finish("findings.json")?;
    kept.done();
    print(arguments.json, &Answer { out: &arguments.out, findings: &found }, report::words(&found, &arguments.out))
}

/// The simulated worlds, and the trials of the others.
fn worlds(arguments: &EvaluateArguments, tasks: &[Task]) -> anyhow::Result<(Vec<World>, Vec<Vec<Trial>>)> {
    let cell = arguments.cell.as_deref().map(Cell::read).transpose()?;
    let theta = arguments.parameters.as_deref().map(Theta::read).transpose()?;
    let (mut simulated, mut elsewhere) = (Vec::new(), Vec::new());
    for name in &arguments.worlds {
        let theta = match name.as_str() {
            "twin" => theta.as_ref(),
            "nominal" if theta.is_some() => None,
            "nominal" => {
                bail!("`nominal` is the twin without --parameters, and none is given; give one, or leave it out")
            }
            file if file.ends_with(".csv") => {
                elsewhere.push(trial::read(Path::new(file))?);
                continue;
            }
            other => bail!("`{other}` is no world; give twin, nominal or FILE.csv, separated by commas"),
        };
        simulated.push(world(name, tasks, cell.as_ref(), theta)?);
    }
    if simulated.is_empty() {
        bail!("--worlds names files alone; give twin or nominal as well");
    }
    Ok((simulated, elsewhere))
}

fn world(name: &str, tasks: &[Task], cell: Option<&Cell>, theta: Option<&Theta>) -> anyhow::Result<World> {
    let mut left_out = Vec::new();
    let mut placed = Vec::new();
    for task in tasks {
        let task = match cell {
            None => task.clone(),
            Some(cell) => {
                let (task, effects) = task.in_cell(cell, theta)?;
                left_out = effects;
                task
            }
        };
        placed.push(Arc::new(task));
    }
    if !left_out.is_empty() {
        console::line(format_args!("{name}: scenes of tasks know nothing of {}: left out", left_out.join(", ")));
    }
    let cell = cell.map(serde_json::to_string).transpose().context("cell.toml")?;
    let description = format!("{} {}", cell.unwrap_or_default(), theta.map_or_else(String::new, Theta::to_toml));
    Ok(World { name: name.to_owned(), tasks: placed, description })
}

/// Refuses two of one name.
fn apart<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> anyhow::Result<()> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            bail!("two of the {what} are called `{name}`; give each a name of its own");
        }
    }
    Ok(())
}

/// The new folder; in place of another one only where an evaluation has written all of that.
fn folder(out: &Path, force: bool) -> anyhow::Result<OutputFolder> {
    let names: Vec<String> = match std::fs::read_dir(out) {
        Ok(entries) if force => {
            entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
        }
        _ => Vec::new(),
    };
    let is_foreign = |name: &&String| !["trials.csv", "findings.json", "report.html"].contains(&name.as_str());
    if let Some(other) = names.iter().find(is_foreign) {
        bail!(
            "{} is not replaced: it holds {other}, which no evaluation has written; give a new folder",
            out.display()
        );
    }
    Ok(if names.is_empty() { OutputFolder::create(out)? } else { OutputFolder::replacing(out)? })
}
