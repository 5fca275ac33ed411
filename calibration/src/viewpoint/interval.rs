//! How sure a pose is, from how much its witnesses disagree: frames where there are several, else links.
//!
//! Places of one link in one frame share what is wrong with it (an edge of a cable, a shadow, an angle of a joint), so they
//! are one witness. What each witness would have liked to change, together with how firmly all of them hold the pose, is
//! its scatter (the sandwich of Huber 1967, by groups).

use super::refine::Refined;
use crate::estimate::interval::student_95;
use nalgebra::{Matrix3, Matrix6, Vector6};
use serde::Serialize;

/// Fewer frames than this are no sample of their own.
const FRAMES: usize = 4;
/// One sigma of how much thicker than its mesh a link looks [pixel].
const THICKNESS: f64 = 0.2;

/// Half-widths of 95 % intervals, axes of the base frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Camera position [m].
    pub position: [f64; 3],
    /// Camera orientation, about the axes of the base frame [rad].
    pub rotation: [f64; 3],
    /// How many witnesses it rests on.
    pub witnesses: usize,
}

/// The interval of a pose; `None` when there are fewer than three witnesses or they leave a direction open.
#[must_use]
pub fn interval(refined: &Refined, frames: usize) -> Option<Interval> {
    let by_frame = frames >= FRAMES;
    let mut witnesses: Vec<((usize, usize), Vector6<f64>)> = Vec::new();
    for group in &refined.groups {
        let key = (group.frame, if by_frame { 0 } else { group.link });
        match witnesses.iter_mut().find(|(known, _)| *known == key) {
            Some((_, sum)) => *sum += group.gradient,
            None => witnesses.push((key, group.gradient)),
        }
    }
    let count = witnesses.len();
    if count < 3 {
        return None;
    }
    let (information, _) = refined.sums();
    let inverse = information.try_inverse()?;
    // Whatever draws a border, a mesh or a mask, draws each link a little too thick or too thin.
    let thickness = refined.groups.iter().map(|group| (THICKNESS * THICKNESS) * group.swell * group.swell.transpose());
    let outer = witnesses.iter().fold(Matrix6::zeros(), |sum, (_, g)| sum + g * g.transpose());
    let outer = outer * (count as f64 / (count - 1) as f64) + thickness.sum::<Matrix6<f64>>();
    let spread = inverse * outer * inverse;
    // Position and orientation of the camera in the base frame, from the six numbers.
    let turn = refined.camera_from_base.rotation.to_rotation_matrix().inverse();
    let mut slopes = Matrix6::zeros();
    let pivot: Matrix3<f64> = refined.pivot.coords.cross_matrix();
    slopes.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-(turn * pivot)));
    slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&-turn.matrix());
    slopes.fixed_view_mut::<3, 3>(3, 0).copy_from(&-turn.matrix());
    let covariance = slopes * spread * slopes.transpose();
    let t = student_95(count - 1);
    let half = |i: usize| t * covariance[(i, i)].max(0.0).sqrt();
    Some(Interval { position: [half(0), half(1), half(2)], rotation: [half(3), half(4), half(5)], witnesses: count })
}
