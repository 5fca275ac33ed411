//! The clips of a session in which the arm moves, and joints that stand still in them.

use super::Model;
use crate::identify::error::IdentifyError;
use crate::identify::used::Used;
use inference::admit::{self, Looked};
use inference::estimate::{ClipModel as _, Unknown};
use inference::likelihood::Setting;
use inference::likelihood::arm::LeftOut;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, ReadError, Session};
use std::path::Path;

/// A session in memory.
pub(super) struct Material {
    pub(super) cell: Cell,
    pub(super) clips: Vec<Clip>,
    pub(super) left_out: Vec<admit::LeftOut>,
}

pub(super) fn open(path: &Path, cell: Option<&Path>) -> Result<Material, ReadError> {
    let session = Session::open_with(path, cell)?;
    // What of a clip can be simulated is said by the model.
    let look = |clip| Ok((clip, Vec::new()));
    let Looked { usable, left_out } = Looked::of_session(&session, |entry| entry.kind != ClipKind::FreeMotion, look);
    Ok(Material { cell: session.cell, clips: usable.into_iter().map(|usable| usable.clip).collect(), left_out })
}

/// Clips by their use; `unusable`: what the model found that it cannot simulate.
pub(super) fn used(
    path: &Path,
    model: &Model<'_>,
    mut left_out: Vec<admit::LeftOut>,
    unusable: Vec<LeftOut>,
    seed: u64,
) -> Result<Used, IdentifyError> {
    left_out.extend(unusable.into_iter().map(|clip| admit::LeftOut { file: clip.file, why: clip.why.to_string() }));
    if model.clips() == 0 {
        return Err(IdentifyError::no_clip(path, "arm", &left_out));
    }
    let all = (0..model.clips()).map(|clip| (model.clip(clip).name(), &model.clip(clip).recorded));
    Ok(Used::of(all, left_out, seed))
}

/// Gains of joints that stand still in every clip to be fitted stay where they are.
pub(super) fn hold_dead(model: &Model<'_>, train: &[usize], settings: &[Setting], unknowns: &mut [Unknown]) {
    for (setting, unknown) in settings.iter().zip(unknowns) {
        let gain = matches!(setting, Setting::Stiffness(_) | Setting::Damping(_));
        let Some(joint) = setting.joint().filter(|_| gain) else { continue };
        if train.iter().all(|clip| model.clip(*clip).stands_still(joint)) {
            (unknown.lower, unknown.upper) = (unknown.start, unknown.start);
        }
    }
}
