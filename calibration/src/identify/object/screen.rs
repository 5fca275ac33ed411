//! Which recorded clips can be held against the twin: an object that topples, is lost by its tracker, is never hit or lies
//! elsewhere than the tool is noticed here, mended where that is safe, and told. Base frame, SI.

use crate::forward::object::Clearance;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::recording::{Clip, ObjectSeries};
use twin::scene::{ObjectModel, ObjectShape};

/// A pose this far from the middle of its neighbours, and they nearer to each other, is the tracker's mistake [m].
const JUMP: f64 = 0.04;
/// An object that moves this much farther from one pose to the next than before or after was lost [m]: a hit makes it
/// fast at once, but friction does not stop it at once.
const STEP: f64 = 0.03;
/// Share of poses that may be mistakes.
const MOST_MISTAKES: f64 = 0.1;
/// Longest time without a pose while the object moves [s].
const LONGEST_GAP: f64 = 0.2;
/// An object leans no further while it slides [rad].
const TOPPLED: f64 = 0.35;
/// An object that went no farther was not hit [m].
const NOT_HIT: f64 = 5e-3;
/// A tool that came no nearer while the object moved does not push it: the poses are in another frame [m].
const ELSEWHERE: f64 = 0.03;
/// Fewest poses a second that show a slide.
const SLOWEST_TRACKER: f64 = 20.0;
/// Turns by nearly half about an axis from one pose to the next are a box taken for itself turned over [rad].
const FLIP: f64 = 2.6;

/// A clip that was looked at.
pub(crate) struct Screened {
    /// The clip, with what could be mended mended.
    pub(crate) clip: Clip,
    /// What is odd about it.
    pub(crate) remarks: Vec<String>,
    /// Why its poses cannot be used, if they cannot.
    pub(crate) unusable: Option<String>,
    /// Why its poses are not those of what the arm hits, if they are not.
    pub(crate) elsewhere: Option<String>,
}

/// Looks at a clip.
pub(crate) fn screened(clip: Clip, cell: &Cell) -> Screened {
    let mut remarks: Vec<String> = clip.warnings.iter().chain(&clip.damage).cloned().collect();
    let (clip, mended) = mended(clip, cell);
    remarks.extend(mended);
    let unusable = unusable(&clip);
    let hits = unusable.is_none() && clip.kind == ClipKind::ControlHitSlide;
    let elsewhere = if hits { apart(&clip, cell) } else { None };
    if let Some(rate) = rate(&clip.object).filter(|rate| *rate < SLOWEST_TRACKER) {
        remarks.push(format!(
            "the object was tracked at {rate:.0} Hz: a slide shows in a few poses, and intervals are wide; track at 30 Hz \
             or more"
        ));
    }
    Screened { clip, remarks, unusable, elsewhere }
}

/// Poses that are the tracker's mistakes left out, a symmetric box turned back.
fn mended(mut clip: Clip, cell: &Cell) -> (Clip, Vec<String>) {
    let mut remarks = Vec::new();
    let flips = turn_back(&mut clip.object, cell);
    if flips > 0 {
        remarks.push(format!(
            "the tracker took the box for itself turned by half in {flips} poses; they were turned back to the first one's side"
        ));
    }
    let all = clip.object.len();
    let place = |row: usize| clip.object.poses[row].isometry().translation.vector;
    let mistake = |row: usize| {
        if row == 0 || row + 1 >= all {
            return false;
        }
        let (before, after) = (place(row - 1), place(row + 1));
        let off = (place(row) - (before + after) * 0.5).norm();
        off > JUMP && (after - before).norm() < off
    };
    let good: Vec<usize> = (0..all).filter(|row| !mistake(*row)).collect();
    if good.len() < all {
        remarks.push(format!(
            "{} of {all} poses jump away and back by more than {:.0} mm; they were left out",
            all - good.len(),
            JUMP * 1e3
        ));
        let ObjectSeries { stamps_ns, poses } = &clip.object;
        clip.object = ObjectSeries {
            stamps_ns: good.iter().map(|row| stamps_ns[*row]).collect(),
            poses: good.iter().map(|row| poses[*row]).collect(),
        };
    }
    (clip, remarks)
}

/// Turns poses of a box that flip by half against the pose before; how many.
fn turn_back(series: &mut ObjectSeries, cell: &Cell) -> usize {
    let is_box =
        matches!(ObjectModel::new(cell, None), Ok(Some(model)) if matches!(model.shape, ObjectShape::Box { .. }));
    let halves = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
        .map(|axis| UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI));
    let mut flips = 0;
    for row in 1..series.len() {
        let before = series.poses[row - 1].isometry().rotation;
        let pose = series.poses[row].isometry();
        if is_box && before.angle_to(&pose.rotation) > FLIP {
            let nearest = halves
                .map(|half| pose.rotation * half)
                .into_iter()
                .min_by(|a, b| before.angle_to(a).total_cmp(&before.angle_to(b)))
                .unwrap_or(pose.rotation);
            series.poses[row] = Pose::from_isometry(Isometry3::from_parts(pose.translation, nearest));
            flips += 1;
        }
    }
    flips
}

fn unusable(clip: &Clip) -> Option<String> {
    let ObjectSeries { stamps_ns, poses } = &clip.object;
    if poses.len() < 10 {
        return Some(format!("it holds {} object poses; the tracker has to see the whole slide", poses.len()));
    }
    let place = |row: usize| poses[row].isometry().translation.vector;
    let seconds = |a: usize, b: usize| (stamps_ns[b] - stamps_ns[a]) as f64 * 1e-9;
    let step = |row: &usize| (place(*row) - place(row - 1)).norm();
    let speed = |row: usize| if (1..poses.len()).contains(&row) { step(&row) / seconds(row - 1, row) } else { 0.0 };
    let jump = |row: &usize| step(row) - speed(row - 1).max(speed(row + 1)) * seconds(row - 1, *row);
    if let Some(row) = (1..poses.len()).find(|row| jump(row) > STEP) {
        let (at, far) = (seconds(0, row), step(&row) * 1e3);
        return Some(format!(
            "the tracker lost the object: its pose jumps by {far:.0} mm at {at:.2} s and stays there"
        ));
    }
    let missing = poses.len() as f64 / (seconds(0, poses.len() - 1) * rate(&clip.object)?).max(1.0);
    if missing < 1.0 - MOST_MISTAKES {
        return Some(format!("{:.0} % of its poses are missing", 100.0 * (1.0 - missing)));
    }
    let moving: Vec<usize> = (1..poses.len()).filter(|row| step(row) > 1.5e-3).collect();
    if let Some(row) = moving.iter().find(|row| seconds(**row - 1, **row) > LONGEST_GAP) {
        return Some(format!("the object was not seen for {:.2} s while it moved", seconds(row - 1, *row)));
    }
    if clip.kind == ClipKind::FreeMotion {
        return None;
    }
    let far = (0..poses.len()).map(|row| (place(row) - place(0)).norm()).fold(0.0, f64::max);
    if far < NOT_HIT {
        return Some(format!("the object was not hit: it moved by {:.1} mm", far * 1e3));
    }
    let up = |row: usize| poses[row].isometry().rotation * poses[0].isometry().rotation.inverse() * Vector3::z();
    let lean = (0..poses.len()).map(|row| up(row).z.clamp(-1.0, 1.0).acos()).fold(0.0, f64::max);
    if lean > TOPPLED {
        return Some(format!(
            "the object toppled: it leaned by {:.0} degrees; hit it lower or slower",
            lean.to_degrees()
        ));
    }
    None
}

/// Tool and object never come near each other although the object moves.
fn apart(clip: &Clip, cell: &Cell) -> Option<String> {
    let mut clearance = Clearance::new(cell, clip)?;
    let nearest = (0..clip.object.len()).map(|row| clearance.gap(row)).fold(f64::INFINITY, f64::min);
    (nearest > ELSEWHERE).then(|| {
        format!(
            "the object moves, but the tool never comes nearer than {:.0} mm: the poses are not in `{}`, or tool and table in \
             cell.toml are not this cell's",
            nearest * 1e3,
            cell.robot.as_ref().and_then(|robot| robot.base_frame.as_deref()).unwrap_or("the base frame")
        )
    })
}

/// Usual number of poses a second.
fn rate(series: &ObjectSeries) -> Option<f64> {
    let mut steps: Vec<u64> = series.stamps_ns.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).map(|step| 1e9 / *step as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::frames::{Base, Object};
    use shared_mem::recording::JointSeries;
    use shared_mem::toml_file;
    use std::path::Path;

    fn cell() -> Cell {
        let text = "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.1]\n";
        toml_file::parse(text, Path::new("cell.toml")).expect("a cell.toml")
    }

    /// A box that stands for half a second, slides 0.1 m and rests, seen at 60 Hz.
    fn clip(change: impl Fn(usize, &mut Isometry3<f64>)) -> Clip {
        let poses = (0..90).map(|row| {
            let along = ((row as f64 - 30.0) / 20.0).clamp(0.0, 1.0);
            let mut pose = Isometry3::translation(0.5 + 0.1 * along, 0.0, 0.05);
            change(row, &mut pose);
            Pose::<Base, Object>::from_isometry(pose)
        });
        let object = ObjectSeries { poses: poses.collect(), stamps_ns: (0..90).map(|row| row * 16_666_667).collect() };
        Clip {
            file: "clip.mcap".into(),
            kind: ClipKind::ControlHitSlide,
            joint_names: Vec::new(),
            desired: JointSeries::default(),
            measured: JointSeries::default(),
            object,
            warnings: Vec::new(),
            damage: None,
        }
    }

    fn why(change: impl Fn(usize, &mut Isometry3<f64>)) -> Option<String> {
        screened(clip(change), &cell()).unusable
    }

    #[test]
    fn a_plain_slide_is_used_without_a_remark() {
        let Screened { clip, remarks, unusable, .. } = screened(clip(|_, _| {}), &cell());
        assert_eq!((clip.object.len(), remarks.len(), unusable), (90, 0, None));
    }

    #[test]
    fn single_poses_that_jump_away_are_left_out_and_told() {
        let far = |row: usize, pose: &mut Isometry3<f64>| {
            if row == 40 || row == 70 {
                pose.translation.vector.y += 0.05;
            }
        };
        let Screened { clip, remarks, unusable, .. } = screened(clip(far), &cell());
        assert_eq!((clip.object.len(), unusable), (88, None));
        assert!(remarks[0].contains("2 of 90 poses jump"), "{remarks:?}");
    }

    #[test]
    fn an_object_that_is_lost_is_not_hit_or_topples_is_left_out_with_the_reason() {
        let lost = why(|row, pose| pose.translation.vector.y += if row > 60 { 0.3 } else { 0.0 });
        assert!(lost.as_deref().is_some_and(|why| why.contains("lost the object")), "{lost:?}");
        for row in [10, 50, 80] {
            let jumped = why(|at, pose| pose.translation.vector.y += if at > row { 0.05 } else { 0.0 });
            assert!(jumped.as_deref().is_some_and(|why| why.contains("jumps by 50 mm")), "{row}: {jumped:?}");
        }
        let still = why(|_, pose| pose.translation.vector.x = 0.5);
        assert!(still.as_deref().is_some_and(|why| why.contains("not hit")), "{still:?}");
        let toppled = why(|row, pose| {
            let lean = Vector3::y() * ((row as f64 - 40.0) / 10.0).clamp(0.0, 1.57);
            pose.rotation = UnitQuaternion::from_scaled_axis(lean);
        });
        assert!(toppled.as_deref().is_some_and(|why| why.contains("toppled")), "{toppled:?}");
    }

    #[test]
    fn a_box_that_is_taken_for_itself_turned_over_is_turned_back() {
        let flip = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let flipped = |row: usize, pose: &mut Isometry3<f64>| {
            if (35..45).contains(&row) {
                pose.rotation *= flip;
            }
        };
        let Screened { clip, remarks, unusable, .. } = screened(clip(flipped), &cell());
        assert_eq!(unusable, None);
        assert!(clip.object.poses.iter().all(|pose| pose.isometry().rotation.angle() < 1e-6));
        assert!(remarks[0].contains("turned by half"), "{remarks:?}");
    }
}
