//! The command line of `calibration`: one file a verb.

mod against;
mod benchmark;
mod capture;
mod check;
mod compare;
mod demo;
mod diagnose;
mod engine;
mod evaluate;
mod example;
mod export;
mod export_episodes;
mod export_model;
mod hand_eye;
mod identify;
mod import;
mod init;
mod policy;
mod sweep;
mod viewpoint;

use crate::report::terminal;
use clap::{Parser, Subcommand};
use inference::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::command_line::{self, Build};
use shared_mem::{answer, console, ending, error_line};
use std::fmt::Display;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// Records how a robot cell moves, and says where its twin differs.
#[derive(Debug, Parser)]
#[command(
    arg_required_else_help = true,
    after_help = "\
Examples:
  calibration demo --out demo
  calibration example session
  calibration capture excitation --cell fr3 --clips 4 --out session
  calibration check session --report check.html
  calibration identify arm session --out theta.toml --report page.html
  calibration diagnose session --report report.html
  calibration viewpoint session --out cell.toml --picture outline.png
  calibration hand-eye board --board 5x7,0.034,0.028,DICT_5X5_100 --out hand_eye.toml
  calibration import last_week --out session
  calibration init --urdf arm.urdf --out cell.toml
  calibration export session --to rosbag2 --out bags
  calibration export-episodes pick_carrot carrot --to lerobot --out carrot_lerobot
  calibration export-model theta.toml --cell cell.toml --to mjcf --out cell.xml
  calibration evaluate --policies expert --tasks pick_carrot --out carrot
Every verb has its own --help with an example. Logs and progress go to stderr (RUST_LOG=debug for more)."
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

// No documentation here: the program's own help would be replaced by it.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Moves the arm through a running bridge (or starts one) and records clips into a session folder.
    #[command(
        subcommand,
        after_help = "\
Examples:
  calibration capture excitation --cell fr3 --clips 8 --out session
  calibration capture control-hit-slide --cell fr3 --clips 12 --out strokes
  calibration capture scan --cell lab/cell.toml --hand-eye hand_eye.toml --at 0.5,0,0.05 --out scan"
    )]
    Capture(capture::Capture),
    /// Finds the parameters of controller or object from a session, with intervals, and says which are not identifiable.
    #[command(
        subcommand,
        after_help = "\
Examples:
  calibration identify arm session --out theta.toml --report page.html
  calibration identify object strokes --parameters theta.toml --out object.toml"
    )]
    Identify(identify::Identify),
    /// Ways of finding an object's parameters side by side: error, and what it cost.
    Compare(compare::CompareArguments),
    /// Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.
    Diagnose(diagnose::Arguments),
    /// How often the diagnosis is right, on simulated worlds of which the truth is known.
    Benchmark(benchmark::BenchmarkArguments),
    /// The doctor of a recording: whether the data can mean what they say, and what each clip is good for.
    Check(check::CheckArguments),
    /// Finds where the camera stands, from pictures of the robot and its joints.
    Viewpoint(Box<viewpoint::ViewpointArguments>),
    /// Finds where a camera is mounted on the arm, or beside it, from pictures of a board.
    HandEye(hand_eye::HandEyeArguments),
    /// Makes a session of logs of other programs: bags, data sets, tables.
    Import(import::ImportArguments),
    /// Writes a cell.toml to begin with, commented: from a URDF, a bag, recorded clips, or by questions.
    Init(Box<init::InitArguments>),
    /// Writes a session as ROS 2 bags, TwinAligner clip folders or own clips.
    Export(export::ExportArguments),
    /// Writes episodes of a task as a LeRobot data set, or their pictures.
    ExportEpisodes(export_episodes::ExportEpisodesArguments),
    /// Writes what was found as a model of MuJoCo, ROS or Gazebo, to run or to bring your own model up to date with.
    ExportModel(export_model::ExportModelArguments),
    /// How often policies succeed at tasks, with intervals, and how far success in one world predicts that in another.
    Evaluate(Box<evaluate::EvaluateArguments>),
    /// Runs a policy: on a task in the twin, or on the robot.
    #[command(
        subcommand,
        after_help = "\
Examples:
  calibration policy run --task pick_carrot --policy ws://localhost:8000 --episodes 10"
    )]
    Policy(policy::Policy),
    /// Many runs of other verbs as units: on many cores and machines, going on after a kill, merged without gaps.
    #[command(
        subcommand,
        after_help = "\
Examples:
  calibration sweep plan commands.txt --each seed=0..200 --out sweep
  calibration sweep local sweep --jobs 2
  calibration sweep merge sweep --out merged"
    )]
    Sweep(sweep::Sweep),
    /// The whole story on the simulated cell: shadow, record, replay, explain.
    Demo(demo::DemoArguments),
    /// A session to try things on, with something hidden in it.
    Example(example::ExampleArguments),
}

/// Reads the command line and does what it says.
pub fn main(build: &Build) -> ExitCode {
    command_line::program(build, |arguments: Arguments| run(arguments.verb))
}

/// What was said is that there is no answer: the exit code says so as well, and nothing more is said.
#[derive(Debug, thiserror::Error)]
#[error("no answer")]
struct NoAnswer;

/// Of [`NoAnswer`]: neither done nor failed.
const NO_ANSWER: u8 = 3;

/// Does what a verb says.
pub fn run(verb: Verb) -> ExitCode {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| console::Log).init();
    match done(verb) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<NoAnswer>() => ExitCode::from(NO_ANSWER),
        Err(error) => {
            console::line(format_args!("error: {}", error_line(error.as_ref())));
            ExitCode::FAILURE
        }
    }
}

/// One line where it fails: what happened, and what to do.
fn done(verb: Verb) -> anyhow::Result<()> {
    match verb {
        // What was recorded is kept and looked at, and a benchmark says what it has, after Ctrl-C too.
        Verb::Capture(capture) => capture::run(capture, &Interrupt::listen()?),
        Verb::Demo(arguments) => demo::run(arguments, &Interrupt::listen()?),
        Verb::Benchmark(arguments) => benchmark::run(arguments, &Interrupt::listen_and_cut_short()?),
        // Its children are waited for, which end within a moment.
        Verb::Sweep(sweep) => sweep::run(sweep, &Interrupt::listen_and_cut_short()?),
        verb => {
            let interrupt = Interrupt::listen_to_end_at_once()?;
            let done = run_to_the_end(verb, &interrupt);
            interrupt.work_is_over();
            match done {
                // What a reader that was stopped says of its file is not the file's fault.
                Err(error) if ending::asked() && !error.to_string().starts_with("interrupted") => {
                    anyhow::bail!("interrupted; start again")
                }
                done => done,
            }
        }
    }
}

/// Verbs that say nothing when they are interrupted.
fn run_to_the_end(verb: Verb, interrupt: &Interrupt) -> anyhow::Result<()> {
    match verb {
        Verb::Identify(identify) => identify::run(identify, interrupt),
        Verb::Compare(arguments) => compare::run(arguments, interrupt),
        Verb::Diagnose(arguments) if arguments.against.is_some() => {
            let found = against::run(&arguments, interrupt)?;
            print(arguments.json, &found, terminal::comparison(&found))
        }
        Verb::Diagnose(arguments) => {
            let found = diagnose::run(&arguments, interrupt)?;
            print(arguments.json, &found, terminal::diagnosis(&found))
        }
        Verb::Check(arguments) => check::run(&arguments),
        Verb::Viewpoint(arguments) => viewpoint::run(*arguments, interrupt),
        Verb::HandEye(arguments) => hand_eye::run(arguments),
        Verb::Import(arguments) => import::run(&arguments),
        Verb::Init(arguments) => init::run(*arguments),
        Verb::Example(arguments) => example::run(arguments),
        Verb::Export(arguments) => export::run(&arguments),
        Verb::ExportEpisodes(arguments) => export_episodes::run(&arguments),
        Verb::ExportModel(arguments) => export_model::run(&arguments),
        Verb::Policy(policy) => policy::run(policy, interrupt),
        Verb::Evaluate(arguments) => evaluate::run(&arguments, interrupt),
        Verb::Capture(_) | Verb::Demo(_) | Verb::Benchmark(_) | Verb::Sweep(_) => Ok(()),
    }
}

/// The answer, on standard output: one JSON object, or words for people.
fn print(json: bool, answer: &impl Serialize, words: impl Display) -> anyhow::Result<()> {
    Ok(if json { answer::json(answer) } else { answer::words(words) }?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::conclude::advice;
    use crate::diagnose::conclude::site::Site;
    use std::path::Path;

    const BUILD: Build = Build { version: "0", commit: "", features: &[] };

    /// As the program reads it.
    fn read(command: &str) -> Result<clap::ArgMatches, clap::Error> {
        command_line::command::<Arguments>(&BUILD).try_get_matches_from(words(command))
    }

    /// The words a POSIX shell makes of a command.
    fn words(command: &str) -> Vec<String> {
        let script = format!("for word in {command}; do printf '%s\\n' \"$word\"; done");
        let output = std::process::Command::new("sh").args(["-c", &script]).output().expect("a shell");
        String::from_utf8(output.stdout).expect("UTF-8").lines().map(str::to_owned).collect()
    }

    #[test]
    fn every_command_that_a_report_advises_is_accepted() {
        let mut accepted = std::collections::BTreeSet::new();
        for (strokes, clips) in [(false, vec![0, 3]), (true, vec![1, 2]), (true, vec![]), (false, vec![])] {
            for folder in ["monday", "it's monday/strokes"] {
                let site = Site::new(Path::new(folder), strokes, clips.clone(), 1.62);
                for command in advice::all(&site).into_iter().flat_map(|advice| advice.commands) {
                    if accepted.insert(command.clone()) {
                        read(&command).unwrap_or_else(|error| panic!("{command}\n{error}"));
                    }
                }
            }
        }
        assert!(accepted.len() > 40, "{} commands", accepted.len());
    }

    #[test]
    fn what_does_not_go_together_is_refused_and_negative_numbers_are_no_options() {
        let excitation = "calibration capture excitation --cell cell.toml --out session";
        let strokes = "calibration capture control-hit-slide --cell cell.toml --out session";
        for (command, fits) in [
            (format!("{excitation} --clips 1 --seed=-5"), true),
            (format!("{excitation} --clips 1 --seed -5"), true),
            (excitation.to_owned(), false),
            (format!("{excitation} --repeat 3,4 --speed 0.5"), true),
            (format!("{excitation} --clips 1 --speed 0"), false),
            (format!("{excitation} --clips 1 --joints 0"), false),
            (format!("{strokes} --turn-object -90,0"), true),
            (format!("{strokes} --headings 8 --repeat 1"), false),
            (format!("{strokes} --repeat 2 --turn-tool -90"), true),
            (strokes.to_owned(), false),
            ("calibration diagnose monday --cell cell.toml --seed -5".to_owned(), true),
            ("calibration diagnose monday --against tuesday --torques".to_owned(), true),
            ("calibration diagnose monday --against tuesday --budget 60".to_owned(), false),
            ("calibration demo --seed=-5".to_owned(), true),
            ("calibration compare strokes --seed -5 --out comparison.json".to_owned(), true),
            ("calibration identify arm clip.mcap --cell cell.toml --seed -5".to_owned(), true),
            ("calibration identify object strokes --seed 1.5".to_owned(), false),
        ] {
            assert_eq!(read(&command).is_ok(), fits, "{command}");
        }
    }
}
