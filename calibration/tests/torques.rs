//! `diagnose --torques` on a log of motor currents: what cell.toml says that an ampere is worth is worth it there as well.

use calibration::diagnose::{Diagnosis, Options, diagnose};
use calibration::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::recording::{ClipInfo, ClipWriter, Session};
use shared_mem::theta::Theta;
use std::path::Path;
use twin::control::Drive;
use twin::effects::{Role, Shape, Stage, registry};
use twin::sim::SimCell;

/// Clips, and control periods of each.
const CLIPS: u32 = 4;
const PERIODS: u64 = 1500;
/// Control periods in which the arm comes to rest before a clip.
const STILL: u64 = 500;
/// What a diagnosis may find here; all others are known to rest.
const CANDIDATES: [&str; 3] = ["payload", "torque_gain", "joint_viscous_friction"];
/// A load that cell.toml does not know.
const HIDDEN: &str = "[[effect]]\nname = \"payload\"\nmass = 0.8\ncentre = [0.0, 0.0, 0.05]\n";
/// Torque at the joint over the current of its motor [N m/A].
const CONSTANTS: [f64; 7] = [2.0, 4.0, 0.5, 3.0, 1.25, 0.75, 8.0];

/// A session of an arm alone that swings with three sines a joint, different ones in each clip; with torques, or with the currents that
/// make them.
fn session(folder: &Path, currents: bool) {
    let lab =
        Cell::parse(include_str!("../../config/fr3_cell.toml"), Path::new("cell.toml")).expect("the shipped cell");
    let mut alone = Cell { objects: Vec::new(), ..lab };
    let hidden: Theta = shared_mem::toml_file::parse(HIDDEN, Path::new("hidden.toml")).expect("a theta");
    let worth = if currents { CONSTANTS } else { [1.0; 7] };
    let mut entries = String::new();
    for number in 0..CLIPS {
        let file = format!("clip_{number:02}.mcap");
        let mut twin = SimCell::new(&alone, Some(&hidden)).expect("a cell");
        let mut writer = ClipWriter::create(&folder.join(&file), &ClipInfo::default()).expect("a file");
        let mut state = ArmState::default();
        twin.read(&mut state);
        let home = state.q;
        (0..STILL).for_each(|_| twin.step(&Drive::JointImpedance { q_d: home, dq_d: [0.0; 8] }));
        twin.read(&mut state);
        for tick in 0..PERIODS {
            let (mut q_d, mut dq_d) = (home, [0.0; 8]);
            let t = tick as f64 * 1e-3;
            for joint in 0..7 {
                for wave in 0..3 {
                    let omega = 2.0 + 1.7 * f64::from(wave) + 0.37 * joint as f64 + 0.53 * f64::from(number);
                    q_d[joint] += 0.05 * (1.0 - (omega * t).cos());
                    dq_d[joint] += 0.05 * omega * (omega * t).sin();
                }
            }
            (state.q_d, state.dq_d) = (q_d, dq_d);
            (state.stamp_ns, state.cycle) = (1_000_000_000_000 + tick * 1_000_000, tick);
            state.tau_J.iter_mut().zip(worth).for_each(|(torque, worth)| *torque /= worth);
            writer.arm_state(&state).expect("room");
            twin.step(&Drive::JointImpedance { q_d, dq_d });
            twin.read(&mut state);
        }
        writer.finish().expect("room");
        entries += &format!("\n[[clip]]\nfile = \"{file}\"\nkind = \"excitation\"\n");
    }
    if currents {
        alone.controller.as_mut().expect("a controller").torque_constant = CONSTANTS.to_vec();
    }
    std::fs::write(folder.join("cell.toml"), alone.to_toml() + &entries).expect("room");
}

/// The diagnosis among the candidates: each effect more costs a test time.
fn diagnosed(currents: bool) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    session(folder.path(), currents);
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
    let session = Session::open(folder.path()).expect("a session");
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
