//! Nuisance parameters profiled out: every clip's at their best for shared parameters that are given.

use super::least_squares::{Place, fit_from};
use super::linear::ClipFit;
use super::problem::{ClipModel, Impossible, Random};
use super::solve::Schedule;
use super::views::{Given, Subset};
use rayon::prelude::*;

/// A clip with its nuisance parameters at their best.
pub struct Profile {
    pub clip: ClipFit,
    /// Calls of the model that it took.
    pub evaluations: usize,
}

/// Every clip at `shared`, its nuisance parameters at their best from `own` on. Clips do not depend on each other once nothing is
/// shared.
///
/// # Errors
/// [`Impossible`] when the model has no answer there.
pub fn profiled(
    model: &impl ClipModel,
    shared: &[f64],
    random: &[Random],
    own: &[Vec<f64>],
    schedule: &Schedule,
) -> Result<Vec<Profile>, Impossible> {
    let given = Given { model, shared };
    let one = |(clip, own): (usize, &Vec<f64>)| {
        let alone = Subset { model: &given, clips: &[clip] };
        let place = Place { shared: Vec::new(), own: vec![own.clone()] };
        let mut fit = fit_from(&alone, &[], random, place, schedule, |_, _| true)?;
        Ok(Profile { clip: fit.clips.swap_remove(0), evaluations: fit.evaluations })
    };
    own.par_iter().enumerate().map(one).collect()
}

/// The same from rest: how clips that were not fitted are judged.
///
/// # Errors
/// As [`profiled`].
pub fn score(
    model: &impl ClipModel,
    shared: &[f64],
    random: &[Random],
    schedule: &Schedule,
) -> Result<Vec<ClipFit>, Impossible> {
    let rest = vec![vec![0.0; random.len()]; model.clips()];
    Ok(profiled(model, shared, random, &rest, schedule)?.into_iter().map(|profile| profile.clip).collect())
}
