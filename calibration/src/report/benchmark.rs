//! The page of the benchmark: how often the diagnosis was right, false or silent, beside the simple rules, on the same worlds.

use crate::benchmark::score::{Case, Method, Rate, Scores, reliability};
use crate::page::figure::calibration_curve::{Bin, calibration_curve};
use crate::page::figure::forest::{Group, Row, forest};
use crate::page::figure::matrix::confusion;
use crate::page::frame::{figure, frame, unbroken};
use crate::words::share::{percent, percent_interval};
use crate::words::words;
use maud::{Markup, html};

/// The page. The first method is the one in question, the others stand beside it. `origin`: the command, the time it took.
pub fn page(methods: &[Method], origin: &str) -> String {
    let scores: Vec<(&str, Scores)> =
        methods.iter().map(|method| (method.name.as_str(), Scores::of(&method.cases))).collect();
    let body = html! {
        p.kicker { "Benchmark of the diagnosis on sealed simulated worlds" }
        @if let Some((_, first)) = scores.first() { h1 { (unbroken(&sentence(first))) } }
        (figure("Beside the simple rules, on the same worlds", "Share of worlds; exact 95 % intervals in brackets.", &table(&scores)))
        @if let (Some((_, first)), Some(method)) = (scores.first(), methods.first()) {
            (figure("Effect by effect", "Worlds with this effect alone in which exactly it was named.", &by_effect(first)))
            (figure("What was taken for what", "True down, said across; blue is right.", &confusion(&first.confusion, is_right)))
            (figure("Are verdicts right as often as their confidence says?", &calibration_words(first), &curve(&method.cases)))
        }
    };
    frame("benchmark of the diagnosis", origin, &body)
}

/// The finding in one sentence.
pub fn sentence(scores: &Scores) -> String {
    let Rate { hits, of, ci95 } = scores.false_alarms;
    format!(
        "The true effect was named in {} of {} worlds, and one was named without cause in {hits} of {of} (at most {}).",
        percent(scores.top1.value()),
        scores.top1.of,
        percent(ci95[1])
    )
}

/// One of the rates.
pub(super) type Pick = fn(&Scores) -> Rate;

/// The rates, in words.
pub(super) const RATES: [(&str, Pick); 6] = [
    ("effect named exactly", |s| s.top1),
    ("named, or in the class", |s| s.top1_or_class),
    ("among the first three", |s| s.top3),
    ("both of two named", |s| s.exact_pair),
    ("false alarms", |s| s.false_alarms),
    ("unknown causes refused", |s| s.refusals),
];

fn table(scores: &[(&str, Scores)]) -> Markup {
    html! {
        table {
            tr { th { "" } @for (name, _) in scores { th { (name) } } }
            @for (what, rate) in RATES {
                tr { td { (what) } @for (_, scores) in scores { td.nowrap { (cell(rate(scores))) } } }
            }
            tr { td { "shrink, as a share of the shrink with the true effect (median)" } @for (_, s) in scores { td { (percent(s.shrink_of_oracle)) } } }
            tr { td { "mean distance of confidence from the share that was right" } @for (_, s) in scores { td { (percent(s.calibration_error)) } } }
        }
    }
}

fn cell(rate: Rate) -> Markup {
    html! {
        @if rate.of == 0 { "-" } @else {
            (percent_interval(rate.value(), rate.ci95))
            small { (rate.hits) " of " (rate.of) }
        }
    }
}

fn by_effect(scores: &Scores) -> Markup {
    let mut rows: Vec<Row> = scores
        .by_effect
        .iter()
        .map(|(name, rate)| Row {
            name: format!("{} ({})", words(name), rate.of),
            value: rate.value(),
            interval: rate.ci95,
            nominal: None,
            warning: None,
        })
        .collect();
    rows.sort_by(|a, b| b.value.total_cmp(&a.value));
    forest(&[Group { name: "", unit: "%", rows }])
}

fn is_right(truth: &str, said: &str) -> bool {
    truth == said || (truth == "nothing" && said == "none") || (truth.starts_with("outside") && said == "unexplained")
}

fn calibration_words(scores: &Scores) -> String {
    format!(
        "Numbers beside the dots count verdicts. On the dashed line confidence and share agree; on average they are {} apart.",
        percent(scores.calibration_error)
    )
}

fn curve(cases: &[Case]) -> Markup {
    let bins: Vec<Bin> = reliability(cases)
        .into_iter()
        .map(|(confidence, rate)| Bin { confidence, right: rate.value(), interval: rate.ci95, count: rate.of })
        .collect();
    calibration_curve(&bins)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::benchmark::score::Said;
    use worlds::world::Truth;

    fn case(truth: Truth, verdict: &str, effects: &[&str]) -> Case {
        let effects: Vec<String> = effects.iter().map(|effect| (*effect).to_owned()).collect();
        let said = Said { verdict: verdict.into(), ranking: effects.clone(), effects, confidence: 0.93, shrink: 0.9 };
        Case { world: 1, truth, detectability: 20.0, oracle_shrink: 0.95, said }
    }

    /// One world of each kind, and one taken for another.
    pub(in crate::report) fn cases() -> Vec<Case> {
        let one = |name: &str| Truth::Effects(vec![name.to_owned()]);
        vec![
            case(one("payload"), "named", &["payload"]),
            case(one("payload"), "named", &["base_tilt"]),
            case(Truth::Nothing, "none", &[]),
            case(Truth::Outside("wear".into()), "unexplained", &[]),
        ]
    }

    #[test]
    fn the_page_tells_rates_confusions_and_calibration() {
        let cases = cases();
        let rule = Method { name: "largest RMSE".into(), cases: cases.clone() };
        let html = page(&[Method { name: "twinalign".into(), cases }, rule], "calibration benchmark");
        assert!(html.contains("The true effect was named in 50\u{a0}% of 2\u{a0}worlds"), "{html}");
        for text in [
            "largest RMSE",
            "1 of 2",
            "outside: wear",
            "payload (2)",
            "Are verdicts right as often as their confidence says?",
        ] {
            assert!(html.contains(text), "no {text}");
        }
        assert_eq!(html.matches("<svg").count(), 3);
        assert!(page(&[], "").contains("</html>"));
    }
}
