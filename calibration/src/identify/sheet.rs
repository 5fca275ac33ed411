//! What was identified, as a page or a terminal shows it.

use crate::page::Trace;
use shared_mem::recording::SessionFiles;
use std::path::PathBuf;

/// Everything on the page. SI units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sheet {
    /// `arm`, `object` or `joint`.
    pub target: String,
    /// The session's folder.
    pub session: String,
    /// Where its clips come from.
    pub origin: String,
    /// How it was named.
    pub files: SessionFiles,
    /// The finding in one sentence.
    pub sentence: String,
    /// What was found.
    pub parameters: Vec<Parameter>,
    /// Parameters that are not identifiable from the clips, and why.
    pub not_identifiable: Vec<[String; 2]>,
    /// How far off the twin is, by kind of error and set of clips.
    pub errors: Vec<Error>,
    /// The same by clip.
    pub clips: Vec<Clip>,
    /// Which error is shown by clip, and its SI unit.
    pub clip_error: [&'static str; 2],
    /// Residuals by clip and channel.
    pub traces: Vec<Trace>,
    /// Evaluations so far, and the best loss then.
    pub convergence: Vec<[f64; 2]>,
    /// Names of all numbers, in the order of the correlations.
    pub names: Vec<String>,
    /// Correlations of the estimates, row by row.
    pub correlation: Vec<Vec<f64>>,
    /// What to record next.
    pub advice: Vec<String>,
    /// What a reader has to know.
    pub notes: Vec<String>,
    /// Facts about the run: what, and its value.
    pub provenance: Vec<[String; 2]>,
    /// Where the parameters were written.
    pub theta_file: Option<PathBuf>,
}

/// A parameter of one or several numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parameter {
    /// Name in files.
    pub name: String,
    pub unit: String,
    pub values: Vec<f64>,
    /// Their 95 % intervals.
    pub intervals: Vec<[f64; 2]>,
    /// What cell.toml says; empty where it says nothing.
    pub nominal: Vec<f64>,
    /// A remark on each number, such as `at its upper bound`; empty where there is none.
    pub warnings: Vec<Option<String>>,
}

/// An error before and after.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Error {
    /// Which error, on which clips.
    pub name: String,
    pub unit: String,
    /// With what cell.toml says; none where it says too little to simulate.
    pub before: Option<f64>,
    /// With what was found.
    pub after: f64,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clip {
    pub file: String,
    /// What it was used for: `fitted`, `held out`, `left out`.
    pub used: String,
    /// The main error with what cell.toml says, and with what was found; see [`Sheet::clip_error`].
    pub error: [Option<f64>; 2],
    /// What is odd about it; empty where nothing is.
    pub remark: String,
}
