//! How sure a pose is, from how much its witnesses disagree.
//!
//! Places of one link share what is wrong with it in every picture (its mesh, how light falls on it, an edge of a cable);
//! those of one picture share what is wrong with that (a joint's angle, a shadow, the moment). So links are witnesses, and so
//! are pictures where there are several: the scatter of both together, less what is counted twice (two-way clustering,
//! Cameron, Gelbach & Miller 2011), each by [`inference::estimate::sandwich`].
//!
//! What all places share no witness tells: light from one side moves the edges of all limbs alike. By how much the pose moves
//! when the edges are explained otherwise is what is not known of that, and comes on top.

use super::refine::{Group, Refined};
use inference::estimate::interval::LEVEL;
use inference::estimate::sandwich::{Witness, covariance};
use inference::statistics::student;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector6};
use serde::{Deserialize, Serialize};

/// Fewer frames than this are no sample of their own.
const FRAMES: usize = 4;
/// One sigma of how much thicker than its mesh a link looks in a picture [pixel].
const THICKNESS: f64 = 0.2;

/// Half-widths of 95 % intervals, axes of the base frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Camera position [m].
    pub position: [f64; 3],
    /// Camera orientation, about the axes of the base frame [rad].
    pub rotation: [f64; 3],
    /// How many witnesses it rests on.
    pub witnesses: usize,
}

/// The interval of a pose; `None` when there are fewer than three witnesses or they leave a direction open.
pub fn interval(refined: &Refined, frames: usize) -> Option<Interval> {
    let groups: Vec<Group> = refined.freed().collect();
    let links = witnesses(&groups, |group| (0, group.link));
    let by_links = spread(refined, &links)?;
    let (scatter, count) = if frames < FRAMES {
        (by_links, links.len())
    } else {
        let pictures = witnesses(&groups, |group| (group.frame, 0));
        let by_pictures = spread(refined, &pictures)?;
        let twice = spread(refined, &witnesses(&groups, |group| (group.frame, group.link)))?;
        (both(by_links, by_pictures, &twice), links.len().min(pictures.len()))
    };
    if count < 3 {
        return None;
    }
    let scatter = scatter + thickness(refined, &groups)? + explained_otherwise(refined, &groups)?;
    // Position and orientation of the camera in the base frame, from the six numbers.
    let turn = refined.camera_from_base.rotation.to_rotation_matrix().inverse();
    let mut slopes = Matrix6::zeros();
    let pivot: Matrix3<f64> = refined.pivot.coords.cross_matrix();
    slopes.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-(turn * pivot)));
    slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&-turn.matrix());
    slopes.fixed_view_mut::<3, 3>(3, 0).copy_from(&-turn.matrix());
    let covariance = slopes * scatter * slopes.transpose();
    let t = student(LEVEL, count - 1);
    let half = |i: usize| t * covariance[(i, i)].max(0.0).sqrt();
    Some(Interval { position: [half(0), half(1), half(2)], rotation: [half(3), half(4), half(5)], witnesses: count })
}

/// Whatever draws a border, a mesh or a mask, draws each link a little too thick or too thin, beyond what all have in common.
fn thickness(refined: &Refined, groups: &[Group]) -> Option<Matrix6<f64>> {
    let inverse = refined.sums().information.try_inverse()?;
    let outer = groups.iter().map(|group| (THICKNESS * THICKNESS) * group.swell * group.swell.transpose());
    Some(inverse * outer.sum::<Matrix6<f64>>() * inverse)
}

/// How far the pose moves when what is seen is explained otherwise, as a covariance.
fn explained_otherwise(refined: &Refined, groups: &[Group]) -> Option<Matrix6<f64>> {
    let doubt: Vector6<f64> = groups.iter().map(|group| group.doubt.0).sum();
    let moved = refined.sums().information.cholesky()?.solve(&doubt);
    Some(moved * moved.transpose())
}

/// Number by number the sum less what is in both; what is taken off is itself a guess, and never leaves less than the larger.
fn both(links: Matrix6<f64>, pictures: Matrix6<f64>, twice: &Matrix6<f64>) -> Matrix6<f64> {
    let sum = links + pictures - twice;
    let larger = if links.trace() > pictures.trace() { links } else { pictures };
    if sum.cholesky().is_some() && (0..6).all(|i| sum[(i, i)] >= larger[(i, i)]) { sum } else { larger }
}

/// Groups together that have the same key.
fn witnesses(groups: &[Group], key: impl Fn(&Group) -> (usize, usize)) -> Vec<Witness> {
    let mut found: Vec<((usize, usize), Witness)> = Vec::new();
    for group in groups {
        let score = DVector::from_column_slice(group.gradient.as_slice());
        let information = DMatrix::from_column_slice(6, 6, group.information.as_slice());
        match found.iter_mut().find(|(known, _)| *known == key(group)) {
            Some((_, witness)) => {
                witness.score += score;
                witness.information += information;
            }
            None => found.push((key(group), Witness { score, information })),
        }
    }
    found.into_iter().map(|(_, witness)| witness).collect()
}

fn spread(refined: &Refined, witnesses: &[Witness]) -> Option<Matrix6<f64>> {
    let information = DMatrix::from_column_slice(6, 6, refined.sums().information.as_slice());
    covariance(&information, witnesses.iter()).map(|found| Matrix6::from_column_slice(found.as_slice()))
}
