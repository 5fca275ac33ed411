//! A fit number by number, for every identification alike: values with their intervals, which numbers hang together, and what one
//! more recording would bring.

use crate::answer::identification::{Advice, Identification, NotIdentifiable, Parameter};
use crate::words::number_in_words;
use inference::estimate::{Fit, Intervals, Unknown};
use inference::likelihood::Setting;
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// A gain, friction or a mass is not identifiable where its 95 % interval, to either side, is wider than this share of it (a choice).
pub(super) const OPEN_FROM_SHARE_OF_VALUE: f64 = 0.25;
/// Correlation of two estimates from which on they are said to move together (a choice).
const MOVE_TOGETHER: f64 = 0.9;
/// Recordings that are proposed (a choice).
const PROPOSALS: usize = 3;

/// A fit with all that it says.
pub(super) struct Finding<'a> {
    pub(super) settings: &'a [Setting],
    pub(super) unknowns: &'a [Unknown],
    pub(super) fit: Fit,
    /// Numbers that were not free at the end.
    pub(super) held: Vec<bool>,
    pub(super) intervals: Intervals,
    /// Clips simulated.
    pub(super) simulated: usize,
    /// Clips simulated so far, and the loss then.
    pub(super) convergence: Vec<[f64; 2]>,
    /// Whether the search came to its end.
    pub(super) arrived: bool,
}

impl Finding<'_> {
    /// The part of an answer that the fit alone says; `before`: the numbers that were known.
    pub(super) fn answer(&self, target: &str, before: &[f64]) -> Identification {
        let at_bound =
            |(unknown, held): (&Unknown, &bool)| (*held && unknown.upper > unknown.lower).then(|| unknown.name.clone());
        Identification {
            target: target.into(),
            parameters: self.parameters(before),
            evaluations: self.simulated,
            converged: self.arrived,
            at_bounds: self.unknowns.iter().zip(&self.held).filter_map(at_bound).collect(),
            names: self.unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
            correlation: rows(&self.intervals.correlation),
            convergence: self.convergence.clone(),
            witnesses: self.intervals.witnesses,
            misfit: self.fit.misfit().sqrt(),
            ..Identification::default()
        }
    }

    /// Numbers of one parameter together, in its own unit.
    fn parameters(&self, before: &[f64]) -> BTreeMap<String, Parameter> {
        let mut parameters = BTreeMap::<String, Parameter>::new();
        for (k, setting) in self.settings.iter().enumerate() {
            let (value, half) = (self.fit.shared[k], self.intervals.half_width[k]);
            let ends = [value - half, value + half].map(|end| setting.physical(end));
            let ends = if half.is_finite() { ends } else { [f64::NEG_INFINITY, f64::INFINITY] };
            let parameter = parameters.entry(setting.parameter()).or_default();
            parameter.unit = setting.physical_unit();
            parameter.single = matches!(setting, Setting::Friction | Setting::Mass | Setting::TipFriction);
            parameter.value.push(setting.physical(value));
            parameter.start.push(setting.physical(before[k]));
            parameter.ci95.push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
        }
        parameters
    }

    /// The bound of its search that a number is nearer to, in words.
    pub(super) fn nearer_bound(&self, k: usize) -> &'static str {
        let (unknown, value) = (&self.unknowns[k], self.fit.shared[k]);
        if value - unknown.lower < unknown.upper - value { "lower" } else { "upper" }
    }

    /// Numbers that are not identifiable: those of which `why` gives a reason.
    pub(super) fn not_identifiable(&self, why: impl Fn(usize) -> Option<String>) -> Vec<NotIdentifiable> {
        let names = self.unknowns.iter().map(|unknown| unknown.name.clone()).enumerate();
        names.filter_map(|(k, parameter)| Some(NotIdentifiable { parameter, why: why(k)? })).collect()
    }

    /// With what a number moves together closely, as a part of a sentence; nothing where there is no such number.
    pub(super) fn together(&self, k: usize, then: &str) -> String {
        let said = |(name, r)| format!(" it moves together with {name} (correlation {r:.2}){then}");
        self.partner(k).map_or_else(String::new, said)
    }

    /// The number that one moves together with most closely, and their correlation; `None` where none does closely.
    pub(super) fn partner(&self, k: usize) -> Option<(String, f64)> {
        let row = self.intervals.correlation.row(k);
        let others = (0..row.len()).filter(|other| *other != k).map(|other| (other, row[other]));
        let (other, r) = others.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        (r.abs() > MOVE_TOGETHER).then(|| (number_in_words(&self.unknowns[other].name), r))
    }

    /// What to record next, best first: what most sharpens the number whose interval is widest by `width`. `more`: what may be
    /// recorded, and the information that it adds.
    pub(super) fn advice(
        &self,
        width: impl Fn(usize) -> f64,
        more: impl IntoIterator<Item = (String, DMatrix<f64>)>,
    ) -> Vec<Advice> {
        let half = &self.intervals.half_width;
        let known = (0..half.len()).filter(|k| half[*k].is_finite());
        let Some(worst) = known.max_by(|a, b| width(*a).total_cmp(&width(*b))) else { return Vec::new() };
        let advice = |(record, information): (String, DMatrix<f64>)| Advice {
            record,
            parameter: self.unknowns[worst].name.clone(),
            now: half[worst],
            predicted: self.intervals.with_more(&self.fit, &information)[worst],
        };
        let mut all: Vec<Advice> = more.into_iter().map(advice).collect();
        all.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        all.truncate(PROPOSALS);
        all
    }
}

/// Rows of a matrix, as an answer holds them.
pub(super) fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_finding::{Seen, found};
    use super::*;

    /// Two clips that see the sum of two numbers, and one of them a little better than the other.
    const SUM: [Seen; 2] = [Seen { of: [1.0, 1.0], sigma: 0.1 }, Seen { of: [1.0, 1.05], sigma: 0.1 }];
    const NUMBERS: [Setting; 2] = [Setting::Friction, Setting::Mass];

    #[test]
    fn a_finding_says_values_intervals_and_where_the_search_began() {
        found(&NUMBERS, &SUM, |finding| {
            let answer = finding.answer("object", &[0.4, 0.3]);
            let friction = &answer.parameters["friction"];
            assert!(friction.single && friction.start == [0.4] && answer.parameters["mass"].start == [0.3]);
            assert!((friction.ci95[0][0]..friction.ci95[0][1]).contains(&friction.value[0]));
            assert_eq!((answer.names.len(), answer.correlation.len(), answer.at_bounds.len()), (2, 2, 0));
            assert!((answer.correlation[0][1] - answer.correlation[1][0]).abs() < 1e-9);
        });
    }

    #[test]
    fn a_value_on_its_bound_is_named_and_its_interval_is_open() {
        // Both clips see values beyond the bound of 1.
        let beyond = [Seen { of: [0.1, 0.0], sigma: 0.01 }, Seen { of: [0.0, 1.0], sigma: 0.01 }];
        found(&NUMBERS, &beyond, |finding| {
            let answer = finding.answer("object", &[0.4; 2]);
            assert_eq!((answer.at_bounds.as_slice(), finding.nearer_bound(0)), (&["friction".to_owned()][..], "upper"));
            assert_eq!(answer.parameters["friction"].ci95[0], [f64::NEG_INFINITY, f64::INFINITY]);
            assert!(answer.parameters["mass"].ci95[0][1].is_finite());
        });
    }

    #[test]
    fn numbers_of_joints_stand_together_in_their_order() {
        let gains = [Setting::Stiffness(0), Setting::Stiffness(1)];
        let each = [Seen { of: [1.0, 0.0], sigma: 0.1 }, Seen { of: [0.0, 1.0], sigma: 0.1 }];
        found(&gains, &each, |finding| {
            let answer = finding.answer("arm", &[0.4; 2]);
            let stiffness = &answer.parameters["stiffness"];
            assert_eq!((answer.parameters.len(), stiffness.value.len(), stiffness.single), (1, 2, false));
            assert!(stiffness.value.iter().all(|value| (value - 0.5).abs() < 0.1), "{stiffness:?}");
            assert_eq!((stiffness.unit.as_str(), &answer.names[1][..]), ("N m/rad", "stiffness[1]"));
            assert_eq!(finding.partner(0), None, "each is seen by itself");
        });
    }

    #[test]
    fn numbers_that_move_together_are_named_and_more_information_narrows_the_widest_interval() {
        found(&NUMBERS, &SUM, |finding| {
            let (name, r) = finding.partner(0).expect("two sums that are nearly one");
            assert!(name == "mass" && r < -MOVE_TOGETHER, "{name} {r}");
            let more = |times: f64| (format!("{times}"), finding.fit.information() * times);
            let advice = finding.advice(|k| k as f64, [more(1.0), more(4.0), more(2.0), more(3.0)]);
            let order: Vec<&str> = advice.iter().map(|advice| advice.record.as_str()).collect();
            assert_eq!(order, ["4", "3", "2"]);
            let narrower = |advice: &Advice| advice.predicted < advice.now && advice.parameter == "mass";
            assert!(advice.iter().all(narrower), "{advice:?}");
        });
    }
}
