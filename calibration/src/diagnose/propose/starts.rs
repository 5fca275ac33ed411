//! Where fits of a candidate begin. Effects on the arm answer evenly: there the slope at the neutral point shows the way. What
//! has no slope there, and what changes how an object is hit or slides, is tried at strengths that are met in practice; what
//! does nothing below a threshold, joint by joint.

use super::{along_motion, ripple};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::library::Candidate;
use inference::likelihood::Likelihood;
use inference::likelihood::Setting;
use twin::effects::{Search, Stage};

/// Other starts of a fit are this share of the strongest that is met in practice away.
const ASIDE: f64 = 0.3;
/// Shares of the strongest at which one whose slope tells little is tried.
const TRIED: [f64; 3] = [0.1, 0.3, 0.6];
/// Shares of the strongest at which a patch is tried in every place, and friction beside it as a share of what it is without
/// one: what was fitted is a mean of both.
const PLACED: [f64; 2] = [0.4, 0.8];
const BESIDE: [f64; 3] = [0.9, 1.0, 1.1];
/// So many of the places where the clips cost least are fitted.
const PLACES: usize = 3;
/// Shares of the strongest at which a candidate without a slope is tried.
const SCANNED: [f64; 4] = [0.06, 0.2, 0.5, 1.0];

/// A start that costs more than this many times what the hypothesis without the candidate does is far from anything that
/// acts: an effect whose strength is right spares something, though the other numbers still stand in for it.
const FAR_OFF: f64 = 2.0;

/// Units of a probe at which each direction of one with a threshold is tried.
const STEPPED: [f64; 9] = [0.95, 1.05, 1.15, 1.3, 1.6, 2.2, 4.0, 10.0, 25.0];
/// A further limit leaves less than this share of what the clips cost.
const SPARES: f64 = 0.98;
/// Shares of the strongest that is usual at which an effect in a joint is tried with the gains of that joint: simpler machines
/// have more.
const BY_JOINT: [f64; 4] = [0.1, 0.3, 1.0, 3.0];
/// Units of a probe at which a number that only the object tells is tried: all of what is met in practice.
const ALL_ALONG: [f64; 10] = [-9.0, -7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0, 9.0];

/// [`of`], worked out unless it is known.
pub(in crate::diagnose) fn kept<E: Likelihood>(
    bench: &Bench<'_, E>,
    (from, weights): (&Hypothesis<E::Own>, &[f64]),
    scored: &Scored,
    overlooked: bool,
) -> Vec<Vec<f64>> {
    let step = bench.step("starts").with(&(scored.candidate, overlooked)).with_numbers(&from.full);
    bench.trail.0.once(&step.with_numbers(weights), || of(bench, (from, weights), scored, overlooked))
}

/// Numbers at which fits of a candidate begin; `overlooked`: the score test did not point to it.
fn of<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    scored: &Scored,
    overlooked: bool,
) -> Vec<Vec<f64>> {
    if overlooked { scanned(bench, at, scored) } else { pointed_at(bench, at, scored) }
}

/// Numbers at which fits of a candidate begin: where the score test points. Of an effect with many forms (a place on the
/// table) also the forms next to the best; of one beyond the arm also some way to either side, since the object's numbers,
/// fitted without it, stand in for a part of it; of one whose slope at one point tells little, as where the object is hit
/// elsewhere, also where the clips cost least.
fn pointed_at<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    scored: &Scored,
) -> Vec<Vec<f64>> {
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
    if one_probe && !candidate.is_of_arm() {
        starts.extend(aside(bench, scored, &[ASIDE]));
    }
    let mut numbers: Vec<Vec<f64>> = starts.iter().map(|start| bench.begun(at.0.full.clone(), start)).collect();
    if has_places(bench, scored.candidate) {
        numbers.extend(placed(bench, at, scored));
    }
    numbers.extend(without_a_slope(bench, at, candidate));
    if candidate.is_searched(Search::Periodic) {
        numbers.extend(ripple::start(bench, at, scored.candidate));
    }
    // What an object pivots about changes the hit, of which slopes tell little, and its number decides how it spins besides.
    if (uneven && !one_probe) || candidate.is_searched(Search::NonSmooth) {
        numbers.extend(least_cost_aside(bench, at, scored).map(|(_, full)| full));
    }
    numbers
}

/// Whether a candidate's forms are places on the table.
pub(in crate::diagnose) fn has_places<E>(bench: &Bench<'_, E>, candidate: usize) -> bool {
    let candidate = &bench.library.candidates[candidate];
    candidate.alternatives.len() > PLACES && candidate.effect.stage == Stage::Slide
}

/// Where the clips cost least with a candidate in each of its many forms, friction being another beside it: an edge that lies
/// elsewhere than it is shows no slope towards its place.
fn placed<E: Likelihood>(bench: &Bench<'_, E>, at: (&Hypothesis<E::Own>, &[f64]), scored: &Scored) -> Vec<Vec<f64>> {
    let friction = bench.library.settings.settings().iter().position(|setting| *setting == Setting::Friction);
    let forms = 0..bench.library.candidates[scored.candidate].alternatives.len();
    let mut places: Vec<(f64, Vec<f64>)> = Vec::new();
    for alternative in forms {
        let starts = aside(bench, &Scored { alternative, ..scored.clone() }, &PLACED);
        let numbers = starts.into_iter().flat_map(|start| {
            BESIDE.map(|share| {
                let mut full = bench.begun(at.0.full.clone(), &start);
                friction.into_iter().for_each(|k| full[k] *= share);
                full
            })
        });
        // A place that costs more than those that are fitted anyway is not fitted.
        let bound = places.get(PLACES - 1).map_or(f64::INFINITY, |(cost, _)| *cost);
        places.extend(cheapest_below(bench, at, numbers, bound));
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    places.into_iter().take(PLACES).map(|(_, full)| full).collect()
}

/// Of a candidate that the score test did not point to, the strength at which the fitted clips cost least, in any form, unless
/// they cost far more than without it.
fn scanned<E: Likelihood>(bench: &Bench<'_, E>, at: (&Hypothesis<E::Own>, &[f64]), scored: &Scored) -> Vec<Vec<f64>> {
    let forms = 0..bench.library.candidates[scored.candidate].alternatives.len();
    let starts = forms.flat_map(|alternative| aside(bench, &Scored { alternative, ..scored.clone() }, &SCANNED));
    let numbers = starts.map(|start| bench.begun(at.0.full.clone(), &start));
    let ripples = bench.library.candidates[scored.candidate].is_searched(Search::Periodic);
    let in_step = if ripples { ripple::start(bench, at, scored.candidate) } else { None };
    let most = FAR_OFF * bench.plain_cost(&at.0.clips(), &at.0.full, at.1).unwrap_or(f64::INFINITY);
    let start = cheapest_below(bench, at, numbers.chain(in_step), most);
    let candidate = &bench.library.candidates[scored.candidate];
    start.map(|(_, full)| full).into_iter().chain(without_a_slope(bench, at, candidate)).collect()
}

/// Numbers of an effect to which no slope leads, joint by joint.
fn without_a_slope<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    candidate: &Candidate,
) -> Vec<Vec<f64>> {
    let fitted = at.0.full.clone();
    if candidate.is_searched(Search::Limit) {
        let nominal = with_nominal_arm(bench, fitted.clone());
        return vec![limits(bench, at, candidate, fitted), limits(bench, at, candidate, nominal)];
    }
    let threshold = candidate.is_searched(Search::Threshold).then(|| joint_by_joint(bench, at, candidate));
    threshold.into_iter().chain(along_motion::start(bench, at, candidate)).collect()
}

/// Limits of joints, each time that of the joint where the clips then cost least, for as long as that spares something: until the
/// worst is limited, those of the others mean nothing.
fn limits<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    candidate: &Candidate,
    mut full: Vec<f64>,
) -> Vec<f64> {
    let mut cost = bench.plain_cost(&at.0.clips(), &full, at.1).unwrap_or(f64::INFINITY);
    for _ in &candidate.sizes {
        let probes = candidate.alternatives[0].probes.iter().filter_map(|probe| probe.moves.first());
        let tried = probes.flat_map(|(size, probed)| {
            let unknown = &bench.library.unknowns[*size];
            let value = move |units: f64| {
                (unknown.start + units * (probed - unknown.start)).clamp(unknown.lower, unknown.upper)
            };
            STEPPED.map(|units| (*size, value(units)))
        });
        let numbers = tried.map(|(size, value)| {
            let mut tried = full.clone();
            tried[size] = value;
            tried
        });
        let Some((less, better)) = cheapest_below(bench, at, numbers.collect::<Vec<_>>().into_iter(), SPARES * cost)
        else {
            break;
        };
        (cost, full) = (less, better);
    }
    full
}

/// Sizes of an effect in the joints, one joint after the other, where the clips cost least once the gains of that joint are fitted
/// beside it: gains that were fitted without the effect stand in for it.
fn joint_by_joint<E: Likelihood>(
    bench: &Bench<'_, E>,
    (from, weights): (&Hypothesis<E::Own>, &[f64]),
    candidate: &Candidate,
) -> Vec<f64> {
    let (library, mut full) = (bench.library, from.full.clone());
    for probe in &candidate.alternatives[0].probes {
        let Some(&(size, probed)) = probe.moves.first() else { continue };
        let beside = library.baseline.clone().filter(|k| library.joints[*k] == library.joints[size]);
        let chosen: Vec<usize> = beside.chain([size]).collect();
        let unknown = &library.unknowns[size];
        let with = |share: f64| {
            let mut tried = full.clone();
            let value = unknown.start + share * probe.largest * (probed - unknown.start);
            tried[size] = value.clamp(unknown.lower, unknown.upper);
            tried
        };
        let tried = BY_JOINT.iter().filter_map(|share| bench.after_a_step((from, with(*share)), &chosen, weights));
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        let now = bench.plain_cost(&from.clips(), &full, weights).unwrap_or(f64::INFINITY);
        full = best.filter(|(cost, _)| *cost < now).map_or(full, |(_, better)| better);
        if bench.interrupt.asked() {
            break;
        }
    }
    full
}

/// The numbers with gains as cell.toml has them: where an arm is driven into its limits, gains that were fitted without these mean
/// nothing.
fn with_nominal_arm<E: Likelihood>(bench: &Bench<'_, E>, full: Vec<f64>) -> Vec<f64> {
    with_nominal(bench, full, |k| bench.library.joints[k].is_some())
}

/// The numbers with some of the baseline's as cell.toml has them.
fn with_nominal<E: Likelihood>(bench: &Bench<'_, E>, mut full: Vec<f64>, which: impl Fn(usize) -> bool) -> Vec<f64> {
    bench.library.baseline.clone().filter(|k| which(*k)).for_each(|k| full[k] = bench.library.unknowns[k].start);
    full
}

/// Some way to either side along each of a candidate's directions, in any of its forms: what the clips cost where they cost
/// least, and the numbers there. Also with the object as it is said to be: fitted without the effect, its numbers stand in
/// for it, and would have to be unlearnt.
pub(in crate::diagnose) fn least_cost_aside<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
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

/// Numbers of an effect in the joints that the arm's own channels leave open, where the object tells them: nothing but what
/// the tip hits says how far off a vertical joint's encoder is. `full`: the others, as the arm tells them.
pub(in crate::diagnose) fn seen_by_the_object<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    full: Vec<f64>,
    open: &[usize],
) -> Vec<f64> {
    one_by_one(bench, at, full, open, &ALL_ALONG)
}

/// Numbers of a candidate, one after the other, where the clips cost least beside those before it: from rest no slope leads
/// there. `units` of each number's probe are tried, and rest.
fn one_by_one<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    mut full: Vec<f64>,
    numbers: &[usize],
    units: &[f64],
) -> Vec<f64> {
    let probes = bench.library.candidates.iter().flat_map(|candidate| &candidate.alternatives[0].probes);
    let moves: Vec<(usize, f64)> = probes.filter_map(|probe| probe.moves.first().copied()).collect();
    for (number, probed) in moves.into_iter().filter(|(number, _)| numbers.contains(number)) {
        let unknown = &bench.library.unknowns[number];
        let tried = [0.0].iter().chain(units).map(|units| {
            let mut tried = full.clone();
            tried[number] = (unknown.start + units * (probed - unknown.start)).clamp(unknown.lower, unknown.upper);
            tried
        });
        full = cheapest(bench, at, tried.collect::<Vec<_>>().into_iter()).map_or(full, |(_, full)| full);
    }
    full
}

/// The numbers with the baseline's object as cell.toml has it, but for its friction: how far it slides tells that whatever
/// the hit was like.
fn with_nominal_object<E: Likelihood>(bench: &Bench<'_, E>, full: Vec<f64>) -> Vec<f64> {
    let (library, at) = (bench.library, full.clone());
    with_nominal(bench, full, |k| !library.arm_feels(k, &at) && library.settings.settings()[k] != Setting::Friction)
}

/// Which numbers make the fitted clips cost least, and how much, where that is less than `bound`. Of numbers that cost more
/// before all clips were asked the others are not.
fn cheapest_below<E: Likelihood>(
    bench: &Bench<'_, E>,
    (from, weights): (&Hypothesis<E::Own>, &[f64]),
    numbers: impl Iterator<Item = Vec<f64>>,
    bound: f64,
) -> Option<(f64, Vec<f64>)> {
    let (clips, mut best) = (from.clips(), None::<(f64, Vec<f64>)>);
    for full in numbers {
        if bench.interrupt.asked() {
            break;
        }
        let bound = best.as_ref().map_or(bound, |(cost, _)| *cost);
        if let Some(cost) = bench.plain_cost_below(&clips, &full, weights, bound) {
            best = Some((cost, full));
        }
    }
    best
}

/// The same whatever they cost.
fn cheapest<E: Likelihood>(
    bench: &Bench<'_, E>,
    at: (&Hypothesis<E::Own>, &[f64]),
    numbers: impl Iterator<Item = Vec<f64>>,
) -> Option<(f64, Vec<f64>)> {
    cheapest_below(bench, at, numbers, f64::INFINITY)
}

/// A candidate at shares of the strongest that is met in practice, either way where it acts both ways.
fn aside<E: Likelihood>(bench: &Bench<'_, E>, scored: &Scored, shares: &[f64]) -> Vec<Scored> {
    let probes = &bench.library.candidates[scored.candidate].alternatives[scored.alternative].probes;
    let one_sided = probes.iter().any(|probe| probe.one_sided);
    let sides = shares.iter().flat_map(|share| [*share, -share]).filter(|side| *side > 0.0 || !one_sided);
    let units = |side: f64| probes.iter().map(|probe| side * probe.largest).collect();
    sides.map(|side| Scored { units: units(side), ..scored.clone() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, nothing_said_of, on_bench, on_strokes, shipped, with_effect};
    use inference::likelihood::arm::ArmClips;
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use shared_mem::theta::{EffectTheta, Theta};
    use worlds::session::record;
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn limits_of_the_torque_are_found_joint_by_joint_though_no_slope_leads_there() {
        let cell = shipped();
        let well = World::draw(3, Kind::Excitation, Fault::Nothing, &cell);
        let base = setting::complete(&cell, Some(&well.hidden)).expect("a cell");
        let arm =
            ArmClips::moments(&cell, &record(&well, 2).expect("a session"), |_: &[f64]| base.clone()).expect("an arm");
        let peaks = arm.peaks(&[]).expect("it can be simulated");
        // Two joints are cut short, each to its own share of what it needs.
        let shares = [None, Some(0.8), None, Some(0.88), None, None, None];
        let cut_short = shares.iter().zip(peaks).map(|(share, peak)| share.map_or(1e3, |share: f64| share * peak));
        let parameters = [("limit".to_owned(), cut_short.collect::<Vec<f64>>().into())].into();
        let cut = EffectTheta { name: "torque_saturation".into(), parameters };
        let world = World { hidden: Theta { effects: vec![cut], ..well.hidden.clone() }, ..well };
        let library = Library::new(&cell, &base, None, &peaks);
        let candidate = library.find("torque_saturation").expect("a candidate");
        let begun = on_bench((&cell, &world), &library, |bench, even| {
            let baseline = bench.fit((&[], library.start()), &[0, 1], even, None, ONCE).expect("a fit");
            limits(bench, (&baseline, even), &library.candidates[candidate], library.start())
        });
        for ((size, share), peak) in library.candidates[candidate].sizes.iter().zip(shares).zip(peaks) {
            let found = (begun[*size] * peak).recip();
            match share {
                Some(share) => assert!((found / share - 1.0).abs() < 0.1, "{found} for {share} of what is asked"),
                None => assert!(found > 0.9, "{found} of what is asked"),
            }
        }
    }

    #[test]
    fn what_slopes_do_not_point_to_is_tried_where_it_spares_something_and_nowhere_else() {
        let cell = shipped();
        let well = World::draw(3, Kind::Excitation, Fault::Nothing, &cell);
        let base = setting::complete(&cell, Some(&well.hidden)).expect("a cell");
        let play = [("play".to_owned(), vec![1e-3; 7].into())].into();
        let loose = EffectTheta { name: "joint_backlash".into(), parameters: play };
        let world = World { hidden: Theta { effects: vec![loose], ..well.hidden.clone() }, ..well };
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let from = bench.fit((&[], library.start()), &[0, 1], even, None, ONCE).expect("a fit");
            let starts = |name| {
                let candidate = library.find(name).expect("a candidate");
                scanned(bench, (&from, even), &nothing_said_of(&library, candidate)).len()
            };
            // All joints at once, and joint by joint.
            assert_eq!((starts("joint_backlash"), starts("command_delay")), (2, 0));
        });
    }

    #[test]
    fn a_patch_is_tried_in_the_places_where_the_clips_cost_least() {
        let cell = shipped();
        let world = with_effect("friction_patch", 5, Kind::Strokes, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let from = bench.fit((&[], bench.library.start()), &[0, 1], even, None, ONCE).expect("a fit");
            let patch = bench.library.find("friction_patch").expect("a candidate");
            let starts = placed(bench, (&from, even), &nothing_said_of(bench.library, patch));
            assert_eq!(starts.len(), PLACES);
            let cost = |full: &[f64]| bench.plain_cost(&from.clips(), full, even).expect("strokes");
            let costs: Vec<f64> = starts.iter().map(|full| cost(full)).collect();
            assert!(costs.is_sorted() && costs[0] < cost(&from.full), "{costs:?}");
            let places = bench.library.candidates[patch].numbers.clone();
            assert!(starts.iter().skip(1).all(|other| other[places.clone()] != starts[0][places.clone()]), "elsewhere");
        });
    }

    #[test]
    fn what_acts_on_the_slide_is_tried_from_either_side() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        let tried = on_strokes((&cell, &world), |bench, even| {
            let candidate = bench.library.find("velocity_dependent_friction").expect("a candidate");
            let baseline = bench.fit((&[], bench.library.start()), &[0, 1], even, None, ONCE).expect("a fit");
            let size = bench.library.candidates[candidate].sizes[0];
            let from = pointed_at(bench, (&baseline, even), &nothing_said_of(bench.library, candidate));
            from.into_iter().map(|full| full[size]).collect::<Vec<f64>>()
        });
        assert!(tried.contains(&0.0), "{tried:?}");
        assert!(tried.iter().any(|slope| *slope > 0.05) && tried.iter().any(|slope| *slope < -0.05), "{tried:?}");
    }
}
