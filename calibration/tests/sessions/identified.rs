//! What identification says of small simulated sessions, held against what it said before (`identified.json` beside this file): values, intervals, what
//! is not identifiable, how far the twin is off. Where a change is meant, the object in `target/tmp/identified/` replaces the one of its
//! name.

use crate::arm_session::{NOISE, cell, clips, hidden};
use crate::{golden, slides};
use calibration::identify::{Identification, Options, arm, object};
use inference::interrupt::Interrupt;
use serde_json::json;
use shared_mem::recording::Clip;

const KEPT: [&str; 7] = ["parameters", "not_identifiable", "at_bounds", "names", "gap", "clips", "converged"];

fn holds(name: &str, found: &Identification) {
    let is = golden::kept(&json!(found), &KEPT);
    golden::holds(("identified", include_str!("identified.json")), name, &is);
}

fn of_an_arm(count: u64, options: &Options) -> Identification {
    let cell = cell();
    let clips = clips(&cell, &hidden(&cell, 31), count, 1.0, 31);
    arm::identify_clips(&cell, clips, options, &Interrupt::default()).expect("an answer")
}

#[test]
fn gains_of_an_arm() {
    let found = of_an_arm(3, &Options::default());
    assert!(found.gap.train.joint_rms_rad.is_some_and(|rms| rms < 2.0 * NOISE), "{:?}", found.gap);
    holds("arm", &found);
}

#[test]
fn gains_and_a_delay_that_is_not_there() {
    let options = Options { also: vec!["command_delay".into()], seed: 1, ..Options::default() };
    holds("arm_with_a_delay", &of_an_arm(2, &options));
}

fn slid() -> (shared_mem::cell::Cell, Vec<Clip>) {
    let (session, admitted) = slides::session("[object]\nfriction = 0.25\n");
    (session.cell, admitted.clips.into_iter().take(4).collect())
}

#[test]
fn friction_of_an_object_alone() {
    let (cell, clips) = slid();
    holds(
        "object_alone",
        &object::identify_clips(&cell, clips, &Options::default(), &Interrupt::default()).expect("an answer"),
    );
}

#[test]
fn any_number_of_threads_finds_the_same_bits() {
    let (cell, clips) = slid();
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let found =
            pool.install(|| object::identify_clips(&cell, clips.clone(), &Options::default(), &Interrupt::default()));
        found.expect("an answer").parameters
    };
    assert_eq!(of(1), of(3));
}
