//! How small a change these clips would have shown: that nothing changed can be said only where a change would have been seen.

use super::answer::Smallest;
use super::changes;
use super::scores::Score;
use super::search::smallest_seen;
use super::subjects::Subject;
use super::turned::MAX_GAIN_FACTOR;
use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::library::Library;
use inference::likelihood::Setting;
use std::collections::BTreeMap;

/// What may have changed, with what the slopes around A's own model say of it.
pub(super) struct Power<'a> {
    pub(super) library: &'a Library,
    /// All numbers of A.
    pub(super) of_a: &'a [f64],
    pub(super) subjects: &'a [Subject],
    pub(super) scores: &'a [Score],
}

impl Power<'_> {
    fn score(&self, subject: usize) -> Option<&Score> {
        self.scores.iter().find(|score| score.subject == subject)
    }

    /// Whether a change of a plausible size would have been seen in any of a subject's numbers.
    pub(super) fn shows(&self, subject: usize) -> bool {
        let Some(score) = self.score(subject) else { return false };
        score.sigma.iter().any(|(number, sigma)| smallest_seen(*sigma, score.cost) < self.plausible_change(*number))
    }

    /// The largest change of a number that is no surprise: of what every cell has as much as there is of it, of an effect from rest to
    /// the strongest that is met.
    fn plausible_change(&self, number: usize) -> f64 {
        let unknown = &self.library.unknowns[number];
        match self.library.settings.settings()[number] {
            Setting::Stiffness(_) | Setting::Damping(_) | Setting::Friction | Setting::Mass => self.of_a[number].abs(),
            Setting::Effect { inverse: true, .. } => unknown.upper - unknown.lower,
            _ => match self.library.plausible(number) {
                Some([low, high]) => (high - unknown.start).max(unknown.start - low),
                None => unknown.upper - unknown.lower,
            },
        }
    }

    /// The smallest change of every size that would have been seen, by parameter.
    pub(super) fn smallest(&self, subject: usize) -> BTreeMap<String, Smallest> {
        let mut all: BTreeMap<String, Smallest> = BTreeMap::new();
        let score = self.score(subject);
        for (number, sigma) in score.iter().flat_map(|score| &score.sigma) {
            let setting = &self.library.settings.settings()[*number];
            // Of a stiffness that is turned as its inverse no change has a size of its own.
            if matches!(setting, Setting::Effect { inverse: true, .. }) {
                continue;
            }
            let unit = setting.physical_unit();
            let parameter =
                all.entry(changes::name(&setting.parameter())).or_insert_with(|| Smallest { values: Vec::new(), unit });
            let unknown = &self.library.unknowns[*number];
            let size = smallest_seen(*sigma, score.map_or(1, |score| score.cost));
            // What has no slope in these clips would be seen at no size.
            parameter.values.push((size < MAX_GAIN_FACTOR * (unknown.upper - unknown.lower)).then_some(size));
        }
        all
    }

    /// Share of the subjects of which a change would have been seen.
    pub(super) fn share(&self) -> f64 {
        let shown = (0..self.subjects.len()).filter(|subject| self.shows(*subject)).count();
        shown as f64 / self.subjects.len().max(1) as f64
    }

    /// Whether so much would have been seen that it says something that nothing was: most of what may change, and at least one of the
    /// parameters that every cell has.
    pub(super) fn is_enough(&self) -> bool {
        let mut parameters = (0..self.subjects.len()).filter(|k| self.subjects[*k].effect.is_none()).peekable();
        let blind = parameters.peek().is_some() && !parameters.any(|subject| self.shows(subject));
        !blind && self.share() > MOST_OF_IT
    }
}

#[cfg(test)]
mod tests {
    use super::super::subjects;
    use super::*;
    use crate::diagnose::test_bench::shipped;
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;

    #[test]
    fn what_was_seen_of_nothing_is_not_enough_and_has_no_size() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let (subjects, of_a) = (subjects::all(&library), library.start());
        let asked = |share: f64, blind: Option<&str>| {
            let score = |(subject, of): (usize, &Subject)| {
                let share = if blind.is_none_or(|name| of.name == name) { share } else { 1e-6 };
                let of_number = |k: &usize| (*k, share * (library.unknowns[*k].upper - library.unknowns[*k].lower));
                let (sigma, cost) = (of.sizes.iter().map(of_number).collect(), of.sizes.len());
                Score { subject, gain: 0.0, gain_shared: 0.0, cost, p: 1.0, starts: Default::default(), sigma }
            };
            let scores: Vec<Score> = subjects.iter().enumerate().map(score).collect();
            let power = Power { library: &library, of_a: &of_a, subjects: &subjects, scores: &scores };
            let stiffness = subjects.iter().position(|subject| subject.name == "stiffness").expect("a subject");
            (power.is_enough(), power.shows(stiffness), power.smallest(stiffness)["stiffness"].values[0])
        };
        let (enough, seen, size) = asked(1e-6, None);
        assert!(enough && seen && size.is_some_and(|size| size > 0.0), "{size:?}");
        let (enough, seen, size) = asked(1e200, None);
        assert!(!enough && !seen && size.is_none(), "{size:?}");
        // 535 N m/rad of a joint that has 300 is a size, and would not be seen either.
        let (enough, seen, size) = asked(0.5, None);
        assert!(!enough && !seen && size.is_some_and(|size| size > of_a[0]), "{size:?}");
        let (enough, seen, _) = asked(1e200, Some("stiffness"));
        assert!(enough && !seen, "what else may change would have been seen");
    }
}
