//! A session looked at: all clips, alone and beside each other.

use super::columns::Columns;
use super::good_for::{self, Fitness};
use super::lag::{self, Lag};
use super::picture::{self, Picture};
use super::remark::{Fault, Remark, Severity, merged};
use super::{
    constant, elsewhere, fall, order, publishers, range, rates, reader, stamps, standing, torque, units, velocity,
};
use nalgebra::Point3;
use rayon::prelude::*;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::recording::{Clip, Session, SessionFiles};
use twin::arm::ArmModel;
use twin::replay::in_model_order;

/// What was found about a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// The session's folder.
    pub session: String,
    /// Of several objects in cell.toml the one that this is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// How it was named.
    #[serde(skip)]
    pub files: SessionFiles,
    /// What is odd about it, worst first.
    pub remarks: Vec<Remark>,
    /// Its clips.
    pub clips: Vec<ClipFacts>,
    /// What is missing for verbs that no clip is good for, or that need more than the clips are.
    pub missing: Vec<good_for::Missing>,
    /// What the page draws.
    #[serde(skip)]
    pub pictures: Vec<Picture>,
}

/// Facts about a clip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipFacts {
    /// Its file, as cell.toml lists it.
    pub file: String,
    /// What was done in it.
    pub kind: ClipKind,
    /// How long it lasts; null where it cannot be read [s].
    pub seconds: Option<f64>,
    /// Rows a second of the measured joints, the commands and the object's poses; null where there are none [Hz].
    pub rates_hz: [Option<f64>; 3],
    /// How much later than commanded the arm moves; null where no motion tells it.
    pub lag: Option<Lag>,
    /// What it is good for, verb by verb.
    pub good_for: Vec<Fitness>,
}

/// What was found in clips.
pub struct Found {
    /// Remarks, worst first.
    pub remarks: Vec<Remark>,
    pub(super) clips: Vec<Looked>,
}

/// A clip that was looked at.
pub(super) struct Looked {
    pub(super) columns: Columns,
    pub(super) lag: Option<Lag>,
    pub(super) fall: Option<fall::Fall>,
    remarks: Vec<Remark>,
}

/// What the detectors need of a cell.
pub(super) struct Known<'a> {
    pub(super) cell: &'a Cell,
    pub(super) arm: Option<ArmModel>,
    corners: Vec<Point3<f64>>,
}

impl<'a> Known<'a> {
    pub(super) fn of(cell: &'a Cell) -> Self {
        Self { cell, arm: ArmModel::from_cell(cell).ok(), corners: standing::corners(cell).unwrap_or_default() }
    }
}

/// Looks at clips of a cell, each with its file as cell.toml lists it.
#[must_use]
pub fn check_clips(cell: &Cell, clips: &[(String, Clip)]) -> Found {
    let known = Known::of(cell);
    let looked: Vec<Looked> = clips.par_iter().map(|(file, clip)| look(file, clip, &known)).collect();
    let mut remarks: Vec<Remark> = looked.iter().flat_map(|looked| looked.remarks.iter().cloned()).collect();
    let lags: Vec<(&Columns, Lag)> = looked.iter().filter_map(|l| Some((&l.columns, l.lag?))).collect();
    remarks.extend(lag::remarks(&lags));
    let falls: Vec<(&Columns, fall::Fall)> =
        looked.iter().filter_map(|l| Some((&l.columns, l.fall.clone()?))).collect();
    remarks.extend(fall::remarks(&falls));
    Found { remarks: merged(remarks), clips: looked }
}

fn look(file: &str, clip: &Clip, known: &Known<'_>) -> Looked {
    let arm = known.arm.as_ref();
    let ordered = arm.and_then(|arm| in_model_order(clip.clone(), arm).ok());
    // Without the model's joints nothing is held against the model.
    let arm = arm.filter(|_| ordered.is_some());
    let mut columns = Columns::of(file, ordered.as_ref().unwrap_or(clip));
    let mut remarks = reader::remarks(&columns);
    if let Some(clock) = stamps::clock(&columns) {
        // Gaps by stamps of another unit are those of its rounding.
        remarks.retain(|remark| !matches!(remark.fault, Fault::LostSamples | Fault::StampOrder));
        remarks.push(clock.remark);
        columns = columns.with_clock(clock.factor);
    } else {
        remarks.extend(stamps::uneven(&columns));
    }
    let is_known = |fault: Fault, remarks: &[Remark]| remarks.iter().any(|remark| remark.fault == fault);
    if !is_known(Fault::TwoPublishers, &remarks) {
        remarks.extend(publishers::remarks(&columns));
    }
    remarks.extend(constant::remarks(&columns));
    let mut lag = None;
    if !is_known(Fault::TwoPublishers, &remarks) {
        remarks.extend(rates::remarks(&columns));
        remarks.extend(velocities(&mut columns));
        lag = joints(&mut columns, arm, &mut remarks);
    }
    if !columns.object.is_empty() && !is_known(Fault::Quaternion, &remarks) && !is_known(Fault::LengthUnit, &remarks) {
        remarks.extend(standing::remarks(&columns, known.cell, &known.corners));
        // What is wrong with joints or poses puts them elsewhere, too.
        let odd = |r: &Remark| {
            r.severity == Severity::Wrong || matches!(r.fault, Fault::LengthUnit | Fault::PlaceholderConstant)
        };
        if !remarks.iter().any(odd) {
            remarks.extend(elsewhere::remark(file, clip, known.cell));
        }
    }
    let fall = fall::of(&columns, known.cell, &known.corners);
    Looked { columns, lag, fall, remarks }
}

/// Velocities against slopes; those of another unit are taken as mended from here on.
fn velocities(columns: &mut Columns) -> Vec<Remark> {
    let found = velocity::remarks(columns);
    if found.iter().any(|remark| remark.fault == Fault::VelocityUnit) {
        columns.measured.dq.clear();
    }
    found
}

/// Commands against measurements, and both against the model.
fn joints(columns: &mut Columns, arm: Option<&ArmModel>, remarks: &mut Vec<Remark>) -> Option<Lag> {
    if let Some(units::Converted { factor, remark }) = units::converted(columns, arm) {
        // The reader may have noticed the ratio, but not which topic is wrong.
        remarks.retain(|other| other.fault != Fault::CommandUnit);
        remarks.push(remark);
        columns.desired.q.iter_mut().flatten().for_each(|q| *q *= factor);
        columns.desired.noise.iter_mut().for_each(|noise| *noise *= factor);
    }
    let lag = lag::of(columns);
    let silent = |channel: &str| remarks.iter().any(|r| r.fault == Fault::PlaceholderConstant && r.channel == channel);
    let held = remarks.iter().any(|r| r.fault == Fault::HeldRows && r.channel == "measured");
    // Rows that repeat older ones have no accelerations.
    let (no_position, no_torque) = (silent("measured q"), held || silent("measured effort"));
    if no_position {
        return lag;
    }
    let paired = order::remarks(columns, lag.as_ref());
    // What the commands contradict already, the model need not contradict again.
    if paired.is_empty()
        && let Some(arm) = arm
    {
        let wraps = remarks.iter().any(|remark| remark.fault == Fault::AngleWraps);
        remarks.extend(against_model(columns, arm, wraps, no_torque));
    }
    remarks.extend(paired);
    lag
}

/// Ranges and torques against the model. Torques tell exchanged joints from turned ones, which ranges may not.
fn against_model(columns: &Columns, arm: &ArmModel, wraps: bool, no_torque: bool) -> Vec<Remark> {
    // An angle that wraps leaves its range.
    let beyond = if wraps { Vec::new() } else { range::remarks(columns, arm) };
    let degrees = beyond.iter().any(|remark| remark.fault == Fault::Degrees);
    let torques = if degrees || no_torque { Vec::new() } else { torque::remarks(columns, arm) };
    let explained = torques.iter().any(|remark| matches!(remark.fault, Fault::JointOrder | Fault::JointSign));
    let sure = beyond.iter().any(|remark| remark.fault != Fault::BeyondLimits);
    match (explained, sure) {
        (true, _) => torques,
        (_, true) => beyond,
        _ => beyond.into_iter().chain(torques).collect(),
    }
}

/// Looks at a session: everything of it, for the verb.
#[must_use]
pub fn check(session: &Session) -> Checked {
    let Read { clips, unread } = Read::of(session);
    let Found { mut remarks, clips: looked } = check_clips(&session.cell, &clips);
    remarks.extend(unread.iter().map(|(file, why)| unreadable(file, why)));
    let fitness = good_for::of(session, &clips, &unread, &remarks);
    let pictures = picture::all(&Known::of(&session.cell), &looked, &remarks);
    let facts = session.clips.iter().zip(fitness).map(|(entry, good_for)| {
        let file = entry.file.display().to_string();
        let clip = clips.iter().find(|(name, _)| *name == file).map(|(_, clip)| clip);
        let seen = looked.iter().find(|looked| looked.columns.file == file);
        ClipFacts {
            kind: entry.kind,
            seconds: clip.map(|clip| clip.measured.duration().max(clip.object.duration())),
            rates_hz: seen.map_or([None; 3], rates_of),
            lag: seen.and_then(|looked| looked.lag),
            good_for,
            file,
        }
    });
    let clips: Vec<ClipFacts> = facts.collect();
    let missing = good_for::missing(session, &clips);
    let (folder, files) = (session.folder.display().to_string(), session.files.clone());
    let object = session.cell.one_of_several().map(str::to_owned);
    Checked { session: folder, object, files, remarks: merged(remarks), clips, missing, pictures }
}

/// The clips of a session.
pub(super) struct Read {
    /// Those that can be read, with their files.
    pub(super) clips: Vec<(String, Clip)>,
    /// Files of those that cannot, and why.
    pub(super) unread: Vec<(String, String)>,
}

impl Read {
    pub(super) fn of(session: &Session) -> Self {
        let read = |entry: &ClipEntry| {
            let file = entry.file.display().to_string();
            session.read(entry).map(|clip| (file.clone(), clip)).map_err(|error| (file, error.to_string()))
        };
        let all: Vec<Result<(String, Clip), (String, String)>> = session.clips.par_iter().map(read).collect();
        let (mut clips, mut unread) = (Vec::new(), Vec::new());
        for one in all {
            match one {
                Ok(clip) => clips.push(clip),
                Err(why) => unread.push(why),
            }
        }
        Self { clips, unread }
    }
}

fn unreadable(file: &str, why: &str) -> Remark {
    let (what, remedy) = why.rsplit_once("; ").unwrap_or((why, ""));
    let fault = if why.contains("different clocks") { Fault::DifferentClocks } else { Fault::CutFile };
    Remark::new(fault, file, "file", what).mended_by(remedy)
}

fn rates_of(looked: &Looked) -> [Option<f64>; 3] {
    let Columns { measured, desired, pose_t, .. } = &looked.columns;
    let of = |t: &[f64]| {
        let step = super::statistics::median(t.windows(2).map(|w| w[1] - w[0]).collect());
        (step > 0.0).then(|| 1.0 / step)
    };
    [of(&measured.t), of(&desired.t), of(pose_t)]
}
