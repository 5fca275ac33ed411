//! Where a joint is, out of poses of its part and of what carries it, wherever that stands and moves.

use super::positions::Positions;
use super::subject::Subject;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::origin::Origins;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries, TrackedObject};
use std::path::Path;

const BODY: &str =
    "<inertial><mass value='2'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>";

/// A case with a drawer and a knob that turns without end.
fn subject(joint: &str) -> (tempfile::TempDir, Subject) {
    let folder = tempfile::tempdir().expect("a folder");
    let urdf = format!(
        "<robot name='desk'><link name='case'/><link name='drawer'>{BODY}</link><link name='knob'>{BODY}</link>
         <joint name='rail' type='prismatic'><parent link='case'/><child link='drawer'/><origin xyz='.1 0 .2' rpy='0 0 .3'/>
           <axis xyz='1 0 0'/><limit lower='0' upper='.4' effort='9' velocity='9'/></joint>
         <joint name='pivot' type='revolute'><parent link='case'/><child link='knob'/><origin xyz='0 .3 .1' rpy='.2 0 0'/>
           <axis xyz='0 1 0'/><limit lower='-9' upper='9' effort='9' velocity='9'/></joint></robot>"
    );
    std::fs::write(folder.path().join("desk.urdf"), urdf).expect("room");
    let text = "[[object]]\nname = \"desk\"\nurdf = \"desk.urdf\"\n";
    let mut cell: Cell = shared_mem::toml_file::parse(text, Path::new("cell.toml")).expect("a cell.toml");
    cell.folder = folder.path().to_owned();
    let subject = Subject::of(&cell, None, Some(joint)).expect("a joint");
    (folder, subject)
}

fn series(poses: impl Iterator<Item = (u64, Isometry3<f64>)>) -> ObjectSeries {
    let (stamps_ns, poses) = poses.map(|(stamp, pose)| (stamp, Pose::from_isometry(pose))).unzip();
    ObjectSeries { stamps_ns, poses }
}

/// Sixty poses a second of a carrier, and of the part on it where the joint is.
fn clip(subject: &Subject, carrier: impl Fn(f64) -> Isometry3<f64>, q: impl Fn(f64) -> f64) -> Clip {
    let stamps: Vec<u64> = (0..120).map(|row| 3_000_000_000 + row * 16_666_667).collect();
    let time = |stamp: u64| (stamp - stamps[0]) as f64 * 1e-9;
    let on = |stamp: &u64| (*stamp, carrier(time(*stamp)));
    let part = |stamp: &u64| (*stamp, carrier(time(*stamp)) * subject.joint.pose_at(q(time(*stamp))));
    let other = |name: &String, series| TrackedObject { name: name.clone(), series };
    Clip {
        file: "push.mcap".into(),
        kind: ClipKind::FreeMotion,
        joint_names: Vec::new(),
        desired: JointSeries::default(),
        measured: JointSeries::default(),
        torques_end_at_rows: false,
        object: ObjectSeries::default(),
        others: vec![
            other(&subject.bodies[0], series(stamps.iter().map(on))),
            other(&subject.bodies[1], series(stamps.iter().map(part))),
        ],
        origins: Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

fn swings(t: f64) -> f64 {
    0.2 + 0.15 * (4.0 * t).sin()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_joint_is_found_wherever_and_however_its_carrier_stands(
        place in prop::array::uniform3(-2.0..2.0_f64), turn in prop::array::uniform3(-3.0..3.0_f64), slides in any::<bool>(),
    ) {
        let (_folder, subject) = subject(if slides { "rail" } else { "pivot" });
        let at = Isometry3::new(place.into(), turn.into());
        let found = Positions::of(&clip(&subject, |_| at, swings), None, &subject).expect("positions");
        prop_assert_eq!(found.times.len(), 120);
        for (time, position) in found.times.iter().zip(&found.positions) {
            prop_assert!((position - swings(*time)).abs() < 1e-9, "{time}: {position}");
        }
        prop_assert!(found.carrier.angle_to(&at.rotation) < 1e-6);
    }
}

#[test]
fn a_carrier_that_is_pushed_along_takes_nothing_from_the_joint() {
    let (_folder, subject) = subject("rail");
    let along = |t: f64| Isometry3::new(Vector3::new(0.1 * t, 0.0, 0.0), Vector3::z() * (0.2 * t));
    let mut clip = clip(&subject, along, swings);
    let whole = Positions::of(&clip, None, &subject).expect("positions");
    // A carrier that is seen less often stands between two of its poses.
    let rows: Vec<usize> = (0..120).filter(|row| row % 4 == 0 || *row == 119).collect();
    clip.others[0].series = series(rows.iter().map(|row| {
        let series = &clip.others[0].series;
        (series.stamps_ns[*row], series.poses[*row].isometry())
    }));
    let sparse = Positions::of(&clip, None, &subject).expect("positions");
    assert_eq!(sparse.times.len(), 120);
    for (whole, sparse) in whole.positions.iter().zip(&sparse.positions) {
        assert!((whole - sparse).abs() < 1e-3, "{whole} {sparse}");
    }
}

#[test]
fn a_knob_that_is_turned_round_and_round_counts_its_turns() {
    let (_folder, subject) = subject("pivot");
    let found =
        Positions::of(&clip(&subject, |_| Isometry3::identity(), |t| 4.0 * t), None, &subject).expect("positions");
    assert!(found.positions.windows(2).all(|pair| (pair[1] - pair[0] - 4.0 / 60.0).abs() < 1e-6));
    let turned = found.positions[119] - found.positions[0];
    assert!((turned - 4.0 * found.times[119]).abs() < 1e-6 && turned > std::f64::consts::TAU, "{turned}");
}

#[test]
fn what_is_not_seen_or_lies_beside_its_joint_is_said_by_name() {
    let (_folder, subject) = subject("pivot");
    let still = |_: f64| Isometry3::identity();
    let why = |change: &dyn Fn(&mut Clip)| {
        let mut clip = clip(&subject, still, swings);
        change(&mut clip);
        Positions::of(&clip, None, &subject).expect_err("a reason")
    };
    let missing = why(&|clip| {
        clip.others.pop();
    });
    assert!(missing.contains("no poses of `desk_knob`") && missing.contains("/object/desk_knob/pose"), "{missing}");
    let empty = why(&|clip| clip.others[0].series = ObjectSeries::default());
    assert!(empty.contains("no poses of `desk`"), "{empty}");
    let few = why(&|clip| {
        clip.others[1].series = series(clip.others[1].series.stamps_ns.iter().take(5).map(|s| (*s, still(0.0))))
    });
    assert!(few.contains("only 5 poses of `desk_knob`"), "{few}");
    // Poses of the carrier of another hour are none of its poses.
    let apart = why(&|clip| clip.others[0].series.stamps_ns.iter_mut().for_each(|stamp| *stamp += 3_600_000_000_000));
    assert!(apart.contains("only 0 poses"), "{apart}");
    let moved = |by: Isometry3<f64>| {
        why(&move |clip| {
            for pose in &mut clip.others[1].series.poses {
                *pose = Pose::from_isometry(pose.isometry() * by);
            }
        })
    };
    let beside = moved(Isometry3::from_parts(Translation3::new(0.0, 0.05, 0.0), UnitQuaternion::identity()));
    assert!(beside.contains("`desk_knob` 50 mm and 0 degrees beside its joint"), "{beside}");
    let askew = moved(Isometry3::rotation(Vector3::x() * 0.35));
    assert!(askew.contains("20 degrees beside its joint"), "{askew}");
}

#[test]
fn the_object_in_question_is_the_carrier_where_it_is_so_called() {
    let (_folder, subject) = subject("rail");
    let mut clip = clip(&subject, |_| Isometry3::translation(0.3, 0.0, 0.1), swings);
    let whole = Positions::of(&clip, None, &subject).expect("positions");
    clip.object = clip.others.remove(0).series;
    assert_eq!(Positions::of(&clip, Some("desk"), &subject), Ok(whole));
    assert!(Positions::of(&clip, None, &subject).is_err());
}
