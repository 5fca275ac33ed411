//! Causes that are proven although a part of the gap stays: no model of a real cell is ever complete, and what a laboratory
//! needs is what acts, how much of the gap it closes, and what is left.
//!
//! Effects are taken in the order in which they were found. They are believed as long as each stood out on clips that were
//! not fitted (nearly all of them, far beyond chance, no other effect half as good), and all together close a real share of the
//! squared gap on held-out clips: the whole 90 % interval of the share lies above it. Where it does not, the
//! interval of all that the search found may: then those that are believed have to close more than half of what all of it
//! does. Where an effect that is known to look alike does as well, it is proven that one of the two acts, and both are said. One
//! that is stronger than what is plausible is said to be unusual: a range is what is known beforehand, and no bar for
//! what the clips show. What comes after them in the search belongs to the rest.

use super::gap::Residuals;
use super::held_out::Measured;
use super::trial::{Found, Step};
use super::{confidence, remainder};
use crate::answer::diagnosis::Share;
use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::fit::bench::Bench;
use inference::admit::Split;
use inference::likelihood::Evidence;

/// What is proven.
pub(in crate::diagnose) struct Partly {
    /// The search as if it had ended here.
    pub(in crate::diagnose) found: Found,
    /// It, measured on all clips.
    pub(in crate::diagnose) measured: Measured,
    /// Share of the squared gap that it closes there.
    pub(in crate::diagnose) share: Share,
    /// Whether an effect is stronger than what is plausible.
    pub(in crate::diagnose) unusual: bool,
    /// Effects that do as well as one of those that were found: candidates.
    rivals: Vec<usize>,
}

/// The most effects that are proven; `None` where not even the first is. `before`: what the baseline leaves on
/// held-out clips; `overdispersion`: see [`Found::overdispersion`].
pub(in crate::diagnose) fn proven<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    found: &Found,
    before: &Residuals,
    overdispersion: &[f64],
    seed: u64,
) -> Option<Partly> {
    let all = found.last.effects.len();
    let of_all = || {
        let all = Measured::of(bench, split, &found.last, &found.steps.last()?.weights).ok()?;
        Some(all.held_out.left.shrink(before, seed))
    };
    let most_of = |share: &Share, all: Share| all.ci90[0] > MOST_OF_IT && share.value > MOST_OF_IT * all.value;
    let one = |count: usize| {
        let weights = &with_effects(&found.steps, count).or(found.steps.last())?.weights;
        let last = if count == all { &found.last } else { &with_effects(&found.steps, count)?.from };
        let until = Found { steps: found.steps.clone(), last: last.clone() };
        let rivals = beside_what_stands_out(bench, &until, overdispersion)?;
        let measured = Measured::of(bench, split, last, weights).ok()?;
        let share = measured.held_out.left.shrink(before, seed);
        let unusual = !remainder::implausible(bench, &measured.of_all).is_empty();
        let real = share.ci90[0] > MOST_OF_IT || of_all().is_some_and(|all| most_of(&share, all));
        real.then_some(Partly { found: until, measured, share, unusual, rivals })
    };
    (1..=all).rev().find_map(one)
}

fn with_effects(steps: &[Step], count: usize) -> Option<&Step> {
    steps.iter().find(|step| step.from.effects.len() == count)
}

/// Effects that do as well as those that were found, where each of these stands out but for what is known to look like it.
fn beside_what_stands_out<E: Evidence>(
    bench: &Bench<'_, E>,
    found: &Found,
    overdispersion: &[f64],
) -> Option<Vec<usize>> {
    let added: Vec<(usize, usize)> = found.kept().collect();
    let mut all = Vec::new();
    for (place, effect) in &added {
        let step = &found.steps[*place];
        let mut rivals = confidence::rivals(step, bench.library, *effect, overdispersion[*place]);
        // What does the same with more numbers is no other cause: dry friction that may fall with speed, and does not.
        let more_of_it = |rival: usize| {
            step.trial(rival).zip(step.trial(*effect)).is_some_and(|(rival, own)| rival.is_outdone_by(own))
        };
        rivals.retain(|rival| !found.last.effects.contains(rival) && !more_of_it(*rival));
        let known = |rival: &usize| bench.library.look_alike(*rival, *effect);
        if !step.leads(bench.library, *effect) || !rivals.iter().all(known) {
            return None;
        }
        all.extend(rivals);
    }
    (added.len() == found.last.effects.len()).then_some(all)
}

impl Partly {
    /// Names of the effects that are proven, and of those that do as well as one of them.
    pub(in crate::diagnose) fn effects<E>(&self, bench: &Bench<'_, E>) -> [Vec<String>; 2] {
        let name = |effect: &usize| bench.library.name(*effect).to_owned();
        [&self.found.last.effects, &self.rivals].map(|effects| effects.iter().map(name).collect())
    }

    /// The effect whose signature explains most of what stays; `None` where none explains much of it.
    pub(in crate::diagnose) fn looks_like<E>(&self, bench: &Bench<'_, E>) -> Option<&'static str> {
        let step = self.found.steps.iter().find(|step| step.from.effects == self.found.last.effects)?;
        let best = step.trials.iter().max_by(|a, b| a.scored.cosine.total_cmp(&b.scored.cosine))?;
        let alike = best.scored.cosine.powi(2) > MOST_OF_IT;
        alike.then(|| bench.library.name(best.scored.candidate))
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::Predicted;
    use super::super::trial::Trial;
    use super::*;
    use crate::diagnose::fit::bench::Hypothesis;
    use crate::diagnose::fit::shortlist::Scored;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, nothing_said_of, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    fn likelier(nats: f64) -> Predicted {
        Predicted { clips: (0..12).map(|clip| (clip, 1000.0 - nats / 6.0)).collect() }
    }

    fn trial(library: &Library, candidate: usize, (fitted, nats): (&Hypothesis, f64)) -> Trial {
        Trial {
            scored: Scored { signal: 30.0, ..nothing_said_of(library, candidate) },
            fitted: Some((fitted.clone(), likelier(nats).over(&likelier(0.0)))),
            closes: 0.9,
            own_numbers: false,
        }
    }

    fn step(from: &Hypothesis, trials: Vec<Trial>) -> Step {
        Step {
            from: from.clone(),
            trials,
            predicted: likelier(0.0),
            weights: vec![1.0; 4 * MAX_JOINTS],
            arm_rows: 100,
            left: Vec::new(),
            whole: Vec::new(),
        }
    }

    /// Clips of a world with a command delay; what a search found in it is made of a fit without an effect and one with the truth.
    fn in_a_world_with_a_delay(
        tested: impl FnOnce(&Library, &Hypothesis, &Hypothesis, &dyn Fn(&Found) -> Option<Named>),
    ) {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("command_delay", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let effect = library.find("command_delay").expect("a candidate");
            let with = truth(&library, &world);
            let mut without = with.clone();
            library.candidates[effect].numbers.clone().for_each(|k| without[k] = library.start()[k]);
            let fit = |effects: &[usize], full| bench.fit(effects, full, &[0], even, None, ONCE).expect("a fit");
            let (baseline, last) = (fit(&[], without), fit(&[effect], with));
            let split = Split { train: vec![0], confirm: vec![1], ..Split::default() };
            let before = Residuals::at(bench, &baseline, &split.confirm).expect("it can be simulated");
            let named = |found: &Found| {
                let partly = proven(bench, &split, found, &before, &vec![1.0; found.steps.len()], 0)?;
                Some(Named { share: partly.share, effects: partly.effects(bench) })
            };
            tested(&library, &baseline, &last, &named);
        });
    }

    struct Named {
        share: Share,
        effects: [Vec<String>; 2],
    }

    #[test]
    fn an_effect_is_proven_where_it_stands_out_alone_and_closes_most_of_the_gap() {
        in_a_world_with_a_delay(|library, baseline, last, proven| {
            let [effect, other, alike] =
                ["command_delay", "payload", "command_lag"].map(|name| library.find(name).expect("a candidate"));
            let found = |(rival, nats): (usize, f64), last: &Hypothesis| {
                let trials = vec![trial(library, effect, (last, 300.0)), trial(library, rival, (last, nats))];
                let steps = vec![step(baseline, trials), step(last, Vec::new())];
                Found { steps, last: last.clone() }
            };
            let partly = proven(&found((other, 20.0), last)).expect("it is");
            let [named, rivals] = partly.effects;
            assert!(
                partly.share.ci90[0] > 0.9 && named == ["command_delay"] && rivals.is_empty(),
                "{:?}",
                partly.share
            );
            assert!(proven(&found((other, 290.0), last)).is_none(), "another effect does as well");
            let both = proven(&found((alike, 298.0), last)).expect("one of two that look alike acts");
            assert_eq!(both.effects, [vec!["command_delay".to_owned()], vec!["command_lag".to_owned()]]);
            let useless = Hypothesis { effects: vec![effect], ..baseline.clone() };
            assert!(proven(&found((other, 20.0), &useless)).is_none(), "nothing of the gap closes");
        });
    }

    #[test]
    fn an_effect_that_closes_less_than_half_is_proven_where_it_is_most_of_what_was_found() {
        in_a_world_with_a_delay(|library, baseline, last, proven| {
            let [effect, other] = ["command_delay", "payload"].map(|name| library.find(name).expect("a candidate"));
            let to = |share: f64, effects: &[usize]| {
                let mut full = baseline.full.clone();
                let numbers = library.candidates[effect].numbers.clone();
                numbers.for_each(|k| full[k] += share * (last.full[k] - baseline.full[k]));
                Hypothesis { effects: effects.to_vec(), full, ..baseline.clone() }
            };
            // What an error of the delay leaves grows with its square.
            let (alone, two) = (to(0.28, &[effect]), to(0.55, &[effect, other]));
            let first = || {
                let trials = [(effect, 300.0), (other, 20.0)];
                step(baseline, trials.map(|(k, nats)| trial(library, k, (&alone, nats))).to_vec())
            };
            let last = step(&alone, Vec::new());
            let found = Found { steps: vec![first(), last.clone()], last: alone.clone() };
            assert!(proven(&found).is_none(), "less than half of the gap");
            let steps = vec![first(), last, step(&two, Vec::new())];
            let partly = proven(&Found { steps, last: two }).expect("most of what was found");
            assert!(partly.effects[0] == ["command_delay"] && partly.share.value < 0.5, "{:?}", partly.share);
        });
    }
}
