//! What a fit tells about the arm, number by number: values, intervals, correlations.

use crate::answer::identification::{Identification, Parameter};
use crate::identify::run::Outcome;
use inference::estimate::interval::LEVEL;
use inference::estimate::{Intervals, Unknown, at_bounds};
use inference::likelihood::Settings;
use std::collections::BTreeMap;

/// Everything that a fit tells.
pub(super) struct Finding<'a> {
    pub(super) settings: &'a Settings,
    pub(super) unknowns: &'a [Unknown],
    /// Numbers that were not free at the end.
    pub(super) held: Vec<bool>,
    pub(super) outcome: &'a Outcome,
    pub(super) intervals: Intervals,
}

impl<'a> Finding<'a> {
    /// `open`: half widths of what the fit itself does not know to be open.
    pub(super) fn new(settings: &'a Settings, unknowns: &'a [Unknown], outcome: &'a Outcome, open: &[f64]) -> Self {
        let held = at_bounds(unknowns, &outcome.fit.shared);
        let mut intervals = Intervals::new(&outcome.fit, &held, LEVEL);
        intervals.half_width.iter_mut().zip(open).for_each(|(half, open)| *half = half.hypot(*open));
        Self { settings, unknowns, held, outcome, intervals }
    }

    /// The part of the answer that the fit alone tells; `before` are the numbers that were known.
    pub(super) fn answer(&self, before: &[f64]) -> Identification {
        let rests =
            |(unknown, held): (&Unknown, &bool)| (*held && unknown.upper > unknown.lower).then(|| unknown.name.clone());
        let correlation = &self.intervals.correlation;
        let unfinished = "the search ended before it arrived: values and intervals are those of the place where it \
                          stopped; give more budget, or search for what else acts";
        Identification {
            target: "arm".into(),
            parameters: self.parameters(before),
            evaluations: self.outcome.simulated,
            converged: self.outcome.arrived,
            at_bounds: self.unknowns.iter().zip(&self.held).filter_map(rests).collect(),
            names: self.unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
            correlation: correlation.row_iter().map(|row| row.iter().copied().collect()).collect(),
            convergence: self.outcome.convergence.clone(),
            witnesses: self.intervals.witnesses,
            misfit: self.outcome.fit.misfit().sqrt(),
            warnings: (!self.outcome.arrived).then(|| unfinished.to_owned()).into_iter().collect(),
            ..Identification::default()
        }
    }

    /// Numbers of one parameter together, in its own unit.
    fn parameters(&self, before: &[f64]) -> BTreeMap<String, Parameter> {
        let mut parameters = BTreeMap::<String, Parameter>::new();
        let shared = &self.outcome.fit.shared;
        for (k, setting) in self.settings.settings().iter().enumerate() {
            let half = self.intervals.half_width[k];
            let ends = [shared[k] - half, shared[k] + half].map(|end| setting.physical(end));
            let ends = if half.is_finite() { ends } else { [f64::NEG_INFINITY, f64::INFINITY] };
            let parameter = parameters.entry(setting.parameter()).or_default();
            parameter.unit = setting.physical_unit();
            parameter.value.push(setting.physical(shared[k]));
            parameter.start.push(setting.physical(before[k]));
            parameter.ci95.push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
        }
        parameters
    }
}
