//! The way down to the paper's loss near a place, by asking few points.
//!
//! Hits are rough, so slopes at one point say little; a regression over points scattered around it looks over the
//! roughness. It tells where every pose goes, six numbers each, not only the loss: poses answer to the numbers nearly
//! linearly where their mean distance has a kink, and each point brings thousands of them (Zhang, Conn & Scheinberg 2010
//! go down sums of squares without slopes in the same way). The loss of these modelled poses costs no simulation, so it
//! is searched at leisure; then points are scattered there, less wide.

use super::paper::{Slip, SurfaceLoss};
use inference::estimate::{ClipModel as _, Evolution, Impossible, Unknown, minimise, search};
use inference::kept::{Fingerprint, Trail};
use nalgebra::{Cholesky, DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Times that points are scattered (a choice).
const SCATTER_ROUNDS: usize = 3;
/// First width of the scatter, in what coordinates are counted in, and its shrinking from round to round (choices).
const INITIAL_WIDTH: f64 = 1.5;
const WIDTH_SHRINK: f64 = 0.6;
/// How far the modelled loss may lead away from the middle of the scatter, in its widths (a choice).
const REACH_IN_WIDTHS: f64 = 2.0;
/// Looks at the modelled loss in a round (a choice).
const MODEL_EVALUATIONS: usize = 400;
/// Of the poses that count, every third is modelled (a choice).
const POSE_STRIDE: usize = 3;
/// What the regression holds slopes back with, in squared widths (a choice): enough for a direction that few points went to.
const SLOPE_RIDGE: f64 = 0.3;

/// Points whose loss is asked for at most, of so many coordinates: where all begins, and in every round those scattered
/// and the place they lead to.
pub(super) const fn points(coordinates: usize) -> usize {
    1 + SCATTER_ROUNDS * (scattered(coordinates) + 1)
}

/// Pairs in one more direction than there are.
const fn scattered(coordinates: usize) -> usize {
    2 * (coordinates + 1)
}

/// A place asked for.
#[derive(Serialize, Deserialize)]
struct Asked {
    at: Vec<f64>,
    /// Where the modelled poses went: clip by clip, pose by pose, six numbers each.
    slips: Vec<Vec<[f64; 6]>>,
    loss: f64,
}

/// From zero down to a place of less loss, and the clips simulated on the way. `place` makes numbers of coordinates;
/// clips count as much as `weights` say. `watch` sees coordinates and clips simulated after every round; `false` ends it.
pub(super) fn descend(
    loss: &SurfaceLoss<'_>,
    weights: &[f64],
    coordinates: usize,
    seed: u64,
    place: impl Fn(&[f64]) -> Vec<f64> + Sync,
    (kept, name): Trail<'_>,
    watch: impl Fn(&[f64], usize) -> bool,
) -> (Vec<f64>, usize) {
    let mut random = Pcg64::seed_from_u64(seed);
    let ask = |at: &Vec<f64>| ask(loss, weights, at, &place(at)).ok();
    let (mut middle, mut width, mut simulated) = (vec![0.0; coordinates], INITIAL_WIDTH, loss.clips());
    let mut asked: Vec<Asked> = ask(&middle).into_iter().collect();
    let mut middles: Vec<(f64, Vec<f64>)> = asked.iter().map(|first| (first.loss, first.at.clone())).collect();
    for round in 0..SCATTER_ROUNDS {
        let scattered = scatter(&middle, width, &mut random);
        simulated += (scattered.len() + 1) * loss.clips();
        let of_round = Fingerprint::of(name).with(&("round", round));
        asked.extend(kept.once(&of_round, || scattered.par_iter().filter_map(ask).collect::<Vec<_>>()));
        let Some(vicinity) = Vicinity::through(&asked, &middle, width) else { break };
        middle = vicinity.lowest(loss, weights, seed);
        if let Some(there) = ask(&middle) {
            middles.push((there.loss, middle.clone()));
            asked.push(there);
        }
        width *= WIDTH_SHRINK;
        if !watch(&middle, simulated) {
            break;
        }
    }
    let lowest = middles.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    (lowest.map_or(vec![0.0; coordinates], |(_, at)| at), simulated)
}

fn ask(loss: &SurfaceLoss<'_>, weights: &[f64], at: &[f64], numbers: &[f64]) -> Result<Asked, Impossible> {
    let slips = loss.slips(numbers)?;
    let mean = loss.mean_of(&slips, weights);
    let some = |of_clip: &Vec<Slip>| of_clip.iter().step_by(POSE_STRIDE).map(|slip| (*slip).into()).collect();
    let slips = slips.iter().map(some).collect();
    Ok(Asked { at: at.to_vec(), slips, loss: mean })
}

/// Pairs to both sides of `middle`.
fn scatter(middle: &[f64], width: f64, random: &mut Pcg64) -> Vec<Vec<f64>> {
    let mut points = Vec::new();
    while points.len() < scattered(middle.len()) {
        let way: Vec<f64> = middle.iter().map(|_| random.sample(StandardNormal)).collect();
        for side in [width, -width] {
            points.push(middle.iter().zip(&way).map(|(x, dx): (&f64, &f64)| x + side * dx).collect());
        }
    }
    points
}

/// Where poses go around a place: linear in the coordinates.
struct Vicinity {
    middle: Vec<f64>,
    reach: f64,
    /// Poses modelled, clip by clip.
    poses: Vec<usize>,
    /// `(1 + coordinates, 6 * poses)`: at the middle, and by how much more a unit of each coordinate.
    slopes: DMatrix<f64>,
}

impl Vicinity {
    /// Through the points asked so far, nearer ones counting more; none where there are too few.
    fn through(asked: &[Asked], middle: &[f64], width: f64) -> Option<Self> {
        let n = middle.len();
        let poses: Vec<usize> = asked.first()?.slips.iter().map(Vec::len).collect();
        if asked.len() < n + 2 {
            return None;
        }
        let away = |point: &Asked| point.at.iter().zip(middle).map(|(x, m)| (x - m).powi(2)).sum::<f64>();
        // Square roots of the weights: they stand on both sides of the normal equations.
        let counts = |point: &Asked| (-0.25 * away(point) / (n as f64 * (1.5 * width).powi(2))).exp();
        let roots: Vec<f64> = asked.iter().map(counts).collect();
        let x = DMatrix::from_fn(asked.len(), n + 1, |i, k| {
            roots[i] * if k == 0 { 1.0 } else { asked[i].at[k - 1] - middle[k - 1] }
        });
        let went = |point: &Asked| point.slips.iter().flatten().flat_map(|slip| slip.iter().copied()).collect();
        let went: Vec<Vec<f64>> = asked.iter().map(went).collect();
        let y = DMatrix::from_fn(asked.len(), 6 * poses.iter().sum::<usize>(), |i, k| roots[i] * went[i][k]);
        let mut gram = x.tr_mul(&x);
        // Slopes alone are held back, not the value at the middle.
        for k in 1..=n {
            gram[(k, k)] += SLOPE_RIDGE * width * width;
        }
        let slopes = Cholesky::new(gram)?.solve(&x.tr_mul(&y));
        Some(Self { middle: middle.to_vec(), reach: REACH_IN_WIDTHS * width, poses, slopes })
    }

    /// Where the modelled poses have the least loss.
    fn lowest(&self, loss: &SurfaceLoss<'_>, weights: &[f64], seed: u64) -> Vec<f64> {
        let axis = |m: &f64| Unknown {
            name: String::new(),
            start: *m,
            lower: m - self.reach,
            upper: m + self.reach,
            step: self.reach,
        };
        let axes: Vec<Unknown> = self.middle.iter().map(axis).collect();
        let modelled = |at: &[f64]| loss.mean_of(&self.slips(at), weights);
        let mut cloud = Evolution::new(&search::start(&axes), seed);
        minimise(&mut cloud, &axes, MODEL_EVALUATIONS, &[], modelled, |_, _| true).numbers
    }

    /// Where the poses go, clip by clip.
    fn slips(&self, at: &[f64]) -> Vec<Vec<Slip>> {
        let moved = at.iter().zip(&self.middle).map(|(x, m)| x - m);
        let all = self.slopes.tr_mul(&DVector::from_iterator(1 + at.len(), std::iter::once(1.0).chain(moved)));
        let mut slips = all.as_slice().chunks_exact(6).map(Slip::from_column_slice);
        self.poses.iter().map(|poses| slips.by_ref().take(*poses).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regression_looks_over_roughness_that_slopes_fall_into() {
        let mut random = Pcg64::seed_from_u64(2);
        let rough = |at: &[f64]| {
            let ripple = 0.002 * (90.0 * at[0]).sin();
            Asked { at: at.to_vec(), slips: vec![vec![[0.03 - 0.01 * at[0] + 0.02 * at[1] + ripple; 6]]], loss: 0.0 }
        };
        let asked: Vec<Asked> =
            (0..4).flat_map(|_| scatter(&[1.0, 0.5], 1.0, &mut random)).map(|at| rough(&at)).collect();
        let vicinity = Vicinity::through(&asked, &[1.0, 0.5], 1.0).expect("enough points");
        for at in [[1.0, 0.5], [2.0, 0.5], [1.0, 1.5]] {
            let plain = 0.03 - 0.01 * at[0] + 0.02 * at[1];
            assert!((vicinity.slips(&at)[0][0][5] - plain).abs() < 2e-3, "{at:?}");
        }
        assert!(Vicinity::through(&asked[..3], &[1.0, 0.5], 1.0).is_none(), "too few points say nothing");
    }

    #[test]
    fn points_lie_on_both_sides_and_are_as_many_as_the_bar_counts() {
        let scattered = scatter(&[0.5, -1.0, 2.0], 0.7, &mut Pcg64::seed_from_u64(1));
        assert_eq!(1 + SCATTER_ROUNDS * (scattered.len() + 1), points(3));
        for k in 0..3 {
            let mean = scattered.iter().map(|at| at[k]).sum::<f64>() / scattered.len() as f64;
            assert!((mean - [0.5, -1.0, 2.0][k]).abs() < 1e-12);
        }
    }
}
