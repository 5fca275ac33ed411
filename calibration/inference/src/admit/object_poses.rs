//! Which recorded clips can be held against the twin: an object that topples, is lost by its tracker, is never hit or lies
//! elsewhere than the tool is noticed here, mended where that is safe, and said. Base frame, SI.

use super::mended::mended;
use super::oddities::{oddities, rate};
use crate::likelihood::object::Clearance;
use nalgebra::Vector3;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, ObjectSeries};
use shared_mem::time::seconds_between;
use twin::replay::{Buried, object_start};
use twin::scene::{ObjectModel, ObjectShape};

/// An object that moves this much farther from one pose to the next than before or after was lost [m] (a choice): a hit makes it fast at
/// once, but friction does not stop it at once.
const LOST_STEP: f64 = 0.03;
/// No table reaches so far [m] (a choice): poses in millimetres do.
const FARTHEST_TABLE: f64 = 20.0;
/// Fewer poses show no slide (a choice).
const FEWEST_POSES: usize = 10;
/// An object that goes farther than this from one pose to the next moves [m] (a choice: beyond a tracker's noise).
const STEP_IN_MOTION: f64 = 1.5e-3;
/// Share of poses that may be missing (a choice).
const MAX_SHARE_OF_MISTAKES: f64 = 0.1;
/// Longest time without a pose while the object moves [s] (a choice).
const LONGEST_GAP: f64 = 0.2;
/// An object leans no further while it slides [rad] (a choice: 20 degrees).
const TOPPLED_LEAN: f64 = 0.35;
/// An object that went no farther was not hit [m] (a choice: five times a tracker's noise).
const LEAST_TRAVEL_OF_A_HIT: f64 = 5e-3;
/// A tool that came no nearer while the object moved does not push it: the poses are in another frame [m] (a choice).
const TOOL_ELSEWHERE: f64 = 0.03;
/// A box leans no further where it stands [rad] (a choice: what a tracker's error and a tilted table turn it).
const LEAN_BEFORE_THE_HIT: f64 = 0.2;

/// A clip whose poses were looked at.
pub struct Poses {
    /// The clip, with what could be mended mended.
    pub clip: Clip,
    /// What is odd about it.
    pub remarks: Vec<String>,
    /// Why its poses cannot be used, if they cannot.
    pub unusable: Option<String>,
    /// Why its poses are not those of what the arm hits, if they are not.
    pub elsewhere: Option<String>,
}

/// Looks at the poses of a clip.
pub fn looked_at(clip: Clip, cell: &Cell) -> Poses {
    let mut remarks: Vec<String> = clip.warnings.iter().chain(&clip.damage).cloned().collect();
    let (clip, mended) = mended(clip, cell);
    remarks.extend(mended);
    let placed = on_table(&clip, cell);
    let mut unusable = unusable(&clip, cell).or_else(|| placed.as_ref().err().map(ToString::to_string));
    let hits = unusable.is_none() && clip.kind == ClipKind::ControlHitSlide;
    let mut elsewhere = if hits { apart(&clip, cell) } else { None };
    // What was odd before may be why.
    for why in [&mut unusable, &mut elsewhere].into_iter().flatten() {
        remarks.iter().for_each(|remark| why.push_str(&format!(" ({remark})")));
    }
    remarks.extend(placed.ok().flatten());
    remarks.extend(oddities(&clip.object));
    Poses { clip, remarks, unusable, elsewhere }
}

/// Whether the poses put the object onto its table, and what to tell if they nearly do.
fn on_table(clip: &Clip, cell: &Cell) -> Result<Option<String>, Buried> {
    let Ok(Some(model)) = ObjectModel::new(cell, None) else { return Ok(None) };
    object_start::remark(&clip.object, clip.kind, &model, cell)
}

fn unusable(clip: &Clip, cell: &Cell) -> Option<String> {
    let ObjectSeries { stamps_ns, poses } = &clip.object;
    if poses.len() < FEWEST_POSES {
        return Some(format!("it holds {} object poses; the tracker has to see the whole slide", poses.len()));
    }
    let place = |row: usize| poses[row].isometry().translation.vector;
    let farthest = (0..poses.len()).map(|row| place(row).norm()).fold(0.0, f64::max);
    if farthest > FARTHEST_TABLE {
        return Some(format!("its poses lie up to {farthest:.0} m from the arm's base: publish them in metres"));
    }
    let seconds = |a: usize, b: usize| seconds_between(stamps_ns[a], stamps_ns[b]);
    let step = |row: &usize| (place(*row) - place(row - 1)).norm();
    let speed = |row: usize| if (1..poses.len()).contains(&row) { step(&row) / seconds(row - 1, row) } else { 0.0 };
    // Beyond what the faster of its neighbouring steps leads to expect: a hit is followed by steps as long, a lost pose by none.
    let jump = |row: &usize| step(row) - speed(row - 1).max(speed(row + 1)) * seconds(row - 1, *row);
    if let Some(row) = (1..poses.len()).find(|row| jump(row) > LOST_STEP) {
        let (at, far) = (seconds(0, row), step(&row) * 1e3);
        return Some(format!(
            "the tracker lost the object: its pose jumps by {far:.0} mm at {at:.2} s and stays there"
        ));
    }
    let there = poses.len() as f64 / (seconds(0, poses.len() - 1) * rate(&clip.object)?).max(1.0);
    if there < 1.0 - MAX_SHARE_OF_MISTAKES {
        return Some(format!("{:.0} % of its poses are missing", 100.0 * (1.0 - there)));
    }
    let mut moving = (1..poses.len()).filter(|row| step(row) > STEP_IN_MOTION);
    if let Some(row) = moving.find(|row| seconds(row - 1, *row) > LONGEST_GAP) {
        return Some(format!("the object was not seen for {:.2} s while it moved", seconds(row - 1, row)));
    }
    // What was let go may lie still, tumble and come to rest on any face.
    if clip.kind == ClipKind::FreeMotion {
        return None;
    }
    let far = (0..poses.len()).map(|row| (place(row) - place(0)).norm()).fold(0.0, f64::max);
    if far < LEAST_TRAVEL_OF_A_HIT {
        return Some(format!("the object was not hit: it moved by {:.1} mm", far * 1e3));
    }
    let askew = askew(clip, cell).unwrap_or(0.0);
    if askew > LEAN_BEFORE_THE_HIT {
        return Some(format!(
            "the object stands on none of its faces before it is hit, but leans by {:.0} degrees: its quaternions are stored in \
             another order than x, y, z, w, or its poses are in another frame",
            askew.to_degrees()
        ));
    }
    let up = |row: usize| poses[row].isometry().rotation * poses[0].isometry().rotation.inverse() * Vector3::z();
    let lean = (0..poses.len()).map(|row| up(row).z.clamp(-1.0, 1.0).acos()).fold(0.0, f64::max);
    if lean > TOPPLED_LEAN {
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
    (nearest > TOOL_ELSEWHERE).then(|| {
        format!(
            "the object moves, but the tool never comes nearer than {:.0} mm: the poses are not in `{}`, or tool and table in \
             cell.toml are not this cell's",
            nearest * 1e3,
            cell.robot.as_ref().and_then(|robot| robot.base_frame.as_deref()).unwrap_or("the base frame")
        )
    })
}

/// How far a box is turned from the face it stands on before it is hit [rad].
fn askew(clip: &Clip, cell: &Cell) -> Option<f64> {
    let model = ObjectModel::new(cell, None).ok()??;
    let rotation = clip.object.poses.first()?.isometry().rotation;
    let upright = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (rotation * axis).z.abs()).into_iter();
    let is_box = matches!(model.shape, ObjectShape::Box { .. });
    is_box.then(|| upright.fold(0.0, f64::max).min(1.0).acos())
}

#[cfg(test)]
mod tests {
    use super::super::test_object::{cell, clip};
    use super::*;
    use nalgebra::{Isometry3, UnitQuaternion};

    fn why(change: impl Fn(usize, &mut Isometry3<f64>)) -> Option<String> {
        looked_at(clip(change), &cell()).unusable
    }

    #[test]
    fn a_plain_slide_is_used_without_a_remark() {
        let Poses { clip, remarks, unusable, .. } = looked_at(clip(|_, _| {}), &cell());
        assert_eq!((clip.object.len(), remarks.len(), unusable), (90, 0, None));
    }

    #[test]
    fn single_poses_that_jump_away_are_left_out_and_told() {
        let far = |row: usize, pose: &mut Isometry3<f64>| {
            if row == 40 || row == 70 {
                pose.translation.vector.y += 0.05;
            }
        };
        let Poses { clip, remarks, unusable, .. } = looked_at(clip(far), &cell());
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
    fn poses_that_a_tracker_repeats_after_it_lost_the_object_are_left_out_and_told() {
        let shaken = |row: usize| 1e-4 * (row as f64 * 0.7).sin();
        let lost = |row: usize, pose: &mut Isometry3<f64>| {
            pose.translation.vector.x = if row < 45 { pose.translation.vector.x + shaken(row) } else { 0.575 };
        };
        let Poses { clip, remarks, unusable, .. } = looked_at(clip(lost), &cell());
        assert_eq!((clip.object.len(), unusable), (46, None));
        assert!(remarks[0].contains("44 of 90 poses repeat"), "{remarks:?}");
        assert!(remarks[1].contains("seen until"), "{remarks:?}");
    }

    #[test]
    fn an_object_above_its_table_is_told_and_one_below_it_left_out() {
        let Poses { remarks, unusable, .. } = looked_at(clip(|_, pose| pose.translation.vector.z += 0.02), &cell());
        assert!(unusable.is_none() && remarks[0].contains("20 mm above the table"), "{remarks:?}");
        let Poses { remarks, unusable, .. } = looked_at(clip(|_, pose| pose.translation.vector.z -= 0.02), &cell());
        assert!(unusable.is_none() && remarks[0].contains("20 mm into the table"), "{remarks:?}");
        let below = why(|_, pose| pose.translation.vector.z -= 0.1).expect("a reason");
        assert!(below.contains("below the table"), "{below}");
    }

    #[test]
    fn an_edge_to_stand_on_millimetres_and_what_the_reader_found_are_told_as_reasons() {
        let leans = UnitQuaternion::from_euler_angles(0.5, 0.0, 0.3);
        let askew = why(|_, pose| pose.rotation = leans).expect("a reason");
        assert!(askew.contains("leans by 29 degrees") && askew.contains("x, y, z, w"), "{askew}");
        let far = why(|_, pose| pose.translation.vector *= 1e3).expect("a reason");
        assert!(far.contains("602 m") && far.contains("metres"), "{far}");
        let mut clip = clip(|row, pose| pose.translation.vector.y += if row > 60 { 0.3 } else { 0.0 });
        clip.warnings.push("said by the reader".into());
        let why = looked_at(clip, &cell()).unusable.expect("a reason");
        assert!(why.contains("jumps by") && why.ends_with("(said by the reader)"), "{why}");
    }

    #[test]
    fn a_box_that_is_taken_for_itself_turned_over_is_turned_back() {
        let flip = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let flipped = |row: usize, pose: &mut Isometry3<f64>| {
            if (35..45).contains(&row) {
                pose.rotation *= flip;
            }
        };
        let Poses { clip, remarks, unusable, .. } = looked_at(clip(flipped), &cell());
        assert_eq!(unusable, None);
        assert!(clip.object.poses.iter().all(|pose| pose.isometry().rotation.angle() < 1e-6));
        assert!(remarks[0].contains("turned by half"), "{remarks:?}");
    }
}
