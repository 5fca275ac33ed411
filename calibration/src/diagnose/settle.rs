//! The end of each step of the search: what was chosen is fitted to the end, and what it makes superfluous is dropped.

use super::combine::{FIRST_PASS, LEAST, NEARLY_ALL, convincing};
use super::evidence::Evidence;
use super::fit::{Bench, Effort, Hypothesis};
use super::library::Alternative;
use super::score::foretell;
use super::split::Split;
use super::sweep::Precision;

/// The winner gets so many linearisations more.
const LAST_PASS: Effort = Effort::of(6, Precision::Exact);

/// A fit to the end, from where it is and from elsewhere: an effect frees the object's parameters from what they stood in
/// for, so they are found anew under it, and under the other way in which it could act where there are two.
pub(super) fn settled<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    (fit, weights): (&Hypothesis, &[f64]),
    refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
) -> Option<Hypothesis> {
    let from = |full| bench.fit((&fit.effects, full), &split.train, weights, Some(fit), last_pass(bench));
    let starts = [Some(fit.full.clone()), other_way(bench, fit)];
    let anew = starts.iter().flatten().filter_map(|full| refined(full)).filter_map(from);
    anew.chain(from(fit.full.clone())).min_by(|a, b| a.deviance().total_cmp(&b.deviance()))
}

/// The numbers of a fit whose last effect has two forms, in the form that is further from what was fitted.
fn other_way<E: Evidence>(bench: &Bench<'_, E>, fit: &Hypothesis) -> Option<Vec<f64>> {
    let [one, two] = &bench.library.candidates[*fit.effects.last()?].alternatives[..] else { return None };
    let far = |form: &Alternative| form.form.iter().map(|(k, value)| (fit.full[*k] - value).abs()).sum::<f64>();
    let mut full = fit.full.clone();
    let other = if far(one) > far(two) { one } else { two };
    other.form.iter().for_each(|(k, value)| full[*k] = *value);
    Some(full)
}

/// The effort of a fit to the end. Clips with an object take a simulation for each number of their own; joints one by one
/// besides would take too long.
pub fn last_pass<E: Evidence>(bench: &Bench<'_, E>) -> Effort {
    if bench.scatter.count() == 0 { LAST_PASS } else { Effort { precision: Precision::Joints, ..LAST_PASS } }
}

/// Drops effects that the others make superfluous, one after the other.
pub(super) fn without_superfluous<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    mut now: Hypothesis,
    weights: &[f64],
) -> Hypothesis {
    while now.effects.len() > 1 && !bench.interrupt.asked() {
        let Some(whole) = foretell(bench, &now, &split.choose, weights) else { break };
        let dropped = now.effects.iter().find_map(|effect| {
            let others: Vec<usize> = now.effects.iter().copied().filter(|other| other != effect).collect();
            let mut full = now.full.clone();
            let candidate = &bench.library.candidates[*effect];
            candidate.numbers.clone().for_each(|k| full[k] = bench.library.unknowns[k].start);
            let fit = bench.fit((&others, full), &split.train, weights, Some(&now), FIRST_PASS)?;
            let less = foretell(bench, &fit, &split.choose, weights)?;
            let cost = candidate.alternatives[0].probes.len();
            let loss = whole.over(&less);
            let missed = loss.share > NEARLY_ALL && loss.nats > LEAST;
            (!missed && !convincing(&loss, cost)).then_some(fit)
        });
        match dropped {
            Some(fit) => now = fit,
            None => break,
        }
    }
    now
}
