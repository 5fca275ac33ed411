//! Whole sessions of pushes: what is answered of a hinge that is known, and what is said besides.

use super::{Options, identify};
use crate::answer::identification::Identification;
use crate::identify::test_pushes::{DAMPING, FRICTION, session, session_of};
use inference::interrupt::Interrupt;
use std::path::Path;
use std::sync::LazyLock;

static FOUND: LazyLock<Identification> = LazyLock::new(|| answer(session(&[3.0, 4.0, 5.0]).path()));

fn options(session: &Path) -> Options {
    Options { session: session.to_owned(), ..Options::default() }
}

fn answer(session: &Path) -> Identification {
    identify(&options(session), &Interrupt::default()).expect("an answer")
}

fn says(found: &Identification, what: &str) -> bool {
    found.warnings.iter().any(|warning| warning.contains(what))
}

#[test]
fn figures_are_of_every_push_held_out_in_turn_and_the_trace_is_what_is_left() {
    assert_eq!(
        (FOUND.target.as_str(), FOUND.joint.as_deref(), FOUND.object.as_deref()),
        ("joint", Some("hinge"), Some("laptop"))
    );
    assert_eq!((FOUND.clips.train.len(), FOUND.clips.holdout.len()), (3, 3));
    assert!(
        FOUND
            .by_clip
            .iter()
            .all(|clip| clip.used == "held out in turn" && clip.warnings[0].starts_with("moves by itself"))
    );
    let rms = |off: &[[f64; 2]]| (off.iter().map(|[_, off]| off * off).sum::<f64>() / off.len() as f64).sqrt();
    let (mut sum, mut rows) = (0.0, 0);
    for trace in &FOUND.traces {
        assert!(FOUND.clips.train.contains(&trace.clip) && trace.channel == "hinge" && trace.unit == "rad");
        assert!(rms(&trace.after) < 2.0 * trace.sigma && rms(&trace.before) > 5.0 * rms(&trace.after));
        sum += rms(&trace.after).powi(2) * trace.after.len() as f64;
        rows += trace.after.len();
    }
    // Of all that was fitted the figure is the root mean square of all rows.
    let fitted = FOUND.gap.train.joint_rms_rad.expect("a figure");
    assert!(((sum / rows as f64).sqrt() / fitted - 1.0).abs() < 1e-6, "{fitted}");
    assert!(FOUND.gap.holdout.joint_rms_rad.expect("a figure") >= fitted && FOUND.gap.train.joint_rms_m.is_none());
    assert_eq!(FOUND.names, ["dry_friction", "viscous_friction"]);
    assert!((FOUND.correlation[0][1] - FOUND.correlation[1][0]).abs() < 1e-9 && FOUND.correlation[0][1] < 0.0);
    assert!(FOUND.misfit < 2.0, "{}", FOUND.misfit);
    assert_eq!(FOUND.witnesses, 5 * FOUND.traces.len());
    assert!(says(&FOUND, "in proportion to the inertia that the URDF gives `laptop_lid`"), "{:?}", FOUND.warnings);
}

#[test]
fn intervals_hold_the_numbers_of_hinges_of_several_kinds() {
    let mut inside = 0;
    for (friction, damping) in [(0.03, 0.02), (0.08, 0.006)] {
        let pushes = [3.0, 4.0, 5.0].map(|speed| (speed, [friction, damping]));
        let found = answer(session_of(&pushes).path());
        for (name, truth) in [("dry_friction", friction), ("viscous_friction", damping)] {
            let parameter = &found.parameters[name];
            let [low, high] = parameter.ci95[0];
            inside += u32::from((low..=high).contains(&truth));
            assert!(parameter.start == [0.0] && parameter.single, "{parameter:?}");
        }
    }
    assert!(inside >= 3, "{inside} of 4");
    assert_eq!(FOUND.parameters["viscous_friction"].unit, "N m s/rad");
}

#[test]
fn a_push_that_met_another_friction_is_left_out_by_name() {
    let alike = [FRICTION, DAMPING];
    let pushes = [(3.0, alike), (4.0, [3.0 * FRICTION, DAMPING]), (5.0, alike), (4.5, alike)];
    let found = answer(session_of(&pushes).path());
    assert!(
        found.clips.left_out.iter().any(|out| out.file == "push_1.mcap" && out.why.contains("is left out")),
        "{:?}",
        found.clips
    );
    assert!(says(&found, "push_1.mcap") && (found.parameters["dry_friction"].value[0] / FRICTION - 1.0).abs() < 0.15);
}

#[test]
fn one_push_is_said_to_be_one_and_nothing_is_held_out_of_it() {
    let found = answer(session(&[5.0]).path());
    assert!(says(&found, "only one motion of the part"), "{:?}", found.warnings);
    assert!(found.gap.holdout.joint_rms_rad.is_none() && found.clips.holdout.is_empty());
    assert_eq!(found.by_clip[0].used, "fitted");
    let two = answer(session(&[4.0, 5.0]).path());
    assert!(says(&two, "only 2 motions") && two.gap.holdout.joint_rms_rad.is_some());
    assert!(two.parameters["dry_friction"].ci95[0][1] > FOUND.parameters["dry_friction"].value[0]);
}

#[test]
fn refusals_name_the_session_the_part_and_the_remedy() {
    let still = session(&[0.0]);
    let refused = identify(&options(still.path()), &Interrupt::default()).expect_err("nothing moves").to_string();
    assert!(refused.contains("`laptop_lid`") && refused.contains("let go") && !refused.contains('\n'), "{refused}");
    let folder = session(&[4.0]);
    let of = |change: &dyn Fn(&mut Options)| {
        let mut options = options(folder.path());
        change(&mut options);
        identify(&options, &Interrupt::default()).expect_err("a refusal").to_string()
    };
    assert!(of(&|options| options.joint = Some("knob".into())).contains("there are hinge"));
    assert!(of(&|options| options.object = Some("desk".into())).contains("there are laptop"));
    assert!(of(&|options| options.session = "/nowhere".into()).contains("/nowhere"));
    let interrupt = Interrupt::default();
    interrupt.ask();
    let ended = identify(&options(folder.path()), &interrupt).expect_err("it was asked to end").to_string();
    assert!(ended.contains("interrupted"), "{ended}");
}
