//! What a fit says about the object, number by number: what the clips cannot tell and why, and what to record next.

use super::Problem;
use super::material::Material;
use crate::answer::identification::Identification;
use crate::identify::finding::{Finding, OPEN_FROM_SHARE_OF_VALUE};
use inference::likelihood::Setting;
use inference::object_fit::ObjectFit;

/// A number is not identifiable where half its interval is more than this share of its range (a choice).
const OPEN_FROM_SHARE_OF_RANGE: f64 = 0.25;
/// Weight of a clip below which it is said (a choice).
const FULL_WEIGHT: f64 = 0.99;

/// The fit with its intervals; `disagreement`: half widths that they have at least.
pub(super) fn finding<'a>(
    Problem { settings, unknowns, .. }: &'a Problem,
    found: &ObjectFit,
    disagreement: &[f64],
) -> Finding<'a> {
    let (fit, held, mut intervals) = found.at.estimate(unknowns);
    intervals.half_width.iter_mut().zip(&found.widths).for_each(|(half, width)| *half *= width);
    intervals.half_width.iter_mut().zip(disagreement).for_each(|(half, least)| *half = half.max(*least));
    Finding {
        settings: settings.settings(),
        unknowns,
        fit,
        held,
        intervals,
        simulated: found.evaluations,
        convergence: found.convergence.clone(),
        arrived: found.converged,
    }
}

/// The answer but for figures; `weights`: how much every clip counts in the fit.
pub(super) fn answer(finding: &Finding<'_>, weights: &[f64], material: &Material) -> Identification {
    let starts: Vec<f64> = finding.unknowns.iter().map(|unknown| unknown.start).collect();
    let mut answer = finding.answer("object", &starts);
    answer.clips = material.used.clips.clone();
    answer.warnings = material.warnings();
    for (file, weight) in answer.clips.train.iter().zip(weights).filter(|(_, weight)| **weight < FULL_WEIGHT) {
        answer.warnings.push(format!("{file} fits worse than the others and counts {:.0} %", weight * 100.0));
    }
    if (0..finding.unknowns.len()).all(|k| !shows(finding, k)) {
        answer.warnings.push(
            "nothing in these clips depends on any of the numbers: all of them stay where the search began; record clips in which \
             the object is hit and slides"
                .into(),
        );
    }
    answer.not_identifiable = finding.not_identifiable(|k| why(finding, k, material));
    let motion = if material.cell.robot.is_some() { "stroke" } else { "toss" };
    let more = finding.fit.clips.iter().zip(&answer.clips.train);
    let more = more.map(|(clip, file)| (format!("one more {motion} like {file}"), clip.information.clone()));
    answer.advice = finding.advice(|k| finding.intervals.half_width[k] / range(finding, k), more);
    answer
}

/// Width of a number's search.
fn range(finding: &Finding<'_>, k: usize) -> f64 {
    finding.unknowns[k].upper - finding.unknowns[k].lower
}

/// Whether the clips would tell one end of a number's range from the other.
fn shows(finding: &Finding<'_>, k: usize) -> bool {
    finding.fit.information()[(k, k)] * range(finding, k).powi(2) >= 1.0
}

fn why(finding: &Finding<'_>, k: usize, material: &Material) -> Option<String> {
    let setting = &finding.settings[k];
    let (value, half) = (finding.fit.shared[k], finding.intervals.half_width[k]);
    let remedy = remedy(setting, material);
    // Before the bound: a number that nothing shows may have drifted there, and a wider range would help no one.
    if !shows(finding, k) {
        return Some(format!("nothing in these clips depends on it; {remedy}"));
    }
    if finding.held[k] {
        let end = finding.nearer_bound(k);
        let or = if material.cell.robot.is_some() { ", or ask `calibration diagnose` what else acts" } else { "" };
        return Some(format!(
            "the best value lies at or beyond {value:.4}, the {end} bound of its range in cell.toml: widen the range{or}"
        ));
    }
    let relative = matches!(setting, Setting::Friction | Setting::Mass) && half > OPEN_FROM_SHARE_OF_VALUE * value;
    if !relative && half <= OPEN_FROM_SHARE_OF_RANGE * range(finding, k) {
        return None;
    }
    let together = finding.together(k, ";");
    let unit = setting.physical_unit();
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    Some(format!("its 95 % interval is as wide as ±{half:.3}{unit};{together} {remedy}"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::test_finding::{Seen, found};
    use crate::identify::used::Used;
    use shared_mem::cell::{Cell, Robot};

    fn said(clips: &[Seen], robot: Option<Robot>) -> Identification {
        let cell = Cell { robot, ..Cell::default() };
        let mut used = Used::of([], Vec::new(), 0);
        used.clips.train = vec!["a.mcap".into(), "b.mcap".into()];
        let material = Material { cell, usable: Vec::new(), used, remarks: Vec::new() };
        let mut all = Identification::default();
        found(&[Setting::Friction, Setting::TipFriction], clips, |finding| {
            all = answer(finding, &[1.0, 0.4], &material);
        });
        all
    }

    fn why(answer: &Identification, parameter: &str) -> String {
        let open = answer.not_identifiable.iter().find(|open| open.parameter == parameter);
        open.map_or_else(String::new, |open| open.why.clone())
    }

    #[test]
    fn what_is_seen_well_is_no_open_number_and_a_clip_that_counts_less_is_named() {
        let answer = said(&[Seen { of: [1.0, 0.0], sigma: 0.05 }, Seen { of: [0.0, 1.0], sigma: 0.05 }], None);
        assert_eq!(answer.not_identifiable, []);
        assert!(
            answer.warnings.iter().any(|warning| warning.starts_with("b.mcap fits worse") && warning.ends_with("40 %"))
        );
        let advice = &answer.advice[0];
        assert!(advice.record.starts_with("one more toss like ") && advice.predicted < advice.now, "{advice:?}");
    }

    #[test]
    fn a_number_is_open_on_its_bound_where_nothing_shows_it_and_where_only_a_sum_does() {
        let bound =
            said(&[Seen { of: [0.1, 0.0], sigma: 0.01 }, Seen { of: [0.0, 1.0], sigma: 0.05 }], Some(Robot::default()));
        assert!(why(&bound, "friction").contains("the upper bound of its range"), "{:?}", bound.not_identifiable);
        assert!(why(&bound, "friction").ends_with("or ask `calibration diagnose` what else acts"));
        let unseen = said(&[Seen { of: [1.0, 0.0], sigma: 0.05 }; 2], None);
        assert!(why(&unseen, "tip_friction").contains("nothing in these clips depends on it"));
        assert!(why(&unseen, "tip_friction").ends_with("record strokes that meet the object's face askew"));
        let sum = said(&[Seen { of: [1.0, 1.0], sigma: 0.3 }, Seen { of: [1.0, 1.05], sigma: 0.3 }], None);
        assert!(why(&sum, "friction").contains("moves together with tip friction"), "{:?}", sum.not_identifiable);
        let nothing = said(&[Seen { of: [0.0; 2], sigma: 0.1 }; 2], None);
        assert!(nothing.warnings.iter().any(|warning| warning.contains("nothing in these clips depends on any")));
    }
}
