//! A tracker's mistakes that can be mended: single poses that jump away, a box taken for itself turned over, poses that
//! are published on after the object was lost. Base frame, SI.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;
use shared_mem::frames::Pose;
use shared_mem::recording::{Clip, ObjectSeries};
use twin::scene::{ObjectModel, ObjectShape};

/// A pose this far from the middle of its neighbours, and they nearer to each other, is the tracker's mistake [m] (a choice: a slide of 3
/// m/s that stops within a frame of 60 Hz leaves less).
const JUMP_BESIDE_NEIGHBOURS: f64 = 0.04;
/// Turns by more about an axis from one pose to the next are a box taken for itself turned over [rad] (a choice: pi less what noise
/// turns).
const HALF_TURN: f64 = 2.6;
/// A pose that is repeated more often than this was not measured anew: no filter holds a noisy pose for so long [1] (a choice).
const REPEATS_OF_A_LOST_OBJECT: usize = 5;

/// Poses that are the tracker's mistakes left out, a symmetric box turned back.
pub(super) fn mended(mut clip: Clip, cell: &Cell) -> (Clip, Vec<String>) {
    let mut remarks: Vec<String> = stood_still(&mut clip.object).into_iter().collect();
    let flips = turn_back(&mut clip.object, cell);
    if flips > 0 {
        remarks.push(format!(
            "the tracker took the box for itself turned by half in {flips} poses; they were turned back to the first one's side"
        ));
    }
    let all = clip.object.len();
    let place = |row: usize| clip.object.poses[row].isometry().translation.vector;
    let mistake = |row: usize| {
        // The first pose and the last have one neighbour: which of the two is wrong is not known.
        if row == 0 || row + 1 >= all {
            return false;
        }
        let (before, after) = (place(row - 1), place(row + 1));
        let off = (place(row) - (before + after) * 0.5).norm();
        off > JUMP_BESIDE_NEIGHBOURS && (after - before).norm() < off
    };
    let good: Vec<usize> = (0..all).filter(|row| !mistake(*row)).collect();
    if good.len() < all {
        remarks.push(format!(
            "{} of {all} poses jump away and back by more than {:.0} mm; they were left out",
            all - good.len(),
            JUMP_BESIDE_NEIGHBOURS * 1e3
        ));
        clip.object = clip.object.select_rows(&good);
    }
    (clip, remarks)
}

/// Leaves out poses that repeat the one before to the bit, many times over, although the tracker's noise moved every pose
/// at first: the tracker lost the object and published on.
fn stood_still(series: &mut ObjectSeries) -> Option<String> {
    let poses = &series.poses;
    // Of a tracker without noise an object at rest repeats its pose from the beginning on: there a repeat says nothing.
    if poses.windows(2).take(REPEATS_OF_A_LOST_OBJECT).any(|pair| pair[0] == pair[1]) {
        return None;
    }
    let (mut good, mut at) = (Vec::new(), 0);
    for run in poses.chunk_by(|a, b| a == b) {
        good.extend(at..at + if run.len() > REPEATS_OF_A_LOST_OBJECT { 1 } else { run.len() });
        at += run.len();
    }
    let (all, left_out) = (at, at - good.len());
    if left_out == 0 {
        return None;
    }
    *series = series.select_rows(&good);
    Some(format!(
        "{left_out} of {all} poses repeat the one before to the bit: the tracker lost the object and published on; they were \
         left out"
    ))
}

/// Turns poses of a box that flip by half against the pose before; how many.
fn turn_back(series: &mut ObjectSeries, cell: &Cell) -> usize {
    let is_box =
        matches!(ObjectModel::new(cell, None), Ok(Some(model)) if matches!(model.shape, ObjectShape::Box { .. }));
    let halves = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
        .map(|axis| UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI));
    let mut flips = 0;
    for row in 1..series.len() {
        // The one before is turned back already, so that a run of poses on the wrong side is turned as a whole.
        let before = series.poses[row - 1].isometry().rotation;
        let pose = series.poses[row].isometry();
        if is_box && before.angle_to(&pose.rotation) > HALF_TURN {
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
