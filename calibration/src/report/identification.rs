//! The page of an identification: what the clips say about the arm or the object, how sure that is, and what they cannot say.

use super::figure::bars::{Row, bars};
use super::figure::chart::{Chart, Line};
use super::figure::forest::{Group, forest};
use super::figure::matrix::correlations;
use super::frame::{facts, figure, frame, legend, unbroken};
use super::parameters::group;
use super::quantity::{Unit, short};
use super::scale::span;
use super::trace::gallery;
use crate::identify::{Errors, Identification};
use crate::numbers::Numbers;
use maud::{Markup, html};

/// Clips whose residuals are shown.
const SHOWN_CLIPS: usize = 6;

/// The page.
#[must_use]
pub fn page(found: &Identification) -> String {
    let body = html! {
        p.kicker { "Identification of the " (found.target) " from " b { (found.session) } }
        h1 { (unbroken(&sentence(found))) }
        (facts(&errors(found).iter().map(|error| (error.arrow(), error.name)).collect::<Vec<_>>()))
        (figure("What was found", "Dot and bar: value and 95 % interval. Upright line: cell.toml.", &parameters(found)))
        (untold(found))
        (figure("How far off the twin is", "On average over clips.", &error_bars(found)))
        @if !found.traces.is_empty() { (residuals(found)) }
        (by_clip(found))
        @if !found.advice.is_empty() {
            section { h2 { "What to record next" } @for line in &found.advice { p.next { (line) } } }
        }
        (search(found))
        (origin(found))
    };
    let command = format!("calibration identify {} {} --seed {}", found.target, found.session, found.seed);
    frame(&format!("{} of {}", found.target, found.session), &command, &body)
}

/// The finding in one sentence.
#[must_use]
pub fn sentence(found: &Identification) -> String {
    let told: Vec<String> = errors(found)
        .iter()
        .filter_map(|error| {
            let (now, unit) = (error.holdout?, error.unit());
            let instead =
                error.before.map_or_else(String::new, |before| format!(" instead of {}", unit.with_unit(before)));
            Some(format!("{}{instead} ({})", unit.with_unit(now), error.name))
        })
        .collect();
    let doubts = match found.not_identifiable.len() {
        0 => String::new(),
        1 => format!(" {} cannot be told from them.", found.not_identifiable[0].parameter.replace('_', " ")),
        many => format!(" {many} parameters cannot be told from them."),
    };
    if told.is_empty() {
        return format!("No clip was held out, so how far off the twin is elsewhere is not known.{doubts}");
    }
    format!("On clips never used the twin is now off by {}.{doubts}", told.join(", "))
}

/// One kind of error.
pub(super) struct Error {
    /// Which.
    pub(super) name: &'static str,
    si: &'static str,
    before: Option<f64>,
    train: Option<f64>,
    holdout: Option<f64>,
}

impl Error {
    fn unit(&self) -> Unit {
        let values = [self.before, self.train, self.holdout];
        Unit::suited(self.si, span(values.into_iter().flatten())[1])
    }

    /// Held out, before and after.
    pub(super) fn arrow(&self) -> String {
        let unit = self.unit();
        let before = self.before.map_or_else(String::new, |before| format!("{} \u{2192} ", short(unit.scaled(before))));
        format!("{before}{}", unit.with_unit(self.holdout.or(self.train).unwrap_or(f64::NAN)))
    }
}

/// One kind of error out of all.
type Pick = fn(&Errors) -> Option<f64>;

/// The kinds of error that were measured.
pub(super) fn errors(found: &Identification) -> Vec<Error> {
    let kinds: [(&str, &str, Pick); 3] = [
        ("joint RMS", "rad", |errors| errors.joint_rms_rad),
        ("ADD", "m", |errors| errors.object_add_m),
        ("ADD-S", "m", |errors| errors.object_add_s_m),
    ];
    let gap = &found.gap;
    kinds
        .into_iter()
        .map(|(name, si, of)| Error {
            name,
            si,
            before: of(&gap.before),
            train: of(&gap.train),
            holdout: of(&gap.holdout),
        })
        .filter(|error| error.train.or(error.holdout).is_some())
        .collect()
}

/// A remark on the `k`-th number of a parameter, where one is due.
pub(super) fn warning(found: &Identification, parameter: &str, k: usize) -> Option<String> {
    let hit = found.at_bound.iter().find(|hit| hit.parameter == parameter && hit.index == k)?;
    Some(format!("at the bound {} of the search", short(hit.bound)))
}

fn parameters(found: &Identification) -> Markup {
    let named: Vec<(String, &String, &Numbers)> =
        found.parameters.iter().map(|(name, numbers)| (name.replace('_', " "), name, numbers)).collect();
    let groups: Vec<Group> = named
        .iter()
        .map(|(heading, name, numbers)| {
            let nominal = found.nominal.get(*name).map_or(&[][..], Vec::as_slice);
            group(heading, numbers, nominal, |k| warning(found, name, k))
        })
        .collect();
    forest(&groups)
}

fn untold(found: &Identification) -> Markup {
    html! {
        @if !found.not_identifiable.is_empty() {
            section {
                h2 { "What these clips cannot tell" }
                dl { @for one in &found.not_identifiable { dt { (one.parameter.replace('_', " ")) } dd { (one.why) } } }
            }
        }
    }
}

fn error_bars(found: &Identification) -> Markup {
    let errors = errors(found);
    let value = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let rows: Vec<Row> = errors
        .iter()
        .map(|e| Row {
            name: e.name,
            unit: e.si,
            values: [e.before, e.holdout, e.train].map(value).to_vec(),
            floor: None,
        })
        .collect();
    html! {
        (legend(&[
            ("before", "cell.toml, on clips never used"),
            ("after", "what was found, on clips never used"),
            ("band", "what was found, on fitted clips"),
        ]))
        (bars(&["before", "after", "band"], &rows))
    }
}

fn residuals(found: &Identification) -> Markup {
    let pictures = gallery(&found.traces, SHOWN_CLIPS, ["twin with cell.toml", "twin with what was found"]);
    figure("Measured less predicted", "The worst channel of the worst clips.", &pictures)
}

fn by_clip(found: &Identification) -> Markup {
    let si = if found.target == "object" { "m" } else { "rad" };
    let unit = Unit::suited(si, span(found.by_clip.iter().filter_map(|clip| clip.before.or(clip.after)))[1]);
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| unit.with_unit(value));
    let used = |file: &String| match () {
        () if found.clips.train.contains(file) => "fitted",
        () if found.clips.holdout.contains(file) => "held out",
        () => "left out",
    };
    html! {
        @if !found.by_clip.is_empty() {
            section {
                h2 { "Clip by clip" }
                table {
                    tr { th { "clip" } th { "used" } th.n { "cell.toml" } th.n { "found" } th { "remark" } }
                    @for clip in &found.by_clip {
                        tr {
                            td { (clip.file.trim_end_matches(".mcap")) }
                            td { (used(&clip.file)) }
                            td.n { (shown(clip.before)) }
                            td.n { (shown(clip.after)) }
                            td { (clip.remark) }
                        }
                    }
                }
            }
        }
    }
}

fn search(found: &Identification) -> Markup {
    let lines = [Line { class: "after", points: &found.convergence }];
    let size = [600.0, 200.0];
    let chart =
        Chart { title: "best loss", x: "evaluations", unit: "1", lines: &lines, band: None, logarithmic: true, size };
    let reading = "In hundredths. Numbers that hang together closely (near \u{b1}100) are not told apart, only their combination is.";
    let correlation = &found.correlation;
    html! {
        @if correlation.names.len() > 1 {
            (figure("Which numbers hang together", reading, &correlations(&correlation.names, &correlation.values)))
        }
        @if found.convergence.len() > 1 { (figure("How the search went", "", &chart.draw())) }
    }
}

fn origin(found: &Identification) -> Markup {
    html! {
        section {
            h2 { "Where this comes from" }
            dl {
                dt { "session" } dd { code { (found.session) } }
                dt { "clips" } dd { (found.clips.train.len()) " fitted, " (found.clips.holdout.len()) " held out" }
                dt { "search" } dd { (found.optimizer) ", " (found.evaluations) " simulated clips, seed " (found.seed) }
                dt { "took" } dd { (format!("{:.1} s", found.seconds)) }
            }
            @if let Some(file) = &found.theta_file {
                p { "The parameters are in " code { (file.display()) } ". The gap with them, clip by clip:" }
                pre { code { "twin replay " (found.session) " --parameters " (file.display()) } }
            }
            details { summary { "theta.toml" } pre { code { (found.theta.to_toml()) } } }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::identify::{AtBound, ClipError, Clips, Correlation, Gap, NotIdentifiable};
    use crate::numbers::Per;
    use crate::report::Trace;
    use std::collections::BTreeMap;

    /// An identification with something of everything.
    pub(in crate::report) fn arm() -> Identification {
        let values = vec![598.0, 40.0];
        let intervals = values.iter().map(|k| [0.99 * k, 1.01 * k]).collect();
        let stiffness = Numbers { values, intervals, unit: "N m/rad".into(), per: Per::Joint, ..Numbers::default() };
        let rms = |value| Errors { joint_rms_rad: Some(value), ..Errors::default() };
        let clip = ClipError { file: "clip_07.mcap".into(), remark: "a pause".into(), ..ClipError::default() };
        Identification {
            target: "arm",
            parameters: BTreeMap::from([("stiffness".into(), stiffness)]),
            nominal: BTreeMap::from([("stiffness".into(), vec![600.0, 50.0])]),
            at_bound: vec![AtBound { parameter: "stiffness".into(), index: 1, bound: 40.0 }],
            not_identifiable: vec![NotIdentifiable { parameter: "tip_friction".into(), why: "never touched".into() }],
            gap: Gap { train: rms(1e-4), holdout: rms(1.1e-4), before: rms(2.13e-3) },
            clips: Clips { train: vec![], holdout: vec!["clip_07.mcap".into()] },
            by_clip: vec![clip],
            convergence: vec![[15.0, 4e4], [60.0, 900.0]],
            correlation: Correlation {
                names: vec!["stiffness[0]".into(), "stiffness[1]".into()],
                values: vec![vec![1.0, -0.4], vec![-0.4, 1.0]],
            },
            advice: vec!["Move joint 7 faster.".into()],
            optimizer: "least-squares".into(),
            session: "monday & <co>".into(),
            theta_file: Some("theta.toml".into()),
            traces: vec![Trace { clip: "clip_07.mcap".into(), channel: "joint7".into(), ..Trace::default() }],
            ..Identification::default()
        }
    }

    #[test]
    fn the_page_tells_values_doubts_and_where_to_go_on() {
        let page = page(&arm());
        for text in [
            "off by 0.110\u{a0}mrad instead of 2.13\u{a0}mrad (joint RMS). tip friction cannot be told",
            "598 [592, 604] N m/rad",
            "at the bound 40.0 of the search",
            "never touched",
            "2.13 \u{2192} 0.110 mrad",
            "<td>held out</td>",
            "Move joint 7 faster.",
            "twin replay monday &amp; &lt;co&gt; --parameters theta.toml",
        ] {
            assert!(page.contains(text), "no {text} in {page}");
        }
        assert_eq!(page.matches("<svg").count(), 5);
    }

    #[test]
    fn an_empty_answer_is_still_a_page() {
        let nothing = Identification::default();
        assert!(page(&nothing).contains("</html>"));
        assert!(sentence(&nothing).starts_with("No clip was held out"));
    }
}
