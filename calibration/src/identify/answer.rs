//! What an identification found: one structure for the JSON answer, the page and the terminal. SI units.

use super::sheet::{Clip as SheetClip, Error as SheetError, Parameter as SheetParameter, Sheet};
use crate::page::{Trace, number_in_words};
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
    pub not_identifiable: Vec<Untold>,
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
    /// Whether the search arrived at an end.
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
pub struct Untold {
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

/// A clip that was not used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub file: String,
    pub why: String,
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

impl Identification {
    /// The same for page and terminal.
    pub fn sheet(&self) -> Sheet {
        let parameters = self.parameters.iter().map(|(name, parameter)| self.sheet_parameter(name, parameter));
        let sets = [
            ("clips fitted", &self.gap.train_before, &self.gap.train),
            ("clips held out", &self.gap.holdout_before, &self.gap.holdout),
        ];
        let mut errors = Vec::new();
        for (set, before, after) in sets.into_iter().rev() {
            let mut push = |what: &str, unit: &str, before: Option<f64>, after: Option<f64>| {
                if let Some(after) = after {
                    errors.push(SheetError { name: format!("{what}, {set}"), unit: unit.into(), before, after });
                }
            };
            push("ADD", "m", before.object_add_m, after.object_add_m);
            push("ADD-S", "m", before.object_add_s_m, after.object_add_s_m);
            push("joint error (RMS)", "rad", before.joint_rms_rad, after.joint_rms_rad);
            push("joint error (RMS)", "m", before.joint_rms_m, after.joint_rms_m);
        }
        let clip = |clip: &ClipGap| SheetClip {
            file: clip.file.clone(),
            used: clip.used.clone(),
            error: [clip.before, clip.after].map(|f| f.object_add_m.or(f.joint_rms_rad).or(f.joint_rms_m)),
            remark: clip.warnings.join("; "),
        };
        let left_out = |clip: &LeftOut| SheetClip {
            file: clip.file.clone(),
            used: "left out".into(),
            error: [None; 2],
            remark: clip.why.clone(),
        };
        Sheet {
            target: self.target.clone(),
            session: self.session.clone(),
            origin: self.origin.clone(),
            files: self.files.clone(),
            sentence: self.sentence(),
            parameters: parameters.collect(),
            not_identifiable: self
                .not_identifiable
                .iter()
                .map(|u| [number_in_words(&u.parameter), u.why.clone()])
                .collect(),
            errors,
            clips: self.by_clip.iter().map(clip).chain(self.clips.left_out.iter().map(left_out)).collect(),
            clip_error: match self.gap.train {
                Figures { object_add_m: Some(_), .. } => ["ADD", "m"],
                Figures { joint_rms_m: Some(_), .. } => ["joint error (RMS)", "m"],
                _ => ["joint error (RMS)", "rad"],
            },
            traces: self.traces.clone(),
            convergence: self.convergence.clone(),
            names: self.names.iter().map(|name| number_in_words(name)).collect(),
            correlation: self.correlation.clone(),
            advice: self.advice.iter().map(Advice::sentence).collect(),
            notes: self.warnings.clone(),
            provenance: vec![
                ["origin".into(), self.origin.clone()],
                ["way of searching".into(), self.optimizer.clone()],
                ["clips simulated".into(), self.evaluations.to_string()],
                ["wall time".into(), format!("{:.1} s", self.seconds)],
            ],
            theta_file: self.theta_file.clone(),
        }
    }

    /// The finding in one sentence.
    pub fn sentence(&self) -> String {
        let known = self.names.len() - self.not_identifiable.len().min(self.names.len());
        let figure = |f: &Figures| {
            f.object_add_m
                .map(|m| format!("{:.2} mm ADD", m * 1e3))
                .or_else(|| f.joint_rms_rad.map(|rad| format!("{:.3} mrad", rad * 1e3)))
                .or_else(|| f.joint_rms_m.map(|m| format!("{:.3} mm", m * 1e3)))
        };
        let (set, before, after) = if self.clips.holdout.is_empty() {
            ("the clips it was fitted to", &self.gap.train_before, &self.gap.train)
        } else {
            ("held-out clips", &self.gap.holdout_before, &self.gap.holdout)
        };
        let end = if self.converged { "" } else { "; the search did not arrive at an end" };
        match (figure(before), figure(after)) {
            (Some(before), Some(after)) => format!(
                "{known} of {} numbers are identifiable; on {set} the twin is off by {after} instead of {before}{end}",
                self.names.len()
            ),
            _ => format!("{known} of {} numbers are identifiable{end}", self.names.len()),
        }
    }

    fn sheet_parameter(&self, name: &str, parameter: &Parameter) -> SheetParameter {
        let part = |k: usize| if parameter.value.len() > 1 { format!("{name}[{k}]") } else { name.to_owned() };
        let warning = |k: usize| {
            let part = part(k);
            if self.at_bounds.contains(&part) {
                return Some("at a bound of its search".to_owned());
            }
            self.not_identifiable.iter().any(|u| u.parameter == part).then(|| "not identifiable".to_owned())
        };
        SheetParameter {
            name: name.into(),
            unit: parameter.unit.clone(),
            values: parameter.value.clone(),
            intervals: parameter.ci95.clone(),
            nominal: parameter.start.clone(),
            warnings: (0..parameter.value.len()).map(warning).collect(),
        }
    }
}

impl Advice {
    fn sentence(&self) -> String {
        let share = 100.0 * (1.0 - self.predicted / self.now);
        format!("{} narrows the interval of {} by {share:.0} %", self.record, number_in_words(&self.parameter))
    }
}
