//! One step of the shared numbers, every clip's own ones at their best before and after it.
//!
//! Own numbers are cheap (they cost a slide, not a hit) and must not hold up the shared ones: a clip whose slide begins
//! elsewhere than simulated finds its own way first. A clip that nothing fits counts less, so that it does not steer
//! the others.

use inference::estimate::{
    ClipFit, ClipModel, Descent, Fit, Impossible, Intervals, Options, Random, Unknown, at_bounds, fit_from,
    without_leaning,
};
use inference::likelihood::object::ObjectClips;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is asked of the clips.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub(super) clips: &'a ObjectClips,
    /// The shared numbers.
    pub(super) unknowns: &'a [Unknown],
    /// The own ones.
    pub(super) random: &'a [Random],
}

/// All clips around one point, own numbers at their best.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Linearised {
    /// The shared numbers.
    pub(super) shared: Vec<f64>,
    /// The clips there.
    pub(super) clips: Vec<ClipFit>,
    /// How much each counts: 1, less where nothing fits.
    pub(super) weights: Vec<f64>,
    /// Whether the step that led here was small against what the clips can tell.
    pub(super) small: bool,
    /// Calls of the model that led here.
    pub(super) evaluations: usize,
}

/// How much wider an interval may get by a look at the deviance.
const WIDEST: f64 = 6.0;
/// Steps of the own numbers at most.
const OWN: Options = Options { iterations: 2, tolerance: 0.3 };
/// Damping of the first trial: a hit is rough, and a whole step seldom leads down.
const DAMPING: f64 = 1e-3;
/// Trials with growing damping.
const TRIALS: usize = 5;
/// A step is small when it promises less than this [nats of -2 ln likelihood].
const SMALL: f64 = 0.3;
/// A clip counts less from so many times the usual misfit on.
const MISFIT: f64 = 4.0;

impl Linearised {
    /// `-2 ln` of the likelihood of all clips.
    pub(super) fn deviance(&self) -> f64 {
        self.clips.iter().zip(&self.weights).map(|(clip, weight)| weight * clip.deviance).sum()
    }

    /// The clips' own numbers.
    pub(super) fn own(&self) -> Vec<Vec<f64>> {
        self.clips.iter().map(|clip| clip.own.clone()).collect()
    }

    /// Information on the shared numbers.
    pub(super) fn information(&self) -> DMatrix<f64> {
        let n = self.shared.len();
        let parts = self.clips.iter().zip(&self.weights);
        parts.fold(DMatrix::zeros(n, n), |sum, (clip, weight)| sum + &clip.information * *weight)
    }

    /// The estimate of the shared numbers to first order: the clips as much as each counts, wanting what they would want
    /// had they been left out; which numbers rest on a bound; how sure the others are.
    pub(super) fn estimate(&self, unknowns: &[Unknown]) -> (Fit, Vec<bool>, Intervals) {
        let mut clips = self.clips.clone();
        for (clip, weight) in clips.iter_mut().zip(&self.weights) {
            clip.information *= *weight;
            clip.gradient *= *weight;
            clip.scores.iter_mut().for_each(|score| *score *= *weight);
        }
        let shared = self.shared.clone();
        let mut fit = Fit { shared, clips, converged: self.small, evaluations: self.evaluations, history: Vec::new() };
        let held = at_bounds(unknowns, &fit.shared);
        without_leaning(&mut fit, &held);
        let intervals = Intervals::new(&fit, &held);
        (fit, held, intervals)
    }

    fn gradient(&self) -> DVector<f64> {
        let parts = self.clips.iter().zip(&self.weights);
        parts.fold(DVector::zeros(self.shared.len()), |sum, (clip, weight)| sum + &clip.gradient * *weight)
    }
}

/// One clip at shared numbers that are given.
struct OneClip<'a> {
    clips: &'a ObjectClips,
    clip: usize,
    shared: &'a [f64],
}

impl ClipModel for OneClip<'_> {
    fn clips(&self) -> usize {
        1
    }

    fn residuals(&self, _: usize, _: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.clips.residuals(self.clip, self.shared, own, out)
    }

    fn stepped(
        &self,
        _: usize,
        (_, own): (&[f64], &[f64]),
        ((_, from), base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.clips.stepped(self.clip, (self.shared, own), ((self.shared, from), base), out)
    }
}

/// Own numbers at their best, their cost, calls of the model.
type Profiled = (Vec<f64>, f64, usize);

impl Question<'_> {
    /// The clips linearised after one step from `shared` with `own`; where no step leads down, there.
    ///
    /// # Errors
    /// [`Impossible`] when a clip cannot be simulated there.
    pub(super) fn improved(&self, shared: &[f64], own: &[Vec<f64>]) -> Result<Linearised, Impossible> {
        let here = self.profiled(shared, own)?;
        let at = self.linearised(shared, &here)?;
        let (information, gradient, cost) = (at.information(), at.gradient(), weighted(&here, &at.weights));
        let room: Vec<[f64; 2]> = self.unknowns.iter().zip(shared).map(|(unknown, at)| unknown.room(*at)).collect();
        let descent =
            Descent { information: &information, gradient: &gradient, room: &room, enough: SMALL, trials: TRIALS };
        let start: Vec<Vec<f64>> = here.iter().map(|(own, ..)| own.clone()).collect();
        let mut evaluations = at.evaluations;
        let mut damping = DAMPING;
        let found = descent.step(&mut damping, |_, step| {
            let to: Vec<f64> = shared.iter().zip(step.iter()).map(|(x, dx)| x + dx).collect();
            let there = self.profiled(&to, &start).ok()?;
            evaluations += there.iter().map(|(.., calls)| calls).sum::<usize>();
            (weighted(&there, &at.weights) < cost).then_some((to, there))
        });
        let Some((to, there)) = found else { return Ok(Linearised { small: true, evaluations, ..at }) };
        let mut after = self.linearised(&to, &there)?;
        after.evaluations += evaluations;
        Ok(after)
    }

    /// The clips linearised at `shared`, own numbers at their best.
    ///
    /// # Errors
    /// As [`Self::improved`].
    pub(super) fn here(&self, shared: &[f64], own: &[Vec<f64>]) -> Result<Linearised, Impossible> {
        self.linearised(shared, &self.profiled(shared, own)?)
    }

    /// By how much wider than slopes say the clips leave each number, 1 to [`WIDEST`]: the deviance is looked at where the
    /// interval of half width `half` ends, to both sides, the other numbers following. A hit's roughness makes slopes, and
    /// so information, larger than what the clips can really tell, and nearer by nothing but the roughness would be seen.
    ///
    /// # Errors
    /// As [`Self::improved`].
    pub(super) fn widths(&self, at: &Linearised, half: &[f64]) -> Result<(Vec<f64>, usize), Impossible> {
        let n = at.shared.len();
        let (own, mut evaluations) = (at.own(), 0);
        let information = at.information();
        let Some(covariance) = information.clone().try_inverse() else { return Ok((vec![1.0; n], 0)) };
        let here = weighted(&self.profiled(&at.shared, &own)?, &at.weights);
        let mut widths = vec![1.0; n];
        let looked_at = |k: &usize| covariance[(*k, *k)] > 0.0 && half[*k].is_finite();
        for (k, width) in widths.iter_mut().enumerate().filter(|(k, _)| looked_at(k)) {
            let way = covariance.column(k) * (half[k] / covariance[(k, k)]);
            let (mut promised, mut risen) = (0.0, 0.0);
            for side in [-1.0, 1.0] {
                let inside =
                    |j: usize| (at.shared[j] + side * way[j]).clamp(self.unknowns[j].lower, self.unknowns[j].upper);
                let to: Vec<f64> = (0..n).map(inside).collect();
                if let Ok(there) = self.profiled(&to, &own) {
                    evaluations += there.iter().map(|(.., calls)| calls).sum::<usize>();
                    let moved = DVector::from_fn(n, |j, _| to[j] - at.shared[j]);
                    promised += moved.dot(&(&information * &moved));
                    risen += weighted(&there, &at.weights) - here;
                }
            }
            // Both sides together: one alone may fall by chance where the hit is rough.
            *width = (promised / risen.max(1e-9)).sqrt().clamp(1.0, WIDEST);
        }
        Ok((widths, evaluations))
    }

    fn profiled(&self, shared: &[f64], own: &[Vec<f64>]) -> Result<Vec<Profiled>, Impossible> {
        let one = |(clip, own): (usize, &Vec<f64>)| {
            let model = OneClip { clips: self.clips, clip, shared };
            let fit = fit_from(&model, &[], self.random, (Vec::new(), vec![own.clone()]), &OWN, |_, _| true)?;
            let [clip] = &fit.clips[..] else { return Err(Impossible("no clip".into())) };
            Ok((clip.own.clone(), clip.chi2 + Random::penalty(self.random, &clip.own), fit.evaluations))
        };
        own.par_iter().enumerate().map(one).collect()
    }

    fn linearised(&self, shared: &[f64], at: &[Profiled]) -> Result<Linearised, Impossible> {
        let one = |(clip, (own, ..)): (usize, &Profiled)| {
            ClipFit::at(self.clips, clip, (self.unknowns, shared), (self.random, own))
        };
        let clips: Vec<ClipFit> = at.par_iter().enumerate().map(one).collect::<Result<_, _>>()?;
        let each = 1 + self.unknowns.len() + self.random.iter().filter(|effect| effect.sigma > 0.0).count();
        let evaluations = at.iter().map(|(.., calls)| calls + each).sum();
        let weights = weights(&clips);
        Ok(Linearised { shared: shared.to_vec(), clips, weights, small: false, evaluations })
    }
}

fn weighted(clips: &[Profiled], weights: &[f64]) -> f64 {
    clips.iter().zip(weights).map(|((_, cost, _), weight)| cost * weight).sum()
}

/// 1 for clips whose misfit is usual, in inverse proportion to it beyond.
fn weights(clips: &[ClipFit]) -> Vec<f64> {
    let misfits: Vec<f64> = clips.iter().map(|clip| clip.chi2 / clip.rows.max(1) as f64).collect();
    let mut sorted = misfits.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0).max(0.25);
    misfits.into_iter().map(|misfit| (MISFIT * usual / misfit).min(1.0)).collect()
}
