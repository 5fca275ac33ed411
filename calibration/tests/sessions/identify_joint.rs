//! Pushes of a laptop's lid as clips of poses: what is found of its hinge, and what is said where there is nothing to find.

use crate::pushes::{DAMPING, FRICTION, LAPTOP, session};
use calibration::identify::{Identification, joint};
use inference::interrupt::Interrupt;
use std::fs;
use std::path::Path;
use twin::arm::UrdfBody;

fn identify(session: &Path, out: Option<&Path>) -> Result<Identification, String> {
    let (session, out) = (session.to_owned(), out.map(Path::to_owned));
    let options = joint::Options { session, out, ..joint::Options::default() };
    joint::identify(&options, &Interrupt::default()).map_err(|error| error.to_string())
}

#[test]
fn a_hinge_is_found_from_three_pushes_and_written_into_its_urdf() {
    let folder = session(&[3.0, 4.0, 5.0]);
    let out = folder.path().join("found.urdf");
    let found = identify(folder.path(), Some(&out)).expect("an answer");
    for (name, truth) in [("dry_friction", FRICTION), ("viscous_friction", DAMPING)] {
        let parameter = &found.parameters[name];
        let [low, high] = parameter.ci95[0];
        assert!((low..=high).contains(&truth), "{name}: {parameter:?}");
        assert!((parameter.value[0] / truth - 1.0).abs() < 0.1 && high - low < 0.5 * truth, "{name}: {parameter:?}");
    }
    assert!(found.not_identifiable.is_empty(), "{:?}", found.not_identifiable);
    let [before, after] = [found.gap.holdout_before, found.gap.holdout].map(|gap| gap.joint_rms_rad.expect("an error"));
    assert!(after < 4e-3 && before > 10.0 * after, "{before} {after}");
    let text = fs::read_to_string(&out).expect("it is written");
    assert!(text.contains("<!-- out of a scan -->") && text.len() < LAPTOP.len() + 60, "{text}");
    let written = UrdfBody::of(&text, &out).expect("a URDF")[1].joint.clone().expect("a hinge");
    assert_eq!(
        [written.friction, written.damping],
        ["dry_friction", "viscous_friction"].map(|name| found.parameters[name].value[0])
    );
    let page = calibration::report::identification::page(&found);
    assert!(page.contains("push_1") && page.contains("held out in turn"), "a page");
}

#[test]
fn sessions_without_a_motion_or_without_poses_say_what_is_missing() {
    let still = session(&[0.0, 0.0]);
    let why = identify(still.path(), None).expect_err("nothing moves");
    assert!(why.contains("`laptop_lid`") && why.contains("let go") && !why.contains('\n'), "{why}");
    let cell = fs::read_to_string(still.path().join("cell.toml")).expect("a cell.toml");
    fs::write(still.path().join("cell.toml"), cell.replace("\"laptop\"", "\"screen\"")).expect("room");
    let why = identify(still.path(), None).expect_err("no poses");
    assert!(why.contains("/object/screen/pose") && !why.contains('\n'), "{why}");
}
