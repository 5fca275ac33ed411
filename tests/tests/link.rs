//! `rt_bridge link` without a network: what it refuses, and what a build without the feature says.

use std::process::Command;
use tests::{Finished, Program, program_path};

fn is_built_in() -> bool {
    let output = Command::new(program_path("rt_bridge")).arg("--version").output().expect("it runs");
    let version = String::from_utf8_lossy(&output.stdout).into_owned();
    version.split_once("features:").is_some_and(|(_, features)| features.contains("link"))
}

fn link(arguments: &[&str]) -> Finished {
    let domain = format!("link-{}", std::process::id());
    Program::start("rt_bridge", &domain, &[&["link"], arguments].concat()).wait(std::time::Duration::from_secs(20))
}

#[test]
fn wrong_addresses_topics_and_commands_are_refused_before_anything_is_opened() {
    for (arguments, expected) in [
        (&["--listen", "0.0.0.0:7447"][..], "tcp/HOST:PORT"),
        (&["--connect", "tcp/robot"], "tcp/HOST:PORT"),
        (&["--connect", "tcp/robot:7447#iface=eth0"], "tcp/HOST:PORT"),
        (&["--connect", "tcp/robot:1", "--listen", "tcp/0.0.0.0:1"], "cannot be used with"),
        (&[], "--listen"),
        (&["--connect", "tcp/robot:1", "--topics", "/arm/stat"], "there is no topic `/arm/stat`"),
        (&["--listen", "tcp/0.0.0.0:1", "--topics", "/arm/target"], "--take-commands"),
        (&["--listen", "tcp/0.0.0.0:1", "--take-commands", "/arm/motion"], "/arm/target"),
    ] {
        let finished = link(arguments);
        assert_eq!(finished.status.code(), Some(2), "{arguments:?}: {}", finished.stderr);
        assert!(finished.stderr.contains(expected), "{arguments:?}: {}", finished.stderr);
        assert_eq!(finished.stdout, "");
    }
    let both = link(&["--connect", "tcp/127.0.0.1:1", "--topics", "/events", "--send", "/events"]);
    assert!(both.complaint().contains("/events cannot be sent and taken"), "{}", both.stderr);
}

#[test]
fn a_program_without_the_network_says_how_to_build_one_with_it() {
    if is_built_in() {
        return;
    }
    let finished = link(&["--connect", "tcp/127.0.0.1:1", "--json"]);
    let line = finished.complaint();
    assert!(line.contains("--features rt_bridge/link") && line.contains("--locked --features link"), "{line}");
    assert_eq!(finished.stderr.trim_end().lines().count(), 1, "{}", finished.stderr);
}
