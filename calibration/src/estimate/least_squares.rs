//! Bounded Levenberg-Marquardt over all clips: the default way to find shared numbers, the clips' own ones with them.

use super::linear::ClipFit;
use super::problem::{ClipModel, Impossible, Random, Unknown};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// At most so many linearisations.
    pub iterations: usize,
    /// Converged once a step promises to lower the deviance by less than this; 1 is what noise alone moves.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { iterations: 20, tolerance: 1e-3 }
    }
}

/// The best numbers found, and every clip linearised there.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The shared numbers, in the order of the unknowns.
    pub shared: Vec<f64>,
    /// The clips there.
    pub clips: Vec<ClipFit>,
    /// Whether the last step was small; otherwise the iterations ran out or the caller stopped it.
    pub converged: bool,
    /// Calls of the model: one is one clip simulated.
    pub evaluations: usize,
    /// Deviance after each linearisation.
    pub history: Vec<f64>,
}

impl Fit {
    /// `-2 ln` of the likelihood of all clips.
    #[must_use]
    pub fn deviance(&self) -> f64 {
        self.clips.iter().map(|clip| clip.deviance).sum()
    }

    /// Information on the shared numbers from all clips, `P x P`.
    #[must_use]
    pub fn information(&self) -> DMatrix<f64> {
        let parts = self.clips.iter().map(|clip| &clip.information);
        parts.fold(DMatrix::zeros(self.shared.len(), self.shared.len()), |sum, part| sum + part)
    }

    fn gradient(&self) -> DVector<f64> {
        self.clips.iter().fold(DVector::zeros(self.shared.len()), |sum, clip| sum + &clip.gradient)
    }
}

/// Finds the shared numbers and every clip's own ones.
///
/// `watch` is told every new deviance and the shared numbers there; `false` ends the search with the best so far.
///
/// # Errors
/// [`Impossible`] when the model has no answer at the start.
pub fn fit(
    model: &impl ClipModel,
    unknowns: &[Unknown],
    random: &[Random],
    options: &Options,
    watch: impl Fn(f64, &[f64]) -> bool,
) -> Result<Fit, Impossible> {
    let shared = unknowns.iter().map(|unknown| unknown.start).collect();
    let own = vec![vec![0.0; random.len()]; model.clips()];
    fit_from(model, unknowns, random, (shared, own), options, watch)
}

/// The same from another start: the shared numbers and every clip's own ones.
///
/// # Errors
/// As [`fit`].
pub fn fit_from(
    model: &impl ClipModel,
    unknowns: &[Unknown],
    random: &[Random],
    (shared, own): (Vec<f64>, Vec<Vec<f64>>),
    options: &Options,
    watch: impl Fn(f64, &[f64]) -> bool,
) -> Result<Fit, Impossible> {
    let counted = Counted { model, calls: AtomicUsize::new(0) };
    let clips = linearise(&counted, unknowns, random, &shared, &own)?;
    let mut best = Fit { shared, clips, converged: false, evaluations: 0, history: Vec::new() };
    best.history.push(best.deviance());
    let mut damping = 1e-6;
    for _ in 0..options.iterations {
        if !watch(best.deviance(), &best.shared) {
            break;
        }
        match improve(&counted, unknowns, random, &mut best, &mut damping, options.tolerance)? {
            Progress::Better => best.history.push(best.deviance()),
            Progress::Arrived => {
                best.converged = true;
                break;
            }
        }
    }
    best.evaluations = counted.calls.into_inner();
    Ok(best)
}

/// Every clip at shared numbers that are given, its own numbers at their best: how clips that were not fitted are judged.
///
/// # Errors
/// [`Impossible`] when the model has no answer there.
pub fn score(
    model: &impl ClipModel,
    shared: &[f64],
    random: &[Random],
    options: &Options,
) -> Result<Vec<ClipFit>, Impossible> {
    let fixed = Given { model, shared };
    // Clips do not depend on each other once nothing is shared.
    let clips: Vec<usize> = (0..model.clips()).collect();
    clips
        .into_par_iter()
        .map(|clip| {
            let one = One { model: &fixed, clip };
            fit(&one, &[], random, options, |_, _| true).map(|mut fit| fit.clips.swap_remove(0))
        })
        .collect()
}

enum Progress {
    Better,
    Arrived,
}

/// Most trials with growing damping before a point counts as the best there is.
const TRIALS: usize = 12;

fn improve<M: ClipModel>(
    model: &Counted<'_, M>,
    unknowns: &[Unknown],
    random: &[Random],
    best: &mut Fit,
    damping: &mut f64,
    tolerance: f64,
) -> Result<Progress, Impossible> {
    let (information, gradient) = (best.information(), best.gradient());
    for _ in 0..TRIALS {
        let step = bounded_step(unknowns, &best.shared, &information, &gradient, *damping);
        let own: Vec<Vec<f64>> = best.clips.iter().map(|clip| clip.own_after(&step)).collect();
        if promised(best, &step) < tolerance {
            return Ok(Progress::Arrived);
        }
        let shared: Vec<f64> = (best.shared.iter().zip(unknowns).zip(step.iter()))
            .map(|((value, unknown), step)| (value + step).clamp(unknown.lower, unknown.upper))
            .collect();
        if cost(model, random, &shared, &own).is_some_and(|cost| cost < current(best, random)) {
            *damping = (*damping * 0.1).max(1e-9);
            best.clips = linearise(model, unknowns, random, &shared, &own)?;
            best.shared = shared;
            return Ok(Progress::Better);
        }
        *damping = (*damping * 10.0).max(1e-4);
        // The own numbers alone may be what overshoots, and damping the shared ones does not shorten their way.
        if unknowns.is_empty() {
            return Ok(halved_own(model, random, best, &own)?.map_or(Progress::Arrived, |()| Progress::Better));
        }
    }
    Ok(Progress::Arrived)
}

/// The way of the own numbers, halved until it leads down.
fn halved_own<M: ClipModel>(
    model: &Counted<'_, M>,
    random: &[Random],
    best: &mut Fit,
    target: &[Vec<f64>],
) -> Result<Option<()>, Impossible> {
    let mut share = 0.5;
    for _ in 0..TRIALS {
        let own: Vec<Vec<f64>> = (best.clips.iter().zip(target))
            .map(|(clip, to)| clip.own.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect())
            .collect();
        if cost(model, random, &best.shared, &own).is_some_and(|cost| cost < current(best, random)) {
            best.clips = linearise(model, &[], random, &best.shared, &own)?;
            return Ok(Some(()));
        }
        share *= 0.5;
    }
    Ok(None)
}

/// A damped Newton step that keeps numbers at a bound there when they are pushed against it.
fn bounded_step(
    unknowns: &[Unknown],
    shared: &[f64],
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> DVector<f64> {
    let mut held = vec![false; unknowns.len()];
    loop {
        let free: Vec<usize> = (0..unknowns.len()).filter(|k| !held[*k]).collect();
        let mut h = DMatrix::from_fn(free.len(), free.len(), |i, j| information[(free[i], free[j])]);
        for i in 0..free.len() {
            // A number that nothing depends on stays where it is.
            h[(i, i)] += damping * h[(i, i)] + f64::MIN_POSITIVE.sqrt();
        }
        let g = DVector::from_fn(free.len(), |i, _| gradient[free[i]]);
        let solved = h.clone().cholesky().map_or_else(|| &g * 0.0, |h| h.solve(&g));
        let mut step = DVector::zeros(unknowns.len());
        free.iter().zip(solved.iter()).for_each(|(k, solved)| step[*k] = -solved);
        let leaves = |k: usize| {
            let (value, to) = (shared[k], shared[k] + step[k]);
            (value <= unknowns[k].lower && to < value) || (value >= unknowns[k].upper && to > value)
        };
        let newly: Vec<usize> = free.into_iter().filter(|k| leaves(*k)).collect();
        if newly.is_empty() {
            for (k, unknown) in unknowns.iter().enumerate() {
                step[k] = step[k].clamp(unknown.lower - shared[k], unknown.upper - shared[k]);
            }
            return step;
        }
        newly.into_iter().for_each(|k| held[k] = true);
    }
}

/// By how much a step lowers the deviance if the clips are as linear as they look.
fn promised(best: &Fit, step: &DVector<f64>) -> f64 {
    let shared = -(2.0 * best.gradient().dot(step) + step.dot(&(best.information() * step)));
    // What the own numbers gain by themselves, measured by how far they go against their covariance.
    let gain = |clip: &ClipFit| {
        let way = clip.own_way();
        clip.own_covariance.clone().cholesky().map_or(0.0, |c| way.dot(&c.solve(way)))
    };
    shared + best.clips.iter().map(gain).sum::<f64>()
}

fn penalty(random: &[Random], own: &[f64]) -> f64 {
    random.iter().zip(own).filter(|(effect, _)| effect.sigma > 0.0).map(|(effect, u)| (u / effect.sigma).powi(2)).sum()
}

fn current(best: &Fit, random: &[Random]) -> f64 {
    best.clips.iter().map(|clip| clip.chi2 + penalty(random, &clip.own)).sum()
}

/// Sum of squared residuals and of the own numbers in their sigmas; `None` where the model has no answer.
fn cost(model: &impl ClipModel, random: &[Random], shared: &[f64], own: &[Vec<f64>]) -> Option<f64> {
    let costs: Vec<Option<f64>> = (0..model.clips())
        .into_par_iter()
        .map(|clip| {
            let mut out = Vec::new();
            model.residuals(clip, shared, &own[clip], &mut out).ok()?;
            let chi2: f64 = out.iter().map(|r| r * r).sum();
            chi2.is_finite().then_some(chi2 + penalty(random, &own[clip]))
        })
        .collect();
    costs.into_iter().sum()
}

fn linearise(
    model: &impl ClipModel,
    unknowns: &[Unknown],
    random: &[Random],
    shared: &[f64],
    own: &[Vec<f64>],
) -> Result<Vec<ClipFit>, Impossible> {
    let at = |clip| ClipFit::at(model, clip, (unknowns, shared), (random, &own[clip]));
    (0..model.clips()).into_par_iter().map(at).collect()
}

/// Counts the calls.
struct Counted<'a, M> {
    model: &'a M,
    calls: AtomicUsize,
}

impl<M: ClipModel> ClipModel for Counted<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.model.residuals(clip, shared, own, out)
    }
}

/// A model whose shared numbers are given.
struct Given<'a, M> {
    model: &'a M,
    shared: &'a [f64],
}

impl<M: ClipModel> ClipModel for Given<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, _: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.model.residuals(clip, self.shared, own, out)
    }
}

/// One clip of a model.
struct One<'a, M> {
    model: &'a M,
    clip: usize,
}

impl<M: ClipModel> ClipModel for One<'_, M> {
    fn clips(&self) -> usize {
        1
    }

    fn residuals(&self, _: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.model.residuals(self.clip, shared, own, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y = a exp(-b t) + u`, with an offset `u` of its own for every clip, in sigmas of 0.01.
    struct Decay {
        offsets: Vec<f64>,
        a: f64,
        b: f64,
    }

    impl ClipModel for Decay {
        fn clips(&self) -> usize {
            self.offsets.len()
        }

        fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            if shared[1] < 0.0 {
                return Err(Impossible("grows without bound".into()));
            }
            out.clear();
            out.extend((0..50).map(|i| {
                let t = f64::from(i) * 0.1;
                let measured = self.a * (-self.b * t).exp() + self.offsets[clip];
                (measured - shared[0] * (-shared[1] * t).exp() - own.first().unwrap_or(&0.0)) / 0.01
            }));
            Ok(())
        }
    }

    fn unknowns(a: f64, b: f64) -> [Unknown; 2] {
        let unknown = |name: &str, start| Unknown { name: name.into(), start, lower: 0.0, upper: 10.0, step: 1e-6 };
        [unknown("a", a), unknown("b", b)]
    }

    const OFFSET: Random = Random { name: String::new(), sigma: 0.1, step: 1e-6 };

    #[test]
    fn shared_numbers_and_every_clips_own_are_found_together() {
        let model = Decay { offsets: vec![0.1, -0.05, 0.02], a: 2.0, b: 0.7 };
        let fit = fit(&model, &unknowns(1.0, 0.1), &[OFFSET], &Options::default(), |_, _| true).expect("an answer");
        assert!(fit.converged);
        assert!((fit.shared[0] - 2.0).abs() < 2e-3 && (fit.shared[1] - 0.7).abs() < 2e-3, "{:?}", fit.shared);
        for (clip, offset) in fit.clips.iter().zip(&model.offsets) {
            assert!((clip.own[0] - offset).abs() < 1e-3, "{} {offset}", clip.own[0]);
        }
    }

    #[test]
    fn a_number_whose_best_lies_beyond_its_bound_stays_at_the_bound() {
        let model = Decay { offsets: vec![0.0], a: 12.0, b: 0.7 };
        let fit = fit(&model, &unknowns(1.0, 0.1), &[], &Options::default(), |_, _| true).expect("an answer");
        assert_eq!(fit.shared[0], 10.0);
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let model = Decay { offsets: vec![0.1, -0.05, 0.02, 0.0, 0.3], a: 2.0, b: 0.7 };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let run = || fit(&model, &unknowns(1.0, 0.1), &[OFFSET], &Options::default(), |_, _| true);
            pool.install(run).expect("an answer").shared
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn clips_that_were_not_fitted_are_scored_with_their_own_numbers_at_their_best() {
        let model = Decay { offsets: vec![0.2, -0.1], a: 2.0, b: 0.7 };
        let clips = score(&model, &[2.0, 0.7], &[OFFSET], &Options::default()).expect("an answer");
        assert!((clips[0].own[0] - 0.2).abs() < 1e-3);
        assert!(clips[1].chi2 < 0.1, "{}", clips[1].chi2);
    }
}
