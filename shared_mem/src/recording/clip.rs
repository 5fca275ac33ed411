//! A clip as callers see it, whatever it was recorded with.

use super::checks;
use super::error::ReadError;
use super::joint_log::{self, JointLog, Wanted};
use super::series::{JointSeries, ObjectSeries};
use crate::cell::{Cell, ClipKind};
use crate::origin::Origins;
use std::path::{Path, PathBuf};

/// One recorded clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// File or folder it was read from.
    pub file: PathBuf,
    /// What was done in it.
    pub kind: ClipKind,
    /// Names of the joints, in the order of both series.
    pub joint_names: Vec<String>,
    /// What the arm was told: `q_d`, `dq_d` and, where logged, `tau_J_d` (without gravity). Empty without an arm.
    pub desired: JointSeries,
    /// What the arm did: `q`, `dq` and, where logged, `tau_J` (with gravity). Empty without an arm.
    pub measured: JointSeries,
    /// Whether a row's torques acted in the control period that ends at its stamp, as in the states of an arm, or in the one
    /// that begins there, as where a controller logs what it has just calculated.
    pub torques_end_at_rows: bool,
    /// Where the object was that cell.toml's [`Cell::object`] is. Empty when it was not tracked.
    pub object: ObjectSeries,
    /// Where the other objects of cell.toml were, in its order.
    pub others: Vec<TrackedObject>,
    /// Where it comes from, as far as it says.
    pub origins: Origins,
    /// What was found odd in it, one sentence each.
    pub warnings: Vec<String>,
    /// The part of the file that could not be read; `None` when the file is whole.
    pub damage: Option<String>,
}

/// An object beside the one that a command is about.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedObject {
    /// Its name in cell.toml.
    pub name: String,
    /// Where it was; empty when it was not tracked.
    pub series: ObjectSeries,
}

impl Clip {
    /// A clip of nothing.
    pub(super) fn empty(path: &Path, kind: ClipKind) -> Self {
        Self {
            file: path.to_owned(),
            kind,
            joint_names: Vec::new(),
            desired: JointSeries::default(),
            measured: JointSeries::default(),
            torques_end_at_rows: false,
            object: ObjectSeries::default(),
            others: Vec::new(),
            origins: Origins::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    /// Puts the joints of both series into the order of `names`; joints that are not named are left out.
    ///
    /// # Errors
    /// [`ReadError::Content`] when a wanted joint is not in the clip; names both lists.
    pub fn reorder(mut self, names: &[String]) -> Result<Self, ReadError> {
        if self.joint_names == names {
            return Ok(self);
        }
        let columns = joint_log::columns(names, &self.joint_names).ok_or_else(|| {
            let what = format!(
                "the model's joints are [{}], the recording has [{}]; list the recording's, from base to flange, as \
                 `joints` beside `urdf` in `[robot]` of cell.toml",
                names.join(", "),
                self.joint_names.join(", ")
            );
            ReadError::content(&self.file, "joint names", what)
        })?;
        self.desired = self.desired.select_columns(&columns);
        self.measured = self.measured.select_columns(&columns);
        self.joint_names = names.to_vec();
        Ok(self)
    }

    /// The clip as if it had just been read with these rows: what is mended in reading is mended, and what is odd stands in
    /// [`Clip::warnings`]. For clips that were made or changed in memory.
    ///
    /// # Errors
    /// [`ReadError::Content`] when more than 1 % of its rows cannot be used.
    pub fn checked(mut self) -> Result<Self, ReadError> {
        let file = self.file.clone();
        let fail = |topic: &str| {
            let (file, topic) = (file.clone(), topic.to_owned());
            move |what: String| ReadError::content(&file, &topic, what)
        };
        if !self.measured.is_empty() {
            let measured = (std::mem::take(&mut self.measured), "measured");
            let desired = (std::mem::take(&mut self.desired), "desired");
            let (measured, desired, found) = mended(&file, &self.joint_names, measured, desired)?;
            (self.measured, self.desired) = (measured, desired);
            self.warnings.extend(found);
        }
        let topic = "object";
        let ObjectSeries { stamps_ns, poses } = std::mem::take(&mut self.object);
        let rows = stamps_ns.into_iter().zip(poses.into_iter().map(Some)).collect();
        let (object, found) = checks::object(rows, topic).map_err(fail(topic))?;
        self.warnings.extend(found);
        let (object, warning) = checks::beside_arm(object, &self.measured, topic).map_err(fail(topic))?;
        self.object = object;
        self.warnings.extend(warning);
        Ok(self)
    }
}

/// Joint order that a cell.toml asks for.
pub(super) fn wanted_joints(cell: &Cell) -> Wanted {
    match &cell.robot {
        Some(robot) if !robot.joints.is_empty() => Wanted::Names(robot.joints.clone()),
        Some(robot) if robot.model.is_some() => Wanted::Model((1..=7).map(|i| format!("fr3_joint{i}")).collect()),
        _ => Wanted::Any,
    }
}

/// Names for recordings that only number their joints: those of cell.toml where their number fits.
pub(super) fn numbered_joints(cell: &Cell, dof: usize) -> Vec<String> {
    match wanted_joints(cell) {
        Wanted::Names(names) | Wanted::Model(names) if names.len() == dof => names,
        _ => (1..=dof).map(|i| format!("joint{i}")).collect(),
    }
}

/// Rows of the two joint topics as checked series in one joint order.
pub(super) struct Joints {
    pub(super) names: Vec<String>,
    pub(super) desired: JointSeries,
    pub(super) measured: JointSeries,
    pub(super) warnings: Vec<String>,
}

/// A topic's name and its rows.
pub(super) struct NamedLog<'a> {
    pub(super) topic: &'a str,
    pub(super) log: JointLog,
}

/// Orders, aligns and checks the two joint topics of a file.
pub(super) fn joints(
    path: &Path,
    measured: NamedLog<'_>,
    desired: NamedLog<'_>,
    wanted: &Wanted,
) -> Result<Joints, ReadError> {
    let fail = |topic: &str| {
        let topic = topic.to_owned();
        move |what: String| ReadError::content(path, &topic, what)
    };
    let ordered = measured.log.finish(measured.topic, wanted).map_err(fail(measured.topic))?;
    let (names, measured_series) = (ordered.names, ordered.series);
    let mut warnings = ordered.warnings;
    let wanted = match wanted {
        Wanted::Any => &Wanted::Names(names.clone()),
        given => given,
    };
    let ordered = desired.log.finish(desired.topic, wanted).map_err(fail(desired.topic))?;
    // What holds for both topics is said once.
    warnings.extend(ordered.warnings.into_iter().filter(|warning| !warnings.contains(warning)).collect::<Vec<_>>());
    let (measured, desired) = ((measured_series, measured.topic), (ordered.series, desired.topic));
    let (measured, desired, found) = mended(path, &names, measured, desired)?;
    warnings.extend(found);
    Ok(Joints { names, desired, measured, warnings })
}

/// Checks the two joint topics, each with its name, alone and side by side: both as mended, and what was found.
fn mended(
    path: &Path,
    names: &[String],
    measured: (JointSeries, &str),
    desired: (JointSeries, &str),
) -> Result<(JointSeries, JointSeries, Vec<String>), ReadError> {
    let mut warnings = Vec::new();
    let mut alone = |(series, topic): (JointSeries, &str)| -> Result<JointSeries, ReadError> {
        let (series, found) =
            checks::joints(series, topic, names).map_err(|what| ReadError::content(path, topic, what))?;
        warnings.extend(found);
        Ok(series)
    };
    let topics = [measured.1.to_owned(), desired.1.to_owned()];
    let (mut measured, mut desired) = (alone(measured)?, alone(desired)?);
    for (series, topic) in [&measured, &desired].into_iter().zip(&topics) {
        warnings.extend(checks::gaps(&series.stamps_ns, topic));
    }
    warnings.extend(checks::pair(&mut desired, &mut measured));
    Ok((measured, desired, warnings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_made_in_memory_is_mended_as_one_that_is_read() {
        let series = JointSeries {
            stamps_ns: (0..100).map(|i| i * 1_000_000).collect(),
            dof: 1,
            q: (0..100).map(|i| f64::from(i) * 1e-3).collect(),
            dq: vec![],
            tau: vec![],
        };
        let mut clip = Clip {
            joint_names: vec!["a".into()],
            desired: series.clone(),
            measured: series,
            ..Clip::empty(Path::new("a"), ClipKind::Excitation)
        };
        assert_eq!(clip.clone().checked().expect("a clip"), clip);
        clip.measured.q[0] = 1.0;
        let mended = clip.checked().expect("a clip");
        assert_eq!(mended.measured.len(), 99);
        assert!(mended.warnings[0].contains("`measured`: the first row lies 0.999 rad"), "{:?}", mended.warnings);
    }
}
