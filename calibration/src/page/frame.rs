//! The frame of every page: one HTML file that opens anywhere, without network and without scripts, by day, by night, on paper.

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");

/// A page around its body. `origin`: how it came about, for the foot.
pub(crate) fn frame(title: &str, origin: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "twinalign: " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (body)
                footer { "twinalign " (env!("CARGO_PKG_VERSION")) ". " (origin) }
            }
        }
    };
    page.into_string()
}

/// A sentence whose numbers stay with their units when it is broken into lines.
pub(crate) fn unbroken(sentence: &str) -> String {
    let mut out = String::with_capacity(sentence.len());
    for c in sentence.chars() {
        let after_number = out.ends_with(|last: char| last.is_ascii_digit());
        out.push(if c == ' ' && after_number { '\u{a0}' } else { c });
    }
    out.replace("N m", "N\u{a0}m")
}

/// A figure under its heading, with a line that says how to read it.
pub(crate) fn figure(heading: &str, reading: &str, picture: &Markup) -> Markup {
    html! {
        section {
            h2 { (heading) }
            @if !reading.is_empty() { p.note { (reading) } }
            figure { (picture) }
        }
    }
}

/// What the colours mean: class (`before`, `after`, `data`, `band`, `floor`) and words.
pub(crate) fn legend(entries: &[(&str, &str)]) -> Markup {
    html! {
        div.legend {
            @for (class, words) in entries { span { i class=(class) {} (words) } }
        }
    }
}

/// What to record next: the sentence, commands as they can be typed, and motions to be played.
pub(crate) fn next_clip(sentence: &str, commands: &[String], motions: &[String]) -> Markup {
    html! {
        @if !sentence.is_empty() {
            section {
                h2 { "The next clip" }
                p.next { (sentence) }
                @if !commands.is_empty() { pre { code { (commands.join("\n")) } } }
                @if !motions.is_empty() { ul { @for motion in motions { li { (motion) } } } }
            }
        }
    }
}

/// What a reader has to know, a sentence each.
pub(crate) fn worth_knowing(warnings: &[String]) -> Markup {
    html! {
        @if !warnings.is_empty() { section { h2 { "Worth knowing" } @for warning in warnings { p { (warning) } } } }
    }
}

/// Figures to remember, each with what it is.
pub(crate) fn facts(entries: &[(String, &str)]) -> Markup {
    html! {
        div.facts {
            @for (value, what) in entries { div { b { (value) } span { (what) } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_opens_without_network_and_without_scripts() {
        let body = figure("a < b", "read it so", &legend(&[("before", "the twin as it was")]));
        let page = frame("test", "made by a test", &html! { (body) (facts(&[("1 mm".into(), "held out")])) });
        for outside in ["http:", "https:", "<script", "<link", "@import", "url("] {
            assert!(!page.contains(outside), "{outside} in the page");
        }
        assert!(
            page.contains("a &lt; b") && page.contains("prefers-color-scheme: dark") && page.contains("@media print")
        );
    }
}
