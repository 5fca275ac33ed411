//! Least squares over all clips: the default way to find shared parameters, the clips' nuisance parameters with them.

use super::linear::ClipFit;
use super::problem::{ClipModel, Impossible, Random, Unknown};
use super::solve::{Descent, End, Problem, Quadratic, Schedule, Trial, descend};
use super::views::Counted;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The best parameters found, and every clip linearised there.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Fit {
    /// The shared parameters, in the order of the unknowns.
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

/// Values of the shared parameters and of every clip's nuisance parameters.
#[derive(Debug, Clone)]
pub struct Place {
    pub shared: Vec<f64>,
    pub own: Vec<Vec<f64>>,
}

impl Place {
    /// Shared parameters with the nuisance parameters of so many clips at rest.
    pub fn at_rest(shared: Vec<f64>, random: &[Random], clips: usize) -> Self {
        Self { shared, own: vec![vec![0.0; random.len()]; clips] }
    }
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

    /// Information on the shared parameters from all clips, `P x P`.
    pub fn information(&self) -> DMatrix<f64> {
        let parts = self.clips.iter().map(|clip| &clip.information);
        parts.fold(DMatrix::zeros(self.shared.len(), self.shared.len()), |sum, part| sum + part)
    }

    fn gradient(&self) -> DVector<f64> {
        self.clips.iter().fold(DVector::zeros(self.shared.len()), |sum, clip| sum + &clip.gradient)
    }

    fn place(&self) -> Place {
        Place { shared: self.shared.clone(), own: self.clips.iter().map(|clip| clip.own.clone()).collect() }
    }
}

/// Finds the shared parameters and every clip's nuisance parameters.
///
/// `watch` sees every new deviance and the shared parameters there; `false` ends the search with the best so far.
///
/// # Errors
/// [`Impossible`] when the model has no answer at the start.
///
/// # Example
/// A slope that twelve clips share, each with an offset of its own that is of no interest:
///
/// ```
/// use inference::estimate::interval::LEVEL;
/// use inference::estimate::{ClipModel, Impossible, Intervals, Random, Schedule, Unknown, at_bounds, fit};
///
/// struct Lines;
/// const SIGMA: f64 = 0.01;
///
/// impl ClipModel for Lines {
///     fn clips(&self) -> usize {
///         12
///     }
///
///     fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
///         out.clear();
///         for row in 0..50 {
///             let x = f64::from(row) / 50.0;
///             // What was measured: slope 2, an offset, and noise that is drawn from no generator here.
///             let noise = SIGMA * f64::from((row * 7 + clip as i32 * 13) % 11 - 5) / 3.2;
///             let measured = 2.0 * x + 0.1 * (clip as f64).sin() + noise;
///             out.push((measured - (shared[0] * x + own[0])) / SIGMA);
///         }
///         Ok(())
///     }
/// }
///
/// let unknowns = [Unknown { name: "slope".into(), start: 1.0, lower: 0.0, upper: 10.0, step: 1e-4 }];
/// let random = [Random { name: "offset".into(), sigma: 0.2, step: 1e-4 }];
/// let found = fit(&Lines, &unknowns, &random, &Schedule::default(), |_, _| true)?;
/// let intervals = Intervals::new(&found, &at_bounds(&unknowns, &found.shared), LEVEL);
/// assert!(found.converged);
/// assert!((found.shared[0] - 2.0).abs() < intervals.half_width[0], "{:?}", found.shared);
/// # Ok::<(), inference::estimate::Impossible>(())
/// ```
pub fn fit(
    model: &impl ClipModel,
    unknowns: &[Unknown],
    random: &[Random],
    schedule: &Schedule,
    watch: impl Fn(f64, &[f64]) -> bool,
) -> Result<Fit, Impossible> {
    let shared = unknowns.iter().map(|unknown| unknown.start).collect();
    fit_from(model, unknowns, random, Place::at_rest(shared, random, model.clips()), schedule, watch)
}

/// The same from another start.
///
/// # Errors
/// As [`fit`].
pub fn fit_from(
    model: &impl ClipModel,
    unknowns: &[Unknown],
    random: &[Random],
    start: Place,
    schedule: &Schedule,
    watch: impl Fn(f64, &[f64]) -> bool,
) -> Result<Fit, Impossible> {
    let now = begin(model, (unknowns, random), &start, schedule)?;
    go_on(model, (unknowns, random), now, schedule, |now| watch(now.fit.deviance(), &now.fit.shared))
}

/// A fit on its way: all that it takes to go on from here as if it had never stopped.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Underway<F = Fit> {
    /// The best parameters so far.
    pub fit: F,
    damping: f64,
}

/// A fit before its first step: the clips linearised at the start.
///
/// # Errors
/// As [`fit`].
pub fn begin(
    model: &impl ClipModel,
    (unknowns, random): (&[Unknown], &[Random]),
    start: &Place,
    schedule: &Schedule,
) -> Result<Underway, Impossible> {
    let (model, history, watch) = (Counted::new(model), Vec::new(), |_: &Underway<&Fit>| true);
    let mut clips = AllClips { model, unknowns, random, before: 0, history, watch };
    Ok(Underway { fit: clips.linearised(start)?, damping: schedule.damping })
}

/// A fit from where it is to its end; `watch` sees it before every step.
///
/// # Errors
/// As [`fit`].
pub fn go_on(
    model: &impl ClipModel,
    (unknowns, random): (&[Unknown], &[Random]),
    now: Underway,
    schedule: &Schedule,
    watch: impl Fn(&Underway<&Fit>) -> bool,
) -> Result<Fit, Impossible> {
    let Underway { fit, damping } = now;
    let (before, history) = (fit.evaluations, fit.history.clone());
    // The first linearisation is the start.
    let iterations = (schedule.iterations + 1).saturating_sub(history.len());
    let mut clips = AllClips { model: Counted::new(model), unknowns, random, before, history, watch };
    let mut way = Descent { place: fit.place(), slopes: Some(fit), damping };
    let end = descend(&mut clips, &mut way, &Schedule { iterations, ..*schedule })?;
    let fit = match way.slopes {
        Some(fit) => fit,
        None => clips.linearised(&way.place)?,
    };
    Ok(Fit { converged: end == End::Converged, evaluations: clips.evaluations(), ..fit })
}

/// So many trials shorten the way of the shared parameters alone; then that of the nuisance parameters too.
const TRIALS_OF_SHARED_ALONE: usize = 3;

struct AllClips<'a, M, W> {
    model: Counted<'a, M>,
    unknowns: &'a [Unknown],
    random: &'a [Random],
    /// Calls of the model before these.
    before: usize,
    history: Vec<f64>,
    watch: W,
}

impl<M, W> AllClips<'_, M, W> {
    fn evaluations(&self) -> usize {
        self.before + self.model.calls()
    }
}

impl<M: ClipModel, W: Fn(&Underway<&Fit>) -> bool> Problem for AllClips<'_, M, W> {
    type Place = Place;
    type Slopes = Fit;

    fn linearised(&mut self, Place { shared, own }: &Place) -> Result<Fit, Impossible> {
        let (model, unknowns, random) = (&self.model, self.unknowns, self.random);
        let at = |clip: usize| ClipFit::at(model, clip, (unknowns, shared), (random, &own[clip]));
        let clips = (0..model.clips()).into_par_iter().map(at).collect::<Result<_, _>>()?;
        let evaluations = self.evaluations();
        let mut fit = Fit { shared: shared.clone(), clips, converged: false, evaluations, history: Vec::new() };
        self.history.push(fit.deviance());
        fit.history.clone_from(&self.history);
        Ok(fit)
    }

    fn goes_on(&mut self, at: &Fit, damping: f64) -> bool {
        (self.watch)(&Underway { fit: at, damping })
    }

    fn quadratic(&self, _: &Place, at: &Fit) -> Result<Quadratic, Impossible> {
        let cost = |clip: &ClipFit| clip.chi2 + Random::penalty(self.random, &clip.own);
        Ok(Quadratic {
            cost: at.clips.iter().map(cost).sum(),
            information: at.information(),
            gradient: at.gradient(),
            room: self.unknowns.iter().zip(&at.shared).map(|(unknown, at)| unknown.reach(*at)).collect(),
        })
    }

    fn excess(&self, at: &Fit) -> f64 {
        at.misfit()
    }

    /// Measured by how far they go against their covariance.
    fn promised_besides(&self, at: &Fit) -> f64 {
        let gain = |clip: &ClipFit| {
            let way = clip.own_way();
            clip.own_covariance.clone().cholesky().map_or(0.0, |factor| way.dot(&factor.solve(way)))
        };
        at.clips.iter().map(gain).sum()
    }

    fn stepped(&mut self, from: &Place, at: &Fit, Trial { number, step, .. }: Trial<'_>) -> Option<(Place, f64)> {
        let held = if self.unknowns.is_empty() { 0 } else { TRIALS_OF_SHARED_ALONE };
        let share = 0.5_f64.powi(i32::try_from(number.saturating_sub(held)).unwrap_or(i32::MAX));
        let own = at.clips.iter().map(|clip| clip.own_part_way(step, share)).collect();
        let shared = (from.shared.iter().zip(self.unknowns).zip(step.iter()))
            .map(|((value, unknown), step)| (value + step).clamp(unknown.lower, unknown.upper))
            .collect();
        let to = Place { shared, own };
        let cost = cost(&self.model, self.random, &to)?;
        Some((to, cost))
    }
}

/// Sum of squared residuals and of the nuisance parameters in their sigmas; `None` where the model has no answer.
fn cost(model: &impl ClipModel, random: &[Random], Place { shared, own }: &Place) -> Option<f64> {
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

#[cfg(test)]
mod tests {
    use super::super::profile::score;
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
        let fit = fit(&model, &unknowns(1.0, 0.1), &[OFFSET], &Schedule::default(), |_, _| true).expect("an answer");
        assert!(fit.converged);
        assert!((fit.shared[0] - 2.0).abs() < 2e-3 && (fit.shared[1] - 0.7).abs() < 2e-3, "{:?}", fit.shared);
        for (clip, offset) in fit.clips.iter().zip(&model.offsets) {
            assert!((clip.own[0] - offset).abs() < 1e-3, "{} {offset}", clip.own[0]);
        }
    }

    #[test]
    fn a_number_whose_best_lies_beyond_its_bound_stays_at_the_bound() {
        let model = Decay { offsets: vec![0.0], a: 12.0, b: 0.7 };
        let fit = fit(&model, &unknowns(1.0, 0.1), &[], &Schedule::default(), |_, _| true).expect("an answer");
        assert_eq!(fit.shared[0], 10.0);
    }

    #[test]
    fn a_fit_that_was_stopped_goes_on_to_the_same_bits() {
        let model = Decay { offsets: vec![0.1, -0.05, 0.02], a: 2.0, b: 0.7 };
        let (unknowns, random, options) = (unknowns(1.0, 0.1), [OFFSET], Schedule::default());
        let whole = fit(&model, &unknowns, &random, &options, |_, _| true).expect("an answer");
        assert!(whole.history.len() > 4, "{:?}", whole.history);
        for steps in 1..whole.history.len() {
            let stopped = std::cell::RefCell::new(None);
            let start = Place::at_rest(vec![1.0, 0.1], &random, 3);
            let start = begin(&model, (&unknowns, &random), &start, &options).expect("an answer");
            let watch = |now: &Underway<&Fit>| {
                *stopped.borrow_mut() = Some(Underway { fit: now.fit.clone(), damping: now.damping });
                now.fit.history.len() <= steps
            };
            go_on(&model, (&unknowns, &random), start, &options, watch).expect("an answer");
            let kept = stopped.into_inner().expect("it was watched");
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
            let run = || fit(&model, &unknowns(1.0, 0.1), &[OFFSET], &Schedule::default(), |_, _| true);
            pool.install(run).expect("an answer").shared
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn clips_that_were_not_fitted_are_scored_with_their_own_numbers_at_their_best() {
        let model = Decay { offsets: vec![0.2, -0.1], a: 2.0, b: 0.7 };
        let clips = score(&model, &[2.0, 0.7], &[OFFSET], &Schedule::default()).expect("an answer");
        assert!((clips[0].own[0] - 0.2).abs() < 1e-3);
        assert!(clips[1].chi2 < 0.1, "{}", clips[1].chi2);
    }
}
