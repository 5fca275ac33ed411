//! Strokes and slides as one likelihood: which row is about what, and what of it a change can reach.

use super::arm::ArmClips;
use super::cell::CellClips;
use super::object::ObjectClips;
use super::setting::{Setting, complete};
use super::test_bench::{FRICTION, NOISE, POSES, Stroke, diagnosed_slides, largest, residuals, slide};
use super::{Channel, Group, Likelihood, Reach, Settings, StageName};
use crate::estimate::ClipModel as _;
use shared_mem::theta::Theta;

/// What is searched of a stroke: of the arm, then of the object.
const SEARCHED: [Setting; 4] = [Setting::Stiffness(0), Setting::Damping(0), Setting::Friction, Setting::Mass];
const AT_TRUTH: [f64; 4] = [600.0, 50.0, 0.35, 0.4];

/// The arm's rows, the poses and the joints in contact of a stroke, at numbers that are tried.
fn on_stroke(ask: impl FnOnce(&CellClips<'_, &(dyn Fn(&[f64]) -> Theta + Sync)>)) {
    let Stroke { cell, hidden, clip } = Stroke::new();
    let base = complete(&cell, Some(&hidden)).expect("a cell");
    let settings = Settings::new(base, SEARCHED.to_vec());
    let of_numbers = settings.clone();
    let theta: &(dyn Fn(&[f64]) -> Theta + Sync) = &move |numbers: &[f64]| of_numbers.theta(numbers);
    let arm = ArmClips::moments(&cell, std::slice::from_ref(&clip), theta).expect("an arm");
    let object = ObjectClips::new(&cell, vec![clip], settings).expect("an object");
    ask(&CellClips::new(Some(arm), object, |numbers: &[f64]| numbers[..2].to_vec()));
}

fn channels_of(group: Group) -> impl Fn(&&Channel) -> bool {
    move |channel| channel.group == group
}

#[test]
fn a_stroke_has_the_arm_alone_then_its_poses_then_the_joints_in_contact() {
    on_stroke(|cell| {
        let count = |group| cell.channels().iter().filter(channels_of(group)).count();
        // Positions and velocities; six coordinates in each of three parts; the encoders once more.
        assert_eq!([count(Group::Arm), count(Group::Object), count(Group::Contact)], [14, 18, 7]);
        let groups: Vec<Group> = cell.rows(0).iter().map(|row| cell.channels()[row.channel].group).collect();
        let order = |group: &Group| [Group::Arm, Group::Object, Group::Contact].iter().position(|of| of == group);
        assert!(groups.is_sorted_by_key(order));
        assert_eq!(groups.len(), residuals(cell, 0, &AT_TRUTH, &[]).len());
        for row in cell.rows(0) {
            let channel = &cell.channels()[row.channel];
            let stages: &[StageName] = match channel.group {
                Group::Arm => &[StageName::Control],
                Group::Object => &[StageName::Hit, StageName::Slide, StageName::Rest],
                Group::Contact => &[StageName::Hit],
            };
            assert!(stages.contains(&row.stage), "{row:?} of {channel:?}");
            assert_eq!(channel.joint.is_some(), channel.group != Group::Object);
        }
        // The arm counts as alone until the tool may touch, and the joints in contact from there on.
        let times = |of: Group| {
            let of_group = move |(row, group): (&super::Row, &Group)| (*group == of).then_some(row.time);
            cell.rows(0).iter().zip(&groups).filter_map(of_group).collect::<Vec<f64>>()
        };
        let (alone, contact) = (times(Group::Arm), times(Group::Contact));
        let [last, first] = [alone.iter().copied().fold(0.0, f64::max), contact.iter().copied().fold(9.0, f64::min)];
        assert!(last < first && first < 0.4, "{last} {first}");
        let regimes: std::collections::BTreeSet<&str> = cell
            .rows(0)
            .iter()
            .zip(&groups)
            .filter(|(_, group)| **group == Group::Object)
            .map(|(row, _)| row.regime)
            .collect();
        assert!(
            regimes.contains("before the hit") && regimes.contains("blow") && regimes.contains("free"),
            "{regimes:?}"
        );
    });
}

#[test]
fn what_the_twin_made_of_a_stroke_leaves_little_and_another_mass_shows_in_contact_and_poses_alone() {
    on_stroke(|cell| {
        let [truth, heavier] = [AT_TRUTH, [600.0, 50.0, 0.35, 0.5]].map(|shared| residuals(cell, 0, &shared, &[]));
        let of = |group: Group, out: &[f64]| {
            let rows = cell.rows(0).iter().zip(out).filter(|(row, _)| cell.channels()[row.channel].group == group);
            largest(rows.map(|(_, residual)| *residual))
        };
        assert!(
            of(Group::Arm, &truth) < 1.0 && of(Group::Object, &truth) < 3.0,
            "{} {}",
            of(Group::Arm, &truth),
            of(Group::Object, &truth)
        );
        assert_eq!(of(Group::Arm, &truth), of(Group::Arm, &heavier), "an arm that touches nothing feels no object");
        for group in [Group::Object, Group::Contact] {
            assert!(
                of(group, &heavier) > 2.0 * of(group, &truth),
                "{group:?}: {} {}",
                of(group, &heavier),
                of(group, &truth)
            );
        }
    });
}

#[test]
fn a_change_that_reaches_one_side_alone_takes_the_other_from_the_point_nearby() {
    on_stroke(|cell| {
        let own = vec![0.0; cell.scatter().count()];
        let base = residuals(cell, 0, &AT_TRUTH, &own);
        let of_arm = cell.rows(0).iter().filter(|row| cell.channels()[row.channel].group == Group::Arm).count();
        let changed = |shared: &[f64; 4], reach: Reach, base: &[f64]| {
            let mut out = Vec::new();
            cell.changed(0, (shared, &own), (reach, base, None), &mut out).expect("an answer");
            out
        };
        let (of_object, of_gains) = ([600.0, 50.0, 0.3, 0.4], [630.0, 50.0, 0.35, 0.4]);
        assert_eq!(changed(&of_object, Reach::Object, &base), residuals(cell, 0, &of_object, &own));
        // By way of the arm a gain moves the object too; that is what the reach cuts.
        let (cut, whole) = (changed(&of_gains, Reach::Arm, &base), residuals(cell, 0, &of_gains, &own));
        assert!(
            cut[..of_arm] == whole[..of_arm] && cut[of_arm..] == base[of_arm..] && whole[of_arm..] != base[of_arm..]
        );
        assert_eq!(changed(&of_gains, Reach::All, &[]), whole);
    });
}

#[test]
fn a_friction_of_a_clips_own_is_the_shared_one_times_its_exponential() {
    on_stroke(|cell| {
        let effects = cell.scatter();
        assert_eq!((effects.random[0].name.as_str(), effects.random[1].name.as_str()), ("ln friction", "clock"));
        assert_eq!(effects.heavy, 2..11);
        let mut own = vec![0.0; effects.count()];
        own[0] = 0.2;
        let of_its_own = residuals(cell, 0, &AT_TRUTH, &own);
        let shared = residuals(cell, 0, &[600.0, 50.0, 0.35 * 0.2_f64.exp(), 0.4], &[]);
        assert!(largest(of_its_own.iter().zip(&shared).map(|(a, b)| a - b)) < 1e-9);
        assert!(cell.has_object() && cell.torque_sigma().is_none() && cell.engine().is_none());
    });
}

#[test]
fn an_object_alone_has_poses_alone_and_moves_as_its_own_clips_do() {
    let cell = diagnosed_slides(vec![slide(), slide()], &[Setting::Friction]);
    assert_eq!((cell.clips(), cell.channels().len(), cell.rows(0).len()), (2, 18, 6 * POSES));
    assert!(cell.channels().iter().all(|channel| channel.group == Group::Object && channel.joint.is_none()));
    let stages: Vec<StageName> = cell.rows(0).iter().step_by(6).map(|row| row.stage).collect();
    assert!(stages.contains(&StageName::Slide) && !stages.contains(&StageName::Control), "{stages:?}");
    assert_eq!((stages[0], stages[POSES - 1]), (StageName::Rest, StageName::Rest));
    assert!(cell.following(0).is_empty() && cell.in_halves(0, &[FRICTION]).is_none());
    let [one, other] = [0, 1].map(|clip| residuals(&cell, clip, &[0.36], &[]));
    assert!(one == other && cell.rows(0) == cell.rows(1));
    // In the plane in sigmas of the tracker; what tips while it moves is believed less.
    let object = super::test_bench::slides(NOISE, vec![slide()], &[Setting::Friction]);
    let errors = object.errors(0, &[0.36], &[]).expect("an answer");
    for ((row, error), residual) in cell.rows(0).iter().zip(errors).zip(one) {
        let Channel { quantity, place, .. } = &cell.channels()[row.channel];
        let noise = if *quantity == "position" { NOISE.position } else { NOISE.rotation };
        let in_plane = ["x", "y", "yaw"].contains(&place.as_str());
        let sigma = if in_plane || row.stage == StageName::Rest {
            noise
        } else {
            noise.hypot(if *quantity == "position" { 3e-3 } else { 0.05 })
        };
        assert!((residual * sigma - error).abs() < 1e-9, "{quantity} {place} at {}", row.time);
    }
}
