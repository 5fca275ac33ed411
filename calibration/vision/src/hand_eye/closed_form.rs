//! `A X = X B` in closed form, from pairs of pictures: the mount's rotation takes the axes of the board's turns onto those of the
//! arm's, and with it the translations are linear (Park & Martin, IEEE Transactions on Robotics and Automation 10(5), 1994).
//! Pictures that fit no other are found by the median over triples of pictures (Rousseeuw 1984).

use super::chain::Chain;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use shared_mem::hand_eye::Mount;

/// What the arm says, `M`, and the board in the camera's frame, of one picture.
pub type Pair = (Isometry3<f64>, Isometry3<f64>);

/// Turns between two pictures less than this say nothing of a rotation, and near half a turn their axis has two signs [rad].
const TURNS: std::ops::Range<f64> = 0.02..3.0;
/// Triples of pictures that are looked at.
const TRIPLES: usize = 400;
/// A turn by this counts as much as a shift by one [rad/m]: that of a board half a metre away.
const LEVER: f64 = 0.5;
/// How many times further off than the middle picture one is that fits no other. The rest is left to the likelihood.
const ASTRAY: f64 = 8.0;
/// Distances below this count as this: noise is no outlier [m].
const NOISE: f64 = 2e-3;

/// The camera's mount from all pairs of pictures; `None` where no two turn against each other.
pub fn mount(pictures: &[&Pair]) -> Option<Isometry3<f64>> {
    let pairs = (0..pictures.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let pairs: Vec<(Isometry3<f64>, Isometry3<f64>)> = pairs
        .map(|(i, j)| (pictures[j].0 * pictures[i].0.inverse(), pictures[j].1 * pictures[i].1.inverse()))
        .filter(|(arm, board)| TURNS.contains(&arm.rotation.angle()) && TURNS.contains(&board.rotation.angle()))
        .collect();
    if pairs.is_empty() {
        return None;
    }
    let outer = |sum: Matrix3<f64>, (arm, board): &(Isometry3<f64>, Isometry3<f64>)| {
        sum + arm.rotation.scaled_axis() * board.rotation.scaled_axis().transpose()
    };
    let svd = pairs.iter().fold(Matrix3::zeros(), outer).svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let turn = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t);
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let (mut rows, mut right) = (DMatrix::zeros(3 * pairs.len(), 3), DVector::zeros(3 * pairs.len()));
    for (number, (arm, board)) in pairs.iter().enumerate() {
        let row = arm.rotation.to_rotation_matrix().matrix() - Matrix3::identity();
        rows.fixed_view_mut::<3, 3>(3 * number, 0).copy_from(&row);
        let there = turn * board.translation.vector - arm.translation.vector;
        right.fixed_rows_mut::<3>(3 * number).copy_from(&there);
    }
    // About one axis alone, a shift along it is open: it is left at zero.
    let svd = rows.svd(true, true);
    let least = 1e-3 * svd.singular_values.max();
    let shift = svd.solve(&right, least).ok()?;
    Some(Isometry3::from_parts(Translation3::new(shift[0], shift[1], shift[2]), turn))
}

/// Where the board then lies by one picture.
fn board_by((link, seen): &Pair, camera: &Isometry3<f64>) -> Isometry3<f64> {
    link.inverse() * camera * seen
}

/// The middle of places and rotations.
fn middle(poses: &[Isometry3<f64>]) -> Isometry3<f64> {
    let count = poses.len().max(1) as f64;
    let shift = poses.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() / count;
    let first = poses.first().map_or_else(UnitQuaternion::identity, |pose| pose.rotation);
    let turns = poses.iter().map(|pose| (pose.rotation * first.inverse()).scaled_axis());
    let turn = UnitQuaternion::from_scaled_axis(turns.sum::<Vector3<f64>>() / count) * first;
    Isometry3::from_parts(shift.into(), turn)
}

fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + LEVER * a.rotation.angle_to(&b.rotation)
}

/// Mount and board from the pictures that fit one another, and which these are; `None` for fewer than three pictures or
/// where no two turn against each other.
pub fn start(mount_kind: Mount, pictures: &[Pair]) -> Option<(Chain, Vec<bool>)> {
    let count = pictures.len();
    if count < 3 {
        return None;
    }
    let distances = |of: &[&Pair]| -> Option<Vec<f64>> {
        let camera = mount(of)?;
        let board = middle(&of.iter().map(|pair| board_by(pair, &camera)).collect::<Vec<_>>());
        Some(pictures.iter().map(|pair| apart(&board_by(pair, &camera), &board)).collect())
    };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for [a, b, c] in triples(count) {
        let Some(off) = distances(&[&pictures[a], &pictures[b], &pictures[c]]) else { continue };
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[(count + 3) / 2 - usize::from(count == 3)];
        if best.as_ref().is_none_or(|(least, _)| median < *least) {
            best = Some((median, off));
        }
    }
    let (median, off) = best?;
    let fits: Vec<bool> = off.iter().map(|off| *off <= ASTRAY * median.max(NOISE)).collect();
    let used: Vec<&Pair> = pictures.iter().zip(&fits).filter(|(_, fits)| **fits).map(|(pair, _)| pair).collect();
    let camera = mount(&used)?;
    let board = middle(&used.iter().map(|pair| board_by(pair, &camera)).collect::<Vec<_>>());
    Some((Chain { mount: mount_kind, camera, board }, fits))
}

/// All triples of few pictures, evenly drawn ones of many.
fn triples(count: usize) -> Vec<[usize; 3]> {
    let all = (0..count).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
    let total = count * (count - 1) * (count - 2) / 6;
    let by = total.div_ceil(TRIPLES).max(1);
    // A step that shares no factor with the counts of pictures, so that all of them take part.
    let by = (by..).find(|by| [2, 3, count, count - 1, count - 2].iter().all(|n| gcd(*by, *n) == 1)).unwrap_or(1);
    all.step_by(if total <= TRIPLES { 1 } else { by }).collect()
}

const fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
