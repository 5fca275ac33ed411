//! A session looked at: all clips, alone and beside each other.

use super::columns::Columns;
use super::fall;
use super::good_for::{self, Fitness};
use super::lag::{self, Lag};
use super::look::{Known, Looked, look};
use super::origins;
use super::picture::{self, Picture};
use super::remark::{Fault, Remark, merged};
use import::lag::Group;
use rayon::prelude::*;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::origin::Origins;
use shared_mem::recording::{Clip, Session, SessionFiles};

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
    /// Where its clips come from, in words.
    pub origin: String,
    /// What is odd about it, worst first.
    pub remarks: Vec<Remark>,
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
    /// Where it comes from, as far as it says; empty where it says nothing.
    pub origins: Origins,
    /// How long it lasts; null where it cannot be read [s].
    pub seconds: Option<f64>,
    /// Rows a second of the measured joints, the commands and the object's poses; null where there are none [Hz].
    pub rates_hz: [Option<f64>; 3],
    /// How much later than commanded the arm moves; null where no motion tells it.
    pub lag: Option<Lag>,
    /// Joints in groups of one lag each; empty where all lag alike.
    pub lag_groups: Vec<Group>,
    /// What it is good for, verb by verb.
    pub good_for: Vec<Fitness>,
}

/// What was found in clips.
pub struct Found {
    /// Remarks, worst first.
    pub remarks: Vec<Remark>,
    pub(super) clips: Vec<Looked>,
}

/// Looks at clips of a cell, each with its file as cell.toml lists it.
pub fn check_clips(cell: &Cell, clips: &[(String, Clip)]) -> Found {
    let known = Known::of(cell);
    let looked: Vec<Looked> = clips.par_iter().map(|(file, clip)| look(file, clip, &known)).collect();
    let mut remarks: Vec<Remark> = looked.iter().flat_map(|looked| looked.remarks.iter().cloned()).collect();
    let lags: Vec<(&Columns, Lag)> = looked.iter().filter_map(|l| Some((&l.columns, l.lag?))).collect();
    remarks.extend(lag::remarks(&lags));
    let falls: Vec<(&Columns, fall::Fall)> =
        looked.iter().filter_map(|l| Some((&l.columns, l.fall.clone()?))).collect();
    remarks.extend(fall::remarks(&falls));
    remarks.extend(origins::remark(clips));
    Found { remarks: merged(remarks), clips: looked }
}

/// Looks at a session: everything of it, for the verb.
pub fn check(session: &Session) -> Checked {
    let Read { clips, unread } = Read::of(session);
    let origin = origins::provenance(&clips).to_string();
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
            origins: clip.map_or_else(Origins::default, |clip| clip.origins.clone()),
            seconds: clip.map(|clip| clip.measured.duration().max(clip.object.duration())),
            rates_hz: seen.map_or([None; 3], rates_of),
            lag: seen.and_then(|looked| looked.lag),
            lag_groups: seen.map_or_else(Vec::new, |looked| lag::groups(&looked.columns)),
            good_for,
            file,
        }
    });
    let clips: Vec<ClipFacts> = facts.collect();
    let fitness: Vec<(&str, &[Fitness])> = clips.iter().map(|clip| (&*clip.file, &*clip.good_for)).collect();
    let missing = good_for::missing(session, &fitness);
    let (folder, files) = (session.folder.display().to_string(), session.files.clone());
    let object = session.cell.one_of_several().map(str::to_owned);
    Checked { session: folder, object, origin, files, remarks: merged(remarks), clips, missing, pictures }
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
