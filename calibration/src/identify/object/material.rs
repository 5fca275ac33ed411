//! A session's clips with an object, sorted by their use.

use super::Options;
use crate::identify::error::IdentifyError;
use crate::identify::used::Used;
use inference::admit::look::for_object;
use inference::admit::{Looked, Usable};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::console;
use shared_mem::recording::{Clip, Session};
use twin::arm::{ArmModel, ModelError};

/// A session in memory.
pub(super) struct Material {
    pub(super) cell: Cell,
    pub(super) usable: Vec<Usable>,
    pub(super) used: Used,
    /// What is odd about clips that are used, a line a kind of remark.
    pub(super) remarks: Vec<String>,
}

impl Material {
    pub(super) fn open(options: &Options) -> Result<Self, IdentifyError> {
        let mut session = Session::open_with(&options.session, options.cell.as_deref())?;
        if let Some(subject) = session.about(options.object.as_deref())? {
            console::line(subject);
        }
        let arm = arm_of(&session.cell)?;
        let look = |clip| for_object(clip, &session.cell, arm.as_ref());
        let looked = Looked::of_session(&session, |entry| entry.kind != ClipKind::Excitation, look);
        Self::of(session.cell.clone(), looked, options)
    }

    /// Of clips in memory.
    pub(super) fn of_clips(cell: Cell, clips: Vec<Clip>, options: &Options) -> Result<Self, IdentifyError> {
        let arm = arm_of(&cell)?;
        let looked = Looked::of_clips(clips, |clip| for_object(clip, &cell, arm.as_ref()));
        Self::of(cell, looked, options)
    }

    fn of(cell: Cell, looked: Looked, options: &Options) -> Result<Self, IdentifyError> {
        if cell.object().is_none() {
            return Err(IdentifyError::NoObject);
        }
        let remarks = looked.remarks();
        let Looked { usable, left_out } = looked;
        if usable.is_empty() {
            return Err(IdentifyError::no_clip(&options.session, "object", &left_out));
        }
        let all = usable.iter().map(|usable| (usable.file.clone(), &usable.clip));
        let used = Used::of(all, left_out, options.seed);
        Ok(Self { cell, usable, used, remarks })
    }

    /// The clips that are fitted.
    pub(super) fn train(&self) -> Vec<Clip> {
        self.used.split.train.iter().map(|clip| self.usable[*clip].clip.clone()).collect()
    }

    /// What a reader of the answer has to know about the clips.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = self.used.warnings("strokes at other places and speeds");
        warnings.extend(self.remarks.iter().cloned());
        warnings
    }
}

fn arm_of(cell: &Cell) -> Result<Option<ArmModel>, ModelError> {
    cell.robot.as_ref().map(|_| ArmModel::from_cell(cell)).transpose()
}
