//! Which stage of a search is at work. What is found decides what is tried next, so that nobody knows how long it takes, and
//! nothing is promised.

use std::collections::VecDeque;

/// Work in stages, some of them still to come.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stages {
    current: &'static str,
    ahead: VecDeque<&'static str>,
    over: usize,
    /// Steps of the stage at work in all, and done.
    steps: u64,
    done: u64,
    shown: f64,
}

/// Where a search stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// The stage at work, counted from 1, and how many there are as far as is known.
    pub(super) stage: usize,
    pub(super) of: usize,
    /// Share of the stages that is over, never less than before.
    pub(super) share: f64,
}

impl Stages {
    /// In their order; the first has begun, with so many steps.
    pub(super) fn new(names: &[&'static str], steps: u64) -> Self {
        let mut ahead: VecDeque<&'static str> = names.iter().copied().collect();
        let current = ahead.pop_front().unwrap_or_default();
        Self { current, ahead, over: 0, steps, done: 0, shown: 0.0 }
    }

    /// The stage at work is over, and another one begins: the next of its name, those before it are left out. One that was not
    /// expected comes in between.
    pub(super) fn begin(&mut self, name: &'static str, steps: u64) {
        if let Some(place) = self.ahead.iter().position(|ahead| *ahead == name) {
            self.ahead.drain(..=place);
        }
        (self.current, self.over) = (name, self.over + 1);
        (self.steps, self.done) = (steps, 0);
    }

    /// Stages come next that were not expected.
    pub(super) fn insert(&mut self, names: &[&'static str]) {
        names.iter().rev().for_each(|name| self.ahead.push_front(name));
    }

    /// So many steps of the stage at work are done.
    pub(super) fn done(&mut self, done: u64) {
        self.done = done.min(self.steps);
    }

    pub(super) fn at(&mut self) -> Place {
        let of = self.over + 1 + self.ahead.len();
        let within = self.done as f64 / self.steps.max(1) as f64;
        self.shown = self.shown.max((self.over as f64 + within) / of as f64);
        Place { stage: self.over + 1, of, share: self.shown }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_counted_as_far_as_they_are_known() {
        let mut search = Stages::new(&["baseline", "fits", "refinement", "conclusion"], 2);
        search.done(1);
        assert_eq!(search.at(), Place { stage: 1, of: 4, share: 0.125 });
        search.begin("fits", 10);
        assert_eq!(search.at(), Place { stage: 2, of: 4, share: 0.25 });
        search.insert(&["fits", "fits"]);
        search.done(5);
        assert_eq!(search.at(), Place { stage: 2, of: 6, share: 0.25 });
        search.begin("fits", 1);
        search.begin("conclusion", 1);
        assert_eq!(search.at(), Place { stage: 4, of: 4, share: 0.75 }, "what is left out is not counted");
        search.begin("intervals", 1);
        assert_eq!(search.at().stage, 5);
    }
}
