//! What the diagnosis says of twelve sealed worlds, held against what it said before (`verdicts.json`): verdict, causes, parameters,
//! intervals and shrink. A change of code that is none of arithmetic leaves them as they are.
//!
//! `cargo test --release --workspace --test verdicts -- --include-ignored --nocapture --test-threads 1` looks at all twelve and prints what
//! each cost (13 minutes of one core); the three quickest are always looked at. What is found is written to `target/tmp/verdicts/`, one
//! file a world: where a change is meant, its object replaces the one of that name in `verdicts.json`.

mod driven;
mod golden;
mod slides;

use calibration::benchmark::trial::sealed;
use calibration::diagnose::against::{Pair, compare_clips};
use calibration::diagnose::{Diagnosis, Options, diagnose, diagnose_clips};
use driven::Driven;
use inference::interrupt::Interrupt;
use rustix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};
use shared_mem::cell::Cell;
use shared_mem::msg::MAX_JOINTS;
use std::path::Path;
use worlds::changed::Changed;
use worlds::draw;
use worlds::session::record;
use worlds::world::{Fault, Kind, Outside, World};

/// What of an answer is held to what it was; texts may be said better.
const KEPT: [&str; 4] = ["verdict", "gap", "candidates", "theta"];
/// Clips of a drawn world.
const CLIPS: usize = 8;

fn lab() -> Cell {
    Cell::parse(include_str!("../../config/fr3_cell.toml"), Path::new("cell.toml")).expect("the shipped cell")
}

fn of_effect(kind: Kind, name: &str) -> Fault {
    let all = draw::candidates(kind == Kind::Strokes);
    Fault::Single(all.iter().position(|effect| effect.name == name).expect("an effect of the registry"))
}

/// A world drawn from its number, diagnosed.
fn drawn(number: u64, kind: Kind, fault: Fault) -> Value {
    let world = World::draw(number, kind, fault, &lab());
    let (session, admitted) = sealed(&world, record(&world, CLIPS).expect("a session"));
    let options = Options { seed: number, ..Options::default() };
    json!(diagnose_clips(&session, &admitted, &options, &Interrupt::default()).expect("a diagnosis"))
}

/// Two sessions of one arm, the second with a load.
fn compared() -> Value {
    let worlds = Changed::Payload.worlds(41, &lab()).0;
    let [a, b] = worlds.map(|world| sealed(&world, record(&world, 6).expect("a session")));
    let pair = Pair::of([a.1, b.1], false, Vec::new());
    let options = Options { seed: 41, ..Options::default() };
    json!(compare_clips([&a.0, &b.0], &pair, &options, &Interrupt::default()).expect("a comparison"))
}

fn slid() -> Value {
    let (session, admitted) =
        slides::session("[object]\nfriction = 0.25\n[[effect]]\nname = \"table_tilt\"\ntilt = [0.0, 0.05]\n");
    json!(diagnose_clips(&session, &admitted, &Options::default(), &Interrupt::default()).expect("a diagnosis"))
}

fn recorded(driven: &Driven<'_>, torques: bool) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    let session = driven.session(folder.path());
    diagnose(&session, &Options { torques, ..Options::default() }, &Interrupt::default()).expect("a diagnosis")
}

/// Torques along the measured motion, of an arm with a load.
fn torques() -> Value {
    let cell = Cell { objects: Vec::new(), ..lab() };
    let driven = Driven {
        cell: &cell,
        hidden: "[[effect]]\nname = \"payload\"\nmass = 0.8\ncentre = [0.0, 0.0, 0.05]\n",
        clips: 4,
        periods: 1500,
        row_every: 1,
        amplitude: 0.05,
        torque_constant: [1.0; MAX_JOINTS],
    };
    json!(recorded(&driven, true))
}

/// A hobby servo with dry friction that swings a weight, 200 rows a second.
fn servo() -> Value {
    const CELL: &str = "[robot]\njoints = [\"servo\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [2.0]\nstiffness_range = [0.5, 8.0]\n\
                        damping = [0.1]\ndamping_range = [0.01, 1.0]\nrotor_inertia = [0.006]\ntorque_limit = [3.0]\n";
    let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
    let driven = Driven {
        cell: &cell,
        hidden: "[arm]\nstiffness = [2.4]\ndamping = [0.12]\n[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.08]\n",
        clips: 6,
        periods: 3000,
        row_every: 5,
        amplitude: 0.2,
        torque_constant: [1.0; MAX_JOINTS],
    };
    json!(recorded(&driven, false))
}

/// An arm of three joints described by a URDF, whose commands come late.
fn described() -> Value {
    const LINKS: [(&str, &str, f64); 3] =
        [("shoulder", "0 0 1", 2.0), ("elbow", "0 1 0", 1.5), ("wrist", "0 1 0", 0.6)];
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("arm.urdf");
    let mut urdf = String::from("<robot name=\"arm\"><link name=\"base\"/>");
    let mut parent = "base";
    for (joint, axis, mass) in LINKS {
        urdf += &format!(
            "<link name=\"{joint}_link\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.01\" iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
             <joint name=\"{joint}\" type=\"revolute\"><parent link=\"{parent}_link\"/><child link=\"{joint}_link\"/>\
             <origin xyz=\"0.2 0 0\"/><axis xyz=\"{axis}\"/><limit lower=\"-2.8\" upper=\"2.8\" effort=\"60\" velocity=\"6\"/></joint>"
        );
        parent = joint;
    }
    std::fs::write(&file, (urdf + "</robot>").replace("base_link", "base")).expect("room");
    let cell = format!(
        "[robot]\nurdf = {:?}\n[controller]\nkind = \"joint_impedance\"\nstiffness = [200.0, 200.0, 80.0]\ndamping = [15.0, 15.0, 4.0]\n",
        file.display().to_string()
    );
    let cell = Cell::parse(&cell, &folder.path().join("cell.toml")).expect("a cell");
    let driven = Driven {
        cell: &cell,
        hidden: "[arm]\nstiffness = [180.0, 220.0, 75.0]\ndamping = [14.0, 16.0, 4.4]\n[[effect]]\nname = \"command_delay\"\ndelay = 0.006\n",
        clips: 6,
        periods: 2500,
        row_every: 1,
        amplitude: 0.08,
        torque_constant: [1.0; MAX_JOINTS],
    };
    json!(recorded(&driven, false))
}

/// Holds the answer on a world against what it was.
fn holds(name: &str, answer: impl FnOnce() -> Value) {
    let cpu = || {
        let used = clock_gettime(ClockId::ProcessCPUTime);
        used.tv_sec as f64 + 1e-9 * used.tv_nsec as f64
    };
    let before = cpu();
    let is = golden::kept(&answer(), &KEPT);
    eprintln!("{name}: {} {}, {:.0} CPU s", is["verdict"]["kind"], is["verdict"], cpu() - before);
    golden::holds(("verdicts", include_str!("verdicts.json")), name, &is);
}

#[test]
fn an_arm_in_which_nothing_is_wrong() {
    holds("arm_nothing", || drawn(101, Kind::Excitation, Fault::Nothing));
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn a_servo_with_dry_friction() {
    holds("servo", servo);
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn an_object_alone_on_a_table_that_leans() {
    holds("slides_tilt", slid);
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn an_arm_with_dry_friction() {
    holds("arm_friction", || drawn(102, Kind::Excitation, of_effect(Kind::Excitation, "joint_coulomb_friction")));
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn an_arm_with_two_effects() {
    holds("arm_two", || drawn(103, Kind::Excitation, Fault::Pair));
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn an_arm_with_what_no_effect_describes() {
    holds("arm_hose", || drawn(104, Kind::Excitation, Fault::Outside(Outside::Hose)));
}

#[test]
fn an_arm_of_a_urdf_whose_commands_come_late() {
    holds("urdf_delay", described);
}

#[test]
fn torques_of_an_arm_with_a_load() {
    holds("torques_load", torques);
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn two_sessions_between_which_a_load_came() {
    holds("against_load", compared);
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn strokes_in_which_nothing_is_wrong() {
    holds("strokes_nothing", || drawn(105, Kind::Strokes, Fault::Nothing));
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn strokes_on_a_table_that_leans() {
    holds("strokes_tilt", || drawn(106, Kind::Strokes, of_effect(Kind::Strokes, "table_tilt")));
}

#[test]
#[ignore = "takes 7 to 180 CPU s; all twelve by the command at the head of this file"]
fn strokes_seen_late() {
    holds("strokes_camera_late", || drawn(107, Kind::Strokes, of_effect(Kind::Strokes, "camera_latency")));
}
