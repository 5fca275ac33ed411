//! An object that slides by itself, no robot: what the table does to it is named, and nothing where nothing is wrong.

use crate::slides;
use calibration::diagnose::{Diagnosis, Kind, Options, diagnose_clips};
use inference::interrupt::Interrupt;

fn diagnosed(hidden: &str) -> Diagnosis {
    let (session, admitted) = slides::session(hidden);
    diagnose_clips(&session, &admitted, &Options::default(), &Interrupt::default()).expect("a diagnosis")
}

#[test]
fn a_table_that_leans_is_named_from_slides_alone() {
    let found = diagnosed("[object]\nfriction = 0.25\n[[effect]]\nname = \"table_tilt\"\ntilt = [0.0, 0.05]\n");
    let verdict = &found.verdict;
    assert!(
        matches!(verdict.kind, Kind::Named | Kind::Class)
            && verdict.effects.iter().any(|effect| effect == "table_tilt"),
        "{verdict:?}"
    );
    assert!(found.stage_test.is_none(), "no arm");
}

#[test]
fn slides_in_which_nothing_is_wrong_name_nothing_and_tell_the_friction() {
    let found = diagnosed("[object]\nfriction = 0.25\n");
    assert!(found.verdict.kind == Kind::None, "{:?}", found.verdict);
    let friction = found.theta.object.and_then(|object| object.friction).expect("friction");
    assert!((friction / 0.25 - 1.0).abs() < 0.03, "{friction}");
}
