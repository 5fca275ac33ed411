//! Candidates tried on top of a hypothesis, and what makes one of them a cause.

use super::closing::{Closed, MIN_SHARE_CLOSED, closes};
use super::gap::{Residuals, Typical};
use super::score::{Predicted, predict};
use crate::diagnose::criteria::{MOST_OF_IT, OBJECT_EXCESS};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::floor;
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::library::Library;
use crate::diagnose::select::criteria::EFFECTS;
use crate::diagnose::select::gain::Gain;
use inference::admit::Split;
use twin::effects::Stage;

/// An effect on the arm must be worth more than this for each of its residuals [nats]: there are so many that the least numerics add up.
pub(in crate::diagnose) const MIN_NATS_PER_ROW: f64 = 0.0025;
/// Of one that closes so much of the gap, and predicts nearly all clips better, one that it predicts worse does not matter.
pub(in crate::diagnose) const LARGE_SHARE_CLOSED: f64 = 0.2;
/// A gain of so many of its standard errors is no chance.
pub(super) const NO_CHANCE_SIGMAS: f64 = 3.5;
/// More parameters make a gain larger by this share whatever acts: friction at rest is every engine's own.
const NUMERICS_OF_GAIN: f64 = 1e-3;
/// Where nuisance parameters of clips hide what a candidate closes from the likelihood, one that has more parameters than another must
/// close this much more of the gap.
const CLOSED_BY_MORE_PARAMETERS: f64 = 0.04;
/// The same where it leaves less than half of what the other leaves: near the whole gap, shares say little.
const CLOSED_OF_LITTLE_LEFT: f64 = 0.01;

/// A candidate tried on top of a hypothesis.
#[derive(Debug, Clone)]
pub struct Trial {
    /// What the score test said.
    pub scored: Scored,
    /// Fitted, where that was worth it.
    pub fitted: Option<(Hypothesis, Gain)>,
    /// How much of the gap closes with it.
    pub closed: Closed,
    /// Whether clips have nuisance parameters.
    pub own_numbers: bool,
    /// What shows it apart from the gap that contact leaves.
    pub beside_contact: BesideContact,
}

/// What shows a candidate in strokes apart from the gap. Engines, and an engine and a cell, differ in contact by more than a camera that
/// is off by a millimetre does: of such a cause little of the gap closes, and what shows it does not come from contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BesideContact {
    /// Whether it acts on what a camera sees alone.
    pub of_camera: bool,
    /// Whether a single stage shows it ([`inference::witness`]), and as strong as it was fitted.
    pub in_a_stage: bool,
}

impl Trial {
    /// One that has not been fitted.
    pub fn untried(scored: Scored, own_numbers: bool) -> Self {
        let (closed, beside_contact) = (Closed::default(), BesideContact::default());
        Self { scored, fitted: None, closed, own_numbers, beside_contact }
    }

    /// Whether enough of the gap closes with it for a cause, however much better the clips are predicted, or it shows beside that.
    pub fn is_cause(&self) -> bool {
        self.closed.most > MIN_SHARE_CLOSED || self.shows_beside_contact()
    }

    /// Whether it shows apart from the gap that contact leaves: a single stage shows it, or it is of the camera and nearly all clips
    /// speak for it, beyond any chance.
    pub fn shows_beside_contact(&self) -> bool {
        let Some(gain) = self.gain() else { return false };
        let beyond_chance = gain.in_nearly_all() && gain.nats > NO_CHANCE_SIGMAS * gain.error;
        let in_a_stage = self.beside_contact.in_a_stage && gain.nats > 0.0;
        in_a_stage || self.beside_contact.of_camera && beyond_chance
    }

    /// What it is worth, where it was fitted.
    pub fn gain(&self) -> Option<&Gain> {
        self.fitted.as_ref().map(|(_, gain)| gain)
    }

    /// The same [nats]; 0 where it was not.
    pub(in crate::diagnose) fn nats(&self) -> f64 {
        self.gain().map_or(0.0, |gain| gain.nats)
    }

    /// Whether another does the same with fewer numbers: what is better about this one is no more than engines differ by.
    pub fn is_outdone_by(&self, other: &Self) -> bool {
        let (Some(mine), Some(its)) = (self.gain(), other.gain()) else { return false };
        let alike = mine.nats - its.nats < EFFECTS.min_gain_nats.max(NUMERICS_OF_GAIN * its.nats);
        other.scored.cost < self.scored.cost && alike && !self.closes_more_than(other)
    }

    /// Whether it closes so much more of the gap that its additional numbers are worth it although clips are predicted as well
    /// without them.
    pub fn closes_more_than(&self, other: &Self) -> bool {
        let more = self.closed.most - other.closed.most;
        let halves = 1.0 - self.closed.most < MOST_OF_IT * (1.0 - other.closed.most);
        self.own_numbers && (more > CLOSED_BY_MORE_PARAMETERS || halves && more > CLOSED_OF_LITTLE_LEFT)
    }
}

/// One step of the search.
#[derive(Debug, Clone)]
pub struct Step {
    /// What was extended.
    pub from: Hypothesis,
    /// How it predicts.
    pub predicted: Predicted,
    /// All candidates, best first by the score test.
    pub trials: Vec<Trial>,
    /// Weights of the channels in this step.
    pub weights: Vec<f64>,
    /// How many residuals of the arm the judged clips have.
    pub arm_rows: usize,
    /// What the hypothesis that is extended leaves on the clips of the search.
    pub left: Vec<Typical>,
    /// What the baseline leaves on them.
    pub whole: Vec<Typical>,
}

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Every step; the first extends the baseline.
    pub steps: Vec<Step>,
    /// The hypothesis at the end.
    pub last: Hypothesis,
}

impl Found {
    /// For every step, how many times what the search left of an arm's clips exceeds what was taken for noise in it, at least
    /// 1: so many times less do differences between candidates say. Weights come from slopes, with all candidates at once; a
    /// real arm deviates far more under all that is named. Clips with nuisance parameters take that up.
    pub fn overdispersion(&self, bench: &Bench<'_>) -> Vec<f64> {
        let left = (bench.scatter.count() == 0).then(|| Residuals::at(bench, &self.last, &self.last.clips())).flatten();
        let Some(left) = left else { return vec![1.0; self.steps.len()] };
        let weights = floor::weights(bench.evidence, &left.clips);
        self.steps.iter().map(|step| floor::overdispersion(&step.weights, &weights)).collect()
    }

    /// The effects that were kept, each with the step in which it was added.
    pub fn kept(&self) -> impl Iterator<Item = (usize, usize)> {
        self.steps.windows(2).enumerate().filter_map(|(place, pair)| {
            let added = pair[1].from.effects.iter().find(|effect| !pair[0].from.effects.contains(effect))?;
            self.last.effects.contains(added).then_some((place, *added))
        })
    }
}

impl Found {
    /// Whether each of the effects that were kept shows apart from the gap that contact leaves.
    pub fn shows_beside_contact(&self) -> bool {
        let shows =
            |(place, effect): (usize, usize)| self.steps[place].trial(effect).is_some_and(Trial::shows_beside_contact);
        !self.last.effects.is_empty() && self.kept().all(shows)
    }

    /// Whether the gain of each of the effects that were kept is no chance by far.
    pub fn is_beyond_chance(&self) -> bool {
        let gain = |(place, effect): (usize, usize)| self.steps[place].trial(effect).and_then(Trial::gain);
        self.kept().all(|kept| gain(kept).is_some_and(|gain| gain.nats > NO_CHANCE_SIGMAS * gain.error))
    }
}

impl Step {
    /// The trial that is worth most among those worth it. Of those that are worth the same as far as clips tell, what has a mass, a
    /// length or a friction behind it explains before what needs none.
    pub fn best(&self, bench: &Bench<'_>) -> Option<(&Trial, &Hypothesis, &Gain)> {
        let fitted = self.trials.iter().filter_map(|trial| trial.fitted.as_ref().map(|(fit, gain)| (trial, fit, gain)));
        let mut convincing_ones: Vec<(&Trial, &Hypothesis, &Gain)> =
            fitted.filter(|(trial, fit, gain)| self.convinces(bench, trial, fit, gain)).collect();
        // What a stage shows by itself acts, whatever else may: it comes first.
        if convincing_ones.iter().any(|(trial, ..)| trial.beside_contact.in_a_stage) {
            convincing_ones.retain(|(trial, ..)| trial.beside_contact.in_a_stage);
        }
        let simplest =
            |(trial, ..): &&(&Trial, _, _)| !convincing_ones.iter().any(|(other, ..)| trial.is_outdone_by(other));
        let worth = |trial: &Trial| trial.gain().map_or(0.0, |gain| gain.net(trial.scored.cost));
        let most =
            |a: &&(&Trial, &Hypothesis, &Gain), b: &&(&Trial, &Hypothesis, &Gain)| worth(a.0).total_cmp(&worth(b.0));
        let best = convincing_ones.iter().filter(simplest).max_by(most)?;
        let of_bodies = |trial: &Trial| bench.library.candidates[trial.scored.candidate].effect.is_of_bodies();
        if of_bodies(best.0) {
            return Some(*best);
        }
        let as_good = |(trial, _, gain): &&(&Trial, &Hypothesis, &Gain)| {
            of_bodies(trial) && best.2.beyond(gain).may_be_none(1.0) && self.comes_as_near(trial, best.0)
        };
        convincing_ones.iter().filter(as_good).max_by(most).or(Some(best)).copied()
    }

    /// Whether it is no chance that a trial gains this, and what it gains no numerics.
    fn convinces(&self, bench: &Bench<'_>, trial: &Trial, fit: &Hypothesis, gain: &Gain) -> bool {
        let (library, candidate) = (bench.library, trial.scored.candidate);
        // How joints yield in contact, any two engines differ by: for what changes the hit it shows nothing.
        let of_hit = library.candidates[candidate].effect.stage == Stage::Hit;
        let closes = if of_hit { trial.closed.of_gap } else { trial.closed.most };
        let (of_arm, much) = (library.is_of_arm(candidate), closes > LARGE_SHARE_CLOSED);
        // Strokes of two engines differ by so much anyway that a little gain on most of them shows nothing ...
        let shown = of_arm || self.object_gap() || (much && self.is_alone(library, candidate));
        // ... and beside a cause that was found before, a gain on nearly all of them neither, unless it is far beyond chance.
        let may_show = shown || self.from.effects.is_empty() || gain.nats > NO_CHANCE_SIGMAS * gain.error;
        let plain = much && gain.in_nearly_all() && gain.nats > EFFECTS.min_gain_nats && may_show;
        let proven = EFFECTS.proves(gain, trial.scored.cost) && shown;
        let beside_contact = trial.shows_beside_contact() && gain.nats > EFFECTS.price(trial.scored.cost);
        (proven || plain || beside_contact)
            && (!of_arm || gain.nats > MIN_NATS_PER_ROW * self.arm_rows as f64)
            && trial.is_cause()
            && !bench.negligible(candidate, &fit.full)
            && !bench.is_convention(candidate, fit)
    }

    /// The same with fits of trials, at their places, judged by what they predict and close.
    pub(in crate::diagnose) fn with_fits(
        mut self,
        bench: &Bench<'_>,
        split: &Split,
        fits: impl IntoIterator<Item = (usize, Hypothesis)>,
    ) -> Self {
        for (place, fit) in fits {
            if let Some(predicted) = predict(bench, &fit, &split.choose, &self.weights) {
                let closed = closes(bench, split, &self.whole, [&self.from, &fit]);
                let gain = predicted.over(&self.predicted);
                let name = bench.library.name(fit.effects.last().copied().unwrap_or_default());
                let ranks = gain.rank_sigmas();
                tracing::debug!(
                    "{name}: {:.0} +- {:.0} nats, {:.0} % of clips, ranks {ranks:.1} sigma, closes {:.2}",
                    gain.nats,
                    gain.error,
                    100.0 * gain.share,
                    closed.most
                );
                let trial = &mut self.trials[place];
                trial.closed = closed;
                trial.fitted = Some((fit, gain));
            }
        }
        self
    }

    /// Whether the object's gap is larger than in strokes of another engine with nothing wrong.
    fn object_gap(&self) -> bool {
        self.left.iter().any(|group| group.of_object && group.mean_square - group.floor > OBJECT_EXCESS.value)
    }

    /// Candidates with which clips are predicted worse, by more than the standard error of that.
    pub(in crate::diagnose) fn worse_by_more_than_chance(&self) -> Vec<usize> {
        let worse = |trial: &&Trial| trial.gain().is_some_and(|gain| gain.nats < -gain.error);
        self.trials.iter().filter(worse).map(|trial| trial.scored.candidate).collect()
    }

    /// The trial of a candidate.
    pub fn trial(&self, candidate: usize) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.scored.candidate == candidate)
    }

    /// Whether a trial stands out: nearly all clips speak for it, far beyond chance, and for no other effect half as much.
    pub fn is_clear(&self, library: &Library, candidate: usize) -> bool {
        let clear = |gain: &Gain| gain.in_nearly_all() && gain.nats > NO_CHANCE_SIGMAS * gain.error;
        self.trial(candidate).and_then(Trial::gain).is_some_and(clear) && self.is_alone(library, candidate)
    }

    /// The other effects that could be the cause and are not known to look like a candidate.
    fn causes_unlike(&self, library: &Library, candidate: usize) -> impl Iterator<Item = &Trial> {
        let unlike = move |other: usize| other != candidate && !library.look_alike(candidate, other);
        self.trials.iter().filter(move |trial| trial.is_cause() && unlike(trial.scored.candidate))
    }

    /// Whether a trial's fit goes as much of the way from what clips cost without it to what they cost with another, on a
    /// logarithmic scale: an effect after which next to nothing is left of an arm's gap has no equal in one that leaves most of
    /// it, however unequal clips are. Where clips have nuisance parameters, these hide it, and it is not asked.
    pub(in crate::diagnose) fn comes_as_near(&self, trial: &Trial, other: &Trial) -> bool {
        let without = self.from.deviance();
        let way = |trial: &Trial| trial.fitted.as_ref().map_or(0.0, |(fit, _)| (without / fit.deviance()).ln());
        trial.own_numbers || way(trial) > MOST_OF_IT * way(other)
    }

    /// Whether no other effect that could be the cause is worth half as much, but for those that are known to look alike:
    /// that some of them act stands out even where it does not show which.
    fn is_alone(&self, library: &Library, candidate: usize) -> bool {
        let worth = |trial: &Trial| trial.gain().map(|gain| gain.net(trial.scored.cost));
        let next = self.causes_unlike(library, candidate).filter_map(worth).fold(0.0, f64::max);
        self.trial(candidate).and_then(worth).is_some_and(|own| next < MOST_OF_IT * own)
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_trial::{step, trial};
    use super::*;
    use crate::diagnose::test_bench::{ONCE, nothing_said_of, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    #[test]
    fn a_camera_that_is_off_by_little_is_a_cause_where_nearly_all_clips_speak_for_it_or_a_stage_shows_it() {
        let cell = shipped();
        let library = Library::new(&cell, &setting::complete(&cell, None).expect("a cell"), None, &[87.0; MAX_JOINTS]);
        let fit = Hypothesis { effects: vec![0], full: Vec::new(), free: Vec::new(), fitted: Vec::new() };
        let cause = |nats: &dyn Fn(usize) -> f64, beside_contact| {
            let predicted = |nats: &dyn Fn(usize) -> f64| Predicted {
                clips: (0..12).map(|clip| (clip, 1000.0 - 2.0 * nats(clip))).collect(),
            };
            let gain = predicted(nats).over(&predicted(&|_| 0.0));
            let little = Trial { closed: Closed::all(0.05), beside_contact, ..trial(&library, 0, (&fit, 0.0)) };
            Trial { fitted: Some((fit.clone(), gain)), ..little }.is_cause()
        };
        let (in_all, in_most) = (|clip| 20.0 + (clip % 4) as f64, |clip| if clip % 4 == 0 { -9.0 } else { 20.0 });
        let of_camera = BesideContact { of_camera: true, in_a_stage: false };
        assert!(cause(&in_all, of_camera) && !cause(&in_most, of_camera));
        assert!(!cause(&in_all, BesideContact::default()), "engines differ so in contact");
        let in_a_stage = BesideContact { of_camera: false, in_a_stage: true };
        assert!(cause(&in_most, in_a_stage) && !cause(&|_| -1.0, in_a_stage));
    }

    #[test]
    fn more_numbers_are_worth_it_that_leave_less_than_half() {
        let cell = shipped();
        let library = Library::new(&cell, &setting::complete(&cell, None).expect("a cell"), None, &[87.0; MAX_JOINTS]);
        let untried = Trial::untried(nothing_said_of(&library, 0), true);
        let closing = |share| Trial { closed: Closed::all(share), ..untried.clone() };
        let more = |[one, other]: [f64; 2]| closing(one).closes_more_than(&closing(other));
        assert_eq!([[0.40, 0.35], [0.98, 0.95], [0.97, 0.95], [0.999, 0.995]].map(more), [true, true, false, false]);
    }

    #[test]
    fn a_load_explains_before_the_zeros_of_torque_sensors_that_do_no_better() {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("payload", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let [load, zeros] = ["payload", "torque_sensor_bias"].map(|name| library.find(name).expect("a candidate"));
        on_bench((&cell, &world), &library, |bench, even| {
            let mut full = truth(&library, &world);
            library.candidates[zeros].sizes.iter().for_each(|k| full[*k] = 1.0);
            let fit = bench.fit(&[load], full, &[0, 1], even, None, ONCE).expect("a fit");
            let named = |of_zeros: f64| {
                let trials = [(load, 300.0), (zeros, of_zeros)];
                let step = step(&fit, trials.map(|(k, nats)| trial(&library, k, (&fit, nats))).to_vec());
                step.best(bench).map(|(trial, ..)| trial.scored.candidate)
            };
            assert_eq!(named(299.0), Some(load));
            // Seven numbers against one: worth the same.
            assert_eq!(named(304.0), Some(load));
            assert_eq!(named(400.0), Some(zeros), "what predicts better is not held back");
        });
    }
}
