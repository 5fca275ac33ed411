//! A simulated cell while random bytes are sent on every topic: bridge with gripper, camera and force sensor, its recorder, and the shadow twin
//! run in one domain of shared memory, a recorder alone in another, where the places that the bridge takes are free.
//! The arm is moved to and fro meanwhile, and a judge reads what it is commanded.
//!
//! `random_bytes SECONDS` (600 where none are given) prints one JSON object and fails when a process died or a limit was
//! exceeded.
#![allow(clippy::print_stdout)] // its answer

mod thrower;

use shared_mem::topics;
use shared_mem::transport::Node;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use tests::{Cell, Finished, Judge, Program, lab_cell};
use thrower::Thrower;

/// Pause between two messages of a topic.
const PAUSE: Duration = Duration::from_millis(1);
/// The same where only a recorder runs: it keeps what is valid.
const ALONE_PAUSE: Duration = Duration::from_millis(20);

fn main() -> ExitCode {
    let seconds = std::env::args().nth(1).map_or(600.0, |text| text.parse().expect("random_bytes SECONDS"));
    // Small pictures: a recording of ten minutes must fit on the disk.
    let toml = lab_cell().replace("width = 640\nheight = 480\nrate = 30.0", "width = 64\nheight = 48\nrate = 10.0");
    assert!(toml.contains("width = 64\n"), "the shipped cell has another camera");
    let cell = Cell::with(&toml);
    let alone_domain = format!("{}-alone", cell.domain());
    let clips = [cell.text("bridge.mcap"), cell.text("alone.mcap")];
    let bridge = cell.start_bridge(&["--camera", "sim", "--gripper", "sim", "--wrench", "sim", "--record", &clips[0]]);
    let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--json"]);
    let recorder = Program::start("rt_bridge", &alone_domain, &["record", "--json", "--out", &clips[1]]);
    let mut programs = [("bridge", bridge), ("twin", twin), ("recorder", recorder)];

    // The twin takes its places before somebody else does.
    let node = Node::open_in(cell.domain(), "judge").expect("shared memory");
    let gaps = node.subscriber(topics::TWIN_GAP).expect("a place to read");
    Cell::until("the twin mirrors the arm", Duration::from_secs(20), || gaps.newest().expect("a gap").is_some());

    let mut judge = Judge::new(&shared_mem::cell::Cell::read(&cell.path("cell.toml")).expect("the shipped cell"));
    let mut throwers = [Thrower::open(cell.domain(), 1), Thrower::open(&alone_domain, 2)];
    let dead = throw(Duration::from_secs_f64(seconds), &node, &mut judge, &mut throwers, &mut programs);
    let ended: Vec<_> = programs.map(|(name, program)| (name, program.interrupt())).into();
    report(seconds, &judge, &throwers, &dead, &ended)
}

/// Throws and judges until the time is over or a program has ended; those that have.
fn throw(
    time: Duration,
    node: &Node,
    judge: &mut Judge,
    [beside, alone]: &mut [Thrower; 2],
    programs: &mut [(&'static str, Program); 3],
) -> Vec<&'static str> {
    let commands = node.subscriber(topics::ARM_COMMAND).expect("a place to read");
    let states = node.subscriber(topics::ARM_STATE).expect("a place to read");
    let begin = Instant::now();
    let mut next = begin;
    let mut dead = Vec::new();
    while begin.elapsed() < time && dead.is_empty() {
        while let Some(command) = commands.receive().expect("a command") {
            judge.command(&command);
        }
        while let Some(state) = states.receive().expect("a state") {
            judge.state(&state);
            beside.go_on(&state);
        }
        beside.throw();
        if Instant::now() >= next {
            next += ALONE_PAUSE;
            alone.throw();
            dead = programs.iter_mut().filter_map(|(name, p)| (!p.is_running()).then_some(*name)).collect();
        }
        std::thread::sleep(PAUSE);
    }
    judge.overlooked = commands.ignored() + states.ignored();
    dead
}

/// Prints the answer; failure when a program died or a limit was exceeded.
fn report(
    seconds: f64,
    judge: &Judge,
    [beside, alone]: &[Thrower; 2],
    dead: &[&str],
    ended: &[(&str, Finished)],
) -> ExitCode {
    let failed: Vec<String> =
        ended.iter().filter(|(_, e)| !e.status.success()).map(|(n, e)| format!("{n}: {}", e.status)).collect();
    let replaced = ended.iter().any(|(_, e)| e.stderr.contains("the recorder was killed"));
    let exceeded = judge.exceeded();
    let ignored: Vec<&str> =
        ended.iter().flat_map(|(_, e)| e.stderr.lines()).filter(|l| l.contains("ignored ")).collect();
    let survived = dead.is_empty() && failed.is_empty() && !replaced;
    let worst: serde_json::Map<_, _> = judge
        .worst()
        .iter()
        .map(|(what, ratio)| ((*what).to_owned(), serde_json::json!(if ratio.is_finite() { *ratio } else { f64::MAX })))
        .collect();
    let answer = serde_json::json!({
        "seconds": seconds,
        "thrown": { "beside_the_bridge": beside.thrown, "alone": alone.thrown },
        "occupied": { "beside_the_bridge": beside.occupied, "alone": alone.occupied },
        "commands": judge.judged[0], "states": judge.judged[1], "moved": judge.moved, "overlooked": judge.overlooked,
        "worst_ratio": worst, "exceeded": exceeded,
        "dead": dead, "failed": failed, "recorder_replaced": replaced, "ignored": ignored,
    });
    println!("{answer:#}");
    if survived && exceeded.is_empty() && judge.overlooked == 0 && judge.moved > 0 {
        return ExitCode::SUCCESS;
    }
    for (name, finished) in ended {
        eprintln!("{name} said:\n{}", finished.stderr);
    }
    ExitCode::FAILURE
}
