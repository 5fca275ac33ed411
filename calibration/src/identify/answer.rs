//! The answer of an identification, of arm or object, as it is printed with `--json` and shown on the page.

use crate::numbers::Numbers;
use crate::report::Trace;
use serde::Serialize;
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a session says about the parameters of its cell.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Identification {
    /// `arm` or `object`.
    pub target: &'static str,
    /// What was found, with 95 % intervals, by name.
    pub parameters: BTreeMap<String, Numbers>,
    /// What the clips cannot tell.
    pub not_identifiable: Vec<NotIdentifiable>,
    /// How far off the twin is.
    pub gap: Gap,
    /// Which clips were used for what.
    pub clips: Clips,
    /// Every clip of the session.
    pub by_clip: Vec<ClipError>,
    /// What to record next, best first.
    pub advice: Vec<String>,
    /// How the parameters were searched: `least-squares`, `pso`, `cma`.
    pub optimizer: String,
    /// Simulated clips.
    pub evaluations: usize,
    /// Wall-clock time [s].
    pub seconds: f64,
    /// The session's folder.
    pub session: String,
    /// What everything random was drawn from.
    pub seed: u64,
    /// The parameters, as every other command takes them.
    pub theta: Theta,
    /// Where they were written.
    pub theta_file: Option<PathBuf>,
    /// Correlations of the estimates.
    pub correlation: Correlation,
    /// Evaluations so far, and the best loss then.
    pub convergence: Vec<[f64; 2]>,
    /// What stood in cell.toml, by name of the parameter and number by number, for the page.
    #[serde(skip)]
    pub nominal: BTreeMap<String, Vec<f64>>,
    /// Numbers that ended at a bound of the search: name of the parameter, which number, and which bound in words.
    pub at_bound: Vec<AtBound>,
    /// Residuals by clip and channel with cell.toml and with what was found, for the page.
    #[serde(skip)]
    pub traces: Vec<Trace>,
}

/// A parameter that the clips cannot tell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotIdentifiable {
    /// Its name.
    pub parameter: String,
    /// The reason, and what would help.
    pub why: String,
}

/// A number that ended at a bound of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AtBound {
    /// Name of the parameter.
    pub parameter: String,
    /// Which of its numbers, from 0.
    pub index: usize,
    /// The bound [unit of the parameter].
    pub bound: f64,
}

/// How far off the twin is, on average over clips.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Gap {
    /// With what was found, on the clips that were fitted.
    pub train: Errors,
    /// With what was found, on the others.
    pub holdout: Errors,
    /// With cell.toml, on those others.
    pub before: Errors,
}

/// Errors of the twin; none where there is nothing to compare.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square over joints and time [rad].
    pub joint_rms_rad: Option<f64>,
    /// Mean ADD [m].
    pub object_add_m: Option<f64>,
    /// Mean ADD-S [m].
    pub object_add_s_m: Option<f64>,
}

/// Files of the clips by use.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Clips {
    /// Fitted.
    pub train: Vec<String>,
    /// Held out.
    pub holdout: Vec<String>,
}

/// One clip: the error that was fitted, joint RMS [rad] for the arm, ADD [m] for the object.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ClipError {
    /// Its file.
    pub file: String,
    /// With cell.toml.
    pub before: Option<f64>,
    /// With what was found.
    pub after: Option<f64>,
    /// What is odd about it, and what was done about that; empty where nothing is.
    pub remark: String,
}

/// Correlations of estimates.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Correlation {
    /// What the rows are: `stiffness[2]`.
    pub names: Vec<String>,
    /// Row by row.
    pub values: Vec<Vec<f64>>,
}
