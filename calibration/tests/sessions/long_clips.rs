//! Clips of a minute, of which the arm moves for a few seconds: what counts is where it moves, and the verdict is the same.

use calibration::diagnose::{Kind, Options, diagnose_clips};
use inference::admit::Admitted;
use inference::admit::length::liveliest;
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, JointSeries, Session, SessionFiles};
use shared_mem::theta::{EffectTheta, Theta};
use std::path::Path;
use worlds::session::record;
use worlds::world::{Fault, Kind as Motion, World};

/// Two joints, which are simulated several times faster than the arm of the shipped cell.
const CELL: &str = "[robot]\njoints = [\"shoulder\", \"elbow\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [600.0, 400.0]\n\
    damping = [25.0, 12.0]\nrotor_inertia = [0.3, 0.1]\n";

/// The arm stands on until a minute is over, seen every ten milliseconds.
fn stands(mut series: JointSeries) -> JointSeries {
    let (first, rows) = (series.stamps_ns[0], series.len());
    let end =
        |values: &[f64]| if values.is_empty() { Vec::new() } else { values[values.len() - series.dof..].to_vec() };
    let (q, dq, tau) = (end(&series.q), vec![0.0; end(&series.dq).len()], end(&series.tau));
    for stamp in (series.stamps_ns[rows - 1]..first + 60_000_000_000).step_by(10_000_000).skip(1) {
        series.stamps_ns.push(stamp);
        series.q.extend(&q);
        series.dq.extend(&dq);
        series.tau.extend(&tau);
    }
    series
}

#[test]
fn a_late_command_is_named_out_of_clips_of_a_minute() {
    let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
    let well = World::draw(3, Motion::Excitation, Fault::Nothing, &cell);
    let parameters = [("delay".to_owned(), 8e-3.into())].into();
    let late = EffectTheta { name: "command_delay".into(), parameters };
    let world = World { hidden: Theta { effects: vec![late], ..well.hidden.clone() }, ..well };
    let mut clips: Vec<Clip> = record(&world, 8).expect("a session");
    for clip in &mut clips {
        (clip.desired, clip.measured) = (stands(clip.desired.clone()), stands(clip.measured.clone()));
        assert!((59.9..60.1).contains(&clip.measured.duration()));
    }
    let said = liveliest(&mut clips).expect("they are long");
    assert!(said.contains("of 8 long clips the 12.0 s") && said.contains("96 s of 480 s"), "{said}");
    // As few as are diagnosed: eight take twice as long and say the same.
    clips.truncate(4);
    let files = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    let cell = world.cell.clone();
    let session = Session { folder: "minutes".into(), cell, clips: Vec::new(), files: SessionFiles::default() };
    let admitted = Admitted::of(clips, files, false);
    let found = diagnose_clips(&session, &admitted, &Options::default(), &Interrupt::default()).expect("a diagnosis");
    // A lag looks like it in a few seconds of so stiff an arm.
    assert!(matches!(found.verdict.kind, Kind::Named | Kind::Class), "{:?}", found.verdict);
    assert_eq!(found.verdict.effects[0], "command_delay", "{:?}", found.verdict);
    assert!(found.gap.shrink.value > 0.9, "{:?}", found.gap);
}
