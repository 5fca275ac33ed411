//! The page of a diagnosis: what a tired engineer reads in a minute, from the sentence down to where every number came from.

mod candidates;
mod gap;
mod robot;
mod witnesses;

pub(super) use candidates::sizes;
pub(super) use gap::is_known;

use crate::answer::diagnosis::{Basis, Diagnosis, Kind, NextMotion, Verdict};
use crate::page::figure::where_map::{Cell, where_map};
use crate::page::frame::{facts, figure, frame, next_clip, unbroken, worth_knowing};
use crate::page::trace::gallery;
use crate::words::share::{percent_interval, probability};
use crate::words::words;
use maud::{Markup, html};

/// Clips whose residuals are shown.
const SHOWN_CLIPS: usize = 3;

pub fn page(diagnosis: &Diagnosis) -> String {
    let motions: Vec<String> = diagnosis.next_motions.iter().map(NextMotion::in_words).collect();
    let body = html! {
        (head(diagnosis))
        @if gap::is_known(diagnosis) {
            (figure("How large the gap is, and how far it shrinks", gap::reading(diagnosis), &gap::picture(diagnosis)))
        }
        @if !diagnosis.places.is_empty() {
            (figure("Where it lies", "Share of the squared gap in each stage, channel and regime.", &map(diagnosis)))
        }
        @if !diagnosis.gap.joints.is_empty() { (gap::joints(diagnosis)) }
        @if let Some(test) = &diagnosis.stage_test {
            section { h2 { "The arm's, or the object's" } p { (test.text) } }
        }
        (witnesses::section(&diagnosis.witnesses))
        @if !diagnosis.traces.is_empty() { (residuals(diagnosis)) }
        @if !diagnosis.candidates.is_empty() { (candidates::sections(&diagnosis.candidates)) }
        @if !diagnosis.remedies.is_empty() { (remedies(diagnosis)) }
        (next_clip(&diagnosis.next_experiment, &diagnosis.next_commands, &motions))
        (worth_knowing(&diagnosis.warnings))
        (origin(diagnosis))
    };
    let command =
        diagnosis.files.command("calibration diagnose").words(&format!("--seed {}", diagnosis.seed)).to_string();
    frame(&format!("diagnosis of {}", diagnosis.session), &command, &body)
}

/// The verdict in a few words.
pub(super) fn verdict_words(diagnosis: &Diagnosis) -> &'static str {
    match diagnosis.verdict.kind {
        Kind::None => "no gap beyond the noise",
        Kind::Named => "cause named",
        Kind::Class => "one of several causes",
        Kind::Unexplained => "cause unknown",
        // More time would tell, and no other clips are needed.
        Kind::NotTestable if diagnosis.budget_spent => "time is up",
        Kind::NotTestable => "not testable",
    }
}

/// How sure a verdict is, and what that figure is; nothing where there is nothing to be sure of.
pub(super) fn confidence(verdict: &Verdict) -> Option<(String, &'static str)> {
    let value = probability(verdict.confidence);
    match verdict.basis() {
        Basis::Estimate => Some((value, "estimated from these clips")),
        Basis::Limit => Some((value, "so many such verdicts were right on simulated sessions; more is never claimed")),
        Basis::Rate => {
            Some((value, "so many such verdicts were right on simulated sessions; these clips are not in that figure"))
        }
        Basis::Nothing => None,
    }
}

/// Names of effects that act together, as words.
pub(super) fn together(effects: &[String]) -> String {
    effects.iter().map(|effect| words(effect)).collect::<Vec<_>>().join(" and ")
}

/// Whether an effect was added, so that there is an after.
pub(super) fn has_effects(diagnosis: &Diagnosis) -> bool {
    matches!(diagnosis.verdict.kind, Kind::Named | Kind::Class) && !diagnosis.verdict.effects.is_empty()
}

fn head(diagnosis: &Diagnosis) -> Markup {
    let (verdict, gap) = (&diagnosis.verdict, &diagnosis.gap);
    let mut entries: Vec<(String, &str)> = Vec::new();
    if has_effects(diagnosis) {
        entries.push((percent_interval(gap.shrink.value, gap.shrink.ci90), "shrink of the gap (90 % interval)"));
    }
    let nearest = diagnosis.nearest.as_ref().map(|nearest| {
        let shrink = percent_interval(nearest.shrink.value, nearest.shrink.ci90);
        (shrink, format!("shrink of the gap with {}, which leaves more than a cause does", together(&nearest.effects)))
    });
    entries.extend(nearest.iter().map(|(shrink, what)| (shrink.clone(), what.as_str())));
    let sure = confidence(verdict).map(|(value, what)| (value, format!("confidence: {what}")));
    entries.extend(sure.iter().map(|(value, what)| (value.clone(), what.as_str())));
    html! {
        p.kicker { "Diagnosis of " b { (diagnosis.session) } ": " (verdict_words(diagnosis)) }
        h1 { (unbroken(&verdict.text)) }
        @if !entries.is_empty() { (facts(&entries)) }
    }
}

fn map(diagnosis: &Diagnosis) -> Markup {
    let cells: Vec<Cell> = diagnosis
        .places
        .iter()
        .map(|place| Cell { stage: &place.stage, channel: &place.channel, regime: &place.regime, share: place.share })
        .collect();
    where_map(&cells)
}

fn residuals(diagnosis: &Diagnosis) -> Markup {
    let effects = diagnosis.nearest.as_ref().map_or(&diagnosis.verdict.effects, |nearest| &nearest.effects);
    let added = match diagnosis.verdict.kind {
        Kind::Class => format!("with {}", effects.iter().map(|effect| words(effect)).collect::<Vec<_>>().join(" or ")),
        _ => format!("with {}", together(effects)),
    };
    let pictures = gallery(&diagnosis.traces, SHOWN_CLIPS, ["baseline", &added]);
    figure("Residuals on held-out clips: measured less predicted", "The worst channel of the worst clips.", &pictures)
}

fn remedies(diagnosis: &Diagnosis) -> Markup {
    html! {
        section {
            h2 { "What to do about it" }
            table {
                tr { th { "effect" } th { "in the cell" } th { "in a model" } }
                @for remedy in &diagnosis.remedies {
                    tr { td { (words(&remedy.effect)) } td { (remedy.in_cell) } td { (remedy.in_model) } }
                }
            }
        }
    }
}

fn origin(diagnosis: &Diagnosis) -> Markup {
    let clips = &diagnosis.clips;
    let used = [
        ("fitted to", &clips.train),
        ("chosen on", &clips.choose),
        ("held out in turn: gap and shrink", &clips.confirm),
    ];
    html! {
        section {
            h2 { "Where this comes from" }
            dl {
                dt { "session" } dd { code { (diagnosis.session) } }
                dt { "origin" } dd { (diagnosis.origin) }
                @for (what, clips) in used { dt { (what) } dd { (clip_list(clips)) } }
                dt { "seed" } dd { (diagnosis.seed) }
                dt { "took" } dd { (format!("{:.0} s", diagnosis.seconds)) }
            }
            @if let Some(file) = &diagnosis.theta_file {
                p { "The parameters are in " code { (file.display()) } ". Joint and object errors with them, of every clip:" }
                pre { code { (diagnosis.files.command("twin replay").option("--parameters", file)) } }
            }
            details { summary { "theta.toml" } pre { code { (diagnosis.theta.to_toml()) } } }
        }
    }
}

/// How many clips, and which.
fn clip_list(clips: &[String]) -> String {
    let names: Vec<&str> = clips.iter().map(|clip| clip.trim_end_matches(".mcap")).collect();
    match names.len() {
        0 => "none".to_owned(),
        1 => names.join(", "),
        count => format!("{count} clips: {}", names.join(", ")),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::answer::diagnosis::{
        Candidate, Change, Clips, Gap, JointGap, Medians, Nearest, Place, Remedy, Share, Status, Verdict,
    };
    use crate::answer::{Size, Trace};
    use shared_mem::recording::SessionFiles;
    use shared_mem::theta::Theta;
    use std::collections::BTreeMap;

    fn candidate(effect: &str, probability: f64, status: Status) -> Candidate {
        let delay = Size { values: vec![0.0119], ci90: vec![[0.0112, 0.0126]], unit: "s".into() };
        let creep = Size { values: vec![0.002], ci90: vec![[0.002; 2]], unit: "s".into() };
        Candidate {
            effect: effect.into(),
            probability,
            parameters: BTreeMap::from([("delay".to_owned(), delay), ("creep".to_owned(), creep)]),
            shrink: Share { value: 0.81, ci90: [0.76, 0.85] },
            confusable_with: vec!["camera_latency".into()],
            status,
            why: format!("the reason of {effect}"),
        }
    }

    /// A diagnosis that names one effect.
    pub(in crate::report) fn named() -> Diagnosis {
        let before = (0..30).map(|i| [0.1 * f64::from(i), 2.0 + f64::from(i).sin()]).collect();
        let trace = Trace {
            clip: "clip_05.mcap".into(),
            channel: "joint 2".into(),
            unit: "rad".into(),
            sigma: 1.0,
            before,
            after: vec![[0.0, 0.1], [2.9, -0.1]],
        };
        Diagnosis {
            verdict: Verdict {
                kind: Kind::Named,
                effects: vec!["command_delay".into()],
                confidence: 0.97,
                text: "Commands reach the robot 12 ms late <here>.".into(),
                explained_share: None,
                rest: None,
            },
            gap: Gap {
                unit: "sigma",
                before: 38.4,
                after: 1.4,
                floor: 1.0,
                shrink: Share { value: 0.963, ci90: [0.951, 0.972] },
                explainable_fraction: 0.989,
                joint_rms_rad: Change { before: Some(0.00213), after: Some(0.00018) },
                torque_rms: None,
                joints: vec![JointGap { joint: 4, before: 81.0, after: 1.44, floor: 1.0 }],
                object_add_m: Change { before: Some(0.0139), after: Some(0.0012) },
                object_add_s_m: Change::default(),
                median: Medians::default(),
                sensors: Vec::new(),
            },
            nearest: None,
            stage_test: None,
            witnesses: Vec::new(),
            places: vec![Place {
                stage: "control".into(),
                channel: "joint2".into(),
                regime: "reversal".into(),
                share: 0.41,
            }],
            candidates: vec![
                candidate("command_lag", 0.02, Status::Possible),
                candidate("command_delay", 0.97, Status::Named),
                candidate("payload", 0.0, Status::RuledOut),
                candidate("camera_latency", 0.0, Status::NotTestable),
            ],
            next_experiment: "Play a chirp up to 10 Hz.".into(),
            next_motions: Vec::new(),
            origin: "the simulation".into(),
            next_commands: vec![
                "calibration capture excitation --motion chirp".into(),
                "calibration diagnose monday".into(),
            ],
            remedies: vec![Remedy {
                effect: "command_delay".into(),
                in_cell: "Send commands 12 ms earlier.".into(),
                in_model: "Hold them back by 12 ms.".into(),
            }],
            clips: Clips { train: vec!["clip_00.mcap".into(), "clip_01.mcap".into()], ..Clips::default() },
            warnings: Vec::new(),
            budget_spent: false,
            engine: None,
            seconds: 83.2,
            object: None,
            session: "my monday".into(),
            cell: Default::default(),
            files: SessionFiles { session: "my monday".into(), cell: Some("lab/cell.toml".into()) },
            seed: 7,
            theta: Theta::default(),
            theta_file: Some("theta.toml".into()),
            traces: vec![trace],
        }
    }

    #[test]
    fn the_page_answers_what_where_why_how_sure_and_what_next() {
        let html = page(&named());
        let place = |text: &str| html.find(text).unwrap_or_else(|| panic!("no {text} in {html}"));
        let order = [
            "<h1>Commands reach the robot 12\u{a0}ms late &lt;here&gt;.</h1>",
            "96.3 [95.1, 97.2] %",
            "more is never claimed",
            "38.4 \u{3c3}\u{b2}",
            "noise alone: 1.00 \u{3c3}\u{b2}",
            "13.9 mm",
            ">reversal<",
            "<td>4</td><td>9.0</td><td>1.2</td>",
            "clip_05, joint 2",
            "\u{25cf} named",
            "delay 11.9 [11.2, 12.6] ms",
            "\u{25cb} possible",
            "1 ruled out",
            "the reason of payload",
            "could not have shown",
            "the reason of camera_latency",
            "What to do about it",
            "Send commands 12 ms earlier.",
            "Hold them back by 12 ms.",
            "Play a chirp",
            "<pre><code>calibration capture excitation --motion chirp\ncalibration diagnose monday</code></pre>",
            "2 clips: clip_00, clip_01",
            "twin replay 'my monday' --cell lab/cell.toml --parameters theta.toml",
            "calibration diagnose 'my monday' --cell lab/cell.toml --seed 7",
        ];
        for pair in order.windows(2) {
            assert!(place(pair[0]) < place(pair[1]), "{} comes after {}", pair[0], pair[1]);
        }
        assert!(!html.contains("ADD-S"), "what was not measured is not shown");
        assert_eq!(html.matches("98.9 %").count(), 0, "one figure says how far the gap shrinks");
        assert!(html.contains("creep 2.00 ms (default, not fitted)"), "a default is no result");
    }

    #[test]
    fn a_page_without_a_cause_shows_no_after() {
        let mut diagnosis = named();
        diagnosis.verdict = Verdict {
            kind: Kind::None,
            effects: vec![],
            confidence: 0.99,
            text: "No gap.".into(),
            ..diagnosis.verdict
        };
        diagnosis.candidates.retain(|candidate| candidate.status == Status::RuledOut);
        diagnosis.places.clear();
        diagnosis.traces.clear();
        let html = page(&diagnosis);
        assert!(html.contains("no gap beyond the noise") && !html.contains("1.40 \u{3c3}"), "{html}");
        assert!(html.contains("None of them is named or still possible"));
    }

    #[test]
    fn what_comes_nearest_to_an_unknown_cause_is_shown_with_its_shrink() {
        let mut diagnosis = named();
        diagnosis.verdict = Verdict { kind: Kind::Unexplained, effects: vec![], ..diagnosis.verdict };
        let effects = vec!["payload".into(), "joint_viscous_friction".into()];
        diagnosis.nearest = Some(Nearest { effects, shrink: Share { value: 0.84, ci90: [0.8, 0.88] } });
        let html = page(&diagnosis);
        for text in [
            "84 [80, 88] %",
            "with payload and joint viscous friction, which leaves more",
            "so many such verdicts were right",
        ] {
            assert!(html.contains(text), "no {text} in {html}");
        }
    }

    #[test]
    fn what_could_not_be_tested_shows_no_gap_of_zero() {
        let mut diagnosis = named();
        diagnosis.verdict.kind = Kind::NotTestable;
        diagnosis.gap.before = 0.0;
        diagnosis.candidates.clear();
        diagnosis.places.clear();
        let html = page(&diagnosis);
        assert!(
            html.contains("not testable")
                && !html.contains("confidence")
                && !html.contains("How large the gap is")
                && !html.contains("Candidates")
        );
        diagnosis.budget_spent = true;
        let html = page(&diagnosis);
        assert!(html.contains("time is up") && !html.contains("not testable"), "a longer budget would tell");
    }
}
