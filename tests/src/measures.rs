//! The house in numbers: what a table of before and after counts in a tree of sources.

use crate::constants::constants;
use crate::sources::{Source, below};
use std::path::Path;

/// Where the statistics stand, today and before they were a crate.
const ENGINE: [&str; 11] = [
    "calibration/src/answer/",
    "calibration/src/diagnose/",
    "calibration/src/identify/",
    "calibration/src/forward/",
    "calibration/src/estimate/",
    "calibration/inference/src/admit/",
    "calibration/inference/src/controller/",
    "calibration/inference/src/estimate/",
    "calibration/inference/src/forward/",
    "calibration/inference/src/likelihood/",
    "calibration/inference/src/object_fit/",
];
const DIAGNOSE: [&str; 1] = ["calibration/src/diagnose/"];
const IDENTIFY: [&str; 2] = ["calibration/src/identify/", "calibration/inference/src/object_fit/"];
const FORWARD: [&str; 3] =
    ["calibration/src/forward/", "calibration/inference/src/forward/", "calibration/inference/src/likelihood/"];
/// What follows from clips, and not what trials of policies say.
const CALIBRATION: [&str; 4] =
    ["calibration/src/", "calibration/inference/src/", "calibration/vision/src/", "calibration/capture/src/"];
const EVERYTHING: [&str; 1] = [""];

/// What is counted, and how many there are of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measure {
    pub name: &'static str,
    pub value: String,
}

/// The measures of the tree at `root`, always in the same order.
pub fn measures(root: &Path) -> Vec<Measure> {
    let all = below(root, "");
    let part = |folders: &[&str]| Part {
        sources: all.iter().filter(|s| folders.iter().any(|folder| s.file.starts_with(folder))).collect(),
    };
    let (engine, diagnose, calibration) = (part(&ENGINE), part(&DIAGNOSE), part(&CALIBRATION));
    let measure = |name, value: String| Measure { name, value };
    let count = |name, value: usize| Measure { name, value: value.to_string() };
    vec![
        measure("lines of Rust, source + tests", part(&EVERYTHING).lines()),
        measure("of these below calibration/", part(&["calibration/"]).lines()),
        measure("in the largest crate, calibration/src", part(&["calibration/src/"]).lines()),
        measure("diagnose + identify + forward + estimate, wherever they went", engine.lines()),
        measure("tests per source line, everything", part(&EVERYTHING).share_of_tests()),
        measure("tests per source line, identify", part(&IDENTIFY).share_of_tests()),
        measure("tests per source line, forward", part(&FORWARD).share_of_tests()),
        count("numeric constants of diagnose", diagnose.constants(|constant| constant.is_number())),
        count("numeric constants of those four", engine.constants(|constant| constant.is_number())),
        count("constants of those four named by one generic word", engine.constants(|constant| constant.is_generic())),
        // A loop of its own around a damped step, or the one that takes its schedule as data.
        count("fit loops", calibration.lines_with(&["Descent { information", "fn descend<"], &[])),
        count(
            "places of those four that widen an error by a quantile",
            engine.lines_with(&["student"], &["fn ", "use "]),
        ),
        count("quantiles written as numbers", calibration.lines_with(&["1.96", "1.645", "1.64 "], &[])),
        count("models of clips", calibration.lines_with(&["ClipModel for ", "Evidence for ", "Likelihood for "], &[])),
        count("definitions of `ArmClips`", calibration.lines_with(&["struct ArmClips"], &[])),
        count("definitions of a penalty of random effects", calibration.lines_with(&["fn penalty("], &[])),
        count("definitions of a median", calibration.lines_with(&["fn median("], &[])),
        count("arguments that are tuple patterns", part(&EVERYTHING).tuple_patterns()),
        count("`#[must_use]`", part(&EVERYTHING).lines_with(&["#[must_use"], &[])),
        measure("comments that are no documentation, per source line", part(&EVERYTHING).share_of_comments()),
        count("doc examples that run", part(&EVERYTHING).doc_examples()),
    ]
}

struct Part<'a> {
    sources: Vec<&'a Source>,
}

impl Part<'_> {
    /// Lines of the product, and of tests: in files of their own, behind the product, and the programs in its documentation.
    fn counted(&self) -> [usize; 2] {
        self.sources.iter().fold([0, 0], |[product, tests], source| {
            let all = source.text.lines().count();
            let own = source.product().lines().count() - examples(source).iter().sum::<usize>();
            if source.is_test() { [product, tests + all] } else { [product + own, tests + all - own] }
        })
    }

    fn lines(&self) -> String {
        let [product, tests] = self.counted();
        format!("{product} + {tests}")
    }

    fn share_of_tests(&self) -> String {
        let [product, tests] = self.counted();
        format!("{:.2}", tests as f64 / product.max(1) as f64)
    }

    fn product(&self) -> impl Iterator<Item = &Source> {
        self.sources.iter().copied().filter(|source| !source.is_test())
    }

    fn constants(&self, counts: impl Fn(&crate::constants::Constant) -> bool) -> usize {
        self.product().map(|source| constants(&source.code_text()).iter().filter(|c| counts(c)).count()).sum()
    }

    /// Lines of code with one of `words` and none of `not`.
    fn lines_with(&self, words: &[&str], not: &[&str]) -> usize {
        let holds = |line: &str, words: &[&str]| words.iter().any(|word| line.contains(word));
        self.product().flat_map(Source::code).filter(|line| holds(line, words) && !holds(line, not)).count()
    }

    /// Arguments of functions such as `(a, b): (A, B)`.
    fn tuple_patterns(&self) -> usize {
        let opens = |line: &str| line.trim_start().starts_with('(') || line.contains("fn ");
        let of = |line: &str| line.matches("): (").count() + line.matches("): &(").count();
        self.product().flat_map(Source::code).filter(|line| opens(line)).map(of).sum()
    }

    fn share_of_comments(&self) -> String {
        let is_comment = |line: &&str| {
            let line = line.trim_start();
            line.starts_with("//") && !line.starts_with("///") && !line.starts_with("//!")
        };
        let comments: usize = self.product().map(|s| s.product().lines().filter(is_comment).count()).sum();
        format!("{:.3}", comments as f64 / self.counted()[0].max(1) as f64)
    }

    fn doc_examples(&self) -> usize {
        self.product().map(|source| examples(source).len()).sum()
    }
}

/// Lines of each program in the documentation, which runs as a test; its fences are among them.
fn examples(source: &Source) -> Vec<usize> {
    let fence = |(number, line): (usize, &str)| {
        let line = line.trim_start();
        let text = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"))?;
        Some((number, text.trim_start().strip_prefix("```")?.trim().to_owned()))
    };
    let fences: Vec<(usize, String)> = source.product().lines().enumerate().filter_map(fence).collect();
    let pairs = fences.chunks_exact(2).map(|pair| (&pair[0].1, pair[1].0 - pair[0].0 + 1));
    pairs
        .filter(|(language, _)| ["", "rust", "should_panic"].contains(&language.as_str()))
        .map(|(_, lines)| lines)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_counted_by_what_stands_in_it() {
        let text = "//! What it owns.\n//! ```\n//! one();\n//! ```\n/// ```text\n/// a\n/// ```\n// why\n\
                    const MOST: usize = 3;\nfn f((a, b): (u8, u8)) {}\n#[cfg(test)]\nmod tests {\n}\n";
        let source = Source { file: "calibration/src/diagnose/a.rs".into(), text: text.into() };
        let part = Part { sources: vec![&source] };
        assert_eq!((part.lines(), part.share_of_comments()), ("7 + 6".into(), "0.143".into()));
        assert_eq!((part.doc_examples(), part.tuple_patterns()), (1, 1));
        assert_eq!(part.constants(|constant| constant.is_generic()), 1);
    }
}
