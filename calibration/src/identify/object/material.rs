//! A session's clips with an object, sorted by their use.

use super::screen::{Screened, screened};
use super::{ObjectError, Options};
use crate::answer::identification::{Clips, LeftOut};
use crate::identify::remarks::grouped;
use crate::identify::split::{Split, split};
use inference::likelihood::arm::one_piece;
use rayon::prelude::*;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::console;
use shared_mem::recording::{Clip, Session};
use std::path::Path;
use twin::arm::ArmModel;

/// A clip that can be used.
pub(super) struct Usable {
    /// Its file, as cell.toml lists it.
    pub(super) file: String,
    pub(super) clip: Clip,
    /// What is odd about it.
    pub(super) remarks: Vec<String>,
}

/// A session in memory.
pub(super) struct Material {
    pub(super) cell: Cell,
    pub(super) usable: Vec<Usable>,
    pub(super) split: Split,
    pub(super) left_out: Vec<LeftOut>,
}

impl Material {
    pub(super) fn open(options: &Options) -> Result<Self, ObjectError> {
        let mut session = Session::open_with(&options.session, options.cell.as_deref())?;
        if let Some(subject) = session.about(options.object.as_deref())? {
            console::line(subject);
        }
        let entries: Vec<_> = session.clips.iter().filter(|clip| clip.kind != ClipKind::Excitation).collect();
        let read = |entry: &&ClipEntry| {
            let clip = session.read(entry).map_err(|error| error.to_string());
            (entry.file.display().to_string(), clip)
        };
        let read = entries.par_iter().map(read).collect();
        Self::of(session.cell, read, (&options.session, options.seed))
    }

    /// Of clips that were read, or the reason why one could not be; `path`: what the session is called in errors.
    pub(super) fn of(
        cell: Cell,
        read: Vec<(String, Result<Clip, String>)>,
        (path, seed): (&Path, u64),
    ) -> Result<Self, ObjectError> {
        if cell.object().is_none() {
            return Err(ObjectError::NoObject);
        }
        let arm = cell.robot.as_ref().map(|_| ArmModel::from_cell(&cell)).transpose()?;
        let looked_at = |(file, clip): (String, Result<Clip, String>)| {
            (file, clip.and_then(|clip| shows_object(clip, &cell, arm.as_ref())))
        };
        let read: Vec<_> = read.into_par_iter().map(looked_at).collect();
        let (mut usable, mut left_out) = (Vec::new(), Vec::new());
        for (file, answer) in read {
            match answer {
                Ok((clip, remarks)) => usable.push(Usable { file, clip, remarks }),
                Err(why) => left_out.push(LeftOut { file, why }),
            }
        }
        if usable.is_empty() {
            let reasons = reasons(&left_out);
            let why = if reasons.is_empty() { "it lists none with an object".into() } else { reasons };
            return Err(ObjectError::NoClip { session: path.display().to_string(), why });
        }
        let clips: Vec<&Clip> = usable.iter().map(|usable| &usable.clip).collect();
        let split = split(&clips, seed);
        Ok(Self { cell, split, usable, left_out })
    }

    /// The clips that are fitted.
    pub(super) fn train(&self) -> Vec<Clip> {
        self.split.train.iter().map(|i| self.usable[*i].clip.clone()).collect()
    }

    /// Files by their use.
    pub(super) fn clips(&self) -> Clips {
        let files = |numbers: &[usize]| numbers.iter().map(|i| self.usable[*i].file.clone()).collect();
        Clips { train: files(&self.split.train), holdout: files(&self.split.holdout), left_out: self.left_out.clone() }
    }

    /// What a reader of the answer has to know about the clips.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.split.holdout.is_empty() {
            warnings.push(
                "there is a single motion, so nothing could be held out: how far off the twin is elsewhere is not known; \
                 record strokes at other places and speeds"
                    .into(),
            );
        }
        if !self.left_out.is_empty() {
            let all = self.left_out.len() + self.usable.len();
            warnings.push(format!("{} of {all} clips were left out: {}", self.left_out.len(), reasons(&self.left_out)));
        }
        let remarks = self.usable.iter().flat_map(|u| u.remarks.iter().map(|r| (u.file.as_str(), r.as_str())));
        warnings.extend(grouped(remarks));
        warnings
    }
}

/// The clip with what could be mended mended, and what is odd about it; the reason why it tells nothing about the object
/// otherwise.
pub(crate) fn shows_object(clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<(Clip, Vec<String>), String> {
    match screened(in_one_piece(clip, cell, arm)?, cell) {
        Screened { clip, remarks, unusable: None, elsewhere: None } => Ok((clip, remarks)),
        Screened { unusable, elsewhere, .. } => Err(unusable.or(elsewhere).unwrap_or_default()),
    }
}

/// A stroke with what its arm did in one piece; the reason why it cannot be used otherwise.
fn in_one_piece(clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<Clip, String> {
    let Some(arm) = arm.filter(|_| clip.kind == ClipKind::ControlHitSlide) else { return Ok(clip) };
    let (clip, remarks) = one_piece(clip, cell, arm).map_err(|why| why.to_string())?;
    // What the reader found stands first among them.
    Ok(Clip { warnings: remarks, damage: None, ..clip })
}

/// Why clips were left out, in one line.
fn reasons(left_out: &[LeftOut]) -> String {
    grouped(left_out.iter().map(|clip| (clip.file.as_str(), clip.why.as_str()))).join("; ")
}
