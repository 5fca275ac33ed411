//! The page of a comparison of two sessions: what changed, by how much, and what would have been seen.

use crate::answer::diagnosis::{Kind, Status};
use crate::diagnose::against::change::{rows, smallest_in_words};
use crate::diagnose::against::{Candidate, Comparison};
use crate::diagnose::judge::confidence::MAX_PROBABILITY;
use crate::page::figure::bars::{Row, bars};
use crate::page::frame::{facts, figure, frame, legend, next_clip, unbroken, worth_knowing};
use crate::words::share::{limited, percent_interval, probability};
use crate::words::words;
use maud::{Markup, html};

pub fn page(found: &Comparison) -> String {
    let body = html! {
        (head(found))
        (gap(found))
        (changes(found))
        (others(found))
        (next_clip(&found.next_experiment, &found.next_commands, &[]))
        (worth_knowing(&found.warnings))
        (origin(found))
    };
    let [a, b] = &found.files;
    let command = a.command("calibration diagnose").option("--against", &b.session);
    frame(
        &format!("{} against {}", found.session, found.against),
        &command.words(&format!("--seed {}", found.seed)).to_string(),
        &body,
    )
}

/// The verdict in a few words.
pub(super) fn verdict_words(kind: Kind) -> &'static str {
    match kind {
        Kind::None => "nothing changed",
        Kind::Named => "change named",
        Kind::Class => "one of several changes",
        Kind::Unexplained => "change unknown",
        Kind::NotTestable => "not testable",
    }
}

fn head(found: &Comparison) -> Markup {
    let verdict = &found.verdict;
    let mut entries = vec![(probability(verdict.confidence), "confidence")];
    if matches!(verdict.kind, Kind::Named | Kind::Class) {
        let shrink = percent_interval(found.gap.shrink.value, found.gap.shrink.ci90);
        entries.insert(0, (shrink, "of B's squared gap under A's model closes (90 % interval)"));
    }
    html! {
        p.kicker { "A: " b { (found.session) } ", B: " b { (found.against) } ": " (verdict_words(verdict.kind)) }
        h1 { (unbroken(&verdict.text)) }
        (facts(&entries))
    }
}

fn gap(found: &Comparison) -> Markup {
    let gap = &found.gap;
    let unit = "\u{3c3}\u{b2}";
    let row = |name, values: Vec<f64>| Row { name, unit, values, floor: Some(gap.floor) };
    let both = matches!(found.verdict.kind, Kind::Named | Kind::Class);
    let of_b = if both { vec![gap.before, gap.after] } else { vec![gap.before] };
    let rows = [row("A", vec![found.gap_of_a]), row("B", of_b)];
    let entries = [("before", "A's model"), ("after", "with what changed"), ("floor", "what noise alone leaves")];
    let picture = html! {
        @if both { (legend(&entries)) } @else { (legend(&[entries[0], entries[2]])) }
        (bars(&["before", "after"], &rows))
    };
    figure("How large the gap is", "Mean squared residual of held-out clips, in units of the noise.", &picture)
}

fn changes(found: &Comparison) -> Markup {
    let open = |candidate: &&Candidate| matches!(candidate.status, Status::Named | Status::Possible);
    let candidates: Vec<&Candidate> = found.candidates.iter().filter(open).collect();
    html! {
        @if !candidates.is_empty() {
            section {
                h2 { "What changed" }
                @for candidate in candidates {
                    h3 { (words(&candidate.name)) }
                    p { (limited(candidate.probability, MAX_PROBABILITY)) ": " (candidate.why) ". "
                        @if !candidate.confusable_with.is_empty() {
                            "Looks like: " (candidate.confusable_with.iter().map(|name| words(name)).collect::<Vec<_>>().join(", ")) "."
                        }
                    }
                    table {
                        tr { th { "number" } th { "in A" } th { "in B" } th { "change (95 % interval)" } }
                        @for (name, values) in &candidate.parameters {
                            @for [number, a, b, change] in rows(&candidate.name, name, values) {
                                tr { td { (number) } td.nowrap { (a) } td.nowrap { (b) } td.nowrap { (change) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn others(found: &Comparison) -> Markup {
    let rest = |wanted: Status| found.candidates.iter().filter(move |candidate| candidate.status == wanted);
    html! {
        section {
            h2 { "What was not seen to change" }
            p.note {
                "The smallest change that would have been seen in nine of ten sessions like these: of one number alone, everything else \
                as uncertain as it is."
            }
            table {
                tr { th { "parameter or effect" } th { "smallest change seen" } th { "why not" } }
                @for candidate in rest(Status::RuledOut).chain(rest(Status::NotTestable)) {
                    tr { td { (words(&candidate.name)) } td { (smallest(candidate)) } td { (candidate.why) } }
                }
            }
        }
    }
}

fn smallest(candidate: &Candidate) -> String {
    let all = candidate.smallest_seen.iter().map(|(name, smallest)| smallest_in_words(name, &candidate.name, smallest));
    all.collect::<Vec<_>>().join("; ")
}

fn origin(found: &Comparison) -> Markup {
    let clips = &found.clips;
    let used = [
        ("fitted to", &clips.train),
        ("chosen on", &clips.choose),
        ("held out in turn: gap and share", &clips.confirm),
    ];
    html! {
        section {
            h2 { "Where this comes from" }
            dl {
                dt { "A" } dd { code { (found.session) } }
                dt { "B" } dd { code { (found.against) } }
                @if !found.shared.is_empty() {
                    dt { "in both" } dd { (found.shared.iter().map(|name| words(name)).collect::<Vec<_>>().join(", ")) }
                }
                @for (what, clips) in used { dt { (what) } dd { (clips.len()) " clips: " (clips.join(", ")) } }
                dt { "seed" } dd { (found.seed) }
                dt { "took" } dd { (format!("{:.0} s", found.seconds)) }
            }
            details { summary { "theta.toml of B" } pre { code { (found.theta.to_toml()) } } }
        }
    }
}
