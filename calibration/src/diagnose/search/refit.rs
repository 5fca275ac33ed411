//! The end of each step of the search: what was chosen is fitted to the end, and what it makes superfluous is dropped.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::REFINEMENT;
use crate::diagnose::fit::multi_start::cheapest;
use crate::diagnose::judge::score::predict;
use crate::diagnose::library::Alternative;
use crate::diagnose::propose::Search;
use crate::diagnose::propose::arm_alone::ArmAlone;
use crate::diagnose::select::criteria::EFFECTS;

/// Where in its range a held form is tried, and how often the best of these is then looked for halfway to its neighbours (choices).
const SHARES_OF_RANGE: [f64; 9] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0];
const HALVINGS: usize = 5;

/// A fit to the end, from where it is and from elsewhere: an effect frees the object's parameters from what they stood in
/// for, so they are found anew under it, and under the other way in which it could act where there are two.
pub(super) fn refitted(search: &Search<'_>, fit: &Hypothesis, weights: &[f64]) -> Option<Hypothesis> {
    let (bench, fits) = (search.bench, search.fits(&fit.effects, weights, fit));
    let ways = [Some(fit.full.clone()), other_way(bench, fit)];
    let anew = ways.iter().flatten().filter_map(|full| (search.refined)(full));
    let best = fits.best(anew.chain([fit.full.clone()]), search.last_pass())?;
    let scanned = scanned(bench, &best, weights).and_then(|full| fits.fit(full, search.last_pass()));
    cheapest([Some(best), scanned].into_iter().flatten())
}

/// The numbers of a fit whose last effect is one of the arm, with what is held of it where the arm's channels cost least, the
/// same for all joints; `None` where that is where it was.
fn scanned(bench: &Bench<'_>, fit: &Hypothesis, weights: &[f64]) -> Option<Vec<f64>> {
    let candidate = &bench.library.candidates[*fit.effects.last()?];
    let held: Vec<usize> = candidate.numbers.clone().filter(|k| !candidate.turned.contains(k)).collect();
    if held.is_empty() || !candidate.is_of_arm() {
        return None;
    }
    let evidence = ArmAlone(bench.evidence);
    let arm = evidence.bench(bench);
    let at = |share: f64| {
        let mut full = fit.full.clone();
        for k in &held {
            let unknown = &bench.library.unknowns[*k];
            full[*k] = unknown.lower + share * (unknown.upper - unknown.lower);
        }
        full
    };
    let clips = fit.clips();
    let cost = |full: &[f64]| arm.plain_cost(&clips, full, weights).unwrap_or(f64::INFINITY);
    let mut tried: Vec<(f64, f64)> = SHARES_OF_RANGE.iter().map(|share| (*share, cost(&at(*share)))).collect();
    let least = |tried: &[(f64, f64)]| (0..tried.len()).min_by(|a, b| tried[*a].1.total_cmp(&tried[*b].1)).unwrap_or(0);
    for _ in 0..HALVINGS {
        let best = least(&tried);
        // The upper neighbour first: what is put below shifts it.
        for upper in [best + 1, best] {
            if (1..tried.len()).contains(&upper) {
                let share = 0.5 * (tried[upper - 1].0 + tried[upper].0);
                tried.insert(upper, (share, cost(&at(share))));
            }
        }
    }
    let (share, lowest) = tried[least(&tried)];
    (lowest < cost(&fit.full)).then(|| at(share))
}

/// The numbers of a fit whose last effect has two forms, in the form that is further from what was fitted.
fn other_way(bench: &Bench<'_>, fit: &Hypothesis) -> Option<Vec<f64>> {
    let [one, two] = &bench.library.candidates[*fit.effects.last()?].alternatives[..] else { return None };
    let far = |form: &Alternative| form.form.iter().map(|(k, value)| (fit.full[*k] - value).abs()).sum::<f64>();
    let mut full = fit.full.clone();
    let other = if far(one) > far(two) { one } else { two };
    other.form.iter().for_each(|(k, value)| full[*k] = *value);
    Some(full)
}

/// A hypothesis without the first of its effects that the others make superfluous.
pub(super) fn fewer(search: &Search<'_>, now: &Hypothesis, weights: &[f64]) -> Option<Hypothesis> {
    let bench = search.bench;
    if now.effects.len() < 2 || bench.interrupt.asked() {
        return None;
    }
    let predicted = |fit: &Hypothesis| predict(bench, fit, &search.split.choose, weights);
    let whole = predicted(now)?;
    let without = |place: usize| {
        let effect = now.effects[place];
        let others = [&now.effects[..place], &now.effects[place + 1..]].concat();
        let full = bench.library.with_effects_of(now.full.clone(), &[effect], &bench.library.start());
        let fit = search.fits(&others, weights, now).fit(full, REFINEMENT)?;
        let loss = whole.over(&predicted(&fit)?);
        let missed = loss.in_nearly_all() && loss.nats > EFFECTS.min_gain_nats;
        let cost = bench.library.candidates[effect].alternatives[0].probes.len();
        (!missed && !EFFECTS.proves(&loss, cost)).then_some(fit)
    };
    (0..now.effects.len()).find_map(without)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::fit::effort::Effort;
    use crate::diagnose::fit::sweep::Precision;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    #[test]
    fn friction_that_creeps_further_than_usual_is_found_to_do_so() {
        let cell = shipped();
        let mut world = with_effect("joint_coulomb_friction", 3, Kind::Excitation, &cell);
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let joints = cell.controller.as_ref().expect("a controller").stiffness.len();
        let creeps = 0.0173 * 0.02;
        world.hidden.effects[0].parameters.insert("creep".into(), vec![creeps; joints].into());
        on_bench((&cell, &world), &library, |bench, even| {
            let candidate = library.find("joint_coulomb_friction").expect("a candidate");
            let at = &library.candidates[candidate];
            let held: Vec<usize> = at.numbers.clone().filter(|k| !at.turned.contains(k)).collect();
            let truth = truth(&library, &world);
            let mut usual = truth.clone();
            held.iter().for_each(|k| usual[*k] = library.start()[*k]);
            let found = |full: Vec<f64>| {
                let fit = bench.fit(&[candidate], full, &[0, 1], even, None, Effort::of(0, Precision::Joints));
                scanned(bench, &fit.expect("a fit"), even)
            };
            // Noise may shift it a little.
            let near = |found: Vec<f64>| {
                found.iter().zip(&truth).all(|(found, truth)| (found - truth).abs() <= 0.1 * truth.abs())
            };
            assert!(found(truth.clone()).is_none_or(near));
            assert!(near(found(usual).expect("elsewhere")));
        });
    }
}
