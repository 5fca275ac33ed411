//! The simple rules that people use, on the same clips as the diagnosis: they mark how hard the worlds are.
//!
//! - *largest error*: the channel with the largest error is blamed, on the effect that is most often at fault there.
//! - *fit everything*: all effects at once by least squares; the one furthest from nothing in its own standard errors.
//! - *sample BIC*: each effect alone; the one with the lowest Bayesian information criterion, every sample a witness.
//!
//! None of them treats what varies from clip to clip as such, and none of them can refuse.

use super::score::Said;

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::sweep::{Column, Point, Precision, Swept, sweep};
use crate::diagnose::fit::{floor, shortlist};
use inference::admit::Split;
use inference::estimate::quadratic::minimum;
use inference::likelihood::random_effects::RandomEffects;
use nalgebra::DMatrix;

/// Names in the order of [`all`].
pub const NAMES: [&str; 3] = ["largest error", "fit everything", "sample BIC"];
/// An effect counts from so many standard errors on.
const SIGNIFICANT: f64 = 3.0;

/// What each rule says.
pub fn all(bench: &Bench<'_>, split: &Split, baseline: &Hypothesis) -> Vec<Said> {
    let clips: Vec<(usize, Vec<f64>)> = split.train.iter().map(|clip| (*clip, Vec::new())).collect();
    let probed: Vec<usize> = (0..bench.library.candidates.len()).collect();
    let (full, free) = (&baseline.full[..], &baseline.free[..]);
    let point = Point { full, free, probed: &probed, clips: &clips, precision: Precision::Joints };
    let nothing = || said(&[]);
    let even = floor::sensors_alone(bench.evidence);
    let swept = sweep(bench.evidence, bench.library, &point, &RandomEffects::default(), &|_| true);
    let reduced = swept.and_then(|swept| Ok((swept.reduced(bench.evidence, &even)?, swept)));
    let Ok((reduced, swept)) = reduced else { return NAMES.map(|_| nothing()).to_vec() };
    let size = 1 + swept.columns.len();
    let sum = reduced.iter().fold(DMatrix::zeros(size, size), |sum, clip| sum + &clip.form);
    let rows: usize = split.train.iter().map(|clip| bench.evidence.rows(*clip).len()).sum();
    vec![largest_error(bench, &swept), everything(bench, &swept, &sum), sample_bic(bench, &swept, &sum, rows)]
}

fn said(ranking: &[&str]) -> Said {
    let ranking: Vec<String> = ranking.iter().map(|name| (*name).to_owned()).collect();
    let verdict = if ranking.is_empty() { "none" } else { "named" };
    Said {
        verdict: verdict.into(),
        effects: ranking.first().cloned().into_iter().collect(),
        ranking,
        confidence: 1.0,
        shrink: 0.0,
    }
}

fn largest_error(bench: &Bench<'_>, swept: &Swept) -> Said {
    let channels = bench.evidence.channels();
    let mut sums = vec![(0.0, 0.0); channels.len()];
    for clip in &swept.clips {
        for (row, residual) in bench.evidence.rows(clip.clip).iter().zip(clip.matrix.column(0).iter()) {
            sums[row.channel].0 += residual * residual;
            sums[row.channel].1 += 1.0;
        }
    }
    let mean = |k: &usize| sums[*k].0 / f64::max(sums[*k].1, 1.0);
    let worst = (0..channels.len()).max_by(|a, b| mean(a).total_cmp(&mean(b)));
    let blamed = worst.map(|k| match (channels[k].quantity, channels[k].joint) {
        ("tau_J" | "tau_J_d", _) => "torque_gain",
        (_, Some(_)) => "joint_coulomb_friction",
        ("rotation", None) => "object_inertia",
        (_, None) => "velocity_dependent_friction",
    });
    blamed.map_or_else(|| said(&[]), |name| said(&[name]))
}

/// Columns of the free numbers and of every candidate in its first form.
fn first_forms(swept: &Swept) -> Vec<usize> {
    let first = |column: &Column| matches!(column, Column::Number(_) | Column::Probe(_, 0, _));
    (swept.columns.iter().enumerate()).filter(|(_, column)| first(column)).map(|(at, _)| at + 1).collect()
}

fn everything(bench: &Bench<'_>, swept: &Swept, sum: &DMatrix<f64>) -> Said {
    let mut form = sum.clone();
    shortlist::hold_numbers(&mut form, &swept.columns, bench.library);
    let used = first_forms(swept);
    // Effects that look exactly alike share the blame instead of stopping the fit.
    used.iter().for_each(|k| form[(*k, *k)] += 1e-9 * sum[(*k, *k)] + f64::MIN_POSITIVE);
    let fit = minimum(&form, &used);
    let inner = DMatrix::from_fn(used.len(), used.len(), |i, j| form[(used[i], used[j])]);
    let Some(covariance) = inner.cholesky().map(|inner| inner.inverse()) else { return said(&[]) };
    let mut strengths: Vec<(f64, usize)> = Vec::new();
    for (i, (column, at)) in used.iter().zip(&fit.at).enumerate() {
        if let Column::Probe(candidate, _, _) = swept.columns[column - 1] {
            strengths.push((at.abs() / covariance[(i, i)].sqrt(), candidate));
        }
    }
    strengths.retain(|(sigmas, _)| *sigmas > SIGNIFICANT);
    said(&ranked(bench, strengths))
}

fn sample_bic(bench: &Bench<'_>, swept: &Swept, sum: &DMatrix<f64>, rows: usize) -> Said {
    let price = (rows as f64).ln();
    let gains = shortlist::score(swept, sum, bench.library);
    let better = gains.iter().map(|scored| (scored.gain - price * scored.cost as f64, scored.candidate));
    said(&ranked(bench, better.filter(|(gain, _)| *gain > 0.0).collect()))
}

/// Names, the strongest first, each once.
fn ranked<'a>(bench: &Bench<'a>, mut strengths: Vec<(f64, usize)>) -> Vec<&'a str> {
    strengths.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut names = Vec::new();
    for (_, candidate) in strengths {
        let name = bench.library.candidates[candidate].effect.name;
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}
