//! Which verbs each clip is good for, by the rules by which these admit clips, and what is missing for a verb.

use super::remark::{Remark, Severity};
use crate::identify::IdentifyError;
use inference::admit::admit;
use inference::admit::look::{for_diagnosis, for_object};
use inference::admit::remarks::grouped;
use inference::likelihood::arm::ArmClips;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::recording::{Clip, PictureKind, ReadError, Session, for_pictures};
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use twin::arm::ArmModel;
use twin::replay::{Replayer, in_model_order};

/// Verbs, in the order of the table.
pub const VERBS: [&str; 6] =
    ["replay", "identify arm", "identify object", "diagnose arm", "diagnose object", "viewpoint"];

/// Whether a clip is good for a verb.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fitness {
    /// One of [`VERBS`].
    pub verb: &'static str,
    /// Whether the verb takes it.
    pub good: bool,
    /// Why not; empty where it does.
    pub why: String,
}

/// What is missing for a verb.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// One of [`VERBS`], or `diagnose` for what concerns both.
    pub verb: &'static str,
    /// What, and what to do.
    pub why: String,
}

type Answer = Result<(), String>;

/// Every clip of a session, verb by verb.
pub(super) fn of(
    session: &Session,
    clips: &[(String, Clip)],
    unread: &[(String, String)],
    remarks: &[Remark],
) -> Vec<Vec<Fitness>> {
    let rules = Rules::of(session, clips);
    let wrong =
        |file: &str| remarks.iter().find(|r| r.severity == Severity::Wrong && r.clips.iter().any(|clip| clip == file));
    let fitness = |entry: &ClipEntry| {
        let file = entry.file.display().to_string();
        let answers = match clips.iter().find(|(name, _)| *name == file) {
            Some((_, clip)) => rules.answers(session, entry, clip),
            None => {
                let why = unread.iter().find(|(name, _)| *name == file).map(|(_, why)| why.clone());
                VERBS.map(|_| Err(why.clone().unwrap_or_default()))
            }
        };
        let all = VERBS.into_iter().zip(answers).map(|(verb, answer)| {
            // A replay shows what is wrong, the other verbs would explain it.
            let stops = wrong(&file).filter(|_| !matches!(verb, "replay" | "viewpoint"));
            let answer = stops.map_or(answer, |remark| Err(format!("stopped by {}", remark.fault.key())));
            Fitness { verb, good: answer.is_ok(), why: answer.err().unwrap_or_default() }
        });
        all.collect()
    };
    session.clips.iter().map(fitness).collect()
}

/// What the verbs ask of all clips alike.
struct Rules {
    arm: Result<ArmModel, String>,
    replayed: Answer,
    /// Clips that `identify arm` leaves out, by file name.
    without_arm: BTreeMap<String, String>,
}

impl Rules {
    fn of(session: &Session, clips: &[(String, Clip)]) -> Self {
        let cell = &session.cell;
        let moving = clips
            .iter()
            .map(|(_, clip)| clip)
            .filter(|clip| clip.kind != ClipKind::FreeMotion && !clip.measured.is_empty())
            .cloned()
            .collect();
        let arm = ArmClips::means(cell, moving, |_: &[f64]| Theta::default());
        let without_arm = arm.map(|(_, out)| out.into_iter().map(|out| (out.file, out.why.to_string())).collect());
        Self {
            arm: ArmModel::from_cell(cell).map_err(|error| error.to_string()),
            replayed: Replayer::new(cell, None).map(|_| ()).map_err(|error| error.to_string()),
            without_arm: without_arm.unwrap_or_default(),
        }
    }

    fn answers(&self, session: &Session, entry: &ClipEntry, clip: &Clip) -> [Answer; 6] {
        let cell = &session.cell;
        [
            self.replay(cell, clip),
            self.identify_arm(cell, clip),
            self.identify_object(cell, clip),
            self.diagnose(session, clip, ClipKind::Excitation),
            self.diagnose(session, clip, ClipKind::ControlHitSlide),
            viewpoint(session, entry, clip),
        ]
    }

    fn replay(&self, cell: &Cell, clip: &Clip) -> Answer {
        self.replayed.clone()?;
        if clip.kind == ClipKind::FreeMotion || cell.robot.is_none() {
            return if clip.object.is_empty() { Err("it holds no object poses".into()) } else { Ok(()) };
        }
        commanded(clip)?;
        in_model_order(clip.clone(), self.arm.as_ref().map_err(Clone::clone)?)
            .map(|_| ())
            .map_err(|error| error.to_string())
    }

    fn identify_arm(&self, cell: &Cell, clip: &Clip) -> Answer {
        let lacks = [(cell.robot.is_none(), "[robot]"), (cell.controller.is_none(), "[controller]")];
        if let Some((_, block)) = lacks.into_iter().find(|(lacks, _)| *lacks) {
            return Err(IdentifyError::NoArm(block).to_string());
        }
        if clip.kind == ClipKind::FreeMotion {
            return Err("no arm moves in it".into());
        }
        commanded(clip)?;
        self.arm.as_ref().map_err(Clone::clone)?;
        let name = clip.file.file_name().unwrap_or(clip.file.as_os_str()).to_string_lossy().into_owned();
        self.without_arm.get(&name).map_or(Ok(()), |why| Err(why.clone()))
    }

    fn identify_object(&self, cell: &Cell, clip: &Clip) -> Answer {
        if cell.object().is_none() {
            return Err(IdentifyError::NoObject.to_string());
        }
        if clip.kind == ClipKind::Excitation {
            return Err("no object moves in it".into());
        }
        for_object(clip.clone(), cell, self.arm.as_ref().ok()).map(|_| ())
    }

    /// `of`: whether the arm is to be explained, or with it the object.
    fn diagnose(&self, session: &Session, clip: &Clip, of: ClipKind) -> Answer {
        if clip.kind == ClipKind::FreeMotion {
            // An object alone is explained where no clip of the session has an arm.
            let alone = session.clips.iter().all(|entry| entry.kind == ClipKind::FreeMotion);
            return match of {
                ClipKind::ControlHitSlide if alone => self.identify_object(&session.cell, clip),
                ClipKind::ControlHitSlide => Err("an arm moves in other clips of the session".into()),
                _ => Err("no arm moves in it".into()),
            };
        }
        if session.cell.robot.is_none() {
            return Err(IdentifyError::NoArm("[robot]").to_string());
        }
        if of == ClipKind::ControlHitSlide && clip.kind != of {
            return Err("no object is hit in it".into());
        }
        commanded(clip)?;
        let arm = self.arm.as_ref().map_err(Clone::clone)?;
        for_diagnosis(clip.clone(), &session.cell, Some(arm)).map(|_| ())
    }
}

fn commanded(clip: &Clip) -> Answer {
    match (clip.measured.is_empty(), clip.desired.is_empty()) {
        (true, _) => Err("it holds no measured joints".into()),
        (_, true) => Err("it holds no commands".into()),
        _ => Ok(()),
    }
}

/// What ends the search for pictures.
enum Ended {
    Found,
    Failed(String),
}

impl From<ReadError> for Ended {
    fn from(error: ReadError) -> Self {
        Self::Failed(error.to_string())
    }
}

fn viewpoint(session: &Session, entry: &ClipEntry, clip: &Clip) -> Answer {
    if clip.measured.is_empty() {
        return Err("it holds no measured joints".into());
    }
    let path = session.folder.join(&entry.file);
    for kind in [PictureKind::Color, PictureKind::Depth] {
        match for_pictures(&path, kind, |_, _| Err(Ended::Found)) {
            Err(Ended::Found) => return Ok(()),
            Err(Ended::Failed(why)) => return Err(why),
            Ok(()) => {}
        }
    }
    Err("it holds no pictures".into())
}

/// What is missing for verbs that no clip is good for, each given with its file, and for a diagnosis that needs more clips than there are.
pub(super) fn missing(session: &Session, clips: &[(&str, &[Fitness])]) -> Vec<Missing> {
    let lacking = |(number, verb): (usize, &'static str)| {
        let good = clips.iter().any(|(_, good_for)| good_for[number].good);
        let whys = clips.iter().map(|(file, good_for)| (*file, good_for[number].why.as_str()));
        (!good).then(|| Missing { verb, why: grouped(whys).join("; ") })
    };
    let mut out: Vec<Missing> = VERBS.into_iter().enumerate().filter_map(lacking).collect();
    let diagnosed = clips.iter().any(|(_, good_for)| good_for.iter().any(|f| f.good && f.verb.starts_with("diagnose")));
    if let (true, Err(why)) = (diagnosed, admit(session)) {
        out.push(Missing { verb: "diagnose", why: why.to_string() });
    }
    out
}
