//! One step of the shared parameters, every clip's nuisance parameters at their best before and after it.
//!
//! Own numbers are cheap (they cost a slide, not a hit) and must not hold up the shared ones: a clip whose slide begins
//! elsewhere than simulated finds its own way first. A clip that nothing fits counts less, so that it does not steer
//! the others.

use crate::estimate::interval::LEVEL;
use crate::estimate::profile::{Profile, profiled};
use crate::estimate::solve::{Descent, End, Problem, Quadratic, Schedule, Trial, descend};
use crate::estimate::{ClipFit, Fit, Impossible, Intervals, Random, Unknown, at_bounds, without_leaning};
use crate::likelihood::object::ObjectClips;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is asked of the clips.
#[derive(Clone, Copy)]
pub struct Question<'a> {
    pub clips: &'a ObjectClips,
    /// The shared parameters.
    pub unknowns: &'a [Unknown],
    /// The nuisance parameters.
    pub random: &'a [Random],
}

/// All clips around one point, nuisance parameters at their best.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Linearised {
    /// The shared parameters.
    pub shared: Vec<f64>,
    /// The clips there.
    pub clips: Vec<ClipFit>,
    /// How much each counts: 1, less where nothing fits.
    pub weights: Vec<f64>,
    /// Whether the step that led here was small against what the clips can tell.
    pub small: bool,
    /// Calls of the model that led here.
    pub evaluations: usize,
}

/// How much wider an interval may get by a look at the deviance [1] (a choice).
const MAX_WIDENING: f64 = 6.0;
/// How nuisance parameters come to their best.
const PROFILE: Schedule =
    Schedule { damping: 1e-6, grown: 1e-3, trials: 12, iterations: 2, tolerance: 0.3, secant: None };
/// One step of the shared ones. Much damping: a hit is rough, and a whole step seldom leads down.
const SHARED_STEP: Schedule =
    Schedule { damping: 1e-3, grown: 1e-3, trials: 5, iterations: 1, tolerance: 0.3, secant: None };
/// A clip counts less from so many times the usual misfit on (a choice).
const OUTLIER_MISFIT: f64 = 4.0;

impl Linearised {
    /// `-2 ln` of the likelihood of all clips.
    pub fn deviance(&self) -> f64 {
        self.clips.iter().zip(&self.weights).map(|(clip, weight)| weight * clip.deviance).sum()
    }

    /// The clips' nuisance parameters.
    pub fn own(&self) -> Vec<Vec<f64>> {
        self.clips.iter().map(|clip| clip.own.clone()).collect()
    }

    /// Information on the shared parameters.
    pub fn information(&self) -> DMatrix<f64> {
        let n = self.shared.len();
        let parts = self.clips.iter().zip(&self.weights);
        parts.fold(DMatrix::zeros(n, n), |sum, (clip, weight)| sum + &clip.information * *weight)
    }

    /// The estimate of the shared parameters to first order: the clips as much as each counts, wanting what they would want
    /// had they been left out; which numbers rest on a bound; how sure the others are.
    pub fn estimate(&self, unknowns: &[Unknown]) -> (Fit, Vec<bool>, Intervals) {
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
        let intervals = Intervals::new(&fit, &held, LEVEL);
        (fit, held, intervals)
    }

    fn gradient(&self) -> DVector<f64> {
        let parts = self.clips.iter().zip(&self.weights);
        parts.fold(DVector::zeros(self.shared.len()), |sum, (clip, weight)| sum + &clip.gradient * *weight)
    }
}

impl Question<'_> {
    /// The clips linearised after one step from `shared` with `own`; where no step leads down, there.
    ///
    /// # Errors
    /// [`Impossible`] when a clip cannot be simulated there.
    pub fn improved(&self, shared: &[f64], own: &[Vec<f64>]) -> Result<Linearised, Impossible> {
        let mut strokes = Strokes { question: *self, evaluations: 0 };
        let place = strokes.profiled(shared, own)?;
        let mut way = Descent { place, slopes: None, damping: SHARED_STEP.damping };
        let end = descend(&mut strokes, &mut way, &SHARED_STEP)?;
        let at = match way.slopes {
            Some(at) => at,
            None => strokes.linearised(&way.place)?,
        };
        Ok(Linearised { small: end != End::Stopped, evaluations: strokes.evaluations, ..at })
    }

    /// The clips linearised at `shared`, nuisance parameters at their best.
    ///
    /// # Errors
    /// As [`Self::improved`].
    pub fn here(&self, shared: &[f64], own: &[Vec<f64>]) -> Result<Linearised, Impossible> {
        let mut strokes = Strokes { question: *self, evaluations: 0 };
        let place = strokes.profiled(shared, own)?;
        let at = strokes.linearised(&place)?;
        Ok(Linearised { evaluations: strokes.evaluations, ..at })
    }

    /// By how much wider than slopes say the clips leave each number, 1 to `MAX_WIDENING`: the deviance is looked at where the
    /// 95 % interval ends, to both sides, the other numbers following. A hit's roughness makes slopes, and
    /// so information, larger than what the clips can really tell, and nearer by nothing but the roughness would be seen.
    ///
    /// # Errors
    /// As [`Self::improved`].
    pub fn widths(&self, at: &Linearised) -> Result<(Vec<f64>, usize), Impossible> {
        let (n, half) = (at.shared.len(), at.estimate(self.unknowns).2.half_width);
        let (own, mut strokes) = (at.own(), Strokes { question: *self, evaluations: 0 });
        let information = at.information();
        let Some(covariance) = information.clone().try_inverse() else { return Ok((vec![1.0; n], 0)) };
        let here = strokes.profiled(&at.shared, &own)?.cost(self.random, &at.weights);
        let mut widths = vec![1.0; n];
        let looked_at = |k: &usize| covariance[(*k, *k)] > 0.0 && half[*k].is_finite();
        for (k, width) in widths.iter_mut().enumerate().filter(|(k, _)| looked_at(k)) {
            let way = covariance.column(k) * (half[k] / covariance[(k, k)]);
            let (mut promised, mut risen) = (0.0, 0.0);
            for side in [-1.0, 1.0] {
                let inside =
                    |j: usize| (at.shared[j] + side * way[j]).clamp(self.unknowns[j].lower, self.unknowns[j].upper);
                let to: Vec<f64> = (0..n).map(inside).collect();
                if let Ok(there) = strokes.profiled(&to, &own) {
                    let moved = DVector::from_fn(n, |j, _| to[j] - at.shared[j]);
                    promised += moved.dot(&(&information * &moved));
                    risen += there.cost(self.random, &at.weights) - here;
                }
            }
            // Both sides together: one alone may fall by chance where the hit is rough. Where both fall, the interval is as wide as it
            // may be.
            *width = (promised / risen.max(1e-9)).sqrt().clamp(1.0, MAX_WIDENING);
        }
        Ok((widths, strokes.evaluations))
    }
}

/// Shared parameters, and every clip with its nuisance parameters at their best.
struct Place {
    shared: Vec<f64>,
    clips: Vec<Profile>,
}

impl Place {
    /// What the clips cost, each as much as it counts.
    fn cost(&self, random: &[Random], weights: &[f64]) -> f64 {
        let cost = |clip: &ClipFit| clip.chi2 + Random::penalty(random, &clip.own);
        self.clips.iter().zip(weights).map(|(profile, weight)| cost(&profile.clip) * weight).sum()
    }
}

/// The clips of a question on their way down.
struct Strokes<'a> {
    question: Question<'a>,
    /// Calls of the model.
    evaluations: usize,
}

impl Strokes<'_> {
    fn profiled(&mut self, shared: &[f64], own: &[Vec<f64>]) -> Result<Place, Impossible> {
        let Question { clips, random, .. } = self.question;
        let clips = profiled(clips, shared, random, own, &PROFILE)?;
        self.evaluations += clips.iter().map(|profile| profile.evaluations).sum::<usize>();
        Ok(Place { shared: shared.to_vec(), clips })
    }
}

impl Problem for Strokes<'_> {
    type Place = Place;
    type Slopes = Linearised;

    fn linearised(&mut self, place: &Place) -> Result<Linearised, Impossible> {
        let Question { clips, unknowns, random } = self.question;
        let one = |(clip, profile): (usize, &Profile)| {
            ClipFit::at(clips, clip, (unknowns, &place.shared), (random, &profile.clip.own))
        };
        let clips: Vec<ClipFit> = place.clips.par_iter().enumerate().map(one).collect::<Result<_, _>>()?;
        let each = 1 + unknowns.len() + random.iter().filter(|effect| effect.sigma > 0.0).count();
        self.evaluations += clips.len() * each;
        let weights = weights(&clips);
        Ok(Linearised { shared: place.shared.clone(), clips, weights, small: false, evaluations: 0 })
    }

    fn quadratic(&self, place: &Place, at: &Linearised) -> Result<Quadratic, Impossible> {
        let Question { unknowns, random, .. } = self.question;
        Ok(Quadratic {
            cost: place.cost(random, &at.weights),
            information: at.information(),
            gradient: at.gradient(),
            room: unknowns.iter().zip(&place.shared).map(|(unknown, at)| unknown.room(*at)).collect(),
        })
    }

    fn stepped(&mut self, from: &Place, at: &Linearised, trial: Trial<'_>) -> Option<(Place, f64)> {
        let to: Vec<f64> = from.shared.iter().zip(trial.step.iter()).map(|(x, dx)| x + dx).collect();
        let there = self.profiled(&to, &at.own()).ok()?;
        let cost = there.cost(self.question.random, &at.weights);
        Some((there, cost))
    }
}

/// 1 for clips whose misfit is usual, in inverse proportion to it beyond.
fn weights(clips: &[ClipFit]) -> Vec<f64> {
    let misfits: Vec<f64> = clips.iter().map(|clip| clip.chi2 / clip.rows.max(1) as f64).collect();
    let mut sorted = misfits.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0).max(0.25);
    misfits.into_iter().map(|misfit| (OUTLIER_MISFIT * usual / misfit).min(1.0)).collect()
}
