//! What verbs print for a person: a short table, aligned, and the sentence at the end, where eyes are.

use super::benchmark::RATES;
use super::diagnosis::{confidence, has_effects, is_known, sizes, together, verdict_words};
use super::identification;
use crate::answer::diagnosis::{Candidate, Diagnosis, Kind, Status, TorqueRms};
use crate::answer::identification::{Identification, Parameter};
use crate::answer::witness_in_words;
use crate::benchmark::calibrate::Regenerated;
use crate::benchmark::score::{Method, Scores};
use crate::diagnose::against::{Candidate as Compared, Comparison, change};
use crate::diagnose::judge::confidence::MAX_PROBABILITY;
use crate::words::parameters::{of_joints, part};
use crate::words::quantity::{Unit, short, span};
use crate::words::share::{limited, percent, percent_interval};
use crate::words::{channel_in_words, words};

/// Places of the gap that are named.
const SHOWN_PLACES: usize = 3;

/// An identification: each number with its interval and what was believed, the errors, what is not identifiable, what to do next.
pub fn identification(found: &Identification) -> String {
    let rows = found.parameters.iter().flat_map(|(name, parameter)| numbers(found, name, parameter));
    let mut lines = table(rows.collect());
    lines.extend((!found.origin.is_empty()).then(|| format!("origin: {}", found.origin)));
    lines.extend(identification::errors(found).iter().map(|error| match error.in_words() {
        (Some(before), after) => format!("{}: {before} -> {after}", error.name),
        (None, after) => format!("{}: {after}", error.name),
    }));
    lines.extend(not_identifiable(found));
    lines.extend(found.warnings.iter().map(|warning| format!("note: {warning}")));
    lines.extend(found.advice.iter().map(|advice| format!("next: {}", identification::advice_in_words(advice))));
    lines.push(identification::sentence(found));
    lines.join("\n")
}

/// What is not identifiable, a line a reason.
fn not_identifiable(found: &Identification) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (name, why) in identification::open_numbers(found) {
        match reasons.iter_mut().find(|(known, _)| *known == why) {
            Some((_, names)) => names.push(name),
            None => reasons.push((why, vec![name])),
        }
    }
    reasons.into_iter().map(|(why, names)| format!("not identifiable: {}: {why}", names.join("; "))).collect()
}

/// A diagnosis: gap, place, candidates in question, how many others, what to do next, and the verdict.
pub fn diagnosis(diagnosis: &Diagnosis) -> String {
    let mut lines = if is_known(diagnosis) { gap(diagnosis) } else { Vec::new() };
    let mut places: Vec<_> = diagnosis.places.iter().collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    let places: Vec<String> = places
        .iter()
        .take(SHOWN_PLACES)
        .map(|place| {
            format!("{} {} ({}) {}", place.stage, channel_in_words(&place.channel), place.regime, percent(place.share))
        })
        .collect();
    lines.extend((!diagnosis.origin.is_empty()).then(|| format!("origin: {}", diagnosis.origin)));
    if !places.is_empty() {
        lines.push(format!("where: {}", places.join(", ")));
    }
    let (rows, sizes): (Vec<_>, Vec<_>) = diagnosis.candidates.iter().filter_map(candidate).unzip();
    for (row, sizes) in table(rows).into_iter().zip(sizes) {
        lines.push(row);
        lines.extend(sizes.into_iter().map(|size| format!("    {size}")));
    }
    if !diagnosis.candidates.is_empty() {
        lines.push(others(&diagnosis.candidates));
    }
    lines.extend(diagnosis.stage_test.iter().map(|test| format!("arm or object: {}", test.text)));
    let shown = diagnosis.witnesses.iter().filter(|witness| witness.is_significant());
    lines.extend(shown.map(|witness| format!("{} alone: {}", witness.stage, witness_in_words(witness))));
    lines.extend(diagnosis.warnings.iter().map(|warning| format!("note: {warning}")));
    if !diagnosis.next_experiment.is_empty() {
        lines.push(format!("next clip: {}", diagnosis.next_experiment));
    }
    lines.extend(diagnosis.next_commands.iter().map(|command| format!("    {command}")));
    lines.extend(diagnosis.next_motions.iter().map(|motion| format!("    {}", motion.in_words())));
    for remedy in &diagnosis.remedies {
        let effect = words(&remedy.effect);
        lines.push(format!("about {effect}, in the cell: {}", remedy.in_cell));
        lines.push(format!("about {effect}, in a model: {}", remedy.in_model));
    }
    let verdict = &diagnosis.verdict;
    lines.extend(confidence(verdict).map(|(value, what)| format!("confidence: {value}, {what}")));
    lines.push(format!("{}: {}", verdict_words(diagnosis), verdict.text));
    lines.join("\n")
}

/// A comparison of two sessions: B's gap, what changed number by number, and the verdict.
pub fn comparison(found: &Comparison) -> String {
    let gap = &found.gap;
    let both = matches!(found.verdict.kind, Kind::Named | Kind::Class);
    let after = if both {
        let shrink = percent_interval(gap.shrink.value, gap.shrink.ci90);
        format!(" -> {} with what changed, shrink {shrink}", short(gap.after))
    } else {
        String::new()
    };
    let mut lines = vec![format!(
        "gap: A {}, B under A's model {}{after} sigma^2 (noise alone {})",
        short(found.gap_of_a),
        short(gap.before),
        short(gap.floor)
    )];
    if !found.shared.is_empty() {
        lines.push(format!("in both: {}", found.shared.iter().map(|name| words(name)).collect::<Vec<_>>().join(", ")));
    }
    let open = |candidate: &&Compared| matches!(candidate.status, Status::Named | Status::Possible);
    for candidate in found.candidates.iter().filter(open) {
        lines.push(format!("{}   {}", words(&candidate.name), limited(candidate.probability, MAX_PROBABILITY)));
        let rows = candidate.parameters.iter().flat_map(|(name, values)| change::rows(&candidate.name, name, values));
        let rows = rows.map(|[number, a, b, change]| {
            vec![format!("    {number}"), format!("{a} -> {b}"), format!("change {change}")]
        });
        lines.extend(table(rows.collect()));
    }
    let count = |status| found.candidates.iter().filter(|candidate| candidate.status == status).count();
    lines.push(format!("{} ruled out, {} not testable", count(Status::RuledOut), count(Status::NotTestable)));
    lines.extend(found.warnings.iter().map(|warning| format!("note: {warning}")));
    if !found.next_experiment.is_empty() {
        lines.push(format!("next clip: {}", found.next_experiment));
    }
    lines.extend(found.next_commands.iter().map(|command| format!("    {command}")));
    lines.push(format!("{}: {}", super::against::verdict_words(found.verdict.kind), found.verdict.text));
    lines.join("\n")
}

/// How many candidates are out of the question.
fn others(candidates: &[Candidate]) -> String {
    let count = |status| candidates.iter().filter(|candidate| candidate.status == status).count();
    format!("{} ruled out, {} not testable", count(Status::RuledOut), count(Status::NotTestable))
}

/// The gap, in sigma and in units of the hand.
fn gap(diagnosis: &Diagnosis) -> Vec<String> {
    let gap = &diagnosis.gap;
    let both = has_effects(diagnosis);
    let arrow = |unit: &Unit, before: f64, after: f64| {
        let before_only = unit.with_unit(before);
        if both { format!("{} -> {}", short(unit.scaled(before)), unit.with_unit(after)) } else { before_only }
    };
    let sigma = Unit::suited("sigma^2", gap.before);
    let shrink =
        if both { format!(", shrink {}", percent_interval(gap.shrink.value, gap.shrink.ci90)) } else { String::new() };
    let noise = short(gap.floor);
    let mut lines = vec![format!("gap: {} (noise alone {noise}){shrink}", arrow(&sigma, gap.before, gap.after))];
    if let Some(nearest) = &diagnosis.nearest {
        let shrink = percent_interval(nearest.shrink.value, nearest.shrink.ci90);
        lines.push(format!("nearest: {}, shrink {shrink}, leaves more than a cause does", together(&nearest.effects)));
    }
    let torques = gap.torque_rms.as_ref().map(TorqueRms::over_joints).unwrap_or_default();
    let human = [
        ("joints", "rad", gap.joint_rms_rad),
        ("torques", "N m", torques),
        ("ADD", "m", gap.object_add_m),
        ("median ADD", "m", gap.median.object_add_m),
        ("ADD-S", "m", gap.object_add_s_m),
    ];
    for (name, si, change) in human {
        if let (Some(before), Some(after)) = (change.before, change.after) {
            lines.push(format!("{name}: {}", arrow(&Unit::suited(si, before), before, after)));
        }
    }
    lines
}

/// A row for a candidate that is named or possible, and its sizes.
fn candidate(candidate: &Candidate) -> Option<(Vec<String>, Vec<String>)> {
    let status = match candidate.status {
        Status::Named => "named",
        Status::Possible => "possible",
        Status::RuledOut | Status::NotTestable => return None,
    };
    let shrink = format!("shrink {}", percent_interval(candidate.shrink.value, candidate.shrink.ci90));
    let row =
        vec![words(&candidate.effect), status.to_owned(), limited(candidate.probability, MAX_PROBABILITY), shrink];
    Some((row, sizes(candidate)))
}

/// Rows of a parameter: name, value with interval, what was believed, remark.
fn numbers(found: &Identification, name: &str, parameter: &Parameter) -> Vec<Vec<String>> {
    let [lo, hi] = span(parameter.value.iter().copied());
    let unit = Unit::suited(&parameter.unit, lo.abs().max(hi.abs()));
    let row = |(k, value): (usize, &f64)| {
        let shown = match part(of_joints(name), parameter.value.len(), k) {
            part if part.is_empty() => words(name),
            part => format!("{}, {part}", words(name)),
        };
        let interval = parameter.ci95.get(k).copied().unwrap_or([f64::NAN; 2]);
        let start = parameter.start.get(k).map_or_else(String::new, |x| format!("began at {}", short(unit.scaled(*x))));
        let remark = identification::remark(found, name, parameter, k).unwrap_or_default();
        vec![shown, unit.interval(*value, interval), start, remark.to_owned()]
    };
    parameter.value.iter().enumerate().map(row).collect()
}

/// A benchmark: each rate of each method, and the finding.
pub fn benchmark(methods: &[Method]) -> String {
    let scores: Vec<Scores> = methods.iter().map(|method| Scores::of(&method.cases)).collect();
    let head = std::iter::once(String::new()).chain(methods.iter().map(|method| method.name.clone()));
    let mut rows = vec![head.collect()];
    rows.extend(RATES.iter().map(|(what, rate)| {
        let cells = scores.iter().map(rate).map(|rate| match rate.of {
            0 => "-".to_owned(),
            of => format!("{} ({} of {of})", percent_interval(rate.value(), rate.ci95), rate.hits),
        });
        std::iter::once((*what).to_owned()).chain(cells).collect()
    }));
    let mut lines = table(rows);
    lines.extend(scores.first().map(super::benchmark::sentence));
    lines.join("\n")
}

/// Criteria of a diagnosis, and what labelled sessions make of them.
pub fn criteria(rows: &[Regenerated]) -> String {
    let head = ["", "in use", "from sessions", "sessions", "unit"].map(str::to_owned).to_vec();
    let line = |row: &Regenerated| {
        let found = row.from_sessions.map_or_else(|| "too few".to_owned(), |value| format!("{value:.3}"));
        vec![row.name.to_owned(), row.in_use.to_string(), found, row.sessions.to_string(), row.unit.to_owned()]
    };
    table(std::iter::once(head).chain(rows.iter().map(line)).collect()).join("\n")
}

/// Lines with their columns one under the other.
fn table(rows: Vec<Vec<String>>) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        cells.join("   ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::identification::{Figures, Gap, NotIdentifiable};
    use std::collections::BTreeMap;

    #[test]
    fn columns_stand_under_each_other_and_the_sentence_comes_last() {
        let centre = Parameter {
            unit: "m".into(),
            value: vec![0.0051, -0.002],
            ci95: vec![[0.0042, 0.006], [-0.003, -0.001]],
            start: vec![0.0, 0.0],
            single: false,
        };
        let add = |m: f64| Figures { object_add_m: Some(m), ..Figures::default() };
        let open = |name: &str| NotIdentifiable { parameter: name.into(), why: "weigh it".into() };
        let found = Identification {
            parameters: BTreeMap::from([("centre_of_mass".to_owned(), centre)]),
            gap: Gap { train_before: add(0.0139), train: add(0.002), ..Gap::default() },
            not_identifiable: vec![open("mass"), open("load")],
            at_bounds: vec!["centre_of_mass[1]".into()],
            names: ["centre_of_mass[0]", "centre_of_mass[1]", "mass", "load"].map(str::to_owned).into(),
            converged: true,
            ..Identification::default()
        };
        let expected = "\
centre of mass, x   5.1 [4.2, 6.0] mm      began at 0
centre of mass, y   -2.0 [-3.0, -1.0] mm   began at 0   at a bound of its search
ADD, clips fitted: 13.9 -> 2.00 mm
not identifiable: mass; load: weigh it
2 of 4 numbers are identifiable; on the clips it was fitted to the twin is off by 2.00 mm ADD instead of 13.90 mm ADD";
        assert_eq!(super::identification(&found), expected);
    }

    #[test]
    fn a_diagnosis_fits_a_screen_and_ends_with_the_verdict() {
        let text = diagnosis(&crate::report::diagnosis::tests::named());
        let expected = "\
gap: 38.4 -> 1.40 sigma^2 (noise alone 1.00), shrink 96.3 [95.1, 97.2] %
joints: 2.13 -> 0.180 mrad
ADD: 13.9 -> 1.20 mm
origin: the simulation
where: control joint 2 (reversal) 41 %
command lag     possible   2 %            shrink 81 [76, 85] %
    creep 2.00 ms (default, not fitted)
    delay 11.9 [11.2, 12.6] ms
command delay   named      97 % (limit)   shrink 81 [76, 85] %
    creep 2.00 ms (default, not fitted)
    delay 11.9 [11.2, 12.6] ms
1 ruled out, 1 not testable
next clip: Play a chirp up to 10 Hz.
    calibration capture excitation --motion chirp
    calibration diagnose monday
about command delay, in the cell: Send commands 12 ms earlier.
about command delay, in a model: Hold them back by 12 ms.
confidence: 97 %, so many such verdicts were right on simulated sessions; more is never claimed
cause named: Commands reach the robot 12 ms late <here>.";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_benchmark_shows_methods_side_by_side() {
        let cases = crate::report::benchmark::tests::cases();
        let text =
            benchmark(&["twinalign", "largest RMSE"].map(|name| Method { name: name.into(), cases: cases.clone() }));
        assert!(text.contains("twinalign") && text.contains("50 [1, 99] % (1 of 2)"), "{text}");
        assert!(
            text.lines().last().is_some_and(|line| line.starts_with("The true effect was named in 50 %")),
            "{text}"
        );
    }
}
