//! How far residuals can be trusted: a factor on every channel that makes what the richest hypothesis leaves look like
//! independent noise of unit variance.
//!
//! Sensors are white, but a twin is never exact: what is left is larger than the sensor's noise and says the same thing
//! many times over. Taken at face value it would make any two hypotheses differ by thousands of nats.

use super::shortlist;
use super::sweep::{Column, Swept};
use crate::diagnose::library::Library;
use inference::estimate::Impossible;
use inference::estimate::quadratic::minimum;
use inference::likelihood::arm::noise::correlation_length;
use inference::likelihood::random_effects::OwnNumbers;
use inference::likelihood::{Channel, Group, Likelihood};
use inference::statistics::median;
use nalgebra::DVector;

/// Factors while nothing is known of how far the twin is off: the sensors' noise alone. The joints in contact are left out: any
/// engine is off there by many times their noise.
pub fn sensors_alone<O: OwnNumbers>(evidence: &dyn Likelihood<Own = O>) -> Vec<f64> {
    let known = |channel: &Channel| if channel.group == Group::Contact { 0.0 } else { 1.0 };
    evidence.channels().iter().map(known).collect()
}

/// Factor on each channel of residuals given clip by clip, one list of values a row.
pub fn weights<O: OwnNumbers>(evidence: &dyn Likelihood<Own = O>, clips: &[(usize, Vec<f64>)]) -> Vec<f64> {
    let channels = evidence.channels().len();
    (0..channels).map(|channel| weight(evidence, clips, channel)).collect()
}

fn weight<O: OwnNumbers>(evidence: &dyn Likelihood<Own = O>, clips: &[(usize, Vec<f64>)], channel: usize) -> f64 {
    let of_clip = |(clip, residuals): &(usize, Vec<f64>)| {
        let of_channel: Vec<f64> = (evidence.rows(*clip).iter().zip(residuals))
            .filter(|(row, _)| row.channel == channel)
            .map(|(_, residual)| *residual)
            .collect();
        let count = of_channel.len() as f64;
        let power = of_channel.iter().map(|r| r * r).sum::<f64>() / count;
        (count > 0.0).then(|| (power, correlation_length(&of_channel)))
    };
    let (powers, lengths): (Vec<f64>, Vec<f64>) = clips.iter().filter_map(of_clip).unzip();
    if powers.is_empty() {
        return 0.0;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    // Some strokes go their own way, and where a hit is linearised some clips tell nothing: they must not silence the others.
    let alone = evidence.channels()[channel].group == Group::Arm;
    let power = if alone { mean(&powers) } else { median(powers).unwrap_or(0.0) };
    let (power, length) = (power.max(1.0), mean(&lengths).max(1.0));
    // White residuals of a channel have a length a little above one by chance.
    let length = if length < 1.5 { 1.0 } else { length };
    (power * length).sqrt().recip()
}

/// How many times what is left exceeds what weights take for noise, at least 1: the mean over the channels that count of how many times
/// larger its square is. `found`: the weights of what is left.
pub fn overdispersion(taken: &[f64], found: &[f64]) -> f64 {
    let counts = taken.iter().zip(found).filter(|(taken, found)| **taken > 0.0 && **found > 0.0);
    let ratios: Vec<f64> = counts.map(|(taken, found)| (taken / found).powi(2)).collect();
    (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).max(1.0)
}

/// What the richest hypothesis leaves: all numbers and every candidate's best form at once, each clip's nuisance parameters at
/// their best.
///
/// # Errors
/// As of [`Swept::reduced`].
pub fn richest_residuals<O: OwnNumbers>(
    swept: &Swept,
    evidence: &dyn Likelihood<Own = O>,
    library: &Library,
    weights: &[f64],
) -> Result<Vec<(usize, Vec<f64>)>, Impossible> {
    let mut sum = swept.total(evidence, weights)?;
    shortlist::hold_numbers(&mut sum, &swept.columns, library);
    let scored = shortlist::score(swept, &sum, library);
    let in_best = |column: &Column| match column {
        Column::Number(_) => true,
        Column::Probe(candidate, a, _) => {
            scored.iter().any(|s| s.candidate == *candidate && s.alternative == *a && s.p < shortlist::BY_CHANCE)
        }
    };
    let free: Vec<usize> = (0..swept.columns.len()).filter(|k| in_best(&swept.columns[*k])).map(|k| k + 1).collect();
    for k in &free {
        if let Column::Probe(candidate, a, p) = swept.columns[k - 1] {
            let largest = library.candidates[candidate].alternatives[a].probes[p].largest;
            sum[(*k, *k)] += largest.powi(-2);
        }
    }
    let at = minimum(&sum, &free).at;
    residuals_at(swept, evidence, weights, &free, &at)
}

/// Residuals of a sweep's clips at coefficients of some columns, each clip's nuisance parameters at their best; not weighted.
///
/// # Errors
/// As of [`Swept::own_after`].
pub fn residuals_at<O: OwnNumbers>(
    swept: &Swept,
    evidence: &dyn Likelihood<Own = O>,
    weights: &[f64],
    free: &[usize],
    at: &[f64],
) -> Result<Vec<(usize, Vec<f64>)>, Impossible> {
    let mut all = DVector::zeros(swept.columns.len());
    free.iter().zip(at).for_each(|(k, value)| all[k - 1] = *value);
    let one = |clip: &super::sweep::SweptClip| {
        let mut left = clip.matrix.column(0) + clip.matrix.columns(1, all.len()) * &all;
        let own = swept.own_after(clip, evidence, weights, &all)?;
        for (k, (to, from)) in own.iter().zip(&clip.own).enumerate() {
            left.axpy(to - from, &clip.matrix.column(1 + all.len() + k), 1.0);
        }
        Ok((clip.clip, left.as_slice().to_vec()))
    };
    swept.clips.iter().map(one).collect()
}
