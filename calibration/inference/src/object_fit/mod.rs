//! The likelihood fit: shared parameters by least squares, and between its rounds how wrong the simulated hit is, from the
//! clips themselves.
//!
//! A hit is rough: where tool and object part by a hair's breadth, a little more of any number moves the resting place by
//! millimetres. Slopes are therefore taken over wide steps, the error of the hit is part of the likelihood (one error of
//! a clip's whole rest, not one of each pose), and a clip that nothing fits counts less. What the arm felt counts as well:
//! the blow that it takes says how heavy the object is.
//!
//! [`step`] owns one step of it.

pub mod step;

use crate::estimate::{ClipModel as _, Impossible, Random, Unknown};
use crate::kept::{Fingerprint, Kept, Trail};
use crate::likelihood::object::{Channel, ModelError, ObjectClips, Part};
use rayon::prelude::*;
use shared_mem::cell::PoseNoise;
use step::{Linearised, Question};

/// A fit, and what it assumed at last.
#[derive(Debug, Clone)]
pub struct ObjectFit {
    /// The numbers, linearised there.
    pub at: Linearised,
    /// By how much wider than information says each number's interval is.
    pub widths: Vec<f64>,
    /// Calls of the model: clips simulated, wholly or from the release on.
    pub evaluations: usize,
    /// Clips simulated so far, and the deviance per row then.
    pub convergence: Vec<[f64; 2]>,
    /// Whether the last step was small.
    pub converged: bool,
}

/// What the search trusts a simulated clip to at first: poses as far as their noise, so that the resting places lead.
const INITIAL_MODEL_ERROR: ModelError = ModelError {
    hit: PoseNoise { position: 0.02, rotation: 0.2 },
    rest: PoseNoise { position: 0.0, rotation: 0.0 },
    joints: Some(1e-4),
    flat: true,
};
/// Most steps of the first way, and of one that need not arrive (choices).
const INITIAL_STEPS: usize = 12;
const ROUGH_STEPS: usize = 4;
/// Rounds after it, each with the error that the round before left (a choice).
const ERROR_ROUNDS: usize = 4;
/// Poses of a moving object, and rows of the arm, of which one is a witness: their errors last (a choice).
const CORRELATED_ROWS: f64 = 5.0;
/// Smallest error of the simulated joints [rad]: some steps of an encoder (a choice).
const MIN_JOINT_ERROR: f64 = 2e-5;

/// Clips that are usually simulated until the end: for a bar alone.
pub fn usual_evaluations(clips: &ObjectClips, unknowns: &[Unknown]) -> usize {
    2 * (INITIAL_STEPS + ERROR_ROUNDS) * (2 + unknowns.len()) * clips.clips()
}

/// Fits from `start` on. `watch` sees numbers and evaluations after every step; `false` ends the fit there.
///
/// # Errors
/// [`Impossible`] when the cell cannot be simulated at the start.
pub fn fit_object(
    clips: &mut ObjectClips,
    unknowns: &[Unknown],
    start: &[f64],
    trail: Trail<'_>,
    watch: impl Fn(&[f64], usize) -> bool,
) -> Result<ObjectFit, Impossible> {
    let mut search = Search::new(trail, &watch);
    let mut at = search.first(clips, unknowns, start, INITIAL_STEPS)?;
    let random = clips.random().random;
    for _ in 0..ERROR_ROUNDS {
        if search.stopped {
            break;
        }
        clips.set_model_error(model_error(clips, &at)?);
        at = search.steps(&Question { clips, unknowns, random: &random }, &at.shared, &at.own(), 2)?;
    }
    let Search { evaluations, convergence, stopped, .. } = search;
    let looked = Fingerprint::of(trail.1).with(&"widths");
    let look = || Question { clips, unknowns, random: &random }.widths(&at);
    let (widths, looks): (Vec<f64>, usize) = trail.0.once_if_ok(&looked, look)?;
    let evaluations = evaluations + looks;
    Ok(ObjectFit { converged: at.small && !stopped, at, widths, evaluations, convergence })
}

/// The first way alone: near enough for a search by the loss of poses. Where it came to, and the clips simulated.
///
/// # Errors
/// As [`fit_object`].
pub fn roughly(
    clips: &mut ObjectClips,
    unknowns: &[Unknown],
    start: &[f64],
    watch: impl Fn(&[f64], usize) -> bool,
) -> Result<(Linearised, usize), Impossible> {
    let mut search = Search::new((Kept::nothing(), ""), &watch);
    let at = search.first(clips, unknowns, start, ROUGH_STEPS)?;
    Ok((at, search.evaluations))
}

/// The clips at numbers that were found otherwise, with the error of hits that they leave.
///
/// # Errors
/// [`Impossible`] when the cell cannot be simulated there.
pub fn linearise_object(clips: &mut ObjectClips, unknowns: &[Unknown], at: &[f64]) -> Result<Linearised, Impossible> {
    clips.set_model_error(INITIAL_MODEL_ERROR);
    let random = clips.random().random;
    let own = vec![vec![0.0; random.len()]; clips.clips()];
    let first = Question { clips, unknowns, random: &random }.here(at, &own)?;
    clips.set_model_error(model_error(clips, &first)?);
    let mut there = Question { clips, unknowns, random: &random }.here(at, &first.own())?;
    there.evaluations += first.evaluations;
    Ok(there)
}

/// [`Question::widths`] of clips that were linearised at numbers found otherwise.
///
/// # Errors
/// As [`linearise_object`].
pub fn widths(clips: &ObjectClips, unknowns: &[Unknown], at: &Linearised) -> Result<Vec<f64>, Impossible> {
    Ok(Question { clips, unknowns, random: &clips.random().random }.widths(at)?.0)
}

struct Search<'a, W> {
    convergence: Vec<[f64; 2]>,
    evaluations: usize,
    trail: Trail<'a>,
    watch: &'a W,
    stopped: bool,
}

impl<'a, W: Fn(&[f64], usize) -> bool> Search<'a, W> {
    fn new(trail: Trail<'a>, watch: &'a W) -> Self {
        Self { convergence: Vec::new(), evaluations: 0, trail, watch, stopped: false }
    }

    /// A step from there, worked out unless it is known.
    fn improved(&self, question: &Question<'_>, shared: &[f64], own: &[Vec<f64>]) -> Result<Linearised, Impossible> {
        let (kept, name) = self.trail;
        let step = Fingerprint::of(name).with(&("step", self.convergence.len()));
        kept.once_if_ok(&step, || question.improved(shared, own))
    }

    /// From far away to where resting places agree, no clip having numbers of its own.
    fn first(
        &mut self,
        clips: &mut ObjectClips,
        unknowns: &[Unknown],
        start: &[f64],
        most: usize,
    ) -> Result<Linearised, Impossible> {
        clips.set_model_error(INITIAL_MODEL_ERROR);
        let random = held(clips);
        let own = vec![vec![0.0; random.len()]; clips.clips()];
        self.steps(&Question { clips, unknowns, random: &random }, start, &own, most)
    }

    fn steps(
        &mut self,
        question: &Question<'_>,
        shared: &[f64],
        own: &[Vec<f64>],
        most: usize,
    ) -> Result<Linearised, Impossible> {
        let mut at = self.improved(question, shared, own)?;
        for step in 1.. {
            self.evaluations += at.evaluations;
            let rows: usize = at.clips.iter().map(|clip| clip.rows).sum();
            self.convergence.push([self.evaluations as f64, at.deviance() / rows.max(1) as f64]);
            self.stopped = !(self.watch)(&at.shared, self.evaluations);
            if at.small || self.stopped || step >= most {
                break;
            }
            at = self.improved(question, &at.shared, &at.own())?;
        }
        Ok(at)
    }
}

/// All nuisance parameters held.
fn held(clips: &ObjectClips) -> Vec<Random> {
    clips.random().random.into_iter().map(|effect| Random { sigma: 0.0, ..effect }).collect()
}

/// What is left of hits and rests with every clip's nuisance parameters at their best. Of a clip that nothing fits, as much as
/// it counts.
fn model_error(clips: &ObjectClips, at: &Linearised) -> Result<ModelError, Impossible> {
    let own = at.own();
    let errors: Vec<Vec<f64>> = (0..own.len())
        .into_par_iter()
        .map(|clip| clips.errors(clip, &at.shared, &own[clip]))
        .collect::<Result<_, _>>()?;
    let rms = |counts: &dyn Fn(Channel, Part) -> bool| {
        let (mut sum, mut count) = (0.0, 0.0);
        for (clip, errors) in errors.iter().enumerate() {
            for (_, error) in clips.rows(clip).iter().zip(errors).filter(|(row, _)| counts(row.channel, row.part)) {
                sum += at.weights[clip] * error * error;
                count += at.weights[clip];
            }
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    };
    let noise = clips.noise();
    let pose = |part: Part, alike: f64| {
        let place = rms(&|channel, of| of == part && matches!(channel, Channel::Position(0 | 1)));
        let turn = rms(&|channel, of| of == part && channel == Channel::Rotation(2));
        // Never quite nothing: a clip that fits by chance would outweigh all others.
        let beyond = |rms: f64, noise: f64| (rms * rms - noise * noise).max(0.01 * noise * noise).sqrt() * alike;
        PoseNoise { position: beyond(place, noise.position), rotation: beyond(turn, noise.rotation) }
    };
    let joints = rms(&|channel, _| matches!(channel, Channel::Joint(_)));
    let joints = Some(joints.max(MIN_JOINT_ERROR) * CORRELATED_ROWS.sqrt());
    Ok(ModelError { hit: pose(Part::Hit, CORRELATED_ROWS.sqrt()), rest: pose(Part::After, 1.0), joints, flat: true })
}
