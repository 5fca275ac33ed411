//! The page of an identification: what the clips say about the arm or the object, how sure that is, and what they cannot say.

use crate::identify::sheet::{Parameter, Sheet};
use crate::page::figure::bars::{Row, bars};
use crate::page::figure::chart::{Chart, Line};
use crate::page::figure::forest::forest;
use crate::page::figure::matrix::correlations;
use crate::page::frame::{facts, figure, frame, legend, unbroken};
use crate::page::parameters::{Numbers, of_joints, part};
use crate::page::quantity::{Unit, short};
use crate::page::trace::gallery;
use crate::page::words;
use maud::{Markup, html};

/// Clips whose residuals are shown.
const SHOWN_CLIPS: usize = 3;
/// Errors shown under the sentence.
const SHOWN_ERRORS: usize = 3;

impl Sheet {
    pub fn page(&self) -> String {
        let body = html! {
            p.kicker { "Identification of the " (self.target) " from " b { (self.session) } }
            h1 { (unbroken(&self.sentence)) }
            (self.facts())
            (figure("What was found", "Dot and bar: value and 95 % interval. Upright line: cell.toml, or the middle of its range.", &self.forest()))
            (self.not_identifiable())
            (figure("How far off the twin is", "", &self.bars()))
            @if !self.traces.is_empty() { (self.residuals()) }
            (self.table())
            @if !self.advice.is_empty() { (self.next()) }
            @if !self.notes.is_empty() {
                section { h2 { "Worth knowing" } @for note in &self.notes { p { (note) } } }
            }
            (self.search())
            (self.origin())
        };
        let title = format!("{} of {}", self.target, self.session);
        frame(&title, &self.files.command(&format!("calibration identify {}", self.target)).to_string(), &body)
    }

    fn facts(&self) -> Markup {
        let entries: Vec<(String, &str)> = self
            .errors
            .iter()
            .take(SHOWN_ERRORS)
            .map(|error| {
                let unit = Unit::suited(&error.unit, error.before.unwrap_or(error.after));
                let before =
                    error.before.map_or_else(String::new, |before| format!("{} \u{2192} ", short(unit.scaled(before))));
                (format!("{before}{}", unit.with_unit(error.after)), error.name.as_str())
            })
            .collect();
        facts(&entries)
    }

    fn forest(&self) -> Markup {
        let numbers: Vec<Numbers> = self.parameters.iter().map(Parameter::numbers).collect();
        let headings: Vec<String> = self.parameters.iter().map(|p| words(&p.name)).collect();
        let groups: Vec<_> = numbers
            .iter()
            .zip(&headings)
            .zip(&self.parameters)
            .map(|((numbers, heading), p)| numbers.group(heading, &p.nominal, |k| p.warnings.get(k).cloned().flatten()))
            .collect();
        forest(&groups)
    }

    fn not_identifiable(&self) -> Markup {
        html! {
            @if !self.not_identifiable.is_empty() {
                section {
                    h2 { "Not identifiable from these clips" }
                    dl { @for [name, why] in &self.not_identifiable { dt { (name) } dd { (why) } } }
                }
            }
        }
    }

    fn bars(&self) -> Markup {
        let rows: Vec<Row> = self
            .errors
            .iter()
            .map(|error| Row {
                name: &error.name,
                unit: &error.unit,
                values: vec![error.before.unwrap_or(f64::NAN), error.after],
                floor: None,
            })
            .collect();
        html! {
            (legend(&[("before", "twin with cell.toml"), ("after", "twin with what was found")]))
            (bars(&["before", "after"], &rows))
        }
    }

    fn residuals(&self) -> Markup {
        let names = ["twin with cell.toml", "twin with what was found"];
        let pictures = gallery(&self.traces, SHOWN_CLIPS, names);
        figure("Measured less predicted, clip by clip", "The worst channel of the worst clips.", &pictures)
    }

    fn table(&self) -> Markup {
        let [what, unit] = self.clip_error;
        let largest = crate::page::scale::span(self.clips.iter().flat_map(|clip| clip.error).flatten())[1];
        let unit = Unit::suited(unit, largest);
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| unit.with_unit(value));
        html! {
            @if !self.clips.is_empty() {
                details open {
                    summary { "Clip by clip: " (what) }
                    table {
                        tr { th { "clip" } th { "used" } th.n { "cell.toml" } th.n { "found" } th { "remark" } }
                        @for clip in &self.clips {
                            tr {
                                td { (clip.file.trim_end_matches(".mcap")) }
                                td { (clip.used) }
                                td.n { (shown(clip.error[0])) }
                                td.n { (shown(clip.error[1])) }
                                td { (clip.remark) }
                            }
                        }
                    }
                }
            }
        }
    }

    fn next(&self) -> Markup {
        html! { section { h2 { "What to record next" } @for line in &self.advice { p.next { (line) } } } }
    }

    fn search(&self) -> Markup {
        let lines = [Line { class: "after", points: &self.convergence }];
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
        html! {
            @if self.correlation.len() > 1 {
                (figure("Which numbers hang together", reading, &correlations(&self.names, &self.correlation)))
            }
            @if self.convergence.len() > 1 { (figure("How the search went", "", &chart.draw())) }
        }
    }

    fn origin(&self) -> Markup {
        html! {
            section {
                h2 { "Where this comes from" }
                dl { @for [what, value] in &self.provenance { dt { (what) } dd { (value) } } }
                @if let Some(file) = &self.theta_file {
                    p { "To see the gap with these parameters, clip by clip:" }
                    pre { code { (self.files.command("twin replay").option("--parameters", file)) } }
                }
            }
        }
    }
}

impl Parameter {
    /// What the `k`-th number belongs to: a joint, an axis; empty for the only one.
    pub(super) fn part(&self, k: usize) -> String {
        part(of_joints(&self.name), self.values.len(), k)
    }

    fn numbers(&self) -> Numbers<'_> {
        let joints = of_joints(&self.name);
        Numbers { name: &self.name, joints, unit: &self.unit, values: &self.values, intervals: &self.intervals }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::sheet::{Clip, Error};
    use crate::page::Trace;
    use shared_mem::recording::SessionFiles;

    fn sheet() -> Sheet {
        let stiffness = Parameter {
            name: "stiffness".into(),
            unit: "N m/rad".into(),
            values: vec![598.0, 496.0, 522.0, 669.0, 292.0, 167.0, 40.0],
            intervals: [598.0, 496.0, 522.0, 669.0, 292.0, 167.0, 40.0].map(|k| [0.99 * k, 1.01 * k]).to_vec(),
            nominal: vec![600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0],
            warnings: vec![None, None, None, None, None, None, Some("at its lower bound".into())],
        };
        Sheet {
            origin: "the simulation".into(),
            target: "arm".into(),
            session: "monday & <co>".into(),
            files: SessionFiles { session: "monday & <co>".into(), cell: Some("lab/cell.toml".into()) },
            sentence: "The gains explain the motion.".into(),
            parameters: vec![stiffness],
            not_identifiable: vec![["payload".into(), "no clip holds still under load".into()]],
            errors: vec![Error {
                name: "joints, held out".into(),
                unit: "rad".into(),
                before: Some(2e-3),
                after: 1e-4,
            }],
            clips: vec![Clip { file: "clip_07.mcap".into(), used: "held out".into(), ..Clip::default() }],
            convergence: vec![[15.0, 4e4], [60.0, 900.0]],
            names: vec!["stiffness 1".into(), "damping 1".into()],
            correlation: vec![vec![1.0, -0.4], vec![-0.4, 1.0]],
            clip_error: ["joint error (RMS)", "rad"],
            advice: vec!["Move joint 7 faster.".into()],
            notes: vec!["The clock of clip_03 jumped.".into()],
            provenance: vec![["optimiser".into(), "least squares".into()]],
            theta_file: Some("theta.toml".into()),
            traces: vec![Trace { clip: "clip_07.mcap".into(), channel: "joint7".into(), ..Trace::default() }],
        }
    }

    #[test]
    fn the_page_shows_values_doubts_and_where_to_go_on() {
        let page = sheet().page();
        for text in [
            "<h1>The gains explain the motion.</h1>",
            "598 [592, 604] N m/rad",
            "at its lower bound",
            "no clip holds still under load",
            "0.100 mrad",
            "<td>held out</td>",
            "Clip by clip: joint error (RMS)",
            "Move joint 7 faster.",
            "The clock of clip_03 jumped.",
            "twin replay 'monday &amp; &lt;co&gt;' --cell lab/cell.toml --parameters theta.toml",
            "calibration identify arm 'monday &amp; &lt;co&gt;' --cell lab/cell.toml",
        ] {
            assert!(page.contains(text), "no {text}");
        }
        assert_eq!(page.matches("<svg").count(), 5);
    }

    #[test]
    fn an_empty_sheet_is_still_a_page() {
        assert!(Sheet::default().page().contains("</html>"));
    }
}
