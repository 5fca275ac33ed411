//! What cannot be identified is refused by name, in one line, with the remedy; what can be used of the rest is.

use super::test_servo::{self, DOF, Swing, gains};
use super::{Identification, IdentifyError, Options, arm, object, test_slides};
use inference::interrupt::Interrupt;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};

fn servo() -> Cell {
    test_servo::cell("joint_impedance")
}

fn swing(seed: u64) -> Clip {
    let speeds = [4.0 + 0.5 * seed as f64, 6.0 + 0.6 * seed as f64];
    test_servo::clip(
        &servo(),
        &gains([33.0, 18.0], [2.6, 2.2]),
        &Swing { speeds, seed, noise: 2e-5, ..Swing::default() },
    )
}

fn of_arm(cell: &Cell, clips: Vec<Clip>) -> Result<Identification, IdentifyError> {
    arm::identify_clips(cell, clips, &Options::default(), &Interrupt::default())
}

fn of_object(cell: &Cell, clips: Vec<Clip>) -> Result<Identification, IdentifyError> {
    object::identify_clips(cell, clips, &Options::default(), &Interrupt::default())
}

fn slid(count: usize) -> (Cell, Vec<Clip>) {
    let (session, admitted) = test_slides::session("[object]\nfriction = 0.25\n");
    (session.cell, admitted.clips.into_iter().take(count).collect())
}

/// The words of an error, which are one line.
fn why(found: Result<Identification, IdentifyError>) -> String {
    let why = found.expect_err("a refusal").to_string();
    assert!(!why.contains('\n') && !why.is_empty(), "{why}");
    why
}

#[test]
fn a_cell_without_an_arm_or_without_an_object_says_which_block_is_missing() {
    let lawless = Cell { controller: None, ..servo() };
    let (alone, slides) = slid(2);
    for (cell, block) in [(&alone, "[robot]"), (&lawless, "[controller]")] {
        let refused = of_arm(cell, vec![swing(0)]);
        assert!(matches!(&refused, Err(IdentifyError::NoArm(missing)) if *missing == block));
        assert!(why(refused).contains(block));
    }
    let refused = of_object(&servo(), slides);
    assert!(matches!(refused, Err(IdentifyError::NoObject)));
    assert!(why(refused).contains("[object]"));
}

#[test]
fn a_session_without_clips_says_what_it_lists_none_of() {
    for (refused, target) in [(of_arm(&servo(), Vec::new()), "arm"), (of_object(&slid(0).0, Vec::new()), "object")] {
        assert!(matches!(&refused, Err(IdentifyError::NoClip { target: said, .. }) if *said == target));
        assert!(why(refused).contains("lists none with an"), "{target}");
    }
}

/// A clip of the arm with a fault, and what is said of it.
fn faults() -> Vec<(Clip, &'static str)> {
    let whole = swing(1);
    let of = |change: &dyn Fn(&mut Clip)| {
        let mut clip = whole.clone();
        change(&mut clip);
        clip
    };
    let cut = |clip: &mut Clip, rows: usize| clip.measured = clip.measured.select_rows(&(0..rows).collect::<Vec<_>>());
    let every = |clip: &mut Clip, n: usize| {
        clip.measured = clip.measured.select_rows(&(0..clip.measured.len()).step_by(n).collect::<Vec<_>>());
    };
    vec![
        (of(&|clip| clip.measured = JointSeries { dof: DOF, ..JointSeries::default() }), "no measured joints"),
        (of(&|clip| clip.desired = JointSeries { dof: DOF, ..JointSeries::default() }), "no commands"),
        (of(&|clip| cut(clip, 300)), "at least 0.5 s"),
        (of(&|clip| every(clip, 50)), "logged at 20 Hz"),
        (of(&|clip| clip.joint_names = vec!["elbow".into(), "wrist".into()]), "elbow"),
        (of(&|clip| clip.desired.stamps_ns.iter_mut().for_each(|stamp| *stamp += 60_000_000_000)), "do not overlap"),
        (
            of(&|clip| clip.measured.q.chunks_exact_mut(DOF).for_each(|row| row.copy_from_slice(&[0.3, 0.3]))),
            "no joint moves",
        ),
    ]
}

#[test]
fn a_clip_that_cannot_be_used_is_named_with_its_reason_and_the_others_are_used() {
    for (clip, said) in faults() {
        let refused = why(of_arm(&servo(), vec![clip.clone()]));
        assert!(refused.contains("no clip can be used for the arm") && refused.contains(said), "{said}: {refused}");
        let named = Clip { file: "faulty.mcap".into(), ..clip };
        let found = of_arm(&servo(), vec![swing(0), named, swing(2)]).expect("an answer");
        let [left_out] = &found.clips.left_out[..] else { panic!("{said}: {:?}", found.clips) };
        assert!(left_out.file == "faulty.mcap" && left_out.why.contains(said), "{left_out:?}");
        assert!(found.warnings.iter().any(|warning| warning.starts_with("1 of 3 clips were left out")));
        assert!((found.parameters["stiffness"].value[0] / 33.0 - 1.0).abs() < 0.02);
    }
}

#[test]
fn readings_that_are_no_numbers_are_an_error_and_no_answer() {
    let mut clip = swing(0);
    clip.measured.q[500 * DOF] = f64::NAN;
    let refused = of_arm(&servo(), vec![clip, swing(1)]);
    assert!(
        matches!(refused, Err(IdentifyError::Impossible(_) | IdentifyError::NoClip { .. })),
        "{:?}",
        refused.map(|f| f.parameters)
    );
}

#[test]
fn an_effect_of_another_place_and_a_file_that_is_not_there_are_refused_by_name() {
    let ask = |options: Options| why(arm::identify_clips(&servo(), vec![swing(0)], &options, &Interrupt::default()));
    for name in ["table_tilt", "camera_latency", "nonsense"] {
        let said = ask(Options { also: vec![name.into()], ..Options::default() });
        assert!(said.contains(&format!("--also {name}")) && said.contains("command_delay"), "{said}");
    }
    let said = ask(Options { parameters: Some("/nowhere/theta.toml".into()), ..Options::default() });
    assert!(said.contains("/nowhere/theta.toml"), "{said}");
    let nowhere = Options { session: "/nowhere".into(), ..Options::default() };
    for found in [arm::identify(&nowhere, &Interrupt::default()), object::identify(&nowhere, &Interrupt::default())] {
        assert!(matches!(&found, Err(IdentifyError::Read(_))));
        assert!(why(found).contains("/nowhere"));
    }
}

#[test]
fn gains_under_which_no_arm_stays_are_said_to_be_what_cannot_be_simulated() {
    let mut wild = servo();
    let law = wild.controller.as_mut().expect("a controller");
    // Motors without a limit: else the joint shakes within it.
    (law.damping, law.torque_limit) = (vec![3000.0, 2.0], Vec::new());
    let said = why(of_arm(&wild, vec![swing(0), swing(1)]));
    assert!(said.contains("damping") && said.contains("cell.toml"), "{said}");
}

#[test]
fn work_that_is_asked_to_end_ends_without_an_answer() {
    let interrupt = Interrupt::default();
    interrupt.ask();
    let (cell, slides) = slid(3);
    let options = Options::default();
    let all = [
        arm::identify_clips(&servo(), vec![swing(0)], &options, &interrupt),
        object::identify_clips(&cell, slides, &options, &interrupt),
    ];
    let ended = |found: &Result<Identification, IdentifyError>| {
        found.as_ref().is_ok_and(|found| !found.converged)
            || found.as_ref().is_err_and(|why| why.to_string().contains("interrupted"))
    };
    assert!(all.iter().all(ended), "{:?}", all.map(|found| found.map(|found| found.warnings)));
}

/// A slide with a fault, and what is said of it.
fn lost() -> Vec<(Clip, &'static str)> {
    let whole = slid(1).1.swap_remove(0);
    let of = |change: &dyn Fn(&mut ObjectSeries)| {
        let mut clip = whole.clone();
        change(&mut clip.object);
        clip
    };
    let cut = |series: &mut ObjectSeries, poses: usize| {
        series.stamps_ns.truncate(poses);
        series.poses.truncate(poses);
    };
    let moved = |series: &mut ObjectSeries, from: usize, by: [f64; 3]| {
        for pose in series.poses.iter_mut().skip(from) {
            let there = nalgebra::Translation3::from(by) * pose.isometry();
            *pose = shared_mem::frames::Pose::from_isometry(there);
        }
    };
    vec![
        (of(&|series| cut(series, 0)), "0 object poses"),
        (of(&|series| cut(series, 7)), "7 object poses"),
        (of(&|series| moved(series, 0, [800.0, 0.0, 0.0])), "in metres"),
        (of(&|series| moved(series, 50, [0.0, 0.4, 0.0])), "lost the object"),
        (of(&|series| moved(series, 0, [0.0, 0.0, -0.3])), "below the table"),
    ]
}

#[test]
fn a_slide_that_cannot_be_used_is_named_with_its_reason_and_the_others_are_used() {
    for (clip, said) in lost() {
        let (cell, slides) = slid(3);
        let refused = why(of_object(&cell, vec![clip.clone()]));
        assert!(refused.contains("no clip can be used for the object") && refused.contains(said), "{said}: {refused}");
        let named = Clip { file: "faulty.mcap".into(), ..clip };
        let material = [&slides[1..], std::slice::from_ref(&named)].concat();
        let found = of_object(&cell, material).expect("an answer");
        let [left_out] = &found.clips.left_out[..] else { panic!("{said}: {:?}", found.clips) };
        assert!(left_out.file == "faulty.mcap" && left_out.why.contains(said), "{left_out:?}");
    }
}

#[test]
fn poses_that_are_no_numbers_are_an_error_or_left_out_and_no_answer() {
    let (cell, mut slides) = slid(3);
    for clip in &mut slides {
        let away = nalgebra::Isometry3::translation(f64::NAN, 0.0, 0.0);
        clip.object.poses[40] = shared_mem::frames::Pose::from_isometry(away);
    }
    assert!(of_object(&cell, slides).is_err_and(|why| !why.to_string().contains('\n')));
}

#[test]
fn an_arm_alone_says_nothing_of_an_object_and_an_object_alone_nothing_of_an_arm() {
    let (cell, slides) = slid(2);
    let excitation = Clip { kind: ClipKind::Excitation, ..swing(0) };
    let refused = why(of_object(&cell, vec![excitation]));
    assert!(refused.contains("object poses"), "{refused}");
    let refused = why(of_arm(&servo(), slides));
    assert!(refused.contains("no clip can be used for the arm"), "{refused}");
}
