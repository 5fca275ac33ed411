//! Arms of which no masses are known have weight all the same: it is identified with the gains, and what it leaves at rest is not
//! taken for a cause.

use calibration::diagnose::clips::admit::Admitted;
use calibration::diagnose::{Diagnosis, Kind, Options, diagnose_clips};
use calibration::identify::arm;
use calibration::interrupt::Interrupt;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, JointSeries, ObjectSeries, Session, SessionFiles};
use shared_mem::theta::Theta;
use std::path::Path;
use twin::arm::{ArmModel, ControlLaw, JointState};
use twin::control::{ArmRollout, CommandTrack};
use twin::effects::Effects;

const CELL: &str = "[robot]\njoints = [\"shoulder\", \"elbow\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [30.0, 20.0]\n\
    damping = [3.0, 2.0]\nrotor_inertia = [0.3, 0.1]\n";
const WEIGHT: &str =
    "[[effect]]\nname = \"joint_weight\"\nconstant = [0.1, 0.0]\nsine = [1.8, 0.9]\ncosine = [-0.6, 0.3]\n";
const FRICTION: &str = "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.3, 0.2]\ncreep = 0.002\n";
const DOF: usize = 2;
const TICKS: u64 = 3000;

fn cell() -> Cell {
    Cell::parse(CELL, Path::new("cell.toml")).expect("a cell")
}

/// What the arm does under its law with gains that are 10 % off those of cell.toml; `seed` draws the motion.
fn clip(cell: &Cell, hidden: &str, seed: u64) -> Clip {
    let model = ArmModel::from_cell(cell).expect("two joints");
    let gains = "[arm]\nstiffness = [33.0, 18.0]\ndamping = [2.8, 2.1]\n";
    let truth: Theta =
        shared_mem::toml_file::parse(&format!("{gains}{hidden}"), Path::new("theta.toml")).expect("a theta.toml");
    let law = ControlLaw::new(cell.controller.as_ref(), truth.arm.as_ref(), &model).expect("gains");
    let effects = Effects::from_theta(&truth.effects, DOF).expect("known effects");
    let stamps_ns: Vec<u64> = (1..=TICKS).map(|tick| tick * 1_000_000).collect();
    let swing = |stamp: u64, joint: usize, of: fn(f64) -> f64, power: i32| -> f64 {
        let (t, faster) = (stamp as f64 * 1e-9, 1.0 + 0.13 * seed as f64 + 0.4 * joint as f64);
        [1.1, 2.7, 4.3].iter().map(|w| w * faster).map(|w| 0.35 * w.powi(power) * of(w * t + seed as f64)).sum()
    };
    let rows = |of: fn(f64) -> f64, power| -> Vec<f64> {
        let row = |stamp: &u64| [swing(*stamp, 0, of, power), swing(*stamp, 1, of, power)];
        stamps_ns.iter().flat_map(row).collect()
    };
    let desired = JointSeries {
        dof: DOF,
        q: rows(f64::sin, 0),
        dq: rows(f64::cos, 1),
        tau: Vec::new(),
        stamps_ns: stamps_ns.clone(),
    };
    let commands = CommandTrack::new(&desired).expect("commands");
    let arm = effects.arm.real_arm(&model);
    let rollout = ArmRollout { arm: &arm, nominal: &model, law: &law, effects: Some(&effects.arm), parts: 2 };
    let mut start = JointState::default();
    start.q[..DOF].copy_from_slice(&desired.q[..DOF]);
    start.dq[..DOF].copy_from_slice(&desired.dq[..DOF]);
    let mut states = vec![JointState::default(); stamps_ns.len()];
    rollout.run(&start, stamps_ns[0], &commands, &stamps_ns, &mut states);
    let noise = |row: usize, joint: usize| 1e-6 * (1e4 * (2 * row + joint) as f64 + seed as f64).sin();
    let measured = JointSeries {
        q: (states.iter().enumerate())
            .flat_map(|(row, state)| [0, 1].map(|joint| state.q[joint] + noise(row, joint)))
            .collect(),
        dq: Vec::new(),
        ..desired.clone()
    };
    Clip {
        others: Vec::new(),
        file: format!("swing_{seed}.mcap").into(),
        kind: ClipKind::Excitation,
        joint_names: vec!["shoulder".into(), "elbow".into()],
        desired,
        measured,
        torques_end_at_rows: true,
        object: ObjectSeries::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

fn clips(hidden: &str) -> Vec<Clip> {
    (0..8).map(|seed| clip(&cell(), hidden, seed)).collect()
}

fn diagnosed(hidden: &str) -> Diagnosis {
    let folder = Path::new("made");
    let files = SessionFiles { session: folder.into(), cell: None };
    let session = Session { cell: cell(), clips: Vec::new(), folder: folder.into(), files };
    let clips = clips(hidden);
    let files = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    let admitted = Admitted::of(clips, files, false);
    diagnose_clips(&session, &admitted, &Options::default(), &Interrupt::default()).expect("an answer")
}

#[test]
fn gains_and_weight_come_out_together() {
    let found = arm::identify_clips(&cell(), clips(WEIGHT), &arm::Options::default(), &Interrupt::default())
        .expect("an identification");
    for (name, truth) in [
        ("stiffness", [33.0, 18.0]),
        ("damping", [2.8, 2.1]),
        ("joint_weight.sine", [1.8, 0.9]),
        ("joint_weight.cosine", [-0.6, 0.3]),
    ] {
        let values = &found.parameters[name].value;
        let near = values.iter().zip(truth).all(|(value, truth)| (value - truth).abs() < 0.02 * truth.abs());
        assert!(near, "{name}: {values:?} are not {truth:?}");
    }
}

#[test]
fn weight_is_no_cause_and_hides_none() {
    let nothing = diagnosed(WEIGHT);
    assert_eq!(nothing.verdict.kind, Kind::None, "{}", nothing.verdict.text);
    assert!(nothing.candidates.iter().all(|candidate| candidate.effect != "joint_weight"));
    let friction = diagnosed(&format!("{WEIGHT}{FRICTION}"));
    assert_eq!(friction.verdict.kind, Kind::Named, "{}", friction.verdict.text);
    assert_eq!(friction.verdict.effects, ["joint_coulomb_friction"]);
}
