//! The program as people run it: a bridge with a simulated arm, and commands beside it. Each test has its own domain of
//! shared memory.

use rt_bridge::rt::process::ask_to_end;
use shared_mem::msg::arm::ArmState;
use shared_mem::transport::Subscriber;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

pub(crate) const CELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/fr3_cell.toml");
/// Longest wait for something that takes a second; only a fault uses it up.
pub(crate) const LONG: Duration = Duration::from_secs(30);

pub(crate) fn program(domain: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rt_bridge"));
    command
        .env("TWINALIGN_DOMAIN", format!("{domain}{}", std::process::id()))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// A bridge that ends with this test, however that ends.
pub(crate) fn bridge(domain: &str, further: &[&str]) -> Child {
    let mut command = program(domain, &["run", "--cell", CELL, "--arm", "sim", "--camera", "off", "--gripper", "sim"]);
    command.args(["--realtime", "ignore", "--json", "--parent", &std::process::id().to_string()]).args(further);
    command.spawn().expect("the program starts")
}

pub(crate) fn target(domain: &str, arguments: &[&str]) -> Output {
    let all: Vec<&str> = ["target"].iter().chain(arguments).copied().collect();
    program(domain, &all).output().expect("the program runs")
}

pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub(crate) fn wait_for(states: &Subscriber<ArmState>, wanted: impl Fn(&ArmState) -> bool) -> ArmState {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        match states.newest().expect("shared memory") {
            Some(state) if wanted(&state) => return state,
            _ => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    panic!("not within half a minute");
}

pub(crate) fn end(bridge: Child) -> Output {
    ask_to_end(bridge.id()).expect("it still runs");
    bridge.wait_with_output().expect("it ends")
}
