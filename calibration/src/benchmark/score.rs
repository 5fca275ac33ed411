//! Scores of a diagnosis over many worlds: how often it was right, false, silent, and whether its confidence was earned.
//! Rates come with exact (Clopper-Pearson) 95 % intervals.

use inference::statistics;
use serde::Serialize;
use std::collections::BTreeMap;
use worlds::world::Truth;

/// What a method said about a world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Said {
    /// Kind of verdict, as in diagnosis.json.
    pub verdict: String,
    /// Effects named, or the members of the class.
    pub effects: Vec<String>,
    /// Candidates in the order of their probability.
    pub ranking: Vec<String>,
    /// Confidence in the verdict.
    pub confidence: f64,
    /// Share of the gap closed on clips never used.
    pub shrink: f64,
}

/// One world and what was said about it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Number of the world.
    pub world: u64,
    /// What is wrong.
    pub truth: Truth,
    /// How plainly the effect shows in clips never used: `sqrt(2 x gain in ln likelihood)` of the true structure, fitted.
    pub detectability: f64,
    /// Share of the gap that the true structure closes on clips never used.
    pub oracle_shrink: f64,
    /// What was said.
    pub said: Said,
}

/// A share of cases with its exact interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// Cases that count for it.
    pub hits: usize,
    pub of: usize,
    /// 95 % interval of Clopper and Pearson (1934).
    pub ci95: [f64; 2],
}

impl Rate {
    pub fn count(cases: impl Iterator<Item = bool>) -> Self {
        let (hits, of) = cases.fold((0, 0), |(hits, of), hit| (hits + usize::from(hit), of + 1));
        Self { hits, of, ci95: [clopper_pearson(hits, of, 0.025), 1.0 - clopper_pearson(of - hits, of, 0.025)] }
    }

    /// The share; 0 without cases.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.of.max(1) as f64
    }
}

/// The scores of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scores {
    /// Worlds with one testable effect in which exactly that one was named.
    pub top1: Rate,
    /// The same, counting a class that holds it.
    pub top1_or_class: Rate,
    /// Worlds with one testable effect among the three likeliest candidates.
    pub top3: Rate,
    /// Worlds with two testable effects in which exactly both were named.
    pub exact_pair: Rate,
    /// Worlds without any effect in which one was named.
    pub false_alarms: Rate,
    /// Worlds with an unknown disturbance in which no effect was named.
    pub refusals: Rate,
    /// Median over testable single effects of the gap closed, as a share of what the true structure closes.
    pub shrink_of_oracle: f64,
    /// Expected calibration error of the confidence, ten bins.
    pub calibration_error: f64,
    /// By effect: worlds with this one effect, and how often it was named.
    pub by_effect: BTreeMap<String, Rate>,
    /// True effect, then what was said, then how often.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
}

/// An effect that shows less than this in clips never used cannot be asked of anybody.
pub const TESTABLE: f64 = 6.0;

impl Scores {
    /// Scores the cases.
    pub fn of(cases: &[Case]) -> Self {
        let testable = |n: usize| {
            cases
                .iter()
                .filter(move |case| case.detectability >= TESTABLE && case.effects().is_some_and(|e| e.len() == n))
        };
        let mut by_effect: BTreeMap<String, Vec<bool>> = BTreeMap::new();
        for case in testable(1) {
            by_effect.entry(case.truth_label()).or_default().push(case.named_exactly());
        }
        let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for case in cases {
            *confusion.entry(case.truth_label()).or_default().entry(case.said.label()).or_default() += 1;
        }
        let nothing = cases.iter().filter(|case| case.truth == Truth::Nothing);
        let outside = cases.iter().filter(|case| matches!(case.truth, Truth::Outside(_)));
        let shrinks = testable(1).map(|case| case.said.shrink / case.oracle_shrink);
        Self {
            top1: Rate::count(testable(1).map(Case::named_exactly)),
            top1_or_class: Rate::count(testable(1).map(|case| case.named_exactly() || case.in_class())),
            top3: Rate::count(testable(1).map(|case| case.among(3))),
            exact_pair: Rate::count(testable(2).map(Case::named_exactly)),
            false_alarms: Rate::count(nothing.map(|case| case.said.verdict == "named")),
            refusals: Rate::count(outside.map(|case| case.said.verdict != "named")),
            shrink_of_oracle: statistics::median(shrinks.filter(|shrink| shrink.is_finite())).unwrap_or(f64::NAN),
            calibration_error: calibration_error(cases),
            by_effect: by_effect.into_iter().map(|(name, hits)| (name, Rate::count(hits.into_iter()))).collect(),
            confusion,
        }
    }
}

impl Said {
    /// One word for the confusion table.
    fn label(&self) -> String {
        if self.verdict == "named" { sorted(&self.effects).join(" + ") } else { self.verdict.clone() }
    }
}

impl Case {
    /// What is true and what was said, for a log.
    pub fn line(&self) -> String {
        let (truth, said) = (self.truth_label(), self.said.label());
        format!("world {}: {truth} -> {said}, {:.0} % sure", self.world, 100.0 * self.said.confidence)
    }

    fn effects(&self) -> Option<&[String]> {
        match &self.truth {
            Truth::Effects(effects) => Some(effects),
            Truth::Nothing | Truth::Outside(_) => None,
        }
    }

    fn truth_label(&self) -> String {
        match &self.truth {
            Truth::Nothing => "nothing".to_owned(),
            Truth::Effects(effects) => sorted(effects).join(" + "),
            Truth::Outside(name) => format!("outside: {name}"),
        }
    }

    fn named_exactly(&self) -> bool {
        let named = self.said.verdict == "named";
        named && self.effects().is_some_and(|effects| sorted(effects) == sorted(&self.said.effects))
    }

    fn in_class(&self) -> bool {
        let holds = |effects: &[String]| effects.iter().all(|effect| self.said.effects.contains(effect));
        self.said.verdict == "class" && self.effects().is_some_and(holds)
    }

    fn among(&self, first: usize) -> bool {
        let likeliest = &self.said.ranking[..first.min(self.said.ranking.len())];
        self.named_exactly() || self.effects().is_some_and(|effects| effects.iter().all(|e| likeliest.contains(e)))
    }

    /// Whether the verdict is true.
    fn right(&self) -> bool {
        match &self.truth {
            Truth::Nothing => self.said.verdict == "none",
            Truth::Effects(_) => self.named_exactly() || self.in_class(),
            Truth::Outside(_) => self.said.verdict == "unexplained",
        }
    }
}

fn sorted(names: &[String]) -> Vec<String> {
    let mut names = names.to_vec();
    names.sort();
    names
}

/// Mean confidence and share of true verdicts in each of ten bins of confidence that holds any, lowest first.
pub fn reliability(cases: &[Case]) -> Vec<(f64, Rate)> {
    let mut bins: [Vec<&Case>; 10] = Default::default();
    for case in cases {
        bins[((case.said.confidence * 10.0) as usize).min(9)].push(case);
    }
    let mean = |bin: &[&Case]| bin.iter().map(|case| case.said.confidence).sum::<f64>() / bin.len() as f64;
    let filled = bins.iter().filter(|bin| !bin.is_empty());
    filled.map(|bin| (mean(bin), Rate::count(bin.iter().map(|case| case.right())))).collect()
}

/// Mean distance of confidence from the share of true verdicts, over the bins, weighted by cases (Naeini 2015); NaN, in JSON
/// `null`, without cases.
fn calibration_error(cases: &[Case]) -> f64 {
    let distance = |(confidence, right): (f64, Rate)| right.of as f64 * (confidence - right.value()).abs();
    reliability(cases).into_iter().map(distance).sum::<f64>() / cases.len() as f64
}

/// The rate at which `hits` or more of `of` come about with probability `tail`, by bisection on the binomial sum.
fn clopper_pearson(hits: usize, of: usize, tail: f64) -> f64 {
    if hits == 0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for _ in 0..60 {
        let rate = 0.5 * (low + high);
        if at_least(hits, of, rate) < tail { low = rate } else { high = rate }
    }
    0.5 * (low + high)
}

/// Probability of `hits` or more of `of` at `rate`.
fn at_least(hits: usize, of: usize, rate: f64) -> f64 {
    let mut log_choose = 0.0;
    let mut sum = 0.0;
    for k in 0..=of {
        if k > 0 {
            log_choose += ((of - k + 1) as f64 / k as f64).ln();
        }
        if k >= hits {
            sum += (log_choose + k as f64 * rate.ln() + (of - k) as f64 * (1.0 - rate).ln()).exp();
        }
    }
    sum
}

/// What one method said about the worlds.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// Its name in the table.
    pub name: String,
    /// World by world.
    pub cases: Vec<Case>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(truth: Truth, verdict: &str, effects: &[&str], confidence: f64) -> Case {
        let effects: Vec<String> = effects.iter().map(|e| (*e).to_owned()).collect();
        let said = Said { verdict: verdict.into(), ranking: effects.clone(), effects, confidence, shrink: 0.45 };
        Case { world: 0, truth, detectability: 10.0, oracle_shrink: 0.5, said }
    }

    fn one(name: &str) -> Truth {
        Truth::Effects(vec![name.to_owned()])
    }

    #[test]
    fn the_exact_interval_is_the_tabled_one() {
        // Clopper and Pearson: 0 of 300 and 9 of 10.
        let none = Rate::count((0..300).map(|_| false));
        assert_eq!(none.ci95[0], 0.0);
        assert!((none.ci95[1] - 0.01222).abs() < 1e-5, "{:?}", none.ci95);
        let most = Rate::count((0..10).map(|i| i < 9));
        assert!((most.ci95[0] - 0.5550).abs() < 1e-4 && (most.ci95[1] - 0.99747).abs() < 1e-4, "{:?}", most.ci95);
    }

    #[test]
    fn each_score_counts_its_own_worlds() {
        let cases = [
            case(Truth::Nothing, "none", &[], 1.0),
            case(Truth::Nothing, "named", &["payload"], 0.9),
            case(one("payload"), "named", &["payload"], 1.0),
            case(one("payload"), "class", &["payload", "torque_gain"], 1.0),
            case(Truth::Effects(vec!["a".into(), "b".into()]), "named", &["b", "a"], 1.0),
            case(Truth::Outside("wear".into()), "unexplained", &[], 1.0),
        ];
        let scores = Scores::of(&cases);
        let rate = |rate: Rate| (rate.hits, rate.of);
        assert_eq!(rate(scores.top1), (1, 2));
        assert_eq!(rate(scores.top1_or_class), (2, 2));
        assert_eq!(rate(scores.exact_pair), (1, 1));
        assert_eq!(rate(scores.false_alarms), (1, 2));
        assert_eq!(rate(scores.refusals), (1, 1));
        assert!((scores.shrink_of_oracle - 0.9).abs() < 1e-12);
        assert!((scores.calibration_error - 0.9 / 6.0).abs() < 1e-12);
        assert_eq!(scores.confusion["payload"]["class"], 1);
    }

    #[test]
    fn an_effect_that_hardly_shows_is_asked_of_nobody() {
        let hidden = Case { detectability: 2.0, ..case(one("payload"), "none", &[], 0.5) };
        assert_eq!(Scores::of(&[hidden]).top1.of, 0);
        assert!(Scores::of(&[]).calibration_error.is_nan(), "nothing was scored");
    }
}
