//! Where fits of a candidate begin. Effects on the arm are smooth, so the slope at the neutral point shows the way. What has no slope
//! there, and what changes how an object is hit or slides, is tried at strengths that are plausible; what does nothing below a threshold,
//! joint by joint. All of these are starts of one fit ([`crate::diagnose::fit::multi_start`]).

use super::{Around, along_motion, ripple};
use crate::diagnose::fit::multi_start::{Tried, cheapest};
use crate::diagnose::fit::shortlist::{MAX_FORMS, Scored};
use crate::diagnose::library::Candidate;
use inference::likelihood::Setting;
use inference::likelihood::random_effects::OwnNumbers;
use twin::effects::{Search, Stage};

/// Shares of the strongest plausible size at which candidates are tried (choices): one whose slope tells little along each direction, and
/// at the middle share one beyond the arm beside where its slope points; a patch in every place; one without a slope; and one in a joint
/// together with the gains of that joint, up to what simpler machines have.
const EACH_DIRECTION: [f64; 3] = [0.1, 0.3, 0.6];
const IN_EACH_PLACE: [f64; 2] = [0.4, 0.8];
const WITHOUT_A_SLOPE: [f64; 4] = [0.06, 0.2, 0.5, 1.0];
const IN_EACH_JOINT: [f64; 4] = [0.1, 0.3, 1.0, 3.0];
/// Friction beside a patch as a share of what it is without one: what was fitted is a mean of both.
const FRICTION_BESIDE: [f64; 3] = [0.9, 1.0, 1.1];

/// A start that costs more than this many times what the hypothesis without the candidate does is far from anything that
/// acts: an effect whose strength is right spares something, though the other numbers still stand in for it.
const MAX_TIMES_COST: f64 = 2.0;

/// Units of a probe at which each limit is tried: it bites from 1 on.
const LIMIT_UNITS: [f64; 9] = [0.95, 1.05, 1.15, 1.3, 1.6, 2.2, 4.0, 10.0, 25.0];
/// A further limit leaves less than this share of what the clips cost.
const MAX_COST_LEFT: f64 = 0.98;
/// Units of a probe at which a number that only the object tells is tried: all of its plausible range.
const WHOLE_RANGE_UNITS: [f64; 11] = [0.0, -9.0, -7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0, 9.0];

/// Numbers at which fits of a candidate begin, worked out unless they are known; `overlooked`: the score test did not point to it.
pub(in crate::diagnose) fn kept<O: OwnNumbers>(at: &Around<'_, O>, scored: &Scored, overlooked: bool) -> Vec<Vec<f64>> {
    let step = at.bench.step("starts").with(&(scored.candidate, overlooked)).with_numbers(&at.from.full);
    let of = || if overlooked { scanned(at, scored) } else { pointed_at(at, scored) };
    at.bench.trail.0.once(&step.with_numbers(at.weights), of)
}

/// Where the score test points. Of an effect with many forms (a place on the
/// table) also the forms next to the best; of one beyond the arm also some way to either side, since the object's numbers,
/// fitted without it, stand in for a part of it; of one whose slope at one point tells little, as where the object is hit
/// elsewhere, also where the clips cost least.
fn pointed_at<O: OwnNumbers>(at: &Around<'_, O>, scored: &Scored) -> Vec<Vec<f64>> {
    let candidate = at.candidate(scored);
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
    if one_probe && !candidate.is_of_arm() {
        starts.extend(aside(candidate, scored, &EACH_DIRECTION[1..2]));
    }
    let mut numbers: Vec<Vec<f64>> = starts.iter().map(|start| at.begun(start)).collect();
    if has_places(candidate) {
        numbers.extend(placed(at, scored));
    }
    numbers.extend(without_a_slope(at, candidate));
    if candidate.is_searched(Search::Periodic) {
        numbers.extend(ripple::start(at, scored.candidate));
    }
    let uneven = matches!(candidate.effect.stage, Stage::Hit | Stage::Camera);
    // What an object pivots about changes the hit, of which slopes tell little, and its number decides how it spins besides.
    if (uneven && !one_probe) || candidate.is_searched(Search::NonSmooth) {
        numbers.extend(each_direction(at, scored, if has_many_minima(candidate) { MAX_FORMS } else { 1 }));
    }
    numbers
}

/// Whether a candidate's forms are places on the table.
fn has_places(candidate: &Candidate) -> bool {
    candidate.alternatives.len() > MAX_FORMS && candidate.effect.stage == Stage::Slide
}

/// Whether what lies in the right place may come down later than what stands in for it elsewhere.
pub(in crate::diagnose) fn has_many_minima(candidate: &Candidate) -> bool {
    has_places(candidate) || candidate.is_searched(Search::NonSmooth)
}

/// Where the clips cost least with a candidate in each of its many forms, friction being another beside it: an edge that lies
/// elsewhere than it is shows no slope towards its place.
fn placed<O: OwnNumbers>(at: &Around<'_, O>, scored: &Scored) -> Vec<Vec<f64>> {
    let friction = at.bench.library.settings.settings().iter().position(|setting| *setting == Setting::Friction);
    let mut places: Vec<Tried> = Vec::new();
    for form in in_each_form(at.candidate(scored), scored) {
        let numbers = aside(at.candidate(scored), &form, &IN_EACH_PLACE).into_iter().flat_map(|start| {
            FRICTION_BESIDE.map(|share| {
                let mut full = at.begun(&start);
                friction.into_iter().for_each(|k| full[k] *= share);
                full
            })
        });
        // A place that costs more than those that are fitted anyway is not fitted.
        let bound = places.get(MAX_FORMS - 1).map_or(f64::INFINITY, |place| place.cost);
        places.extend(at.cheapest(numbers, bound));
        places.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    places.into_iter().take(MAX_FORMS).map(|place| place.numbers).collect()
}

/// Of a candidate that the score test did not point to, the strength at which the fitted clips cost least, in any form, unless
/// they cost far more than without it.
fn scanned<O: OwnNumbers>(at: &Around<'_, O>, scored: &Scored) -> Vec<Vec<f64>> {
    let candidate = at.candidate(scored);
    let starts = in_each_form(candidate, scored).flat_map(|form| aside(candidate, &form, &WITHOUT_A_SLOPE));
    let ripples = candidate.is_searched(Search::Periodic);
    let in_step = if ripples { ripple::start(at, scored.candidate) } else { None };
    let numbers = starts.map(|start| at.begun(&start)).chain(in_step);
    let start = at.cheapest(numbers, MAX_TIMES_COST * at.cost(&at.from.full));
    start.map(|start| start.numbers).into_iter().chain(without_a_slope(at, candidate)).collect()
}

/// Numbers of an effect to which no slope leads, joint by joint.
fn without_a_slope<O: OwnNumbers>(at: &Around<'_, O>, candidate: &Candidate) -> Vec<Vec<f64>> {
    if candidate.is_searched(Search::Limit) {
        // Where an arm is driven into its limits, gains that were fitted without these mean nothing.
        let nominal = with_nominal(at, |k| at.bench.library.joints[k].is_some());
        return vec![limits(at, candidate, at.from.full.clone()), limits(at, candidate, nominal)];
    }
    let threshold = candidate.is_searched(Search::Threshold).then(|| joint_by_joint(at, candidate));
    threshold.into_iter().chain(along_motion::start(at, candidate)).collect()
}

/// Limits of joints, each time that of the joint where the clips then cost least, for as long as that spares something: until the
/// worst is limited, those of the others mean nothing.
fn limits<O: OwnNumbers>(at: &Around<'_, O>, candidate: &Candidate, mut full: Vec<f64>) -> Vec<f64> {
    let moves: Vec<(usize, f64)> = first_moves(candidate).collect();
    let mut cost = at.cost(&full);
    for _ in &candidate.sizes {
        let numbers = moves.iter().flat_map(|one| LIMIT_UNITS.map(|units| at.moved(&full, *one, units)));
        let Some(better) = at.cheapest(numbers.collect::<Vec<_>>(), MAX_COST_LEFT * cost) else { break };
        (cost, full) = (better.cost, better.numbers);
    }
    full
}

/// What one unit of each direction of a candidate sets first: number and value.
fn first_moves(candidate: &Candidate) -> impl Iterator<Item = (usize, f64)> {
    candidate.alternatives[0].probes.iter().filter_map(|probe| probe.moves.first().copied())
}

/// Sizes of an effect in the joints, one joint after the other, where the clips cost least once the gains of that joint are fitted
/// beside it: gains that were fitted without the effect stand in for it. In joints that leave no gap it explains nothing.
fn joint_by_joint<O: OwnNumbers>(at: &Around<'_, O>, candidate: &Candidate) -> Vec<f64> {
    let (library, mut full) = (at.bench.library, at.from.full.clone());
    let open = at.joints_with_a_gap();
    for probe in &candidate.alternatives[0].probes {
        let Some(&one) = probe.moves.first() else { continue };
        if library.joints[one.0].is_some_and(|joint| !open.contains(&joint)) {
            continue;
        }
        let beside = library.baseline.clone().filter(|k| library.joints[*k] == library.joints[one.0]);
        let chosen: Vec<usize> = beside.chain([one.0]).collect();
        let tried = IN_EACH_JOINT.iter().filter_map(|share| {
            at.bench.after_a_step(at.from, at.moved(&full, one, share * probe.largest), &chosen, at.weights)
        });
        let now = at.cost(&full);
        full = cheapest(tried).filter(|best| best.cost < now).map_or(full, |better| better.numbers);
        if at.bench.interrupt.asked() {
            break;
        }
    }
    full
}

/// The numbers with some of the baseline's as cell.toml has them.
fn with_nominal<O: OwnNumbers>(at: &Around<'_, O>, which: impl Fn(usize) -> bool) -> Vec<f64> {
    let (library, mut full) = (at.bench.library, at.from.full.clone());
    library.baseline.clone().filter(|k| which(*k)).for_each(|k| full[k] = library.unknowns[k].start);
    full
}

/// Some way to either side along each of a candidate's directions, in any of its forms: the numbers of those `count` places where the
/// clips cost least. Also with the object as it is said to be: fitted without the effect, its numbers stand in
/// for it, and would have to be unlearnt. But for its friction: how far it slides tells that whatever the hit was like.
fn each_direction<O: OwnNumbers>(at: &Around<'_, O>, scored: &Scored, count: usize) -> Vec<Vec<f64>> {
    let alternatives = &at.candidate(scored).alternatives;
    let mut starts = Vec::new();
    for (alternative, form) in alternatives.iter().enumerate() {
        for (place, probe) in form.probes.iter().enumerate() {
            for side in sides(&EACH_DIRECTION, probe.one_sided) {
                let mut units = vec![0.0; form.probes.len()];
                units[place] = side * probe.largest;
                starts.push(Scored { alternative, units, ..scored.clone() });
            }
        }
    }
    let library = at.bench.library;
    let of_object = |k| !library.arm_feels(k, &at.from.full) && library.settings.settings()[k] != Setting::Friction;
    let bases = [at.from.full.clone(), with_nominal(at, of_object)];
    let numbers = starts.iter().flat_map(|start| bases.iter().map(|base| at.bench.begun(base.clone(), start)));
    at.several_cheapest(numbers, count).into_iter().map(|one| one.numbers).collect()
}

/// Numbers of an effect in the joints that the arm's own channels leave open, where the object tells them: nothing but what
/// the tip hits says how far off a vertical joint's encoder is. `full`: the others, as the arm tells them. One number after the other,
/// where the clips cost least: from rest no slope leads there.
pub(in crate::diagnose) fn seen_by_the_object<O: OwnNumbers>(
    at: &Around<'_, O>,
    mut full: Vec<f64>,
    open: &[usize],
) -> Vec<f64> {
    let moves: Vec<_> = at.bench.library.candidates.iter().flat_map(first_moves).collect();
    for one in moves.into_iter().filter(|(number, _)| open.contains(number)) {
        let tried = WHOLE_RANGE_UNITS.map(|units| at.moved(&full, one, units));
        full = at.cheapest(tried, f64::INFINITY).map_or(full, |best| best.numbers);
    }
    full
}

/// A candidate in each of its forms.
fn in_each_form<'a>(candidate: &Candidate, scored: &'a Scored) -> impl Iterator<Item = Scored> + use<'a> {
    (0..candidate.alternatives.len()).map(|alternative| Scored { alternative, ..scored.clone() })
}

/// A candidate at shares of the strongest plausible size in all directions at once, either way where it acts both ways.
fn aside(candidate: &Candidate, scored: &Scored, shares: &[f64]) -> Vec<Scored> {
    let probes = &candidate.alternatives[scored.alternative].probes;
    let units = |side: f64| probes.iter().map(|probe| side * probe.largest).collect();
    let sides = sides(shares, probes.iter().any(|probe| probe.one_sided));
    sides.map(|side| Scored { units: units(side), ..scored.clone() }).collect()
}

fn sides(shares: &[f64], one_sided: bool) -> impl Iterator<Item = f64> {
    shares.iter().flat_map(|share| [*share, -share]).filter(move |side| *side > 0.0 || !one_sided)
}

#[cfg(test)]
mod tests {
    use super::super::around;
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
            let baseline = bench.fit(&[], library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            limits(&around(bench, &baseline, even), &library.candidates[candidate], library.start())
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
            let from = bench.fit(&[], library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let starts = |name| {
                let candidate = library.find(name).expect("a candidate");
                scanned(&around(bench, &from, even), &nothing_said_of(&library, candidate)).len()
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
            let from = bench.fit(&[], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let patch = bench.library.find("friction_patch").expect("a candidate");
            let starts = placed(&around(bench, &from, even), &nothing_said_of(bench.library, patch));
            assert_eq!(starts.len(), MAX_FORMS);
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
            let baseline = bench.fit(&[], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let size = bench.library.candidates[candidate].sizes[0];
            let from = pointed_at(&around(bench, &baseline, even), &nothing_said_of(bench.library, candidate));
            from.into_iter().map(|full| full[size]).collect::<Vec<f64>>()
        });
        assert!(tried.contains(&0.0), "{tried:?}");
        assert!(tried.iter().any(|slope| *slope > 0.05) && tried.iter().any(|slope| *slope < -0.05), "{tried:?}");
    }
}
