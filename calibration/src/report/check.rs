//! What the doctor of a recording says: one page, and lines for a terminal.

use crate::check::good_for::VERBS;
use crate::check::picture::Picture;
use crate::check::remark::Size;
use crate::check::session::ClipFacts;
use crate::check::{Checked, Remark, Severity};
use crate::page::figure::chart::{Chart, Line};
use crate::page::frame::{facts, frame, legend, unbroken};
use maud::{Markup, html};

/// Width and height of a picture.
const SIZE: [f64; 2] = [900.0, 210.0];

/// How a severity is called and coloured.
fn severity(severity: Severity) -> (&'static str, &'static str) {
    match severity {
        Severity::Wrong => ("cannot be", "mark possible"),
        Severity::Warning => ("warning", "mark named"),
        Severity::Note => ("note", "mark out"),
    }
}

/// The whole in one sentence.
pub fn sentence(found: &Checked) -> String {
    let count = |wanted: Severity| found.remarks.iter().filter(|remark| remark.severity == wanted).count();
    let [wrong, warnings, notes] = [Severity::Wrong, Severity::Warning, Severity::Note].map(count);
    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let clips = counted(found.clips.len(), "clip");
    let (warnings_in_words, notes_in_words) = (counted(warnings, "warning"), counted(notes, "note"));
    match (wrong, warnings, notes) {
        (0, 0, 0) => format!("{clips}, no problems found"),
        (0, 0, _) => format!("{notes_in_words} on {clips}; no errors in units, order, sign or clocks"),
        (0, ..) => {
            format!("{warnings_in_words} and {notes_in_words} on {clips}; no errors in units, order, sign or clocks")
        }
        (wrong, ..) => {
            format!("the data cannot be right: {wrong} of {} remarks on {clips}; fix these first", found.remarks.len())
        }
    }
}

fn size(size: &Size) -> String {
    let number = crate::words::quantity::short;
    let [lo, hi] = size.interval;
    let interval = if lo == hi { String::new() } else { format!(" [{}, {}]", number(lo), number(hi)) };
    let unit = if size.unit == "1" { String::new() } else { format!(" {}", size.unit) };
    format!("{}{interval}{unit}", number(size.value))
}

/// Lines for a terminal, the sentence last.
pub fn words(found: &Checked) -> String {
    let mut lines = vec![format!("origin: {}", found.origin)];
    for remark in &found.remarks {
        lines.push(format!(
            "{}, {}: {}: {}",
            severity(remark.severity).0,
            remark.fault.key(),
            remark.clips_in_words(),
            remark.what
        ));
        if let Some(how_large) = &remark.size {
            lines.push(format!("    size: {}", size(how_large)));
        }
        if !remark.remedy.is_empty() {
            lines.push(format!("    fix: {}", remark.remedy));
        }
    }
    let wide = |clip: &&ClipFacts| clip.lag.is_some_and(|lag| lag.tells_neither());
    for clip in found.clips.iter().filter(wide) {
        let [_, from, to] = clip.lag.map_or_else(Default::default, |lag| {
            import::lag::milliseconds([lag.seconds, lag.interval[0], lag.interval[1]])
        });
        lines.push(format!(
            "{}: this motion does not tell whether the arm leads its commands or follows them: any lag from {from} to {to} ms fits",
            clip.file
        ));
    }
    for clip in found.clips.iter().filter(|clip| !clip.lag_groups.is_empty()) {
        lines.push(format!("{}: the joints do not lag alike: {}", clip.file, import::lag::in_words(&clip.lag_groups)));
    }
    for (number, verb) in VERBS.into_iter().enumerate() {
        let good = found.clips.iter().filter(|clip| clip.good_for[number].good).count();
        if good > 0 {
            lines.push(format!("{verb}: {good} of {} clips are good for it", found.clips.len()));
        }
    }
    lines.extend(found.missing.iter().map(|missing| format!("{}: {}", missing.verb, missing.why)));
    lines.push(sentence(found));
    lines.join("\n")
}

pub fn page(found: &Checked) -> String {
    let body = html! {
        p.kicker { "The recording " b { (found.session) } }
        h1 { (unbroken(&sentence(found))) }
        p { "Recorded: " (found.origin) "." }
        (overview(found))
        @if !found.remarks.is_empty() { (remarks(&found.remarks)) }
        @for picture in &found.pictures { (drawn(picture)) }
        (clips(&found.clips))
        @if !found.missing.is_empty() { (missing(found)) }
    };
    frame(&format!("check of {}", found.session), &found.files.command("calibration check").to_string(), &body)
}

fn overview(found: &Checked) -> Markup {
    let seconds: f64 = found.clips.iter().filter_map(|clip| clip.seconds).sum();
    facts(&[
        (found.clips.len().to_string(), "clips"),
        (format!("{seconds:.1} s"), "recorded"),
        (found.remarks.len().to_string(), "remarks"),
    ])
}

fn remarks(all: &[Remark]) -> Markup {
    html! {
        section {
            h2 { "Remarks" }
            p.note { "What matters most stands first; alignment, order, sign and units before anything that is explained by them." }
            table {
                tr { th { "" } th { "what, and where" } th { "how large, and what to do" } }
                @for remark in all {
                    @let (word, class) = severity(remark.severity);
                    tr {
                        td.nowrap { span class=(class) { (word) } small { (remark.fault.key()) } }
                        td.wide { (unbroken(&remark.what)) small { (remark.clips_in_words()) ", " code { (remark.channel) } (moment(remark)) } }
                        td.wide {
                            @if let Some(how_large) = &remark.size { b { (size(how_large)) } br; }
                            (unbroken(&remark.remedy))
                        }
                    }
                }
            }
        }
    }
}

fn moment(remark: &Remark) -> String {
    remark.at_s.map_or_else(String::new, |at| format!(", at {at:.3} s"))
}

fn drawn(picture: &Picture) -> Markup {
    let lines: Vec<Line> = picture.lines.iter().map(|(class, _, points)| Line { class, points }).collect();
    let chart = Chart {
        title: &picture.title,
        x: picture.x,
        unit: picture.unit,
        lines: &lines,
        band: None,
        logarithmic: false,
        size: SIZE,
    };
    let named: Vec<(&str, &str)> =
        picture.lines.iter().filter(|(_, name, _)| !name.is_empty()).map(|(class, name, _)| (*class, *name)).collect();
    html! {
        section {
            h2 { (picture.heading) }
            p.note { (picture.reading) }
            figure { (chart.draw()) }
            (legend(&named))
        }
    }
}

/// Clip by verb; reasons stand below, each once.
fn clips(all: &[ClipFacts]) -> Markup {
    let rate = |rate: Option<f64>| rate.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.0}"));
    let mut reasons: Vec<&str> = Vec::new();
    for fitness in all.iter().flat_map(|clip| &clip.good_for).filter(|fitness| !fitness.good) {
        if !reasons.contains(&fitness.why.as_str()) {
            reasons.push(&fitness.why);
        }
    }
    let number = |why: &str| reasons.iter().position(|reason| *reason == why).map_or(0, |place| place + 1);
    html! {
        section {
            h2 { "What each clip is good for" }
            p.note { "By the rules by which each verb admits clips; numbers stand for the reasons below. Hz: measured joints / commands / object poses." }
            table {
                tr { th { "clip" } th { "origin" } th.n { "s" } th { "Hz" } th.n { "lag" } @for verb in VERBS { th { (verb) } } }
                @for clip in all {
                    tr {
                        td { (clip.file) }
                        td { (clip.origins) }
                        td.n { @if let Some(seconds) = clip.seconds { (format!("{seconds:.1}")) } @else { "-" } }
                        td.nowrap { (clip.rates_hz.map(rate).join(" / ")) }
                        td.n { @if let Some(lag) = clip.lag { (format!("{:.0} ms", lag.seconds * 1e3)) } @else { "-" } }
                        @for fitness in &clip.good_for {
                            td { @if fitness.good { b { "yes" } } @else { "no (" (number(&fitness.why)) ")" } }
                        }
                    }
                }
            }
            @if !reasons.is_empty() { ol { @for reason in &reasons { li { (unbroken(reason)) } } } }
        }
    }
}

fn missing(found: &Checked) -> Markup {
    html! {
        section {
            h2 { "What is missing for which verb" }
            dl { @for missing in &found.missing { dt { (missing.verb) } dd { (unbroken(&missing.why)) } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::good_for::Fitness;
    use crate::check::remark::Fault;
    use crate::page::canvas::tests::assert_well_formed;
    use shared_mem::cell::ClipKind;
    use shared_mem::origin::Origin;
    use shared_mem::recording::SessionFiles;

    fn found(remarks: Vec<Remark>) -> Checked {
        let fitness =
            |(number, verb): (usize, &'static str)| Fitness { verb, good: number == 0, why: "no <arm>".into() };
        let clip = ClipFacts {
            file: "clip_00.mcap".into(),
            kind: ClipKind::Excitation,
            origins: Origin::import("<b>\x1b.csv", "CSV").into(),
            seconds: Some(6.0),
            rates_hz: [Some(1000.0), None, None],
            lag: None,
            lag_groups: vec![],
            good_for: VERBS.into_iter().enumerate().map(fitness).collect(),
        };
        let picture = Picture {
            heading: "Stamps",
            reading: "so".into(),
            title: "clip_00.mcap".into(),
            x: "time [s]",
            unit: "s",
            lines: vec![("after", "measured", vec![[0.0, 1e-3], [1.0, f64::NAN], [2.0, 9e-3]])],
        };
        let files = SessionFiles { session: "my monday".into(), cell: Some("the cell.toml".into()) };
        Checked {
            object: None,
            session: "monday".into(),
            origin: "the simulation & more".into(),
            files,
            remarks,
            clips: vec![clip],
            missing: Vec::new(),
            pictures: vec![picture],
        }
    }

    #[test]
    fn the_page_shows_every_remark_with_size_place_and_remedy_and_escapes_what_files_say() {
        let remark = Remark::new(Fault::JointSign, "clip_<0>.mcap", "joint 2", "turned <round>")
            .sized(Size { value: 0.5, interval: [0.4, 0.6], unit: "rad" })
            .mended_by("turn it back")
            .at(1.25);
        let page = page(&found(vec![remark]));
        for text in [
            "joint_sign",
            "clip_&lt;0&gt;",
            "turned &lt;round&gt;",
            "0.5",
            "[0.4",
            "turn it back",
            "at 1.250 s",
            "no &lt;arm&gt;",
            "the simulation &amp; more",
            "&lt;b&gt;\\u{1b}.csv",
            "cannot be",
        ] {
            assert!(page.contains(text), "no {text}");
        }
        let svg = page.split("<svg").nth(1).and_then(|rest| rest.split("</svg>").next()).expect("a picture");
        assert_well_formed(&format!("<svg{svg}</svg>"));
    }

    #[test]
    fn the_terminal_ends_with_whether_the_data_can_mean_what_they_say() {
        assert!(words(&found(Vec::new())).ends_with("1 clip, no problems found"));
        let wrong = Remark::new(Fault::StampUnit, "a", "stamps", "ms").mended_by("ns");
        let text = words(&found(vec![wrong]));
        assert!(text.contains("cannot be, stamp_unit: a: ms\n    fix: ns\n"), "{text}");
        assert!(text.contains("replay: 1 of 1 clips") && text.contains("the data cannot be right: 1 of 1"), "{text}");
    }
}
