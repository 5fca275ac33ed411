//! The part of a clip that can be simulated in one go, for whoever cannot begin anew behind a hole.

use super::clip::{ArmClip, ArmClipError};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::Clip;
use twin::arm::ArmModel;

/// The longest stretch of a clip that has commands, one clock, and joints that follow; and what was done, one sentence each.
/// A clip with an object is used as a whole or not at all.
///
/// # Errors
/// [`ArmClipError`] with the reason and the remedy.
pub fn one_piece(clip: Clip, cell: &Cell, arm: &ArmModel) -> Result<(Clip, Vec<String>), ArmClipError> {
    let stroke = clip.kind == ClipKind::ControlHitSlide;
    let whole = ArmClip::new(clip, cell, arm)?;
    let whole = if stroke { whole } else { whole.long_enough()? };
    if let Some(joint) = (0..arm.dof()).find(|joint| whole.dead[*joint]) {
        return Err(ArmClipError::DeadJoint { joint: joint + 1, name: arm.joint_names()[joint].clone() });
    }
    let Some(stretch) = whole.longest_stretch() else { return Ok((whole.recorded, whole.warnings)) };
    if stroke {
        return Err(ArmClipError::Broken(whole.warnings.last().cloned().unwrap_or_default()));
    }
    let mut clip = whole.recorded;
    clip.measured = clip.measured.between(stretch.clone());
    clip.desired = clip.desired.between(stretch);
    Ok((clip, whole.warnings))
}
