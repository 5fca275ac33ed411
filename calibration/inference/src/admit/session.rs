//! The clips of a session, read and looked at; and whether they can be diagnosed at all; if not, what is missing.

use super::command::by_command;
use super::length;
use super::look::for_diagnosis;
use super::remarks::{LeftOut, grouped, left_out_in_words, reasons};
use super::torques::{followed, is_tracking};
use rayon::prelude::*;
use shared_mem::cell::{ClipEntry, ClipKind};
use shared_mem::recording::{Clip, ReadError, Session};
use twin::arm::{ArmModel, ModelError};

/// A clip that can be used, as whoever looked at it takes it.
#[derive(Debug, Clone)]
pub struct Usable<T = Clip> {
    /// Its file, as cell.toml names it.
    pub file: String,
    pub clip: T,
    /// What is odd about it.
    pub remarks: Vec<String>,
}

/// Clips that can be used, and those that cannot.
#[derive(Debug, Clone)]
pub struct Looked<T = Clip> {
    pub usable: Vec<Usable<T>>,
    pub left_out: Vec<LeftOut>,
}

/// What a clip is taken as and what is odd about it, or why it cannot be used.
type Look<T> = Result<(T, Vec<String>), String>;

impl<T: Send> Looked<T> {
    /// Reads those clips of a session that are wanted and looks at each.
    pub fn of_session(
        session: &Session,
        wanted: impl Fn(&ClipEntry) -> bool,
        look: impl Fn(Clip) -> Look<T> + Sync,
    ) -> Self {
        let entries: Vec<&ClipEntry> = session.clips.iter().filter(|entry| wanted(entry)).collect();
        let read = |entry: &&ClipEntry| {
            let clip = session.read(entry).map_err(|error| error.to_string());
            (entry.file.display().to_string(), clip.and_then(&look))
        };
        Self::sorted(entries.par_iter().map(read).collect())
    }

    /// The same of clips in memory.
    pub fn of_clips(clips: Vec<Clip>, look: impl Fn(Clip) -> Look<T> + Sync) -> Self {
        let named = |clip: Clip| (clip.file.display().to_string(), look(clip));
        Self::sorted(clips.into_par_iter().map(named).collect())
    }

    fn sorted(all: Vec<(String, Look<T>)>) -> Self {
        let mut looked = Self { usable: Vec::new(), left_out: Vec::new() };
        for (file, answer) in all {
            match answer {
                Ok((clip, remarks)) => looked.usable.push(Usable { file, clip, remarks }),
                Err(why) => looked.left_out.push(LeftOut { file, why }),
            }
        }
        looked
    }

    /// What is odd about the clips that can be used, a line a kind of remark.
    pub fn remarks(&self) -> Vec<String> {
        grouped(
            self.usable.iter().flat_map(|clip| clip.remarks.iter().map(|remark| (clip.file.as_str(), remark.as_str()))),
        )
    }
}

/// Clips that can be diagnosed.
#[derive(Debug)]
pub struct Admitted {
    /// Clips, joints in the model's order.
    pub clips: Vec<Clip>,
    /// Their files, as cell.toml names them.
    pub files: Vec<String>,
    /// Clips of one command, as indices.
    pub groups: Vec<Vec<usize>>,
    /// How many different commands they have.
    pub commands: usize,
    /// Whether every clip has an object: one that the arm hits, or one alone.
    pub with_object: bool,
    /// What a reader has to know about the clips, one sentence each.
    pub warnings: Vec<String>,
}

impl Admitted {
    /// Clips that need no look: `files` are theirs, `with_object` as in the field.
    pub fn of(clips: Vec<Clip>, files: Vec<String>, with_object: bool) -> Self {
        let groups = by_command(&clips);
        Self { commands: groups.len(), groups, clips, files, with_object, warnings: Vec::new() }
    }

    /// Whether objects move by themselves in all clips: tosses and slides.
    pub fn objects_alone(&self) -> bool {
        self.clips.iter().all(|clip| clip.kind == ClipKind::FreeMotion)
    }
}

/// Why a session cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Arm(#[from] ModelError),
    #[error(
        "torques can be predicted from a model with masses alone: give cell.toml a [controller], and a `urdf` or `model` under [robot] in place of `joints`"
    )]
    NoModel,
    /// The clips do not say enough.
    #[error("{0}")]
    NotTestable(String),
}

/// Fewer commands than this cannot be split into clips for fitting, choosing and confirming: two to fit and one for each of the others.
const FEWEST_COMMANDS: usize = 4;

/// Reads a session's clips for a diagnosis.
///
/// # Errors
/// [`Refused`] with what is missing.
pub fn admit(session: &Session) -> Result<Admitted, Refused> {
    let cell = &session.cell;
    if cell.robot.is_none() && cell.object().is_none() {
        let why = "cell.toml has neither [robot] nor [object]; add the block of what moves in the clips";
        return Err(Refused::NotTestable(why.into()));
    }
    let arm = cell.robot.as_ref().map(|_| ArmModel::from_cell(cell)).transpose()?;
    let looked = Looked::of_session(session, |_| true, |clip| for_diagnosis(clip, cell, arm.as_ref()));
    let mut warnings: Vec<String> = left_out_in_words(&looked.left_out, looked.usable.len()).into_iter().collect();
    warnings.extend(looked.remarks());
    let Looked { usable, left_out } = looked;
    if usable.is_empty() && !left_out.is_empty() {
        return Err(Refused::NotTestable(format!("no clip can be used: {}", reasons(&left_out))));
    }
    let (files, mut clips): (Vec<String>, Vec<Clip>) = usable.into_iter().map(|clip| (clip.file, clip.clip)).unzip();
    let tracking = is_tracking(cell);
    check_channels(&clips, tracking)?;
    // Before clips are cut to length: the liveliest parts of one command need not be the same.
    let groups = by_command(&clips);
    if groups.len() < FEWEST_COMMANDS {
        return Err(too_few_commands(groups.len(), clips.len(), &left_out));
    }
    warnings.extend(length::liveliest(&mut clips));
    if tracking {
        // Not before clips are grouped by their commands: two motions of one command differ by noise.
        let all: Option<Vec<Clip>> = clips.into_iter().map(followed).collect();
        let short = || Refused::NotTestable("clips are too short for their motion to be smoothed".into());
        clips = all.ok_or_else(short)?;
    }
    let all = |kind: ClipKind| clips.iter().all(|clip| clip.kind == kind);
    let with_object = !tracking && (all(ClipKind::ControlHitSlide) || all(ClipKind::FreeMotion));
    Ok(Admitted { commands: groups.len(), clips, files, groups, with_object, warnings })
}

fn too_few_commands(commands: usize, usable: usize, left_out: &[LeftOut]) -> Refused {
    let without = if left_out.is_empty() { String::new() } else { format!(" (left out: {})", reasons(left_out)) };
    Refused::NotTestable(format!(
        "too few different commands: {commands} among the clips that can be used ({usable} of {}){without}; at least {FEWEST_COMMANDS} are \
         needed to fit, to choose and to confirm on clips of their own: record more clips with other motions",
        usable + left_out.len()
    ))
}

fn check_channels(clips: &[Clip], tracking: bool) -> Result<(), Refused> {
    let lacks = |what: &str, remedy: &str| Err(Refused::NotTestable(format!("the clips hold no {what}; {remedy}")));
    let moving = || clips.iter().filter(|clip| clip.kind != ClipKind::FreeMotion);
    if moving().any(|clip| clip.measured.is_empty()) {
        return lacks("measured joint states", "log measured_joint_states with every clip");
    }
    if moving().any(|clip| clip.desired.is_empty()) {
        return lacks(
            "commands",
            "log desired_joint_states: without the command the twin cannot be driven; where torques were logged, --torques explains those",
        );
    }
    if tracking {
        let without = moving().any(|clip| clip.measured.tau.is_empty());
        return if without {
            lacks("torques", "log the effort of measured_joint_states, or leave --torques out")
        } else {
            Ok(())
        };
    }
    if clips.iter().any(|clip| clip.kind != ClipKind::Excitation && clip.object.is_empty()) {
        return lacks("object poses", "log the object's pose, or set the clips' kind to \"excitation\"");
    }
    Ok(())
}
