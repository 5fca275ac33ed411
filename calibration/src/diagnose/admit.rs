//! Whether the recorded clips can be diagnosed at all; if not, what is missing.

use super::split;
use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, ReadError, Session};
use twin::arm::{ArmModel, ModelError};

/// Clips that can be used.
#[derive(Debug)]
pub struct Admitted {
    /// Clips, joints in the model's order.
    pub clips: Vec<Clip>,
    /// Their files, as cell.toml names them.
    pub files: Vec<String>,
    /// Clips of one command, as indices.
    pub groups: Vec<Vec<usize>>,
    /// Whether every clip has an object.
    pub with_object: bool,
}

/// Why a session cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// Nothing can be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The arm.
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// The clips do not say enough.
    #[error("{0}")]
    NotTestable(String),
}

/// Fewer commands than this cannot be split into clips for fitting, choosing and confirming.
const FEWEST: usize = 4;

/// Reads a session's clips.
///
/// # Errors
/// [`Refused`] with what is missing.
pub fn admit(session: &Session) -> Result<Admitted, Refused> {
    let arm = session.cell.robot.as_ref().map(|_| ArmModel::from_cell(&session.cell)).transpose()?;
    let (mut clips, mut files, mut broken) = (Vec::new(), Vec::new(), Vec::new());
    for entry in &session.clips {
        let file = entry.file.to_string_lossy().into_owned();
        match session.read(entry).and_then(|clip| in_model_order(clip, arm.as_ref())) {
            Ok(clip) => {
                clips.push(clip);
                files.push(file);
            }
            Err(error) => broken.push(format!("{file}: {error}")),
        }
    }
    if clips.is_empty() && !broken.is_empty() {
        return Err(Refused::NotTestable(format!("no clip can be read: {}", broken.join("; "))));
    }
    check_channels(&clips)?;
    let groups = split::by_command(&clips);
    if groups.len() < FEWEST {
        return Err(Refused::NotTestable(format!(
            "{} clips with {} different commands: at least {FEWEST} different commands are needed to fit, to choose and to \
             confirm on clips of their own; record more clips with other motions",
            clips.len(),
            groups.len()
        )));
    }
    let with_object = clips.iter().all(|clip| clip.kind == ClipKind::ControlHitSlide);
    Ok(Admitted { clips, files, groups, with_object })
}

fn in_model_order(mut clip: Clip, arm: Option<&ArmModel>) -> Result<Clip, ReadError> {
    let Some(arm) = arm else { return Ok(clip) };
    // Own recordings of an arm whose joints have no names number them.
    if clip.joint_names.iter().enumerate().all(|(i, name)| *name == format!("joint{}", i + 1)) {
        clip.joint_names = arm.joint_names().to_vec();
    }
    if clip.measured.is_empty() { Ok(clip) } else { clip.reorder(arm.joint_names()) }
}

fn check_channels(clips: &[Clip]) -> Result<(), Refused> {
    let lacks = |what: &str, remedy: &str| Err(Refused::NotTestable(format!("the clips hold no {what}; {remedy}")));
    let moving = || clips.iter().filter(|clip| clip.kind != ClipKind::FreeMotion);
    if moving().any(|clip| clip.measured.is_empty()) {
        return lacks("measured joint states", "log measured_joint_states with every clip");
    }
    if moving().any(|clip| clip.desired.is_empty()) {
        return lacks("commands", "log desired_joint_states: without the command the twin cannot be driven");
    }
    if clips.iter().any(|clip| clip.kind != ClipKind::Excitation && clip.object.is_empty()) {
        return lacks("object poses", "log the object's pose, or set the clips' kind to \"excitation\"");
    }
    Ok(())
}
