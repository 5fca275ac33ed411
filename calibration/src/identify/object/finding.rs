//! What a fit tells about the object, number by number: value, interval, and what the clips cannot tell and why.

use super::fit::ObjectFit;
use super::material::Material;
use crate::answer::identification::{Advice, Identification, NotIdentifiable, Parameter};
use crate::words::number_in_words;
use inference::estimate::{Fit, Intervals, Unknown};
use inference::likelihood::{Setting, Settings};
use std::collections::BTreeMap;

/// An interval wider than this share of the search's range, to either side, tells nothing.
const RANGE_SHARE: f64 = 0.25;
/// Nor does one of friction or mass wider than this share of the value.
const VALUE_SHARE: f64 = 0.3;
/// Estimates that move together this closely are told apart badly.
const TOGETHER: f64 = 0.9;
/// Motions that are proposed.
const PROPOSALS: usize = 3;
/// A clip that counts less than this is told.
const FULL_WEIGHT: f64 = 0.99;

/// Everything that a fit tells.
pub(super) struct Finding<'a> {
    settings: &'a Settings,
    unknowns: &'a [Unknown],
    found: &'a ObjectFit,
    fit: Fit,
    held: Vec<bool>,
    intervals: Intervals,
}

impl<'a> Finding<'a> {
    /// `disagreement`: half widths that intervals have at least.
    pub(super) fn new(
        (settings, unknowns): (&'a Settings, &'a [Unknown]),
        found: &'a ObjectFit,
        disagreement: &[f64],
    ) -> Self {
        let (fit, held, mut intervals) = found.at.estimate(unknowns);
        intervals.half_width.iter_mut().zip(&found.widths).for_each(|(half, width)| *half *= width);
        intervals.half_width.iter_mut().zip(disagreement).for_each(|(half, least)| *half = half.max(*least));
        Self { settings, unknowns, found, fit, held, intervals }
    }

    /// The answer but for figures.
    pub(super) fn answer(&self, material: &Material) -> Identification {
        let bounded = self.unknowns.iter().zip(&self.held).filter(|(_, held)| **held);
        let clips = material.used.clips.clone();
        let mut warnings = material.warnings();
        for (file, weight) in clips.train.iter().zip(&self.found.at.weights).filter(|(_, w)| **w < FULL_WEIGHT) {
            warnings.push(format!("{file} fits worse than the others and counts {:.0} %", weight * 100.0));
        }
        if (0..self.unknowns.len()).all(|k| !self.shows(k)) {
            warnings.push(
                "nothing in these clips depends on any of the numbers: all of them stay where the search began; record \
                 clips in which the object is hit and slides"
                    .into(),
            );
        }
        Identification {
            target: "object".into(),
            parameters: self.parameters(),
            not_identifiable: self.untold(material),
            evaluations: self.found.evaluations,
            converged: self.found.converged,
            at_bounds: bounded.map(|(unknown, _)| unknown.name.clone()).collect(),
            names: self.unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
            correlation: self.intervals.correlation.row_iter().map(|row| row.iter().copied().collect()).collect(),
            convergence: self.found.convergence.clone(),
            witnesses: self.intervals.witnesses,
            misfit: self.fit.misfit().sqrt(),
            advice: self.advice(&clips.train, if material.cell.robot.is_some() { "stroke" } else { "toss" }),
            clips,
            warnings,
            ..Identification::default()
        }
    }

    fn parameters(&self) -> BTreeMap<String, Parameter> {
        let mut parameters = BTreeMap::<String, Parameter>::new();
        for (k, setting) in self.settings.settings().iter().enumerate() {
            let (value, half) = (self.fit.shared[k], self.intervals.half_width[k]);
            let parameter = parameters.entry(setting.parameter()).or_default();
            parameter.unit = setting.physical_unit();
            parameter.single = !matches!(setting, Setting::CentreOfMass(_));
            parameter.value.push(value);
            parameter.start.push(self.unknowns[k].start);
            parameter.ci95.push([value - half, value + half]);
        }
        parameters
    }

    fn untold(&self, material: &Material) -> Vec<NotIdentifiable> {
        let untold =
            |k: usize| Some(NotIdentifiable { parameter: self.unknowns[k].name.clone(), why: self.why(k, material)? });
        (0..self.unknowns.len()).filter_map(untold).collect()
    }

    fn why(&self, k: usize, material: &Material) -> Option<String> {
        let (setting, unknown) = (&self.settings.settings()[k], &self.unknowns[k]);
        let (value, half) = (self.fit.shared[k], self.intervals.half_width[k]);
        let remedy = remedy(setting, material);
        if self.held[k] {
            let end = if value - unknown.lower < unknown.upper - value { "lower" } else { "upper" };
            let or = if material.cell.robot.is_some() { ", or ask `calibration diagnose` what else acts" } else { "" };
            return Some(format!(
                "the best value lies at or beyond {value:.4}, the {end} bound of its range in cell.toml: widen the range{or}"
            ));
        }
        if !self.shows(k) {
            return Some(format!("nothing in these clips depends on it; {remedy}"));
        }
        let relative = matches!(setting, Setting::Friction | Setting::Mass) && half > VALUE_SHARE * value;
        if !relative && half <= RANGE_SHARE * (unknown.upper - unknown.lower) {
            return None;
        }
        let together = self
            .partner(k)
            .map_or_else(String::new, |(name, r)| format!(" it moves together with {name} (correlation {r:.2});"));
        let unit = setting.physical_unit();
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        Some(format!("its 95 % interval is as wide as ±{half:.3}{unit};{together} {remedy}"))
    }

    /// Whether the clips would tell one end of a number's range from the other.
    fn shows(&self, k: usize) -> bool {
        let unknown = &self.unknowns[k];
        self.fit.information()[(k, k)] * (unknown.upper - unknown.lower).powi(2) >= 1.0
    }

    /// The number that this one moves together with most closely, and their correlation.
    fn partner(&self, k: usize) -> Option<(String, f64)> {
        let row = self.intervals.correlation.row(k);
        let (other, r) =
            (0..row.len()).filter(|i| *i != k).map(|i| (i, row[i])).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        (r.abs() > TOGETHER).then(|| (number_in_words(&self.unknowns[other].name), r))
    }

    /// Motions that sharpen the worst number most.
    fn advice(&self, files: &[String], motion: &str) -> Vec<Advice> {
        let half = &self.intervals.half_width;
        let share = |k: usize| half[k] / (self.unknowns[k].upper - self.unknowns[k].lower);
        let told = (0..half.len()).filter(|k| half[*k].is_finite() && !self.held[*k]);
        let Some(worst) = told.max_by(|a, b| share(*a).total_cmp(&share(*b))) else { return Vec::new() };
        let advice = |(clip, file): (&inference::estimate::ClipFit, &String)| Advice {
            record: format!("one more {motion} like {file}"),
            parameter: self.unknowns[worst].name.clone(),
            now: half[worst],
            predicted: self.intervals.with_more(&self.fit, &clip.information)[worst],
        };
        let mut all: Vec<Advice> = self.fit.clips.iter().zip(files).map(advice).collect();
        all.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        all.truncate(PROPOSALS);
        all
    }
}

/// What would tell a number.
fn remedy(setting: &Setting, material: &Material) -> &'static str {
    let hit = material.cell.robot.is_some();
    match setting {
        Setting::Mass if hit => {
            "the arm is many times heavier than the object: weigh it and write `mass` into [object]"
        }
        Setting::Mass => "an object that slides by itself moves alike whatever it weighs: weigh it",
        Setting::TipFriction => "record strokes that meet the object's face askew",
        Setting::CentreOfMass(2) => "record fast strokes at other heights",
        Setting::CentreOfMass(_) => "record strokes left and right of the object's middle, from several sides",
        _ => "record longer slides",
    }
}
