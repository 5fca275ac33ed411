//! `calibration sweep`.

use super::print;
use crate::sweep::{self, Each, Partition, Ran, Slice, TimeLimit, Wanted};
use anyhow::Context as _;
use clap::{Args, Subcommand};
use inference::interrupt::Interrupt;
use serde_json::json;
use shared_mem::answer;
use shared_mem::input;
use shared_mem::output::OutputFolder;
use std::path::{Path, PathBuf};

#[derive(Debug, Subcommand)]
pub enum Sweep {
    /// Writes the units of a sweep: one for each combination of values.
    Plan(PlanArguments),
    /// Runs units that have no result yet, those of one slice or all.
    Run(RunArguments),
    /// Runs all units that have no result yet on the cores of this machine.
    Local(LocalArguments),
    /// All results as one; refuses gaps, results of other questions, and results that were changed.
    Merge(MergeArguments),
    /// Prints a script for Slurm, whose tasks run a slice each.
    Slurm(SlurmArguments),
}

#[derive(Debug, Args)]
#[command(after_help = "\
COMMANDS holds commands of this program without its name, one a line. {NAME} in them takes each value of --each NAME=VALUES, and {out} is a
folder of the unit's own. --json is added. A unit's result is the JSON object that it prints, and the tables and lists in {out}.

Its hash is that of the command, of the program's build, and of all files and folders that the command names: when one of them changes, the
sweep has to be planned again. Files may have any size; a link counts as what it leads to, each folder once. With the line
`benchmark --null 1 --seed {seed}`, or
`evaluate --policies expert:noise={noise} --tasks push_milk --seed {seed} --out {out}`:

Examples:
  calibration sweep plan commands.txt --each seed=0..200 --out sweep
  calibration sweep plan commands.txt --each seed=0,50,100,150 --each noise=0,0.003,0.01 --out sweep

JSON: out, units.")]
pub struct PlanArguments {
    /// Commands, one a line.
    #[arg(value_name = "COMMANDS")]
    commands: PathBuf,
    /// A placeholder and its values, NAME=A,B,C or NAME=FROM..BEFORE; again for others.
    #[arg(long, value_name = "VALUES")]
    each: Vec<Each>,
    /// New folder.
    #[arg(long, value_name = "SWEEP")]
    out: PathBuf,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Units that have a result are left as they are: a slice that was ended, on whatever machine, is run again by the same command.

Examples:
  calibration sweep run sweep --slice 3/8
  calibration sweep run sweep --slice 1/1 --jobs 4 --json

JSON: units, before (had a result before), now (run now).")]
pub struct RunArguments {
    /// Folder of the sweep.
    #[arg(value_name = "SWEEP")]
    sweep: PathBuf,
    /// K/N: every N-th unit from the K-th on [default: all].
    #[arg(long, value_name = "SLICE")]
    slice: Option<Slice>,
    /// Units at once.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4096))]
    jobs: u32,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  calibration sweep local sweep
  calibration sweep local sweep --jobs 2 --json

JSON: units, before (had a result before), now (run now).")]
pub struct LocalArguments {
    /// Folder of the sweep.
    #[arg(value_name = "SWEEP")]
    sweep: PathBuf,
    /// Units at once [default: as many as there are cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    jobs: Option<u32>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
The new folder gets answers.jsonl, a line for each unit in their order; of evaluations also trials.csv and findings.json, over all of them.

Examples:
  calibration sweep merge sweep --out merged

JSON: out, units, seconds (of all units together), findings (of evaluations).")]
pub struct MergeArguments {
    /// Folder of the sweep.
    #[arg(value_name = "SWEEP")]
    sweep: PathBuf,
    /// New folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Nodes have to see the folder of the sweep, this program, and whatever the units name, under the same paths.

Examples:
  calibration sweep slurm sweep --slices 8 --cpus 4 --time 02:00:00 > sweep.sbatch")]
pub struct SlurmArguments {
    /// Folder of the sweep.
    #[arg(value_name = "SWEEP")]
    sweep: PathBuf,
    /// Slices, a task of the array each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    slices: u32,
    /// Cores of each task, and units at once.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4096))]
    cpus: u32,
    /// Time limit of each task, as Slurm takes it: HH:MM:SS.
    #[arg(long, value_name = "TIME", default_value = "01:00:00")]
    time: TimeLimit,
    /// Partition [default: the cluster's].
    #[arg(long, value_name = "NAME")]
    partition: Option<Partition>,
}

pub(super) fn run(verb: Sweep, interrupt: &Interrupt) -> anyhow::Result<()> {
    match verb {
        Sweep::Plan(arguments) => plan(&arguments, interrupt),
        Sweep::Run(RunArguments { sweep, slice, jobs, json }) => {
            work(&sweep, slice.unwrap_or(Slice::WHOLE), jobs as usize, json, interrupt)
        }
        Sweep::Local(LocalArguments { sweep, jobs, json }) => {
            let jobs = jobs.map_or_else(cores, |jobs| jobs as usize);
            work(&sweep, Slice::WHOLE, jobs, json, interrupt)
        }
        Sweep::Merge(arguments) => merge(&arguments),
        Sweep::Slurm(SlurmArguments { sweep, slices, cpus, time, partition }) => {
            sweep::read(&sweep)?;
            let absolute = sweep.canonicalize().with_context(|| sweep.display().to_string())?;
            let program = std::env::current_exe().context("this program's own path")?;
            let wanted = Wanted { slices, cpus, time, partition };
            Ok(answer::bytes(sweep::script(&absolute, &program, &wanted)?.as_bytes())?)
        }
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn plan(arguments: &PlanArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let PlanArguments { commands, each, out, json } = arguments;
    let folder = OutputFolder::create(out)?;
    let text = input::text(commands, input::Kind::Configuration)?;
    let units = sweep::plan(&sweep::commands(&text)?, each, interrupt)?;
    sweep::write(&units, folder)?;
    let words = format!("{} units in {}; `calibration sweep local` runs them here", units.len(), out.display());
    print(*json, &json!({ "out": out, "units": units.len() }), words)
}

fn work(folder: &Path, slice: Slice, jobs: usize, json: bool, interrupt: &Interrupt) -> anyhow::Result<()> {
    let units = sweep::read(folder)?;
    let threads = cores() / jobs.max(1);
    let runner = |command: &[std::ffi::OsString], interrupt: &Interrupt| sweep::process(command, threads, interrupt);
    let ran = sweep::run((folder, &units), slice, jobs, &runner, interrupt)?;
    if interrupt.asked() {
        anyhow::bail!("interrupted; results so far are kept, and the same command goes on");
    }
    let Ran { units, before, now } = ran;
    print(json, &ran, format!("{now} of {units} units were run, {before} had a result before"))
}

fn merge(arguments: &MergeArguments) -> anyhow::Result<()> {
    let MergeArguments { sweep, out, json } = arguments;
    let folder = OutputFolder::create(out)?;
    let merged = sweep::merge(sweep, &sweep::read(sweep)?)?;
    folder.write(Path::new("answers.jsonl"), merged.answers.as_bytes())?;
    if let Some((table, findings)) = &merged.trials {
        folder.write(Path::new("trials.csv"), table.as_bytes())?;
        folder.write(Path::new("findings.json"), &serde_json::to_vec_pretty(findings)?)?;
    }
    folder.finish("answers.jsonl")?;
    let mut answer = merged.summary();
    if let Some(object) = answer.as_object_mut() {
        object.insert("out".to_owned(), json!(out));
    }
    let words = format!("{} units, {:.0} s together, in {}", merged.units, merged.seconds, out.display());
    print(*json, &answer, words)
}
