//! The answer of a diagnosis, as it is written to diagnosis.json and shown on the page.

use super::{Size, Trace};
use capture::arm_motion::ArmMotion;
use capture::rate::RATE;
use inference::engine::Used;
use inference::witness::Witness;
use shared_mem::cell::Cell;
use shared_mem::recording::SessionFiles;
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What was found about a session.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Diagnosis {
    pub verdict: Verdict,
    /// How large the gap is.
    pub gap: Gap,
    /// What comes nearest to explaining a gap that nothing explains; none where nothing comes near, or something explains it.
    pub nearest: Option<Nearest>,
    /// Whose the object's gap is, where an arm hits it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_test: Option<StageTest>,
    /// What single stages of strokes say by themselves, without a roll-out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub witnesses: Vec<Witness>,
    /// Where it lies; shares sum to 1 over everything that was measured.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// Every effect that was tested, likeliest first.
    pub candidates: Vec<Candidate>,
    /// The one clip that separates the leaders; empty where nothing is left to separate.
    pub next_experiment: String,
    /// The commands that record it, in this order, as they can be typed.
    pub next_commands: Vec<String>,
    /// The motions of it, where no bridge drives the arm.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub next_motions: Vec<NextMotion>,
    /// What to do about the effects that are named, in the cell and in a model.
    pub remedies: Vec<Remedy>,
    /// Which clips were used for what.
    pub clips: Clips,
    /// What a reader has to know about the clips, one sentence each.
    pub warnings: Vec<String>,
    /// Whether the time that was given was spent before everything was tried: then this is the best answer so far.
    pub budget_spent: bool,
    /// The program that simulated the arm; none where the twin did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<Used>,
    /// Wall-clock time [s].
    pub seconds: f64,
    /// Of several objects in cell.toml the one that this is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// The session's folder.
    pub session: String,
    /// Where its clips come from, in words.
    pub origin: String,
    /// What the laboratory knows about its cell, for the page's picture of the robot.
    #[serde(skip)]
    pub cell: Cell,
    /// How it was named.
    #[serde(skip)]
    pub files: SessionFiles,
    /// What everything random was drawn from.
    pub seed: u64,
    /// The parameters identified first, and the effects named.
    pub theta: Theta,
    /// Where [`Self::theta`] was written.
    pub theta_file: Option<PathBuf>,
    /// Residuals of the confirm clips without and with the effects, for the page.
    #[serde(skip)]
    pub traces: Vec<Trace>,
}

/// A motion to be played by whatever drives the arm.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NextMotion {
    pub text: String,
    /// Where it was written: a CSV of a row a control cycle, time [s] and the position of each joint [rad].
    pub file: Option<PathBuf>,
    /// Rows a second of that file [Hz].
    pub rate_hz: f64,
    /// How long it lasts [s]; none where it was not planned.
    pub seconds: Option<f64>,
    /// Why there is no file.
    pub why: Option<String>,
    /// What is to be planned.
    #[serde(skip)]
    pub motion: ArmMotion,
}

impl NextMotion {
    /// A motion that nobody has planned yet.
    pub fn new(motion: ArmMotion) -> Self {
        let (text, why) =
            (motion.in_words(), "with --report or --out it is written beside that file as CSV".to_owned());
        Self { text, file: None, rate_hz: RATE, seconds: None, why: Some(why), motion }
    }

    /// In a line, with where it is or why it is nowhere.
    pub fn in_words(&self) -> String {
        let Self { text, file, rate_hz, seconds, why, .. } = self;
        match (file, seconds, why) {
            (Some(file), Some(seconds), _) => {
                format!("{text}: {} ({seconds:.1} s, {rate_hz} rows a second)", file.display())
            }
            (.., Some(why)) => format!("{text} ({why})"),
            _ => text.clone(),
        }
    }
}

impl Diagnosis {
    /// Whether any parameter was identified: clips that say too little tell none.
    pub fn identifies(&self) -> bool {
        !self.clips.train.is_empty()
    }
}

#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// Which of the five it is.
    pub kind: Kind,
    /// Effects named, or the members of the class.
    pub effects: Vec<String>,
    /// How sure, 0 to 1.
    pub confidence: f64,
    /// One sentence that a person understands.
    pub text: String,
    /// Share of the squared gap that the effects close on held-out clips, where they are named on a gap that is not closed
    /// whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explained_share: Option<Share>,
    /// What they leave of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest: Option<Rest>,
}

/// What named effects leave of a gap, on held-out clips.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Rest {
    /// Root mean square over joints and time [rad]; none without an arm.
    pub joint_rms_rad: Option<f64>,
    /// Mean ADD [m]; none without an object.
    pub object_add_m: Option<f64>,
    /// Where it is largest, in words: `joint 2 (fast forward)`.
    #[serde(rename = "where")]
    pub place: String,
    /// The effect whose signature explains most of it; none where no effect's explains much.
    pub looks_like: Option<String>,
}

/// What the confidence of a verdict is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Estimated from the clips of the session.
    Estimate,
    /// The largest that is ever given: so many verdicts of the kind were right on simulated sessions, however much the clips
    /// say.
    Limit,
    /// How often verdicts of the kind were right on simulated sessions; the clips of the session are not in it.
    Rate,
    /// There is nothing to be sure of.
    Nothing,
}

/// The five verdicts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// No gap beyond the noise.
    #[default]
    None,
    /// One to four effects cause it.
    Named,
    /// One of several effects causes it, and the clips cannot tell which.
    Class,
    /// There is a gap that no effect of the library explains.
    Unexplained,
    /// The clips cannot tell.
    NotTestable,
}

/// The gap on the confirm clips.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Gap {
    /// `sigma`: [`Self::before`], [`Self::after`] and [`Self::floor`] are mean squares of residuals in units of their noise.
    pub unit: &'static str,
    /// With the paper's parameters identified.
    pub before: f64,
    /// With the effects too.
    pub after: f64,
    /// What noise and scatter alone leave.
    pub floor: f64,
    /// `1 - after / before`, at least -1: a gap that more than doubles.
    pub shrink: Share,
    /// `(before - after) / (before - floor)`.
    pub explainable_fraction: f64,
    /// Root mean square over joints and time [rad].
    pub joint_rms_rad: Change,
    /// Root mean square of each joint's torque beyond the predicted one [N m], where torques along the measured motion are
    /// explained.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_rms: Option<TorqueRms>,
    /// Mean ADD [m].
    pub object_add_m: Change,
    /// Mean ADD-S [m].
    pub object_add_s_m: Change,
    /// The same of the clip in the middle.
    pub median: Medians,
    /// The gap of each kind of sensor by itself.
    pub sensors: Vec<SensorGap>,
    /// That of the arm, joint by joint.
    pub joints: Vec<JointGap>,
}

/// Medians over clips: a hit on a corner decides none of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Medians {
    /// Of the root mean square over joints and time [rad].
    pub joint_rms_rad: Change,
    /// Of ADD [m].
    pub object_add_m: Change,
    /// Of ADD-S [m].
    pub object_add_s_m: Change,
}

/// The gap of one kind of sensor: mean squares of residuals in units of their noise, in a clip like most (the geometric mean over
/// all clips).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SensorGap {
    pub sensors: Sensors,
    /// With the paper's parameters identified.
    pub before: f64,
    /// With all effects that the search found, named or not.
    pub after: f64,
    /// What noise and scatter alone leave.
    pub floor: f64,
}

/// The arm's gap in one joint, as [`SensorGap`] has it of all.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct JointGap {
    /// From 1, as a laboratory counts.
    pub joint: usize,
    /// With the paper's parameters identified.
    pub before: f64,
    /// With all effects that the search found, named or not.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
}

/// Kinds of sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensors {
    /// Encoders, torque sensors: the arm.
    Joints,
    /// Poses of the object.
    Object,
}

/// Root mean square over time of each joint's torque beyond the predicted one [N m].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TorqueRms {
    /// Without the effects.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
}

impl TorqueRms {
    /// Over all joints, too.
    pub fn over_joints(&self) -> Change {
        let all = |joints: &[f64]| {
            Some((joints.iter().map(|joint| joint * joint).sum::<f64>() / joints.len().max(1) as f64).sqrt())
        };
        Change { before: all(&self.before), after: all(&self.after) }
    }
}

/// Effects that close a part of the gap but leave more than a cause does.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Nearest {
    /// Names of the registry.
    pub effects: Vec<String>,
    /// [`Gap::shrink`] with them.
    pub shrink: Share,
}

/// A share with its 90 % interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Share {
    pub value: f64,
    /// Its interval over clips.
    pub ci90: [f64; 2],
}

/// A quantity before and after; none where it was not measured.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Change {
    /// Without the effects.
    pub before: Option<f64>,
    pub after: Option<f64>,
}

/// The object under the simulated and under the recorded arm, on held-out clips without effects.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StageTest {
    /// Mean ADD where the twin moves the arm [m].
    pub simulated_arm_add_m: f64,
    /// Mean ADD where the arm moves as it was measured to [m].
    pub recorded_arm_add_m: f64,
    /// Share of the first that is gone in the second.
    pub of_the_arm: f64,
    pub clips: usize,
    /// In how many of them the recorded arm does not touch the object.
    pub untouched: usize,
    /// What that means, in words.
    pub text: String,
}

/// A cell of the map of where the gap lies.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Place {
    /// `control`, `hit`, `slide`, `rest` or `camera`.
    pub stage: String,
    /// `joint2`, `x`, `yaw`.
    pub channel: String,
    /// What was going on.
    pub regime: String,
    /// Share of the squared gap beyond the noise.
    pub share: f64,
}

/// What became of one effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// Name of the registry.
    pub effect: String,
    /// Calibrated probability that it acts.
    pub probability: f64,
    /// Its parameters, by name; empty where it was not fitted.
    pub parameters: BTreeMap<String, Size>,
    /// What it adds to [`Gap::shrink`]: alone, or beside the effects that were named before it.
    pub shrink: Share,
    /// Effects that these clips cannot tell from it.
    pub confusable_with: Vec<String>,
    /// What became of it.
    pub status: Status,
    /// The reason, in words.
    pub why: String,
}

/// What became of a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    Named,
    /// It may act.
    Possible,
    /// It does not act, or too weakly to be seen.
    RuledOut,
    /// It could not have been seen.
    NotTestable,
}

/// Files of the clips by use.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Clips {
    pub train: Vec<String>,
    /// Chose between effects.
    pub choose: Vec<String>,
    /// Opened once, at the end.
    pub confirm: Vec<String>,
}

/// What to do about one effect.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Remedy {
    /// Name of the registry.
    pub effect: String,
    /// On the hardware, in the robot's settings, or in cell.toml.
    pub in_cell: String,
    /// In a model of the cell, whichever simulator it is for.
    pub in_model: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_written_as_others_read_them() {
        assert_eq!(serde_json::to_string(&Kind::NotTestable).expect("JSON"), "\"not_testable\"");
        assert_eq!(serde_json::to_string(&Status::RuledOut).expect("JSON"), "\"ruled_out\"");
    }
}
