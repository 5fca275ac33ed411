//! Whether a final model needs each of its effects, and what could stand in the place of one. Both are asked of the model with all the
//! others in it: alone, of two effects that act together each closes most of the gap and is a rival of the other.

use super::closing::closes;
use super::score::{Predicted, predict};
use super::trial::{Found, NO_CHANCE_SIGMAS, Step, Trial};
use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{Effort, REFINEMENT};
use crate::diagnose::select::criteria::EFFECTS;
use crate::diagnose::select::gain::Gain;
use inference::admit::Split;

/// A model is worth this share more of what an effect is worth in it than the same with another in that place (a choice): two of nearly
/// the same worth do the same.
const LEAD_SHARE: f64 = 0.2;

/// What a search ended with, and how it predicts clips that it was not fitted to.
pub(in crate::diagnose) struct FinalModel<'a> {
    bench: &'a Bench<'a>,
    split: &'a Split,
    last: &'a Hypothesis,
    /// Weights of the channels under which it was fitted.
    weights: &'a [f64],
    predicted: Predicted,
}

/// Another model at its best, and what the final one is worth over it.
struct Other {
    fit: Hypothesis,
    gain: Gain,
}

impl<'a> FinalModel<'a> {
    /// `None` where the twin has no answer.
    pub(in crate::diagnose) fn new(
        bench: &'a Bench<'a>,
        split: &'a Split,
        last: &'a Hypothesis,
        weights: &'a [f64],
    ) -> Option<Self> {
        Some(Self { bench, split, last, weights, predicted: predict(bench, last, &split.choose, weights)? })
    }

    fn refitted(&self, effects: &[usize], full: Vec<f64>, effort: Effort) -> Option<Other> {
        let fit = self.bench.fit(effects, full, &self.split.train, self.weights, Some(self.last), effort)?;
        let predicted = predict(self.bench, &fit, &self.split.choose, self.weights)?;
        Some(Other { gain: self.predicted.over(&predicted), fit })
    }

    /// All numbers with an effect taken back.
    fn taken_back(&self, effect: usize) -> Vec<f64> {
        let library = self.bench.library;
        library.with_effects_of(self.last.full.clone(), &[effect], &library.start())
    }

    /// The same without one of its effects.
    fn without(&self, effect: usize) -> Option<Other> {
        let others: Vec<usize> = self.last.effects.iter().copied().filter(|other| *other != effect).collect();
        self.refitted(&others, self.taken_back(effect), REFINEMENT)
    }

    /// The same with another effect in the place of one; that begins where its own trial ended.
    fn instead(&self, effect: usize, rival: usize, its: &Hypothesis, effort: Effort) -> Option<Other> {
        let in_place = |other: &usize| if *other == effect { rival } else { *other };
        let effects: Vec<usize> = self.last.effects.iter().map(in_place).collect();
        let full = self.bench.library.with_effects_of(self.taken_back(effect), &[rival], &its.full);
        self.refitted(&effects, full, effort)
    }

    /// What the model is worth over the same with another effect in the place of one.
    pub(in crate::diagnose) fn over_instead(
        &self,
        effect: usize,
        rival: usize,
        its: &Hypothesis,
        effort: Effort,
    ) -> Option<Gain> {
        Some(self.instead(effect, rival, its, effort)?.gain)
    }

    /// Effects that do as well as one of the model's in its place; `None` where the model does not plainly need each of its own.
    pub(in crate::diagnose) fn alike(&self, found: &Found) -> Option<Vec<usize>> {
        let added: Vec<(usize, usize)> = found.kept().collect();
        if added.len() != self.last.effects.len() {
            return None;
        }
        let mut all = Vec::new();
        for (place, effect) in added {
            let step = &found.steps[place];
            let without = self.without(effect)?;
            let trial = step.trial(effect)?;
            let closed = closes(self.bench, self.split, &step.whole, [&without.fit, self.last]).most;
            if !is_plain(&without.gain, closed, trial.scored.cost) {
                return None;
            }
            for (rival, its) in self.promising(step, trial) {
                if self.bench.interrupt.asked() {
                    return None;
                }
                let beaten = |other: &Other| {
                    is_beaten(&other.gain, &without.gain) || !self.comes_as_near(other, &without, trial.own_numbers)
                };
                // Where the twin has no answer with it, it is no rival.
                if self.instead(effect, rival, its, REFINEMENT).is_some_and(|other| !beaten(&other)) {
                    all.push(rival);
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        Some(all)
    }

    /// Causes beside the model's own that were worth at least half as much as one of these in its step. What does the same with more
    /// numbers is no other cause: dry friction that may fall with speed, and does not.
    fn promising<'b>(&self, step: &'b Step, trial: &'b Trial) -> impl Iterator<Item = (usize, &'b Hypothesis)> {
        let worth = |trial: &Trial| trial.gain().map_or(0.0, |gain| gain.net(trial.scored.cost));
        let own = worth(trial);
        let last = self.last.effects.clone();
        let others = step.trials.iter().filter(move |other| {
            let another = !last.contains(&other.scored.candidate) && !other.is_outdone_by(trial);
            another && other.is_cause() && worth(other) > MOST_OF_IT * own
        });
        others.filter_map(|other| Some((other.scored.candidate, &other.fitted.as_ref()?.0)))
    }

    /// Whether another model goes as much of the way from what clips cost without an effect to what they cost with it, on a logarithmic
    /// scale ([`Step::comes_as_near`]).
    fn comes_as_near(&self, other: &Other, without: &Other, own_numbers: bool) -> bool {
        let way = |fit: &Hypothesis| (without.fit.deviance() / fit.deviance()).ln();
        own_numbers || way(&other.fit) > MOST_OF_IT * way(self.last)
    }
}

/// Whether a model plainly needs an effect that costs so many numbers: nearly all clips are predicted worse without it, by far more than
/// by chance. Where all are and most of the gap opens, the scatter between gains says only how unequal clips are.
fn is_plain(needed: &Gain, closes: f64, cost: usize) -> bool {
    let in_all = needed.share == 1.0 && closes > MOST_OF_IT;
    let no_chance = in_all || needed.nats > NO_CHANCE_SIGMAS * needed.error;
    no_chance && needed.in_nearly_all() && needed.nats > EFFECTS.price(cost)
}

/// Whether a model with another effect in the place of one is worse beyond chance, and by a real share of what that effect is worth.
fn is_beaten(by: &Gain, needed: &Gain) -> bool {
    by.nats > NO_CHANCE_SIGMAS * by.error && by.nats > LEAD_SHARE * needed.nats
}

#[cfg(test)]
mod tests {
    use super::super::gap::Residuals;
    use super::super::test_trial::{step, trial};
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use shared_mem::theta::{EffectTheta, Theta};
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn an_effect_is_plain_that_nearly_all_clips_miss_and_another_beaten_by_more_than_chance() {
        let gain = |of: &[f64]| Gain::of(vec![of.to_vec()], EFFECTS.min_gain_nats);
        let needed = gain(&[90.0, 120.0, 100.0, 95.0]);
        assert!(is_plain(&needed, 0.1, 7) && !is_plain(&needed, 0.1, 1000), "its numbers cost as much");
        assert!(!is_plain(&gain(&[90.0, 120.0, 100.0, -95.0]), 0.9, 7));
        let unequal = gain(&[400.0, 10.0, 20.0, 15.0]);
        assert!(is_plain(&unequal, 0.9, 7) && !is_plain(&unequal, 0.1, 7), "{unequal:?}");
        assert!(is_beaten(&gain(&[40.0, 45.0, 38.0, 41.0]), &needed));
        assert!(!is_beaten(&gain(&[4.0, 5.0, 4.0, 5.0]), &needed), "of nearly the same worth");
        assert!(!is_beaten(&gain(&[200.0, -100.0, 150.0, -60.0]), &needed), "chance");
    }

    /// Two effects that act together, and a search that found both, the first with the second as good as it alone. What stands in for the
    /// first, by the model that has both; `third` was as good alone, too.
    fn alike(blocks: [&str; 2], third: &str) -> Option<Vec<usize>> {
        let cell = shipped();
        let well = World::draw(3, Kind::Excitation, Fault::Nothing, &cell);
        let blocks = blocks.map(|block| toml::from_str::<EffectTheta>(block).expect("a block"));
        let world = World { hidden: Theta { effects: blocks.to_vec(), ..well.hidden.clone() }, ..well };
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let [one, two] = blocks.each_ref().map(|block| library.find(&block.name).expect("a candidate"));
        let third = library.find(third).expect("a candidate");
        on_bench((&cell, &world), &library, |bench, even| {
            let (both, start) = (truth(&library, &world), library.start());
            let without = |effects: &[usize]| library.with_effects_of(both.clone(), effects, &start);
            let fit = |effects: &[usize], full| bench.fit(effects, full, &[0, 1], even, None, ONCE).expect("a fit");
            let (none, first) = (fit(&[], without(&[one, two])), fit(&[one], without(&[two])));
            let last = fit(&[one, two], both.clone());
            let beside_none = [(one, 300.0), (two, 290.0), (third, 280.0)];
            let beside_one = [(two, 60.0), (third, 50.0)];
            let trials = |of: &[(usize, f64)]| of.iter().map(|(k, nats)| trial(&library, *k, (&last, *nats))).collect();
            let mut steps =
                vec![step(&none, trials(&beside_none)), step(&first, trials(&beside_one)), step(&last, Vec::new())];
            let whole = Residuals::at(bench, &none, &[0, 1]).expect("an answer").typical();
            steps.iter_mut().for_each(|step| step.whole.clone_from(&whole));
            let (found, split) = (Found { steps, last: last.clone() }, Split::new(&[vec![0], vec![1]], 0));
            FinalModel::new(bench, &split, &last, even).expect("an answer").alike(&found)
        })
    }

    #[test]
    fn of_two_effects_that_act_together_neither_blocks_the_other() {
        let viscous = "name = \"joint_viscous_friction\"\nviscous = [4.0, 4.0, 4.0, 4.0, 1.5, 1.5, 1.0]";
        let coulomb = "name = \"joint_coulomb_friction\"\ncoulomb = [1.2, 1.2, 1.2, 1.2, 0.5, 0.5, 0.4]";
        assert_eq!(alike([viscous, coulomb], "payload"), Some(Vec::new()));
    }
}
