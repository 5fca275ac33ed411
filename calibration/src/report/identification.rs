//! The page of an identification: what the clips say about the arm or the object, how sure that is, and what they cannot say.

use crate::answer::identification::{Advice, ClipGap, Figures, Identification, Parameter};
use crate::page::figure::bars::{Row, bars};
use crate::page::figure::chart::{Chart, Line};
use crate::page::figure::forest::forest;
use crate::page::figure::matrix::correlations;
use crate::page::frame::{facts, figure, frame, legend, unbroken, worth_knowing};
use crate::page::trace::gallery;
use crate::words::parameters::{Numbers, of_joints};
use crate::words::quantity::{Unit, short, span};
use crate::words::{number_in_words, words};
use maud::{Markup, html};

/// Clips whose residuals are shown.
const SHOWN_CLIPS: usize = 3;
/// Errors shown under the sentence.
const SHOWN_ERRORS: usize = 3;

pub fn page(found: &Identification) -> String {
    let body = html! {
        p.kicker { "Identification of the " (found.target) " from " b { (found.session) } }
        h1 { (unbroken(&sentence(found))) }
        (head(found))
        (figure("What was found", "Dot and bar: value and 95 % interval. Upright line: cell.toml, or the middle of its range.", &intervals(found)))
        (not_identifiable(found))
        (figure("How far off the twin is", "", &error_bars(found)))
        @if !found.traces.is_empty() { (residuals(found)) }
        (clip_by_clip(found))
        @if !found.advice.is_empty() {
            section { h2 { "What to record next" } @for advice in &found.advice { p.next { (advice_in_words(advice)) } } }
        }
        (worth_knowing(&found.warnings))
        (search(found))
        (origin(found))
    };
    let title = format!("{} of {}", found.target, found.session);
    frame(&title, &found.files.command(&format!("calibration identify {}", found.target)).to_string(), &body)
}

/// The finding in one sentence.
pub(super) fn sentence(found: &Identification) -> String {
    let all = found.names.len();
    let known = all - found.not_identifiable.len().min(all);
    let size = |figures: &Figures| {
        figures
            .object_add_m
            .map(|m| format!("{:.2} mm ADD", m * 1e3))
            .or_else(|| figures.joint_rms_rad.map(|rad| format!("{:.3} mrad", rad * 1e3)))
            .or_else(|| figures.joint_rms_m.map(|m| format!("{:.3} mm", m * 1e3)))
    };
    let (set, before, after) = if found.clips.holdout.is_empty() {
        ("the clips it was fitted to", &found.gap.train_before, &found.gap.train)
    } else {
        ("held-out clips", &found.gap.holdout_before, &found.gap.holdout)
    };
    if found.is_unexplained() {
        let next = found.files.command("calibration diagnose");
        return format!("Gains alone do not explain these clips: something else acts, and `{next}` says what");
    }
    let end = if found.converged { "" } else { "; not converged" };
    match (size(before), size(after)) {
        (Some(before), Some(after)) => format!(
            "{known} of {all} numbers are identifiable; on {set} the twin is off by {after} instead of {before}{end}"
        ),
        _ => format!("{known} of {all} numbers are identifiable{end}"),
    }
}

/// A kind of error on a set of clips.
pub(super) struct Error {
    pub(super) name: String,
    /// SI.
    unit: &'static str,
    before: Option<f64>,
    after: f64,
}

impl Error {
    /// `13.9`, where there is a before, and `2.00 mm`.
    pub(super) fn in_words(&self) -> (Option<String>, String) {
        let unit = Unit::suited(self.unit, self.before.unwrap_or(self.after));
        (self.before.map(|before| short(unit.scaled(before))), unit.with_unit(self.after))
    }
}

/// How far the twin is off, held-out clips first.
pub(super) fn errors(found: &Identification) -> Vec<Error> {
    let sets = [
        ("clips held out", &found.gap.holdout_before, &found.gap.holdout),
        ("clips fitted", &found.gap.train_before, &found.gap.train),
    ];
    let of_set = |(set, before, after): (&str, &Figures, &Figures)| {
        let pairs = [
            ("ADD", "m", before.object_add_m, after.object_add_m),
            ("ADD-S", "m", before.object_add_s_m, after.object_add_s_m),
            ("joint error (RMS)", "rad", before.joint_rms_rad, after.joint_rms_rad),
            ("joint error (RMS)", "m", before.joint_rms_m, after.joint_rms_m),
        ];
        let error = |(what, unit, before, after): (&str, &'static str, Option<f64>, Option<f64>)| {
            after.map(|after| Error { name: format!("{what}, {set}"), unit, before, after })
        };
        pairs.into_iter().filter_map(error).collect::<Vec<_>>()
    };
    sets.into_iter().flat_map(of_set).collect()
}

/// What is not identifiable, in words, and why.
pub(super) fn open_numbers(found: &Identification) -> impl Iterator<Item = (String, &str)> {
    found.not_identifiable.iter().map(|open| (number_in_words(&open.parameter), open.why.as_str()))
}

pub(super) fn advice_in_words(advice: &Advice) -> String {
    let share = 100.0 * (1.0 - advice.predicted / advice.now);
    format!("{} narrows the interval of {} by {share:.0} %", advice.record, number_in_words(&advice.parameter))
}

/// A parameter as its numbers.
pub(super) fn numbers<'a>(name: &'a str, parameter: &'a Parameter) -> Numbers<'a> {
    Numbers {
        name,
        joints: of_joints(name),
        unit: &parameter.unit,
        values: &parameter.value,
        intervals: &parameter.ci95,
    }
}

/// What speaks against the `k`-th number of a parameter.
pub(super) fn remark(found: &Identification, name: &str, parameter: &Parameter, k: usize) -> Option<&'static str> {
    let number = if parameter.value.len() > 1 { format!("{name}[{k}]") } else { name.to_owned() };
    let open = || found.not_identifiable.iter().any(|open| open.parameter == number);
    match found.at_bounds.contains(&number) {
        true => Some("at a bound of its search"),
        false => open().then_some("not identifiable"),
    }
}

fn head(found: &Identification) -> Markup {
    let all = errors(found);
    let entry = |error: &Error| match error.in_words() {
        (Some(before), after) => format!("{before} \u{2192} {after}"),
        (None, after) => after,
    };
    let entries: Vec<(String, &str)> =
        all.iter().take(SHOWN_ERRORS).map(|error| (entry(error), error.name.as_str())).collect();
    facts(&entries)
}

fn intervals(found: &Identification) -> Markup {
    let all: Vec<(String, Numbers<'_>, &Parameter)> =
        found.parameters.iter().map(|(name, parameter)| (words(name), numbers(name, parameter), parameter)).collect();
    let groups: Vec<_> = all
        .iter()
        .map(|(heading, numbers, parameter)| {
            let remark = |k| remark(found, numbers.name, parameter, k).map(str::to_owned);
            numbers.group(heading, &parameter.start, remark)
        })
        .collect();
    forest(&groups)
}

fn not_identifiable(found: &Identification) -> Markup {
    html! {
        @if !found.not_identifiable.is_empty() {
            section {
                h2 { "Not identifiable from these clips" }
                dl { @for (name, why) in open_numbers(found) { dt { (name) } dd { (why) } } }
            }
        }
    }
}

fn error_bars(found: &Identification) -> Markup {
    let all = errors(found);
    let rows = all.iter().map(|Error { name, unit, before, after }| Row {
        name,
        unit,
        values: vec![before.unwrap_or(f64::NAN), *after],
        floor: None,
    });
    let rows: Vec<Row<'_>> = rows.collect();
    html! {
        (legend(&[("before", "twin with cell.toml"), ("after", "twin with what was found")]))
        (bars(&["before", "after"], &rows))
    }
}

fn residuals(found: &Identification) -> Markup {
    let names = ["twin with cell.toml", "twin with what was found"];
    let pictures = gallery(&found.traces, SHOWN_CLIPS, names);
    figure("Measured less predicted, clip by clip", "The worst channel of the worst clips.", &pictures)
}

fn clip_by_clip(found: &Identification) -> Markup {
    let [what, unit] = match found.gap.train {
        Figures { object_add_m: Some(_), .. } => ["ADD", "m"],
        Figures { joint_rms_m: Some(_), .. } => ["joint error (RMS)", "m"],
        _ => ["joint error (RMS)", "rad"],
    };
    let errors =
        |clip: &ClipGap| [clip.before, clip.after].map(|f| f.object_add_m.or(f.joint_rms_rad).or(f.joint_rms_m));
    let largest = span(found.by_clip.iter().flat_map(errors).flatten())[1];
    let unit = Unit::suited(unit, largest);
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| unit.with_unit(value));
    let used =
        found.by_clip.iter().map(|clip| (&clip.file, clip.used.as_str(), errors(clip), clip.warnings.join("; ")));
    let left_out = found.clips.left_out.iter().map(|clip| (&clip.file, "left out", [None; 2], clip.why.clone()));
    html! {
        @if !found.by_clip.is_empty() || !found.clips.left_out.is_empty() {
            details open {
                summary { "Clip by clip: " (what) }
                table {
                    tr { th { "clip" } th { "used" } th.n { "cell.toml" } th.n { "found" } th { "remark" } }
                    @for (file, used, [before, after], remark) in used.chain(left_out) {
                        tr {
                            td { (file.trim_end_matches(".mcap")) }
                            td { (used) }
                            td.n { (shown(before)) }
                            td.n { (shown(after)) }
                            td { (remark) }
                        }
                    }
                }
            }
        }
    }
}

fn search(found: &Identification) -> Markup {
    let lines = [Line { class: "after", points: &found.convergence }];
    let chart = Chart {
        title: "best loss",
        x: "evaluations",
        unit: "1",
        lines: &lines,
        band: None,
        logarithmic: true,
        size: [600.0, 200.0],
    };
    let reading = "In hundredths: of numbers near \u{b1}100 only a combination is identifiable.";
    let names: Vec<String> = found.names.iter().map(|name| number_in_words(name)).collect();
    html! {
        @if found.correlation.len() > 1 {
            (figure("Which numbers hang together", reading, &correlations(&names, &found.correlation)))
        }
        @if found.convergence.len() > 1 { (figure("How the search went", "", &chart.draw())) }
    }
}

fn origin(found: &Identification) -> Markup {
    html! {
        section {
            h2 { "Where this comes from" }
            dl {
                dt { "origin" } dd { (found.origin) }
                dt { "way of searching" } dd { (found.optimizer) }
                dt { "clips simulated" } dd { (found.evaluations) }
                dt { "wall time" } dd { (format!("{:.1} s", found.seconds)) }
            }
            @if let Some(file) = &found.theta_file {
                p { "To see the gap with these parameters, clip by clip:" }
                pre { code { (found.files.command("twin replay").option("--parameters", file)) } }
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::answer::Trace;
    use crate::answer::identification::{Clips, Gap, NotIdentifiable};
    use shared_mem::recording::SessionFiles;
    use std::collections::BTreeMap;

    pub(in crate::report) fn rms(rad: f64) -> Figures {
        Figures { joint_rms_rad: Some(rad), ..Figures::default() }
    }

    fn found() -> Identification {
        let stiffness = Parameter {
            unit: "N m/rad".into(),
            value: vec![598.0, 496.0, 522.0, 669.0, 292.0, 167.0, 40.0],
            ci95: [598.0, 496.0, 522.0, 669.0, 292.0, 167.0, 40.0].map(|k| [0.99 * k, 1.01 * k]).to_vec(),
            start: vec![600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0],
            single: false,
        };
        let files = SessionFiles { session: "monday & <co>".into(), cell: Some("lab/cell.toml".into()) };
        let why = "the clips move the joint too little".to_owned();
        let advice = Advice {
            record: "clip_03 twice as large".into(),
            parameter: "stiffness[6]".into(),
            now: 2.0,
            predicted: 1.0,
        };
        let clip =
            ClipGap { file: "clip_07.mcap".into(), used: "held out".into(), after: rms(1e-4), ..ClipGap::default() };
        Identification {
            origin: "the simulation".into(),
            target: "arm".into(),
            session: "monday & <co>".into(),
            files,
            parameters: BTreeMap::from([("stiffness".to_owned(), stiffness)]),
            not_identifiable: vec![NotIdentifiable { parameter: "stiffness[5]".into(), why }],
            at_bounds: vec!["stiffness[6]".into()],
            gap: Gap { holdout: rms(1e-4), holdout_before: rms(2e-3), train: rms(1e-4), ..Gap::default() },
            clips: Clips { holdout: vec!["clip_07.mcap".into()], ..Clips::default() },
            by_clip: vec![clip],
            converged: true,
            convergence: vec![[15.0, 4e4], [60.0, 900.0]],
            names: vec!["stiffness[0]".into(), "damping[0]".into()],
            correlation: vec![vec![1.0, -0.4], vec![-0.4, 1.0]],
            advice: vec![advice],
            warnings: vec!["The clock of clip_03 jumped.".into()],
            optimizer: "least-squares".into(),
            theta_file: Some("theta.toml".into()),
            traces: vec![Trace { clip: "clip_07.mcap".into(), channel: "joint7".into(), ..Trace::default() }],
            ..Identification::default()
        }
    }

    #[test]
    fn the_page_shows_values_doubts_and_where_to_go_on() {
        let page = page(&found());
        for text in [
            "<h1>1\u{a0}of 2\u{a0}numbers are identifiable; on held-out clips the twin is off by 0.100\u{a0}mrad instead of 2.000\u{a0}mrad</h1>",
            "598 [592, 604] N m/rad",
            "at a bound of its search",
            "<dt>stiffness, joint 6</dt><dd>the clips move the joint too little</dd>",
            "2.00 \u{2192} 0.100 mrad",
            "<td>held out</td>",
            "Clip by clip: joint error (RMS)",
            "clip_03 twice as large narrows the interval of stiffness, joint 7 by 50 %",
            "The clock of clip_03 jumped.",
            "twin replay 'monday &amp; &lt;co&gt;' --cell lab/cell.toml --parameters theta.toml",
            "calibration identify arm 'monday &amp; &lt;co&gt;' --cell lab/cell.toml",
        ] {
            assert!(page.contains(text), "no {text} in {page}");
        }
        assert_eq!(page.matches("<svg").count(), 5);
    }

    #[test]
    fn what_found_nothing_is_still_a_page() {
        assert!(page(&Identification::default()).contains("</html>"));
    }
}
