//! Causes that are proven although a part of the gap stays: no model of a real cell is ever complete, and what a laboratory
//! needs is what acts, how much of the gap it closes, and what is left.
//!
//! Effects are taken in the order in which they were found. They are believed as long as the model that has them all plainly needs
//! each (clips that were not fitted are predicted worse without it, nearly all of them, far beyond chance), and all together close a
//! real share of the squared gap on held-out clips: the whole 90 % interval of the share lies above it. Where it does
//! not, the interval of all that the search found may: then those that are believed have to close more than half of what all of it
//! does. Where the model does as well with another effect in the place of one, it is proven that one of the two acts, and both are
//! said. One that is stronger than what is plausible is said to be unusual: a range is what is known beforehand, and no bar for
//! what the clips show. What comes after them in the search belongs to the rest.

use super::gap::Residuals;
use super::held_out::Measured;
use super::needed::FinalModel;
use super::remainder;
use super::trial::{Found, Step};
use crate::answer::diagnosis::Share;
use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::fit::bench::Bench;
use inference::admit::Split;

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

/// The most effects that are proven; `None` where not even the first is. `before`: what the baseline leaves on held-out clips.
pub(in crate::diagnose) fn proven(
    bench: &Bench<'_>,
    split: &Split,
    found: &Found,
    before: &Residuals,
    seed: u64,
) -> Option<Partly> {
    let all = found.last.effects.len();
    let of_all = || {
        let all = Measured::of(bench, split, &found.last, &found.steps.last()?.weights).ok()?;
        Some(all.held_out.left.shrink(before, seed))
    };
    let one = |count: usize| {
        let weights = &with_effects(&found.steps, count).or(found.steps.last())?.weights;
        let last = if count == all { &found.last } else { &with_effects(&found.steps, count)?.from };
        let until = Found { steps: found.steps.clone(), last: last.clone() };
        let measured = Measured::of(bench, split, last, weights).ok()?;
        let share = measured.held_out.left.shrink(before, seed);
        if !is_real(&share, of_all) {
            return None;
        }
        let rivals = FinalModel::new(bench, split, last, weights)?.alike(&until)?;
        let unusual = !remainder::implausible(bench, &measured.of_all).is_empty();
        Some(Partly { found: until, measured, share, unusual, rivals })
    };
    (1..=all).rev().find_map(one)
}

/// Whether a share of the gap is most of it, or most of what all that was found closes where that is.
fn is_real(share: &Share, of_all: impl FnOnce() -> Option<Share>) -> bool {
    let most_of = |all: Share| all.ci90[0] > MOST_OF_IT && share.value > MOST_OF_IT * all.value;
    share.ci90[0] > MOST_OF_IT || of_all().is_some_and(most_of)
}

fn with_effects(steps: &[Step], count: usize) -> Option<&Step> {
    steps.iter().find(|step| step.from.effects.len() == count)
}

impl Partly {
    /// Names of the effects that are proven, and of those that do as well as one of them.
    pub(in crate::diagnose) fn effects(&self, bench: &Bench<'_>) -> [Vec<String>; 2] {
        let name = |effect: &usize| bench.library.name(*effect).to_owned();
        [&self.found.last.effects, &self.rivals].map(|effects| effects.iter().map(name).collect())
    }

    /// The effect whose signature explains most of what stays; `None` where none explains much of it.
    pub(in crate::diagnose) fn looks_like(&self, bench: &Bench<'_>) -> Option<&'static str> {
        let step = self.found.steps.iter().find(|step| step.from.effects == self.found.last.effects)?;
        let best = step.trials.iter().max_by(|a, b| a.scored.cosine.total_cmp(&b.scored.cosine))?;
        let alike = best.scored.cosine.powi(2) > MOST_OF_IT;
        alike.then(|| bench.library.name(best.scored.candidate))
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_trial::{step, trial};
    use super::*;
    use crate::diagnose::fit::bench::Hypothesis;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    /// Clips of a world with a command delay; what a search found in it is made of a fit without an effect and one with the truth.
    fn in_a_world_with_a_delay(tested: impl FnOnce(&Library, [&Hypothesis; 2], &dyn Fn(&Found) -> Option<Named>)) {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("command_delay", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let effect = library.find("command_delay").expect("a candidate");
            let with = truth(&library, &world);
            let mut without = with.clone();
            library.candidates[effect].numbers.clone().for_each(|k| without[k] = library.start()[k]);
            let fit = |effects: &[usize], full| bench.fit(effects, full, &[0, 1], even, None, ONCE).expect("a fit");
            let (baseline, last) = (fit(&[], without), fit(&[effect], with));
            let split = Split { choose: vec![1], ..Split::in_turn(&[vec![0], vec![1]]) };
            let before = Residuals::at(bench, &baseline, &split.confirm).expect("it can be simulated");
            let named = |found: &Found| {
                let mut found = found.clone();
                for step in &mut found.steps {
                    (step.whole, step.weights) = (before.typical(), even.to_vec());
                }
                let partly = proven(bench, &split, &found, &before, 0)?;
                Some(Named { share: partly.share, effects: partly.effects(bench) })
            };
            tested(&library, [&baseline, &last], &named);
        });
    }

    struct Named {
        share: Share,
        effects: [Vec<String>; 2],
    }

    #[test]
    fn an_effect_is_proven_where_the_model_needs_it_and_it_closes_most_of_the_gap() {
        in_a_world_with_a_delay(|library, [baseline, last], proven| {
            let [effect, other] = ["command_delay", "payload"].map(|name| library.find(name).expect("a candidate"));
            let found = |(rival, nats): (usize, f64), last: &Hypothesis| {
                let trials = vec![trial(library, effect, (last, 300.0)), trial(library, rival, (last, nats))];
                let steps = vec![step(baseline, trials), step(last, Vec::new())];
                Found { steps, last: last.clone() }
            };
            for nats in [20.0, 290.0] {
                let partly = proven(&found((other, nats), last)).expect("it is");
                let [named, rivals] = partly.effects;
                assert!(partly.share.ci90[0] > 0.9, "{:?}", partly.share);
                assert!(
                    named == ["command_delay"] && rivals.is_empty(),
                    "in its place the other does no good: {rivals:?}"
                );
            }
            let useless = Hypothesis { effects: vec![effect], ..baseline.clone() };
            assert!(proven(&found((other, 20.0), &useless)).is_none(), "nothing of the gap closes");
        });
    }

    #[test]
    fn a_share_of_less_than_half_is_real_where_it_is_most_of_what_was_found() {
        let share = |value: f64, least: f64| Share { value, ci90: [least, 1.0] };
        let (less, all) = (share(0.48, 0.4), share(0.8, 0.7));
        assert!(!is_real(&less, || Some(less)) && !is_real(&less, || None));
        assert!(is_real(&less, || Some(all)) && is_real(&all, || None));
        assert!(!is_real(&share(0.3, 0.2), || Some(all)), "others close more");
    }
}
