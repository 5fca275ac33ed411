//! Bounded Levenberg-Marquardt over all clips: the default way to find shared numbers, the clips' own ones with them.

use super::bounded::bounded_step;
use super::descent::Descent;
use super::linear::ClipFit;
use super::problem::{ClipModel, Impossible, Random, Unknown};
use super::views::{Counted, Given, Subset};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// At most so many linearisations.
    pub iterations: usize,
    /// Converged once a step promises to lower the deviance by less than this; 1 is what noise alone moves. Where the
    /// residuals are larger than their sigmas, what they alone move is larger, and so is this.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { iterations: 20, tolerance: 1e-3 }
    }
}

/// The best numbers found, and every clip linearised there.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Fit {
    /// The shared numbers, in the order of the unknowns.
    pub shared: Vec<f64>,
    /// The clips there.
    pub clips: Vec<ClipFit>,
    /// Whether the last step was small; otherwise the iterations ran out, no step led down, or the caller stopped it.
    pub converged: bool,
    /// Calls of the model: one is one clip simulated.
    pub evaluations: usize,
    /// Deviance after each linearisation.
    pub history: Vec<f64>,
}

impl Fit {
    /// `-2 ln` of the likelihood of all clips.
    pub fn deviance(&self) -> f64 {
        self.clips.iter().map(|clip| clip.deviance).sum()
    }

    /// Mean squared residual, at least 1: by how much the residuals exceed their sigmas.
    pub fn misfit(&self) -> f64 {
        let (chi2, rows) = self.clips.iter().fold((0.0, 0), |(chi2, rows), c| (chi2 + c.chi2, rows + c.rows));
        (chi2 / rows.max(1) as f64).max(1.0)
    }

    /// Information on the shared numbers from all clips, `P x P`.
    pub fn information(&self) -> DMatrix<f64> {
        let parts = self.clips.iter().map(|clip| &clip.information);
        parts.fold(DMatrix::zeros(self.shared.len(), self.shared.len()), |sum, part| sum + part)
    }

    pub(super) fn gradient(&self) -> DVector<f64> {
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
    let now = begin(model, (unknowns, random), (shared, own))?;
    go_on(model, (unknowns, random), now, options, |now| watch(now.fit.deviance(), &now.fit.shared))
}

/// A fit on its way: all that it takes to go on from here as if it had never stopped.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Underway {
    /// The best numbers so far.
    pub fit: Fit,
    damping: f64,
}

/// A fit before its first step: the clips linearised at the start.
///
/// # Errors
/// As [`fit`].
pub fn begin(
    model: &impl ClipModel,
    (unknowns, random): (&[Unknown], &[Random]),
    (shared, own): (Vec<f64>, Vec<Vec<f64>>),
) -> Result<Underway, Impossible> {
    let counted = Counted::new(model);
    let clips = linearise(&counted, unknowns, random, &shared, &own)?;
    let mut fit = Fit { shared, clips, converged: false, evaluations: counted.calls(), history: Vec::new() };
    fit.history.push(fit.deviance());
    Ok(Underway { fit, damping: 1e-6 })
}

/// A fit from where it is to its end; `watch` sees it before every step.
///
/// # Errors
/// As [`fit`].
pub fn go_on(
    model: &impl ClipModel,
    (unknowns, random): (&[Unknown], &[Random]),
    mut now: Underway,
    options: &Options,
    watch: impl Fn(&Underway) -> bool,
) -> Result<Fit, Impossible> {
    let counted = Counted::new(model);
    let before = now.fit.evaluations;
    while now.fit.history.len() <= options.iterations {
        if !watch(&now) {
            break;
        }
        let Underway { fit, damping } = &mut now;
        let progress = improve(&counted, unknowns, random, fit, damping, options.tolerance)?;
        fit.evaluations = before + counted.calls();
        match progress {
            Progress::Better => fit.history.push(fit.deviance()),
            Progress::Arrived => {
                fit.converged = true;
                break;
            }
            Progress::Stuck => break,
        }
    }
    Ok(now.fit)
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
            let one = Subset { model: &fixed, clips: &[clip] };
            fit(&one, &[], random, options, |_, _| true).map(|mut fit| fit.clips.swap_remove(0))
        })
        .collect()
}

enum Progress {
    Better,
    Arrived,
    Stuck,
}

/// Most trials with growing damping before the search is stuck.
const TRIALS: usize = 12;
/// So many trials shorten the way of the shared numbers alone; then that of the clips' own ones too.
const SHARED_TRIALS: usize = 3;

fn improve<M: ClipModel>(
    model: &Counted<'_, M>,
    unknowns: &[Unknown],
    random: &[Random],
    best: &mut Fit,
    damping: &mut f64,
    tolerance: f64,
) -> Result<Progress, Impossible> {
    let (information, gradient) = (best.information(), best.gradient());
    let here = current(best, random);
    let room: Vec<[f64; 2]> = unknowns.iter().zip(&best.shared).map(|(unknown, at)| unknown.reach(*at)).collect();
    let whole = bounded_step(&information, &gradient, &room, 0.0);
    let descent = Descent { information: &information, gradient: &gradient, room: &room, enough: 0.0, trials: TRIALS };
    if descent.promised(&whole) + own_promise(best) < tolerance * best.misfit() {
        return Ok(Progress::Arrived);
    }
    let held = if unknowns.is_empty() { 0 } else { SHARED_TRIALS };
    let to = descent.step(damping, |trial, step| {
        let share = 0.5_f64.powi(i32::try_from(trial.saturating_sub(held)).unwrap_or(i32::MAX));
        let own: Vec<Vec<f64>> = best.clips.iter().map(|clip| clip.own_part_way(step, share)).collect();
        let shared: Vec<f64> = (best.shared.iter().zip(unknowns).zip(step.iter()))
            .map(|((value, unknown), step)| (value + step).clamp(unknown.lower, unknown.upper))
            .collect();
        cost(model, random, &shared, &own).is_some_and(|cost| cost < here).then_some((shared, own))
    });
    let Some((shared, own)) = to else { return Ok(Progress::Stuck) };
    best.clips = linearise(model, unknowns, random, &shared, &own)?;
    best.shared = shared;
    Ok(Progress::Better)
}

/// By how much the own numbers lower the deviance by themselves, measured by how far they go against their covariance.
fn own_promise(best: &Fit) -> f64 {
    let gain = |clip: &ClipFit| {
        let way = clip.own_way();
        clip.own_covariance.clone().cholesky().map_or(0.0, |c| way.dot(&c.solve(way)))
    };
    best.clips.iter().map(gain).sum()
}

fn current(best: &Fit, random: &[Random]) -> f64 {
    best.clips.iter().map(|clip| clip.chi2 + Random::penalty(random, &clip.own)).sum()
}

/// Sum of squared residuals and of the own numbers in their sigmas; `None` where the model has no answer.
fn cost(model: &impl ClipModel, random: &[Random], shared: &[f64], own: &[Vec<f64>]) -> Option<f64> {
    let costs: Vec<Option<f64>> = (0..model.clips())
        .into_par_iter()
        .map(|clip| {
            let mut out = Vec::new();
            model.residuals(clip, shared, &own[clip], &mut out).ok()?;
            let chi2: f64 = out.iter().map(|r| r * r).sum();
            chi2.is_finite().then_some(chi2 + Random::penalty(random, &own[clip]))
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
    fn a_fit_that_was_stopped_goes_on_to_the_same_bits() {
        let model = Decay { offsets: vec![0.1, -0.05, 0.02], a: 2.0, b: 0.7 };
        let (unknowns, random, options) = (unknowns(1.0, 0.1), [OFFSET], Options::default());
        let whole = fit(&model, &unknowns, &random, &options, |_, _| true).expect("an answer");
        assert!(whole.history.len() > 4, "{:?}", whole.history);
        for steps in 1..whole.history.len() {
            let stopped = std::cell::RefCell::new(None);
            let own = vec![vec![0.0]; 3];
            let start = begin(&model, (&unknowns, &random), (vec![1.0, 0.1], own)).expect("an answer");
            let told = |now: &Underway| {
                *stopped.borrow_mut() = Some(now.clone());
                now.fit.history.len() <= steps
            };
            go_on(&model, (&unknowns, &random), start, &options, told).expect("an answer");
            let kept = stopped.into_inner().expect("it was told");
            let resumed = go_on(&model, (&unknowns, &random), kept, &options, |_| true).expect("an answer");
            assert_eq!((&resumed.shared, &resumed.history), (&whole.shared, &whole.history));
            assert_eq!((resumed.evaluations, resumed.converged), (whole.evaluations, whole.converged));
        }
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
