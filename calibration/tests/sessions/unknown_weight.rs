//! Arms of which no masses are known have weight all the same: it is identified with the gains, and what it leaves at rest is not
//! taken for a cause.

use calibration::diagnose::{Diagnosis, Kind, Options, diagnose_clips};
use calibration::identify::arm;
use inference::admit::Admitted;
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::recording::{Session, SessionFiles};
use shared_mem::theta::Theta;
use std::path::Path;
use worlds::session::record;
use worlds::world::{Fault, Kind as Motion, World};

const CELL: &str = "[robot]\njoints = [\"shoulder\", \"elbow\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [30.0, 20.0]\n\
    damping = [3.0, 2.0]\nrotor_inertia = [0.3, 0.1]\n";
const WEIGHT: &str =
    "[[effect]]\nname = \"joint_weight\"\nconstant = [0.1, 0.0]\nsine = [1.8, 0.9]\ncosine = [-0.6, 0.3]\n";
const FRICTION: &str = "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.3, 0.2]\ncreep = 0.002\n";
const CLIPS: usize = 8;

/// A world in which these effects act.
fn world(hidden: &str) -> World {
    let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
    let mut world = World::draw(1, Motion::Excitation, Fault::Nothing, &cell);
    let hidden: Theta = shared_mem::toml_file::parse(hidden, Path::new("theta.toml")).expect("a theta.toml");
    world.hidden.effects = hidden.effects;
    world
}

fn diagnosed(hidden: &str) -> Diagnosis {
    let folder = Path::new("made");
    let files = SessionFiles { session: folder.into(), cell: None };
    let world = world(hidden);
    let clips = record(&world, CLIPS).expect("clips");
    let session = Session { cell: world.cell, clips: Vec::new(), folder: folder.into(), files };
    let files = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    let admitted = Admitted::of(clips, files, false);
    diagnose_clips(&session, &admitted, &Options::default(), &Interrupt::default()).expect("an answer")
}

#[test]
fn gains_and_weight_come_out_together() {
    let world = world(WEIGHT);
    let clips = record(&world, CLIPS).expect("clips");
    let found = arm::identify_clips(&world.cell, clips, &arm::Options::default(), &Interrupt::default())
        .expect("an identification");
    let gains = world.hidden.arm.expect("gains");
    let [stiffness, damping] = [gains.stiffness, gains.damping].map(|gains| [gains[0], gains[1]]);
    for (name, truth) in [
        ("stiffness", stiffness),
        ("damping", damping),
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
