//! What a deviation of recorded poses does to their residuals, and what of a clip counts how much.

use super::*;
use crate::likelihood::Setting;
use crate::likelihood::setting::complete;
use crate::likelihood::test_bench::{
    FRICTION, NOISE, POSE_NS, POSES, Stroke, largest, residuals, slide, slide_under, slides, sliding_cell,
};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use shared_mem::cell::GRAVITY;
use shared_mem::recording::ObjectSeries;
use shared_mem::theta::{EffectTheta, Theta};
use std::sync::LazyLock;

/// A slide that does not turn, whose first motion is read off its first poses without an error.
static SLIDE: LazyLock<Clip> = LazyLock::new(|| slide_under(&Theta::default(), 0.0, 0.0));

fn errors(clip: Clip, friction: f64) -> Vec<f64> {
    slides(NOISE, vec![clip], &[Setting::Friction]).errors(0, &[friction], &[]).expect("an answer")
}

/// The slide with its poses changed from a row on.
fn changed(change: impl Fn(usize, &Isometry3<f64>) -> Isometry3<f64>) -> Clip {
    let mut clip = SLIDE.clone();
    for (row, pose) in clip.object.poses.iter_mut().enumerate() {
        *pose = Pose::from_isometry(change(row, &pose.isometry()));
    }
    clip
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Beyond the first poses, which say how the object began to move.
    #[test]
    fn a_pose_that_is_off_is_off_by_that_measured_less_predicted_and_its_neighbours_are_not(
        row in 12..POSES, by in prop::array::uniform3(-0.01..0.01_f64), turn in prop::array::uniform3(-0.05..0.05_f64),
    ) {
        let turned = UnitQuaternion::from_scaled_axis(turn.into());
        let clip = changed(|at, pose| {
            let there = Isometry3::from_parts((pose.translation.vector + Vector3::from(by)).into(), turned * pose.rotation);
            if at == row { there } else { *pose }
        });
        // At the truth, where nothing else turns it.
        let [before, after] = [SLIDE.clone(), clip].map(|clip| errors(clip, FRICTION));
        for at in 0..POSES {
            for axis in 0..3 {
                let [expected, about] = if at == row { [by[axis], turn[axis]] } else { [0.0; 2] };
                let moved = |k: usize| after[6 * at + k] - before[6 * at + k];
                prop_assert!((moved(axis) - expected).abs() < 1e-12, "{at} {axis}: {}", moved(axis));
                prop_assert!((moved(3 + axis) - about).abs() < 2e-3 * about.abs() + 2e-5, "{at} about {axis}: {}", moved(3 + axis));
            }
        }
    }

    /// A level table knows no direction and no place.
    #[test]
    fn a_slide_elsewhere_in_another_heading_leaves_the_same_errors_turned(
        heading in -3.0..3.0_f64, place in prop::array::uniform2(-0.5..0.5_f64),
    ) {
        let turn = Isometry3::from_parts(
            Translation3::new(place[0], place[1], 0.0), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading),
        );
        let [here, there] = [SLIDE.clone(), changed(|_, pose| turn * pose)].map(|clip| errors(clip, 1.2 * FRICTION));
        for (here, there) in here.chunks_exact(3).zip(there.chunks_exact(3)) {
            let here = turn.rotation * Vector3::from_column_slice(here);
            prop_assert!((here - Vector3::from_column_slice(there)).norm() < 2e-6, "{here} {there:?}");
        }
    }

    #[test]
    fn poses_that_are_missing_leave_the_errors_of_the_others(lost in prop::collection::btree_set(12..POSES - 1, 1..25)) {
        let kept: Vec<usize> = (0..POSES).filter(|row| !lost.contains(row)).collect();
        let object = ObjectSeries {
            stamps_ns: kept.iter().map(|row| SLIDE.object.stamps_ns[*row]).collect(),
            poses: kept.iter().map(|row| SLIDE.object.poses[*row]).collect(),
        };
        let [all, some] = [SLIDE.clone(), Clip { object, ..SLIDE.clone() }].map(|clip| errors(clip, 1.2 * FRICTION));
        for (place, row) in kept.iter().enumerate() {
            prop_assert_eq!(&some[6 * place..6 * (place + 1)], &all[6 * row..6 * (row + 1)]);
        }
    }
}

#[test]
fn errors_grow_with_what_friction_is_off_by_and_lie_ahead_where_the_twin_slides_less_far() {
    for side in [-1.0, 1.0] {
        let square =
            |share: f64| errors(SLIDE.clone(), FRICTION * (1.0 + side * share)).iter().map(|e| e * e).sum::<f64>();
        let off = [0.02, 0.06, 0.12, 0.25].map(square);
        assert!(off.is_sorted_by(|a, b| a < b), "{off:?}");
        // It came to rest along its first velocity; with more friction the twin stops short of there.
        let last = errors(SLIDE.clone(), FRICTION * (1.0 + side * 0.2))[6 * (POSES - 1)];
        assert!(side * last > 1e-3, "{side}: {last}");
    }
}

#[test]
fn parts_of_a_slide_follow_each_other_and_the_object_rests_at_its_end() {
    let clips = slides(NOISE, vec![slide()], &[]);
    let parts: Vec<Part> = clips.rows(0).iter().step_by(6).map(|row| row.part).collect();
    let count = |part| parts.iter().filter(|of| **of == part).count();
    assert_eq!((parts[0], parts[POSES - 1], count(Part::Hit)), (Part::Before, Part::After, 0));
    assert!(count(Part::Slide) > 10 && count(Part::After) > 10, "{parts:?}");
    let order = |part: &Part| [Part::Before, Part::Slide, Part::After].iter().position(|of| of == part);
    assert!(parts.is_sorted_by_key(order));
    let rows = clips.rows(0);
    let channels: Vec<Channel> = rows[..6].iter().map(|row| row.channel).collect();
    assert_eq!(
        channels,
        [0, 1, 2].map(Channel::Position).into_iter().chain([0, 1, 2].map(Channel::Rotation)).collect::<Vec<_>>()
    );
    assert_eq!(rows[6].stamp_ns - rows[5].stamp_ns, POSE_NS);
}

#[test]
fn a_residual_is_an_error_over_its_trackers_noise_and_what_the_model_is_off_by() {
    let mut clips = slides(NOISE, vec![slide()], &[Setting::Friction]);
    let (position, rotation) = (2e-3, 0.02);
    let rest = PoseNoise { position, rotation };
    clips.set_model_error(ModelError { rest, ..ModelError::default() });
    let (rows, errors) = (clips.rows(0), clips.errors(0, &[0.34], &[]).expect("an answer"));
    let resting = rows.iter().filter(|row| row.part == Part::After && row.channel == Channel::Position(0)).count();
    for ((row, error), residual) in rows.iter().zip(errors).zip(residuals(&clips, 0, &[0.34], &[])) {
        let (noise, model) = match row.channel {
            Channel::Position(_) => (NOISE.position, position),
            _ => (NOISE.rotation, rotation),
        };
        // All poses of a rest share one error: it counts once, however many there are.
        let sigma = match row.part {
            Part::Before => noise,
            Part::After => noise.hypot(model * (resting as f64).sqrt()),
            Part::Hit | Part::Slide => noise.hypot(model),
        };
        assert!((residual * sigma - error).abs() < 1e-12, "{row:?}: {residual} of {error}");
    }
}

#[test]
fn a_camera_that_is_late_shows_the_object_where_it_was() {
    let latency = 0.03;
    let effect =
        EffectTheta { name: "camera_latency".into(), parameters: [("latency".to_owned(), latency.into())].into() };
    let cell = sliding_cell(NOISE);
    let base = complete(&cell, None).expect("a cell");
    let late = Theta { effects: vec![effect], ..base };
    // The same poses, stamped later by the latency.
    let mut recorded = slide();
    recorded.object.stamps_ns.iter_mut().for_each(|stamp| *stamp += 30_000_000);
    let clips = ObjectClips::new(&cell, vec![recorded], Settings::new(late, Vec::new())).expect("a cell");
    let prompt = slides(NOISE, vec![slide()], &[]);
    let [late, prompt] = [&clips, &prompt].map(|clips| clips.errors(0, &[], &[]).expect("an answer"));
    assert!(largest(late.iter().zip(&prompt).map(|(a, b)| a - b)) < 1e-9, "the first motion is the same");
}

#[test]
fn the_first_motion_and_friction_of_a_clip_move_its_path_as_they_say() {
    let clips = slides(NOISE, vec![SLIDE.clone()], &[Setting::Friction]);
    let names: Vec<String> = clips.random().random.iter().map(|random| random.name.clone()).collect();
    let own = |name: &str, value: f64| {
        let place = names.iter().position(|other| other == name).expect("a parameter of that name");
        let mut own = vec![0.0; names.len()];
        own[place] = value;
        clips.errors(0, &[FRICTION], &own).expect("an answer")
    };
    let rest = own("ln friction", 0.0);
    // It stops where its energy is spent: nearer by as much as friction is larger.
    let felt = own("ln friction", 0.1);
    let last = 6 * (POSES - 1);
    let nearer = (felt[last] - rest[last]).hypot(felt[last + 1] - rest[last + 1]);
    let stops = (0.5_f64.powi(2) + 0.2_f64.powi(2)) / (2.0 * FRICTION * GRAVITY);
    assert!((nearer / (stops * (1.0 - (-0.1_f64).exp())) - 1.0).abs() < 0.1, "{nearer} of {stops}");
    for (name, axis) in [("first velocity x", 0), ("first velocity y", 1)] {
        let faster = own(name, 0.02);
        for row in 1..5 {
            let expected = -0.02 * 0.01 * row as f64;
            let moved = faster[6 * row + axis] - rest[6 * row + axis];
            assert!((moved / expected - 1.0).abs() < 0.2, "{name} at {row}: {moved} {expected}");
        }
    }
    let spun = own("first spin z", 0.3);
    assert!(((spun[6 + 5] - rest[6 + 5]) / (-0.3 * 0.01) - 1.0).abs() < 0.2, "{}", spun[11] - rest[11]);
}

#[test]
fn objects_that_were_seen_too_seldom_say_so_and_clips_without_poses_are_left_out() {
    let cut = |poses: usize| {
        let mut clip = slide();
        clip.object.stamps_ns.truncate(poses);
        clip.object.poses.truncate(poses);
        clip
    };
    let clips = slides(NOISE, vec![cut(0), cut(2), slide()], &[]);
    assert_eq!(clips.clips(), 2);
    let why = clips.errors(0, &[], &[]).expect_err("no answer").0;
    assert!(why.contains("too few poses"), "{why}");
    assert!(clips.errors(1, &[], &[]).is_ok());
    let lost = changed(|row, pose| if row == 30 { Translation3::new(f64::NAN, 0.0, 0.0) * pose } else { *pose });
    assert!(slides(NOISE, vec![lost], &[]).errors(0, &[], &[]).is_err(), "a pose that is no number");
}

#[test]
fn a_stroke_is_hit_when_the_tool_comes_and_its_joints_count_from_there() {
    let Stroke { cell, hidden, clip } = Stroke::new();
    let settings =
        Settings::new(complete(&cell, Some(&hidden)).expect("a cell"), vec![Setting::Friction, Setting::Mass]);
    let mut clips = ObjectClips::new(&cell, vec![clip.clone()], settings).expect("a cell");
    let truth = [0.35, 0.4];
    let predicted = clips.predict(0, &truth, &[]).expect("an answer");
    let contact = predicted.contact_ns.expect("a touch");
    let places = |row: usize| Vector3::from(clip.object.poses[row].position());
    let moved = (0..clip.object.len()).find(|row| (places(*row) - places(0)).norm() > 1e-3).expect("it moves");
    assert!(clip.object.stamps_ns[moved].abs_diff(contact) < 60_000_000, "{contact} {}", clip.object.stamps_ns[moved]);
    let far = (places(clip.object.len() - 1) - places(0)).norm();
    let last = Vector3::from(predicted.poses[predicted.poses.len() - 1].position());
    assert!(far > 0.03 && (last - places(clip.object.len() - 1)).norm() < 2e-3, "{far}");
    assert_eq!(clips.rows(0).len(), 6 * clip.object.len());
    clips.set_model_error(ModelError { joints: Some(1e-4), ..clips.model_error() });
    let rows = clips.rows(0);
    let joints: Vec<&Row> = rows.iter().filter(|row| matches!(row.channel, Channel::Joint(_))).collect();
    assert!(joints.len() > 7 * 5 && joints.len().is_multiple_of(7), "{}", joints.len());
    assert!(
        joints.iter().all(|row| row.stamp_ns + 60_000_000 > contact && row.part != Part::After),
        "from the touch on"
    );
    let out = clips.errors(0, &truth, &[]).expect("an answer");
    assert!(largest(out[6 * clip.object.len()..].iter().copied()) < 2e-4, "encoders at the truth");
    // Of a heavier object the arm feels more, and a slide that the tool does not push is what friction makes of it.
    let heavier = clips.errors(0, &[0.35, 0.8], &[]).expect("an answer");
    let felt = |errors: &[f64]| largest(errors[6 * clip.object.len()..].iter().copied());
    assert!(felt(&heavier) > 3.0 * felt(&out), "{} {}", felt(&heavier), felt(&out));
}

#[test]
fn poses_later_than_the_arms_clock_says_are_a_stroke_seen_at_another_time() {
    let Stroke { cell, hidden, clip } = Stroke::new();
    let settings = || Settings::new(complete(&cell, Some(&hidden)).expect("a cell"), Vec::new());
    let clips = ObjectClips::new(&cell, vec![clip.clone()], settings()).expect("a cell");
    assert_eq!(clips.random().random[1].name, "clock");
    let own = |clock: f64| clips.predict(0, &[], &[0.0, clock]).expect("an answer").poses;
    let (now, late) = (own(0.0), own(0.016));
    // Poses of a period before, one after the other.
    for (late, before) in late[1..].iter().zip(&now) {
        assert!((Vector3::from(late.position()) - Vector3::from(before.position())).norm() < 1e-9);
    }
    let alone = slides(NOISE, vec![slide()], &[]);
    assert!(alone.random().random.iter().all(|random| random.name != "clock"));
}
