//! Where fits of a candidate begin. Effects on the arm and on the slide answer evenly: there the slope at the neutral point
//! shows the way. What has no slope there, and what changes where or how an object is hit, is tried at strengths that are met
//! in practice.

use super::evidence::Evidence;
use super::fit::{Bench, Hypothesis};
use super::shortlist::Scored;
use twin::effects::Stage;

/// Other starts of a fit are this share of the strongest that is met in practice away.
const ASIDE: f64 = 0.3;
/// Shares of the strongest at which one whose slope tells little is tried.
const TRIED: [f64; 3] = [0.1, 0.3, 0.6];
/// Shares of the strongest at which a candidate without a slope is tried.
const SCANNED: [f64; 4] = [0.06, 0.2, 0.5, 1.0];

/// Numbers at which fits of a candidate begin: where the score test points. Of an effect with many forms (a place on the
/// table) also the forms next to the best; of one whose slope at one point tells little, as where the object is hit
/// elsewhere, also where the clips cost least some way to either side.
pub(super) fn starts<E: Evidence>(bench: &Bench<'_, E>, at: (&Hypothesis, &[f64]), scored: &Scored) -> Vec<Vec<f64>> {
    let candidate = &bench.library.candidates[scored.candidate];
    let mut starts = vec![scored.clone()];
    if candidate.effect.stage == Stage::Slide {
        let form = |(alternative, units): &(usize, Vec<f64>)| Scored {
            alternative: *alternative,
            units: units.clone(),
            ..scored.clone()
        };
        starts.extend(scored.next.iter().map(form));
    }
    let one_probe = candidate.alternatives[scored.alternative].probes.len() == 1;
    let uneven = matches!(candidate.effect.stage, Stage::Hit | Stage::Camera);
    if uneven && one_probe {
        starts.extend(aside(bench, scored, &[ASIDE]));
    }
    let mut numbers: Vec<Vec<f64>> = starts.iter().map(|start| bench.begun(at.0.full.clone(), start)).collect();
    if uneven && !one_probe {
        numbers.extend(least_cost_aside(bench, at, scored).map(|(_, full)| full));
    }
    numbers
}

/// Of a candidate that the score test did not point to, the strength at which the fitted clips cost least, in any form.
pub(super) fn scanned<E: Evidence>(bench: &Bench<'_, E>, at: (&Hypothesis, &[f64]), scored: &Scored) -> Vec<Vec<f64>> {
    let forms = 0..bench.library.candidates[scored.candidate].alternatives.len();
    let starts = forms.flat_map(|alternative| aside(bench, &Scored { alternative, ..scored.clone() }, &SCANNED));
    let numbers = starts.map(|start| bench.begun(at.0.full.clone(), &start));
    cheapest(bench, at, numbers).map(|(_, full)| full).into_iter().collect()
}

/// Some way to either side along each of a candidate's directions, in any of its forms: what the clips cost where they cost
/// least, and the numbers there. Also with the object as it is said to be: fitted without the effect, its numbers stand in
/// for it, and would have to be unlearnt.
pub(super) fn least_cost_aside<E: Evidence>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis, &[f64]),
    scored: &Scored,
) -> Option<(f64, Vec<f64>)> {
    let alternatives = &bench.library.candidates[scored.candidate].alternatives;
    let mut starts = Vec::new();
    for (alternative, probe) in
        alternatives.iter().enumerate().flat_map(|(a, form)| (0..form.probes.len()).map(move |probe| (a, probe)))
    {
        let probes = &alternatives[alternative].probes;
        let sides = TRIED.into_iter().flat_map(|share| [share, -share]);
        for side in sides.filter(|side| *side > 0.0 || !probes[probe].one_sided) {
            let mut units = vec![0.0; probes.len()];
            units[probe] = side * probes[probe].largest;
            starts.push(Scored { alternative, units, ..scored.clone() });
        }
    }
    let bases = [at.0.full.clone(), with_nominal_object(bench, at.0.full.clone())];
    let numbers = starts.iter().flat_map(|start| bases.iter().map(|base| bench.begun(base.clone(), start)));
    cheapest(bench, at, numbers)
}

/// The numbers with the baseline's object as cell.toml has it.
fn with_nominal_object<E: Evidence>(bench: &Bench<'_, E>, mut full: Vec<f64>) -> Vec<f64> {
    for k in bench.library.baseline.clone().filter(|k| !bench.library.arm_feels(*k, &full)).collect::<Vec<_>>() {
        full[k] = bench.library.unknowns[k].start;
    }
    full
}

/// Which numbers make the fitted clips cost least, and how much.
fn cheapest<E: Evidence>(
    bench: &Bench<'_, E>,
    (from, weights): (&Hypothesis, &[f64]),
    numbers: impl Iterator<Item = Vec<f64>>,
) -> Option<(f64, Vec<f64>)> {
    let costs = numbers.map(|full| (bench.plain_cost(from, &full, weights).unwrap_or(f64::INFINITY), full));
    costs.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A candidate at shares of the strongest that is met in practice, either way where it acts both ways.
fn aside<E: Evidence>(bench: &Bench<'_, E>, scored: &Scored, shares: &[f64]) -> Vec<Scored> {
    let probes = &bench.library.candidates[scored.candidate].alternatives[scored.alternative].probes;
    let one_sided = probes.iter().any(|probe| probe.one_sided);
    let sides = shares.iter().flat_map(|share| [*share, -share]).filter(|side| *side > 0.0 || !one_sided);
    let units = |side: f64| probes.iter().map(|probe| side * probe.largest).collect();
    sides.map(|side| Scored { units: units(side), ..scored.clone() }).collect()
}
