//! The one program holds the verbs of all three. That it has a test of its own also makes cargo build it for every other test.

use clap::{Command, Subcommand};
use std::collections::BTreeSet;
use std::process;

fn answer(arguments: &[&str]) -> String {
    let output =
        process::Command::new(env!("CARGO_BIN_EXE_twinalign")).args(arguments).output().expect("the program runs");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn one_program_holds_the_verbs_of_all() {
    let all = [
        calibration::cli::Verb::augment_subcommands,
        twin::cli::Verb::augment_subcommands,
        rt_bridge::cli::Verb::augment_subcommands,
    ]
    .into_iter()
    .flat_map(|verbs| {
        verbs(Command::new("part")).get_subcommands().map(|verb| verb.get_name().to_owned()).collect::<Vec<_>>()
    })
    .chain(["help", "completions", "manpages"].map(str::to_owned))
    .collect::<BTreeSet<_>>();
    let text = answer(&["--help"]);
    let commands = text.split_once("\nCommands:\n").map_or("", |(_, rest)| rest);
    let lines = commands.lines().take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    let named = lines.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect::<BTreeSet<_>>();
    assert_eq!(named, all);
    assert!(answer(&["stop", "--help"]).contains("Brake the arm of a running bridge now"));
}

#[test]
fn completions_know_the_verbs_of_every_part() {
    let script = answer(&["completions", "bash"]);
    assert!(script.contains("diagnose") && script.contains("doctor") && script.contains("shadow"));
}
