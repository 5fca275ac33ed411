//! Hypotheses fitted to clips: the baseline's numbers and those of the effects that act, together, by the steps of
//! `descend`.

use super::effort::{Effort, LAST_PASS, REFINEMENT};
use super::shortlist::{Scored, hold_numbers};
use super::sweep::{Point, Precision, Reduced, Swept, sweep};
use crate::diagnose::library::Library;
use inference::interrupt::Interrupt;
use inference::kept::{Fingerprint, Trail};
use inference::likelihood::Likelihood;
use inference::likelihood::random_effects::{OwnNumbers, RandomEffects, WithOwn};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// What every step of the diagnosis is given.
pub struct Bench<'a, O: OwnNumbers = WithOwn> {
    pub evidence: &'a dyn Likelihood<Own = O>,
    pub library: &'a Library,
    /// What varies from clip to clip.
    pub scatter: RandomEffects,
    /// Whether the user asked for the end, or the time is spent.
    pub interrupt: &'a Interrupt,
    /// Where what is found is kept.
    pub trail: Trail<'a>,
}

impl<'a, O: OwnNumbers> Bench<'a, O> {
    pub fn new(
        evidence: &'a dyn Likelihood<Own = O>,
        library: &'a Library,
        interrupt: &'a Interrupt,
        trail: Trail<'a>,
    ) -> Self {
        Self { evidence, library, scatter: evidence.scatter(), interrupt, trail }
    }

    /// A bench of the same clips seen otherwise; `label` separates its kept work from this one's.
    pub fn seen_as<'b, P: OwnNumbers>(&self, evidence: &'b dyn Likelihood<Own = P>, label: &'b str) -> Bench<'b, P>
    where
        'a: 'b,
    {
        Bench::new(evidence, self.library, self.interrupt, (self.trail.0, label))
    }
}

/// Clips, each with its nuisance parameters.
pub(in crate::diagnose) type Clips = Vec<(usize, Vec<f64>)>;

/// A clip at a hypothesis.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct FittedClip<V = WithOwn> {
    /// Index of the clip.
    pub clip: usize,
    /// Its nuisance parameters.
    pub own: Vec<f64>,
    /// Over (residual, free numbers), weighted, nuisance parameters eliminated.
    pub reduced: Reduced,
    /// Whether clips have nuisance parameters at all.
    #[serde(skip)]
    pub kind: PhantomData<V>,
}

impl<V> FittedClip<V> {
    fn all(clips: Clips, forms: Vec<Reduced>) -> Vec<Self> {
        let one = |((clip, own), reduced)| Self { clip, own, reduced, kind: PhantomData };
        clips.into_iter().zip(forms).map(one).collect()
    }

    /// `-2 ln` of its likelihood.
    pub fn deviance(&self) -> f64 {
        self.reduced.form[(0, 0)] + self.reduced.volume
    }
}

/// Where a fit of a hypothesis is.
pub(super) struct Reached {
    pub(super) full: Vec<f64>,
    pub(super) clips: Clips,
    /// Whether numbers were turned round on the way there: a vector's length is never negative.
    pub(super) turned_round: bool,
}

/// A hypothesis with its numbers, of a bench whose clips have nuisance parameters or have none: the other kind of bench takes its numbers
/// alone ([`Bench::fit`] from there), never the hypothesis.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Hypothesis<V = WithOwn> {
    /// Candidates that act, in the order in which they were found.
    pub effects: Vec<usize>,
    pub full: Vec<f64>,
    /// Indices of the free ones.
    pub free: Vec<usize>,
    /// Clips it was fitted to.
    pub fitted: Vec<FittedClip<V>>,
}

impl<V> Hypothesis<V> {
    /// Clips it was fitted to.
    pub fn clips(&self) -> Vec<usize> {
        self.fitted.iter().map(|fitted| fitted.clip).collect()
    }

    /// The same, each with its nuisance parameters.
    pub(in crate::diagnose) fn clips_with_own(&self) -> Clips {
        self.fitted.iter().map(|fitted| (fitted.clip, fitted.own.clone())).collect()
    }

    /// `-2 ln` of the likelihood of the clips it was fitted to.
    pub fn deviance(&self) -> f64 {
        self.fitted.iter().map(FittedClip::deviance).sum()
    }

    /// A clip's nuisance parameters where it was fitted, else at rest.
    pub fn own(&self, clip: usize, count: usize) -> Vec<f64> {
        let fitted = self.fitted.iter().find(|fitted| fitted.clip == clip);
        fitted.map_or_else(|| vec![0.0; count], |fitted| fitted.own.clone())
    }
}

/// Steps in which a clip finds its nuisance parameters.
const PROFILE_STEPS: usize = 2;

impl<O: OwnNumbers> Bench<'_, O> {
    /// Numbers that are free when these effects act.
    pub fn free(&self, effects: &[usize]) -> Vec<usize> {
        let of_effects = effects.iter().flat_map(|effect| self.library.candidates[*effect].turned.clone());
        self.library.baseline.clone().chain(of_effects).collect()
    }

    /// The same with what the effects on the arm hold while they are searched.
    fn all_free(&self, effects: &[usize]) -> Vec<usize> {
        let of_effect = |effect: &usize| {
            let candidate = &self.library.candidates[*effect];
            let held = candidate.held.iter().filter(|_| candidate.is_of_arm());
            candidate.turned.iter().chain(held).copied().collect::<Vec<_>>()
        };
        self.library.baseline.clone().chain(effects.iter().flat_map(of_effect)).collect()
    }

    /// Fits effects on clips from `full` on, each clip's nuisance parameters from `near` on.
    ///
    /// `None` when the twin has no answer at the start.
    pub fn fit(
        &self,
        effects: &[usize],
        full: Vec<f64>,
        clips: &[usize],
        weights: &[f64],
        near: Option<&Hypothesis<O>>,
        effort: Effort,
    ) -> Option<Hypothesis<O>> {
        let from = self.with_own(clips, near);
        let step = self.step("fit").with(&(effects, clips, effort)).with_numbers(&full).with_numbers(weights);
        let step = step.with_numbers(from.iter().flat_map(|(_, own)| own));
        self.trail.0.once(&step, || self.fitted(effects, full, from, weights, effort))
    }

    /// Clips with their nuisance parameters as a hypothesis has them, else at rest.
    pub(in crate::diagnose) fn with_own(&self, clips: &[usize], near: Option<&Hypothesis<O>>) -> Clips {
        let count = self.scatter.count();
        let own = |clip: usize| near.map_or_else(|| vec![0.0; count], |near| near.own(clip, count));
        clips.iter().map(|clip| (*clip, own(*clip))).collect()
    }

    /// A step of this bench by its name.
    pub fn step(&self, name: &str) -> Fingerprint {
        Fingerprint::of(name).with(&self.trail.1)
    }

    fn fitted(
        &self,
        effects: &[usize],
        full: Vec<f64>,
        from: Clips,
        weights: &[f64],
        effort: Effort,
    ) -> Option<Hypothesis<O>> {
        let free = if effort.frees_held { self.all_free(effects) } else { self.free(effects) };
        let holds = |k: &usize| effort.holds_joints && self.library.joints[*k].is_some();
        let moving: Vec<usize> = free.iter().copied().filter(|k| !holds(k)).collect();
        let clips = self.profiled(&full, from, weights)?;
        let clips = self.restarted(&full, clips, weights);
        let before_last = Effort { iterations: effort.iterations.saturating_sub(1), ..effort };
        let (Reached { full, clips, .. }, last) = self.descended(full, clips, &moving, weights, before_last)?;
        let restarted = self.restarted(&full, clips.clone(), weights);
        let at = match last.filter(|_| moving.len() == free.len() && restarted == clips) {
            Some(at) => at,
            None => self.linearise(&full, &free, &restarted, effort.precision)?,
        };
        let forms = at.reduced(self.evidence, weights).ok()?;
        Some(Hypothesis { effects: effects.to_vec(), full, free, fitted: FittedClip::all(restarted, forms) })
    }

    pub(in crate::diagnose) fn linearise(
        &self,
        full: &[f64],
        free: &[usize],
        clips: &[(usize, Vec<f64>)],
        precision: Precision,
    ) -> Option<Swept> {
        let point = Point { full, free, probed: &[], clips, precision };
        // Not to be cut short: what was found is known only once the clips are linearised there.
        sweep(self.evidence, self.library, &point, &self.scatter, &|_| true).ok()
    }

    /// The effort of a trial of a candidate: one beyond the arm leaves the joints' numbers alone.
    pub fn trying(&self, candidate: usize, effort: Effort) -> Effort {
        Effort { holds_joints: !self.library.is_of_arm(candidate), ..effort }
    }

    /// The effort of a fit to the end. Clips with an object take a simulation for each number of their own; joints one by one besides
    /// would take too long.
    pub fn last_pass(&self) -> Effort {
        if self.scatter.count() == 0 { LAST_PASS } else { REFINEMENT }
    }

    /// `full` with the candidate as strong as the score test says, within what is plausible.
    pub fn begun(&self, mut full: Vec<f64>, scored: &Scored) -> Vec<f64> {
        let alternative = &self.library.candidates[scored.candidate].alternatives[scored.alternative];
        for (k, value) in &alternative.form {
            full[*k] = *value;
        }
        let mut vectors: Vec<Polar> = Vec::new();
        for (probe, units) in alternative.probes.iter().zip(&scored.units) {
            let [(size, value), rest @ ..] = &probe.moves[..] else { continue };
            let resting = self.library.unknowns[*size].start;
            let strength = units.clamp(-probe.largest, probe.largest) * (value - resting);
            match (rest, vectors.iter_mut().find(|polar| polar.size == *size)) {
                ([(_, quarter)], Some(polar)) => (polar.across, polar.quarter) = (strength, *quarter),
                ([(angle, _)], None) => {
                    vectors.push(Polar { size: *size, angle: *angle, along: strength, across: 0.0, quarter: 0.0 });
                }
                _ => full[*size] = resting + strength,
            }
        }
        for Polar { size, angle, along, across, quarter } in vectors {
            full[size] = along.hypot(across);
            full[angle] = across.atan2(along) * quarter / std::f64::consts::FRAC_PI_2;
        }
        for k in self.library.candidates[scored.candidate].numbers.clone() {
            let unknown = &self.library.unknowns[k];
            full[k] = full[k].clamp(unknown.lower, unknown.upper);
        }
        full
    }

    /// Clips that were not fitted, at a hypothesis' numbers with their nuisance parameters at their best.
    pub fn judge(&self, hypothesis: &Hypothesis<O>, clips: &[usize], weights: &[f64]) -> Option<Vec<FittedClip<O>>> {
        let step = self.step("judge").with(&clips).with_numbers(&hypothesis.full).with_numbers(weights);
        self.trail.0.once(&step, || self.judged(hypothesis, clips, weights))
    }

    fn judged(&self, hypothesis: &Hypothesis<O>, clips: &[usize], weights: &[f64]) -> Option<Vec<FittedClip<O>>> {
        let at = self.profiled(&hypothesis.full, self.with_own(clips, None), weights)?;
        let at = self.restarted(&hypothesis.full, at, weights);
        let swept = self.linearise(&hypothesis.full, &[], &at, Precision::Exact)?;
        let forms = swept.reduced(self.evidence, weights).ok()?;
        Some(FittedClip::all(at, forms))
    }

    /// Clips with their nuisance parameters at their best for shared ones that are given.
    pub(super) fn profiled(&self, full: &[f64], mut clips: Clips, weights: &[f64]) -> Option<Clips> {
        let steps = if self.scatter.count() == 0 { 0 } else { PROFILE_STEPS };
        for _ in 0..steps {
            let swept = self.linearise(full, &[], &clips, Precision::Exact)?;
            let nothing = DVector::zeros(0);
            let own = |clip: &super::sweep::SweptClip| swept.own_after(clip, self.evidence, weights, &nothing).ok();
            clips = swept.clips.iter().map(|clip| Some((clip.clip, own(clip)?))).collect::<Option<_>>()?;
        }
        Some(clips)
    }

    /// The sum of fitted clips' forms, numbers held to their known ranges.
    pub fn held(&self, hypothesis: &Hypothesis<O>) -> DMatrix<f64> {
        let size = 1 + hypothesis.free.len();
        let mut sum = hypothesis.fitted.iter().fold(DMatrix::zeros(size, size), |sum, clip| sum + &clip.reduced.form);
        let columns: Vec<_> = hypothesis.free.iter().map(|k| super::sweep::Column::Number(*k)).collect();
        hold_numbers(&mut sum, &columns, self.library);
        sum
    }
}

/// Two probes that turn the same size, along and across: length and angle of a vector.
struct Polar {
    size: usize,
    angle: usize,
    along: f64,
    across: f64,
    /// The angle at which the size acts across.
    quarter: f64,
}
