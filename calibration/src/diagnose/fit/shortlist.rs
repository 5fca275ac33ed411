//! Which candidates are worth fitting: a score test of each at the present hypothesis, all that is uncertain projected out.

use super::sweep::{Column, Swept};
use crate::diagnose::library::Library;
use inference::estimate::quadratic::{bounded_minimum, eliminate};
use inference::statistics::beyond_chi_square;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// What a candidate's signature says.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Scored {
    /// Index of the candidate.
    pub candidate: usize,
    /// Its best form.
    pub alternative: usize,
    /// Units of that form's probes.
    pub units: Vec<f64>,
    /// The forms next to the best, with their units.
    pub next: Vec<(usize, Vec<f64>)>,
    /// By how much the deviance would fall.
    pub gain: f64,
    /// Numbers that the gain costs.
    pub cost: usize,
    /// Cosine between its signature and what is left of the residual.
    pub cosine: f64,
    /// Its signal at the strongest that is plausible, in sigmas, what baseline numbers can imitate taken out.
    pub signal: f64,
    /// Share of that signal's power that baseline numbers imitate.
    pub imitated: f64,
    /// Probability of such a gain by chance.
    pub p: f64,
}

/// Below this projected signal the clips cannot show a candidate [sigma].
pub const TESTABLE: f64 = 3.0;

/// A gain in deviance that noise alone reaches with this probability is chance.
pub const BY_CHANCE: f64 = 0.2;

/// So many forms next to the best are remembered, and so many places on the table fitted to the end (a choice).
pub(in crate::diagnose) const MAX_FORMS: usize = 3;

/// Prior precision that keeps baseline numbers within their known ranges, added to a form's diagonal.
pub fn hold_numbers(form: &mut DMatrix<f64>, columns: &[Column], library: &Library) {
    for (k, column) in columns.iter().enumerate() {
        if let Column::Number(number) = column {
            let unknown = &library.unknowns[*number];
            let spread = 0.5 * (unknown.upper - unknown.lower);
            form[(k + 1, k + 1)] += spread.powi(-2);
        }
    }
}

/// Scores all candidates of a sweep on the sum of its clips' forms, best first.
pub fn score(swept: &Swept, sum: &DMatrix<f64>, library: &Library) -> Vec<Scored> {
    let mut form = sum.clone();
    hold_numbers(&mut form, &swept.columns, library);
    let place = |wanted: Column| swept.columns.iter().position(|column| *column == wanted).map(|at| at + 1);
    let numbers: Vec<usize> = (swept.columns.iter().enumerate())
        .filter(|(_, column)| matches!(column, Column::Number(_)))
        .map(|(at, _)| at + 1)
        .collect();
    let left = eliminate(&form, &numbers);
    let mut scored: Vec<Scored> = Vec::new();
    for (candidate, info) in library.candidates.iter().enumerate() {
        let forms = info.alternatives.iter().enumerate().filter_map(|(a, alternative)| {
            let free: Vec<usize> =
                (0..alternative.probes.len()).filter_map(|p| place(Column::Probe(candidate, a, p))).collect();
            if free.len() != alternative.probes.len() {
                return None;
            }
            let one_sided: Vec<bool> = alternative.probes.iter().map(|probe| probe.one_sided).collect();
            let found = bounded_minimum(&left, &free, &one_sided);
            let strongest = |form: &DMatrix<f64>| {
                let largest = alternative.probes.iter().map(|probe| probe.largest);
                free.iter().zip(largest).map(|(k, at)| at * at * form[(*k, *k)]).fold(0.0, f64::max)
            };
            let (power, beyond) = (strongest(&form), strongest(&left));
            let (signal, imitated) = (beyond.sqrt(), (1.0 - beyond / power.max(f64::MIN_POSITIVE)).max(0.0));
            let cost = free.len() + alternative.form.len().min(1);
            let cosine = (found.gain.max(0.0) / left[(0, 0)].max(f64::MIN_POSITIVE)).sqrt().min(1.0);
            let p = beyond_chi_square(found.gain, cost);
            let (units, next, gain) = (found.at, Vec::new(), found.gain);
            Some(Scored { candidate, alternative: a, units, next, gain, cost, cosine, signal, imitated, p })
        });
        let mut forms: Vec<Scored> = forms.collect();
        forms.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut forms = forms.into_iter();
        if let Some(best) = forms.next() {
            let next = forms.take(MAX_FORMS).map(|form| (form.alternative, form.units)).collect();
            scored.push(Scored { next, ..best });
        }
    }
    scored.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    scored
}

/// Gain less what its numbers gain from noise.
fn worth(scored: &Scored) -> f64 {
    scored.gain - 2.0 * scored.cost as f64
}
