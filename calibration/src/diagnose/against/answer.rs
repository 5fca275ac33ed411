//! The answer of a comparison of two sessions, as it is written to a file and shown on the page.

use crate::answer::diagnosis::{Clips, Gap, Kind, Place, Share, Status};
use crate::answer::one_or_list;
use shared_mem::recording::SessionFiles;
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What was found about two sessions of one robot.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    pub verdict: Verdict,
    /// The gap of B's held-out clips: under what was found on A alone, and with what changed.
    pub gap: Gap,
    /// What A's own held-out clips leave under what was found on A alone, in the unit of [`Self::gap`].
    pub gap_of_a: f64,
    /// Where B's gap under A's model lies.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What both sessions have beside the parameters, by the names of effects.
    pub shared: Vec<String>,
    /// Everything that may have changed: what did first, then what promises most.
    pub candidates: Vec<Candidate>,
    /// The one clip that separates the leaders; empty where nothing is left to separate.
    pub next_experiment: String,
    /// The commands that record it.
    pub next_commands: Vec<String>,
    /// Which clips were used for what, those of A as `A/clip`, those of B as `B/clip`.
    pub clips: Clips,
    /// What a reader has to know, one sentence each.
    pub warnings: Vec<String>,
    /// Wall-clock time [s].
    pub seconds: f64,
    /// The session whose model B is held to: A.
    pub session: String,
    pub against: String,
    /// How both were named.
    #[serde(skip)]
    pub files: [SessionFiles; 2],
    /// What everything random was drawn from.
    pub seed: u64,
    /// The parameters of B.
    pub theta: Theta,
    /// Where they were written.
    pub theta_file: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// `none`: nothing changed as far as these clips show; `named`; `class`; `unexplained`: B deviates, and nothing that may change
    /// alone explains it; `not_testable`: of too little of what may change a change would have been seen.
    pub kind: Kind,
    /// What changed, or the members of the class: parameters and effects by name.
    pub changes: Vec<String>,
    /// How sure, 0 to 1.
    pub confidence: f64,
    /// One sentence that a person understands.
    pub text: String,
}

/// What became of one parameter or effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// `stiffness`, `friction`, or the name of an effect.
    pub name: String,
    /// Whether it is an effect; else a parameter that every cell has.
    pub is_effect: bool,
    /// How likely it is that this changed.
    pub probability: f64,
    /// The numbers that each session has of its own, by parameter; empty where it was not fitted.
    pub parameters: BTreeMap<String, Values>,
    /// By how much B's gap under A's model shrinks with it on held-out clips.
    pub shrink: Share,
    /// What these clips cannot tell from it.
    pub confusable_with: Vec<String>,
    /// What became of it.
    pub status: Status,
    /// The reason, in words.
    pub why: String,
    /// The smallest change that would have been seen in nine of ten sessions like these, by parameter: of one number alone.
    pub smallest_seen: BTreeMap<String, Smallest>,
}

/// A parameter in both sessions, in SI.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Values {
    #[serde(serialize_with = "one_or_list")]
    pub a: Vec<f64>,
    #[serde(serialize_with = "one_or_list")]
    pub b: Vec<f64>,
    /// B less A.
    #[serde(serialize_with = "one_or_list")]
    pub change: Vec<f64>,
    /// A 95 % interval of each change.
    #[serde(serialize_with = "one_or_list")]
    pub ci95: Vec<[f64; 2]>,
    /// SI unit; `1` without.
    pub unit: String,
}

/// The smallest change of each number of a parameter that would have been seen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Smallest {
    /// Of each number alone; none where no change of it would have been seen.
    #[serde(rename = "value", serialize_with = "one_or_list")]
    pub values: Vec<Option<f64>>,
    pub unit: String,
}

impl Values {
    pub(super) fn new(unit: &str) -> Self {
        let nothing = Vec::new;
        Self { a: nothing(), b: nothing(), change: nothing(), ci95: Vec::new(), unit: unit.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_stands_by_itself_and_several_as_lists() {
        let delay =
            Values { a: vec![0.0], b: vec![0.012], change: vec![0.012], ci95: vec![[0.011, 0.013]], unit: "s".into() };
        let text = serde_json::to_string(&delay).expect("JSON");
        assert_eq!(text, r#"{"a":0.0,"b":0.012,"change":0.012,"ci95":[0.011,0.013],"unit":"s"}"#);
        let two = Smallest { values: vec![Some(0.1), None], unit: "N m".into() };
        assert_eq!(serde_json::to_string(&two).expect("JSON"), r#"{"value":[0.1,null],"unit":"N m"}"#);
    }
}
