//! When an extension of a model is taken on, and which are fitted at all. Nats are differences of log-likelihood of clips that were not
//! fitted.
//!
//! These thresholds are choices; `calibration benchmark` counts how often verdicts that come of them are right.

use super::gain::{Gain, SAME_WORTH_NATS};
use crate::diagnose::fit::shortlist::BY_CHANCE;

/// Thresholds of one forward selection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// At most so many extensions are taken on.
    pub max_extensions: usize,
    /// So many of those that promise most are fitted at each step.
    pub max_fitted: usize,
    /// An extension is fitted whose gain by slopes noise reaches with no higher probability ...
    pub max_chance: f64,
    /// ... and comes to this share of what the best promises.
    pub min_promise: f64,
    /// What is taken on is worth more than this [nats], and more than one for each of its numbers (AIC). Up to so many a clip counts
    /// whatever the others gain ([`Gain::of`]).
    pub min_gain_nats: f64,
    /// From so many clips on it is enough that nearly all gain: seven of eight do so once in thirty by chance.
    pub min_agreeing_clips: Option<usize>,
    /// More than this share of the clips gains.
    pub min_share: f64,
    /// Whether the scatter between few clips counts as known from few (Student's t).
    pub by_student: bool,
}

/// Of effects in one session.
pub const EFFECTS: Criteria = Criteria {
    max_extensions: 4,
    max_fitted: 5,
    max_chance: BY_CHANCE,
    min_promise: 0.1,
    min_gain_nats: SAME_WORTH_NATS,
    min_agreeing_clips: None,
    min_share: 0.5,
    by_student: false,
};

/// Of changes from one session to another: what the model has may have changed as well as what it lacks, so that more is tried, and so
/// chance has more chances. A change shows in the clips of one session, so that half of all need not gain, and of one session there are
/// few clips: their scatter is known from few.
pub const CHANGES: Criteria =
    Criteria { min_gain_nats: 5.0, min_agreeing_clips: Some(8), min_share: 0.0, by_student: true, ..EFFECTS };

impl Criteria {
    /// Whether an extension is fitted whose gain by its slopes noise reaches with this chance, beside the best.
    pub fn promises(&self, chance: f64, gain: f64, best: f64) -> bool {
        chance < self.max_chance && gain > self.min_promise * best
    }

    /// What an extension with so many numbers has to be worth [nats].
    pub fn price(&self, cost: usize) -> f64 {
        self.min_gain_nats.max(cost as f64)
    }

    /// Whether it is no chance that an extension with so many numbers gains this.
    pub fn proves(&self, gain: &Gain, cost: usize) -> bool {
        let agree = self.min_agreeing_clips.is_some_and(|least| gain.clips() >= least && gain.in_nearly_all());
        let by_chance = if self.by_student { gain.by_chance() } else { gain.twice_its_error() };
        let no_chance = agree || gain.nats > by_chance || gain.is_no_chance_by_ranks();
        gain.nats > self.price(cost) && gain.share > self.min_share && no_chance
    }
}
