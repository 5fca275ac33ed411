//! The candidates: those in question as a table, those ruled out folded away, those that could not have been seen by name.

use crate::answer::diagnosis::{Candidate, Status};
use crate::answer::{Size, numbers};
use crate::diagnose::judge::confidence::MAX_PROBABILITY;
use crate::page::canvas::Canvas;
use crate::page::figure::forest::{Group, forest};
use crate::words::parameters::Numbers;
use crate::words::share::{limited, percent_interval, probability};
use crate::words::words;
use maud::{Markup, html};

/// Width of a probability's bar.
const BAR: f64 = 90.0;

/// All candidates, by what became of them.
pub(super) fn sections(candidates: &[Candidate]) -> Markup {
    let with = |wanted: &[Status]| -> Vec<&Candidate> {
        let mut found: Vec<&Candidate> = candidates.iter().filter(|c| wanted.contains(&c.status)).collect();
        found.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        found
    };
    let open = with(&[Status::Named, Status::Possible]);
    let out = with(&[Status::RuledOut]);
    let blind = with(&[Status::NotTestable]);
    html! {
        section {
            h2 { "Candidates" }
            p.note {
                (candidates.len()) " effects were tested; intervals are to hold the truth in 90 % of cases. The shrink of an effect \
                is what it adds, alone or beside those named before it. No probability is given beyond " (probability(MAX_PROBABILITY))
                ": a cause outside of the library is never excluded."
            }
            @if open.is_empty() { p { "None of them is named or still possible." } } @else { (table(&open)) }
            @for candidate in open.iter().filter(|candidate| candidate.status == Status::Named) { (joints(candidate)) }
            @if !out.is_empty() { (folded(&out)) }
        }
        @if !blind.is_empty() { (unseen(&blind)) }
    }
}

fn table(candidates: &[&Candidate]) -> Markup {
    html! {
        table {
            tr { th { "effect" } th { "probability" } th { "size" } th { "shrink" } th { "why" } }
            @for candidate in candidates {
                tr.lead {
                    td { (words(&candidate.effect)) (mark(candidate.status)) }
                    td.nowrap { (bar(candidate.probability)) }
                    td.wide { @for line in sizes(candidate) { div { (line) } } }
                    td.nowrap { (shrink(candidate)) }
                    td { (candidate.why) (confusable(candidate)) }
                }
            }
        }
    }
}

/// The numbers of a named effect one by one, where they are many.
fn joints(candidate: &Candidate) -> Markup {
    let many = candidate.parameters.iter().filter(|(_, size)| size.values.len() > 1 && fitted(size));
    let named: Vec<(String, Numbers, &Size)> =
        many.map(|(name, size)| (words(name), numbers(&candidate.effect, name, size), size)).collect();
    let not_fitted = |size: &Size, k| (!size.is_fitted(k)).then(|| "not fitted".to_owned());
    let groups: Vec<Group> =
        named.iter().map(|(heading, numbers, size)| numbers.group(heading, &[], |k| not_fitted(size, k))).collect();
    html! {
        @if !groups.is_empty() {
            figure { figcaption { "Size of " (words(&candidate.effect)) } (forest(&groups)) }
        }
    }
}

/// The parameters of a candidate, one a line, with what was not fitted marked so.
pub(in crate::report) fn sizes(candidate: &Candidate) -> Vec<String> {
    let line = |(name, size): (&String, &Size)| {
        let line = numbers(&candidate.effect, name, size).line();
        if fitted(size) { line } else { format!("{line} (default, not fitted)") }
    };
    candidate.parameters.iter().map(line).collect()
}

fn fitted(size: &Size) -> bool {
    (0..size.values.len()).any(|k| size.is_fitted(k))
}

/// What it adds to the shrink; nothing where it was not fitted.
fn shrink(candidate: &Candidate) -> String {
    if candidate.parameters.is_empty() {
        return "not fitted".into();
    }
    percent_interval(candidate.shrink.value, candidate.shrink.ci90)
}

fn mark(status: Status) -> Markup {
    let (class, word) = match status {
        Status::Named => ("mark named", "\u{25cf} named"),
        Status::Possible => ("mark possible", "\u{25cb} possible"),
        Status::RuledOut => ("mark out", "\u{2715} ruled out"),
        Status::NotTestable => ("mark out", "? not testable"),
    };
    html! { small { span class=(class) { (word) } } }
}

fn bar(value: f64) -> Markup {
    let mut canvas = Canvas::new();
    canvas.rect("track", [0.0, 2.0], [BAR, 9.0]);
    canvas.rect("after", [0.0, 2.0], [BAR * value.clamp(0.0, 1.0), 9.0]);
    let words = limited(value, MAX_PROBABILITY);
    html! { div { (words) } (canvas.finish([BAR, 13.0], &words)) }
}

fn confusable(candidate: &Candidate) -> Markup {
    let others: Vec<String> = candidate.confusable_with.iter().map(|effect| words(effect)).collect();
    html! { @if !others.is_empty() { small { "Looks like: " (others.join(", ")) } } }
}

fn folded(candidates: &[&Candidate]) -> Markup {
    html! {
        details {
            summary { (candidates.len()) " ruled out, with the reason" }
            table {
                tr { th { "effect" } th { "shrink" } th { "why not" } }
                @for candidate in candidates {
                    tr {
                        td { (words(&candidate.effect)) }
                        td.nowrap { (shrink(candidate)) }
                        td { (candidate.why) }
                    }
                }
            }
        }
    }
}

fn unseen(candidates: &[&Candidate]) -> Markup {
    html! {
        section {
            h2 { "What these clips could not have shown" }
            p.note { "Not seen is not the same as not there." }
            dl { @for candidate in candidates { dt { (words(&candidate.effect)) } dd { (candidate.why) } } }
        }
    }
}
