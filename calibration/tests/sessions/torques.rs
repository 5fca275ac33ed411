//! `diagnose --torques` on a log of motor currents: what cell.toml says that an ampere is worth is worth it there as well.

use crate::driven::Driven;
use calibration::diagnose::{Diagnosis, Options, diagnose};
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::Session;
use std::path::Path;
use twin::effects::{Role, Shape, Stage, registry};

/// What a diagnosis may find here; all others are known to rest.
const CANDIDATES: [&str; 3] = ["payload", "torque_gain", "joint_viscous_friction"];
/// A load that cell.toml does not know.
const HIDDEN: &str = "[[effect]]\nname = \"payload\"\nmass = 0.8\ncentre = [0.0, 0.0, 0.05]\n";
/// Torque at the joint over the current of its motor [N m/A].
const CONSTANTS: [f64; 7] = [2.0, 4.0, 0.5, 3.0, 1.25, 0.75, 8.0];

/// A session with torques, or with the currents that make them.
fn session(folder: &Path, currents: bool) -> Session {
    let lab =
        Cell::parse(include_str!("../../../config/fr3_cell.toml"), Path::new("cell.toml")).expect("the shipped cell");
    let mut alone = Cell { objects: Vec::new(), ..lab };
    let mut torque_constant = [1.0; MAX_JOINTS];
    if currents {
        torque_constant[..CONSTANTS.len()].copy_from_slice(&CONSTANTS);
        alone.controller.as_mut().expect("a controller").torque_constant = CONSTANTS.to_vec();
    }
    let driven = Driven {
        cell: &alone,
        hidden: HIDDEN,
        clips: 4,
        periods: 1500,
        row_every: 1,
        amplitude: 0.05,
        torque_constant,
    };
    driven.session(folder)
}

/// The diagnosis among the candidates: each effect more costs a test time.
fn diagnosed(currents: bool) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    let session = session(folder.path(), currents);
    let of_arm =
        registry().iter().filter(|effect| effect.stage == Stage::Control && !CANDIDATES.contains(&effect.name));
    let mut known = String::new();
    for effect in of_arm {
        known += &format!("[[effect]]\nname = \"{}\"\n", effect.name);
        for parameter in effect.parameters {
            let Role::Size { neutral } = parameter.role else { continue };
            known += &match parameter.shape {
                Shape::Number => format!("{} = {neutral:?}\n", parameter.name),
                Shape::PerJoint => format!("{} = {:?}\n", parameter.name, [neutral; 7]),
                Shape::Vector(size) => format!("{} = {:?}\n", parameter.name, vec![neutral; size]),
            };
        }
    }
    let theta = shared_mem::toml_file::parse(&known, Path::new("known.toml")).expect("a theta");
    let options = Options { theta: Some(theta), torques: true, ..Options::default() };
    diagnose(&session, &options, &Interrupt::default()).expect("a diagnosis")
}

#[test]
fn currents_with_their_constants_have_the_verdict_of_the_torques_that_they_make() {
    let [torques, currents] = [false, true].map(diagnosed);
    assert_eq!(torques.verdict.effects, ["payload"], "{:?}", torques.verdict);
    assert_eq!((currents.verdict.kind, &currents.verdict.effects), (torques.verdict.kind, &torques.verdict.effects));
    let mass = |found: &Diagnosis| -> f64 {
        let load = found.theta.effects.iter().find(|effect| effect.name == "payload").expect("a load");
        load.parameters["mass"].as_float().expect("a mass")
    };
    assert!((mass(&torques) - 0.8).abs() < 0.05, "{}", mass(&torques));
    assert!((mass(&currents) - mass(&torques)).abs() < 1e-3, "{} {}", mass(&currents), mass(&torques));
}
