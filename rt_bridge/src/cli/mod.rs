//! The command line: what can be asked, and what is answered. One file a verb.
//!
//! Standard output holds nothing but the answer: one JSON object with `--json`, a few lines without. Everything said on
//! the way goes to standard error. Exit codes: 0 done, 1 failed, 2 wrong arguments.

mod convert;
mod doctor;
mod grip;
mod link;
mod record;
mod run;
mod serve;
mod stop;
mod target;

use clap::{Parser, Subcommand};
use shared_mem::command_line::{self, Build};
use shared_mem::msg::arm::ArmState;
use shared_mem::transport::Subscriber;
use shared_mem::{console, parent};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Hardware to shared memory: drives a robot arm at 1 kHz and shows everybody on this machine what it does.
///
/// The arm may be a Franka Research 3, the simulated cell, or a recording: whoever reads from shared memory cannot tell.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:\n  \
        rt_bridge doctor                                               what this machine lacks for real time\n  \
        rt_bridge run --cell fr3 --arm sim                             hold the simulated arm until Ctrl-C\n  \
        rt_bridge run --cell cell.toml --arm fci://172.16.0.2 --record clip.mcap\n  \
        rt_bridge record --out clip.mcap --duration 10                 record what others do\n  \
        rt_bridge convert table.bag --out table.mcap                   a RealSense recording as a clip\n  \
        rt_bridge grip move 0.03                                       tell the gripper of a running bridge\n  \
        rt_bridge target shift 0,0,0.05 --cell fr3                     steer the arm of a running bridge\n  \
        rt_bridge stop                                                 brake it, whoever moves it\n  \
        rt_bridge serve --cell fr3                                     play a Franka robot for any libfranka program\n  \
        rt_bridge link --listen tcp/0.0.0.0:7447                       let another host read along\n\n\
        Processes meet when the environment variable TWINALIGN_DOMAIN agrees (default 0).")]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

// No documentation here: the program's own help would be replaced by it.
#[derive(Debug, Subcommand)]
pub enum Verb {
    Run(run::RunArguments),
    Record(record::RecordArguments),
    Convert(convert::ConvertArguments),
    Serve(serve::ServeArguments),
    Grip(grip::GripArguments),
    Target(target::TargetArguments),
    Stop(stop::StopArguments),
    Link(link::LinkArguments),
    Doctor(doctor::DoctorArguments),
}

/// What is said on standard error unless `RUST_LOG` says otherwise. The network's library says each failure by itself, and
/// what matters of it is said by `link`.
const LOGGED: &str = "info,zenoh=off";

/// Reads the command line and does what it says.
pub fn main(build: &Build) -> ExitCode {
    command_line::program(build, |arguments: Arguments| run(arguments.verb))
}

/// Does what a verb says.
pub fn run(verb: Verb) -> ExitCode {
    tracing_subscriber::fmt()
        .with_writer(|| console::Log)
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env()
                .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new(LOGGED)),
        )
        .with_target(false)
        .with_ansi(false)
        .init();
    let done = match verb {
        // What it found out is its answer, and no error.
        Verb::Doctor(doctor) => doctor.execute(),
        Verb::Run(run) => run.execute().map(success),
        Verb::Record(record) => record.execute().map(success),
        Verb::Convert(convert) => convert.execute().map(success),
        Verb::Serve(serve) => serve.execute().map(success),
        Verb::Grip(grip) => grip.execute().map(success),
        Verb::Target(target) => target.execute().map(success),
        Verb::Stop(stop) => stop.execute().map(success),
        Verb::Link(link) => link.execute().map(success),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            // Every error is one sentence that holds its cause; the chain below would say it twice.
            console::line(format_args!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn success((): ()) -> ExitCode {
    ExitCode::SUCCESS
}

/// A flag that Ctrl-C and `SIGTERM` set, and the end of `parent`, where one started this program.
fn stop_flag(parent: Option<u32>) -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopping = stop.clone();
    ctrlc::set_handler(move || stopping.store(true, Ordering::Relaxed))?;
    if let Some(parent) = parent {
        let stopping = stop.clone();
        parent::when_gone(parent, move || stopping.store(true, Ordering::Relaxed))?;
    }
    Ok(stop)
}

/// The newest state, waiting for one if need be.
fn newest_state(states: &Subscriber<ArmState>, patience: Duration) -> anyhow::Result<Option<ArmState>> {
    let begin = Instant::now();
    while begin.elapsed() < patience {
        if let Some(state) = states.newest()? {
            return Ok(Some(state));
        }
        thread::sleep(Duration::from_millis(2));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent_and_every_verb_shows_an_example() {
        let mut command = Arguments::command();
        command.clone().debug_assert();
        for verb in command.get_subcommands_mut() {
            let help = verb.render_long_help().to_string();
            assert!(help.contains("Example"), "{} has no example", verb.get_name());
        }
    }
}
