//! Which clips of a session can be used for the arm, and for what. What cannot be used is left out and told.

use super::{ArmError, Model};
use crate::answer::identification::{self, Clips, Identification};
use crate::identify::remarks::grouped;
use crate::identify::split::{Split, split};
use inference::estimate::{ClipModel as _, Unknown};
use inference::likelihood::Setting;
use inference::likelihood::arm::LeftOut;
use rayon::prelude::*;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, ReadError, Session};
use std::path::Path;

/// A session in memory.
pub(super) struct Material {
    pub(super) cell: Cell,
    pub(super) clips: Vec<Clip>,
    pub(super) left_out: Vec<identification::LeftOut>,
}

/// Which clips are used for what.
pub(super) struct Used {
    pub(super) split: Split,
    train: Vec<String>,
    holdout: Vec<String>,
    left_out: Vec<identification::LeftOut>,
    warnings: Vec<String>,
}

pub(super) fn open(path: &Path, cell: Option<&Path>) -> Result<Material, ReadError> {
    let session = Session::open_with(path, cell)?;
    let with_arm: Vec<_> = session.clips.iter().filter(|clip| clip.kind != ClipKind::FreeMotion).collect();
    let read: Vec<_> = with_arm.par_iter().map(|entry| (&entry.file, session.read(entry))).collect();
    let (mut clips, mut left_out) = (Vec::new(), Vec::new());
    for (file, clip) in read {
        match clip {
            Ok(clip) => clips.push(clip),
            Err(error) => {
                left_out.push(identification::LeftOut { file: file.display().to_string(), why: error.to_string() })
            }
        }
    }
    Ok(Material { cell: session.cell, clips, left_out })
}

pub(super) fn used(
    path: &Path,
    model: &Model<'_>,
    mut left_out: Vec<identification::LeftOut>,
    unusable: Vec<LeftOut>,
    seed: u64,
) -> Result<Used, ArmError> {
    left_out.extend(
        unusable.into_iter().map(|clip| identification::LeftOut { file: clip.file, why: clip.why.to_string() }),
    );
    if model.clips() == 0 {
        let reasons = reasons(&left_out);
        let why = if reasons.is_empty() { "it lists none with an arm".into() } else { reasons };
        return Err(ArmError::NoClip { session: path.display().to_string(), why });
    }
    let clips: Vec<&Clip> = (0..model.clips()).map(|clip| &model.clip(clip).recorded).collect();
    let split = split(&clips, seed);
    let names = |numbers: &[usize]| numbers.iter().map(|clip| model.clip(*clip).name()).collect();
    let (train, holdout) = (names(&split.train), names(&split.holdout));
    let mut warnings = Vec::new();
    if split.holdout.is_empty() {
        warnings.push(
            "there is a single motion, so nothing could be held out: how far off the twin is elsewhere is not known; \
             record another motion"
                .into(),
        );
    }
    if !left_out.is_empty() {
        let (out, all) = (left_out.len(), left_out.len() + model.clips());
        warnings.push(format!("{out} of {all} clips were left out: {}", reasons(&left_out)));
    }
    Ok(Used { split, train, holdout, left_out, warnings })
}

/// Why clips were left out, in one line.
fn reasons(left_out: &[identification::LeftOut]) -> String {
    grouped(left_out.iter().map(|clip| (clip.file.as_str(), clip.why.as_str()))).join("; ")
}

impl Used {
    /// Files of the clips that are fitted, in their order.
    pub(super) fn fitted(&self) -> &[String] {
        &self.train
    }

    pub(super) fn fill(self, answer: &mut Identification) {
        answer.clips = Clips { train: self.train, holdout: self.holdout, left_out: self.left_out };
        answer.warnings.extend(self.warnings);
        answer.warnings.extend(grouped(
            answer.by_clip.iter().flat_map(|clip| clip.warnings.iter().map(|w| (clip.file.as_str(), w.as_str()))),
        ));
    }
}

/// The joint that a number is about.
pub(super) fn joint_of(setting: &Setting) -> Option<usize> {
    match setting {
        Setting::Stiffness(joint) | Setting::Damping(joint) => Some(*joint),
        Setting::Effect { index, .. } => *index,
        _ => None,
    }
}

/// Gains of joints that stand still in every clip to be fitted stay where they are.
pub(super) fn hold_dead(model: &Model<'_>, clips: &Used, settings: &[Setting], unknowns: &mut [Unknown]) {
    for (setting, unknown) in settings.iter().zip(unknowns) {
        let gain = matches!(setting, Setting::Stiffness(_) | Setting::Damping(_));
        let Some(joint) = joint_of(setting).filter(|_| gain) else { continue };
        if clips.split.train.iter().all(|clip| model.clip(*clip).stands_still(joint)) {
            (unknown.lower, unknown.upper) = (unknown.start, unknown.start);
        }
    }
}
