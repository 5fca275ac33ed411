//! What an identification found. SI units.

use super::Trace;
use inference::admit::LeftOut;
use inference::engine::Used;
use serde::ser::SerializeStruct as _;
use serde::{Serialize, Serializer};
use shared_mem::recording::SessionFiles;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// An identification; what is not marked as an index is in SI units.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Identification {
    /// `arm`, `object` or `joint`.
    pub target: String,
    /// Of several objects in cell.toml the one that this is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// The joint of that object that this is about, where it moves in itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// The session's folder.
    pub session: String,
    /// Where its clips come from, in words.
    pub origin: String,
    /// How it was named.
    #[serde(skip)]
    pub files: SessionFiles,
    /// What was found, by name.
    pub parameters: BTreeMap<String, Parameter>,
    /// What is not identifiable from the clips.
    pub not_identifiable: Vec<NotIdentifiable>,
    /// How far the twin is off.
    pub gap: Gap,
    /// Which clips were used for what.
    pub clips: Clips,
    /// How far the twin is off, clip by clip.
    pub by_clip: Vec<ClipGap>,
    /// The way of searching.
    pub optimizer: String,
    pub evaluations: usize,
    /// The program that simulated the arm; none where the twin did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<Used>,
    /// Wall time [s].
    pub seconds: f64,
    /// Stretches of clips that count as independent witnesses of the intervals.
    pub witnesses: usize,
    /// Root mean square residual in sigmas of the sensors' noise, at least 1.
    pub misfit: f64,
    /// Whether the search converged.
    pub converged: bool,
    /// Numbers that rest on a bound of their search.
    pub at_bounds: Vec<String>,
    /// Names of all numbers, in the order of the correlations.
    pub names: Vec<String>,
    /// Correlations of the estimates.
    pub correlation: Vec<Vec<f64>>,
    /// Clips simulated so far, and the loss then.
    pub convergence: Vec<[f64; 2]>,
    /// What to record next.
    pub advice: Vec<Advice>,
    /// What a reader has to know.
    pub warnings: Vec<String>,
    /// Residuals of the worst channel of each clip.
    #[serde(skip)]
    pub traces: Vec<Trace>,
    /// Where the parameters were written.
    #[serde(skip)]
    pub theta_file: Option<PathBuf>,
}

impl Identification {
    /// Whether gains alone do not explain the clips: the search did not converge, no number is identifiable, and at least half of the gap is
    /// left in the clips that were fitted. Something else acts in them.
    pub fn is_unexplained(&self) -> bool {
        let Gap { train_before, train, .. } = &self.gap;
        let halved = |before: Option<f64>, after: Option<f64>| before.zip(after).is_some_and(|(b, a)| a < 0.5 * b);
        self.target == "arm"
            && !self.converged
            && !self.names.is_empty()
            && self.not_identifiable.len() >= self.names.len()
            && !halved(train_before.joint_rms_rad, train.joint_rms_rad)
            && !halved(train_before.joint_rms_m, train.joint_rms_m)
    }
}

/// One parameter of one or several numbers. As JSON, a single number is a number and no list.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parameter {
    pub value: Vec<f64>,
    /// Their 95 % intervals; null where the clips say nothing.
    pub ci95: Vec<[f64; 2]>,
    pub unit: String,
    /// Where the search began: cell.toml's or the given parameters' values.
    pub start: Vec<f64>,
    /// Whether it is a single number by its nature, not a list that happens to hold one.
    pub single: bool,
}

impl Serialize for Parameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("Parameter", 4)?;
        if let (true, [value], [ci95], [start]) = (self.single, &self.value[..], &self.ci95[..], &self.start[..]) {
            fields.serialize_field("value", value)?;
            fields.serialize_field("ci95", ci95)?;
            fields.serialize_field("start", start)?;
        } else {
            fields.serialize_field("value", &self.value)?;
            fields.serialize_field("ci95", &self.ci95)?;
            fields.serialize_field("start", &self.start)?;
        }
        fields.serialize_field("unit", &self.unit)?;
        fields.end()
    }
}

/// A number that is not identifiable from the clips.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct NotIdentifiable {
    pub parameter: String,
    /// The reason, and what would help.
    pub why: String,
}

/// Mean figures of a set of clips.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Root mean square over joints and rows [rad].
    pub joint_rms_rad: Option<f64>,
    /// Mean over the rows of the 2-norm of the joints' errors [rad].
    pub joint_norm_rad: Option<f64>,
    /// Root mean square of a slide's position [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_rms_m: Option<f64>,
    /// ADD of the object [m].
    pub object_add_m: Option<f64>,
    /// ADD-S of the object [m].
    pub object_add_s_m: Option<f64>,
}

/// How far the twin is off, with what was found and (`before`) with what the search began with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Gap {
    /// Clips that were fitted.
    pub train: Figures,
    /// Clips that were not.
    pub holdout: Figures,
    /// Clips that were fitted, before.
    pub train_before: Figures,
    /// Clips that were not, before.
    pub holdout_before: Figures,
}

/// Files of clips by their use.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Clips {
    pub train: Vec<String>,
    pub holdout: Vec<String>,
    /// Not usable, and why.
    pub left_out: Vec<LeftOut>,
}

/// How far the twin is off in one clip.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ClipGap {
    pub file: String,
    /// `fitted` or `held out`.
    pub used: String,
    /// Root mean square of each joint's error [rad].
    pub joint_rms_rad: Vec<f64>,
    /// With what was found.
    pub after: Figures,
    /// With what the search began with.
    pub before: Figures,
    /// What is odd about it.
    pub warnings: Vec<String>,
}

/// What one more recording would bring.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Advice {
    /// What to record.
    pub record: String,
    /// The number that it sharpens.
    pub parameter: String,
    /// Half its 95 % interval now.
    pub now: f64,
    /// Half its 95 % interval then, predicted.
    pub predicted: f64,
}

impl Figures {
    /// Mean of some clips' figures.
    pub fn mean(figures: &[Self]) -> Self {
        let of = |figure: fn(&Self) -> Option<f64>, power: i32| {
            let values: Vec<f64> = figures.iter().filter_map(figure).collect();
            let mean = values.iter().map(|v| v.powi(power)).sum::<f64>() / values.len() as f64;
            (!values.is_empty()).then(|| mean.powf(1.0 / f64::from(power)))
        };
        Self {
            joint_rms_rad: of(|f| f.joint_rms_rad, 2),
            joint_norm_rad: of(|f| f.joint_norm_rad, 1),
            joint_rms_m: of(|f| f.joint_rms_m, 2),
            object_add_m: of(|f| f.object_add_m, 1),
            object_add_s_m: of(|f| f.object_add_s_m, 1),
        }
    }
}
