//! A clip looked at for what it is wanted for: with what could be mended mended and its joints in the model's order, and what is odd
//! about it; else the reason why it cannot be used.

use super::object_poses::{self, Poses};
use super::torques::is_tracking;
use crate::likelihood::arm::one_piece;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, JointSeries};
use twin::arm::ArmModel;

/// For a diagnosis. `arm`: the cell's, where there is one.
///
/// # Errors
/// Why it cannot be used.
pub fn for_diagnosis(mut clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<(Clip, Vec<String>), String> {
    let tracking = is_tracking(cell);
    if tracking && clip.desired.is_empty() {
        // Where no command was logged, the motion itself says what moves.
        clip.desired = JointSeries { tau: Vec::new(), ..clip.measured.clone() };
    }
    let mut remarks: Vec<String> = clip.warnings.iter().chain(&clip.damage).cloned().collect();
    // What a session lacks as a whole is said of the session.
    let complete = !clip.measured.is_empty() && !clip.desired.is_empty();
    if let Some(arm) = arm.filter(|_| complete) {
        (clip, remarks) = one_piece(clip, cell, arm).map_err(|why| why.to_string())?;
    }
    if tracking || clip.kind == ClipKind::Excitation || clip.object.is_empty() {
        return Ok((clip, remarks));
    }
    (clip.warnings, clip.damage) = (Vec::new(), None);
    let Poses { clip, remarks: odd, unusable, elsewhere } = object_poses::looked_at(clip, cell);
    // Poses elsewhere than the tool may be what is to be found: a camera that looks from another place.
    remarks.extend(odd.into_iter().chain(elsewhere));
    unusable.map_or(Ok((clip, remarks)), Err)
}

/// For what it says about the object.
///
/// # Errors
/// Why it says nothing about it.
pub fn for_object(clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<(Clip, Vec<String>), String> {
    match object_poses::looked_at(in_one_piece(clip, cell, arm)?, cell) {
        Poses { clip, remarks, unusable: None, elsewhere: None } => Ok((clip, remarks)),
        Poses { unusable, elsewhere, .. } => Err(unusable.or(elsewhere).unwrap_or_default()),
    }
}

/// A stroke with what its arm did in one piece; the reason why it cannot be used otherwise.
fn in_one_piece(clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<Clip, String> {
    let Some(arm) = arm.filter(|_| clip.kind == ClipKind::ControlHitSlide) else { return Ok(clip) };
    let (clip, remarks) = one_piece(clip, cell, arm).map_err(|why| why.to_string())?;
    // What the reader found stands first among them.
    Ok(Clip { warnings: remarks, damage: None, ..clip })
}

#[cfg(test)]
mod tests {
    use super::super::test_clip::of_the_shipped_arm;
    use super::*;
    use nalgebra::Translation3;
    use shared_mem::frames::Pose;

    fn without_commands(clip: &mut Clip, rows: std::ops::Range<usize>) {
        let dof = clip.desired.dof;
        let desired = &mut clip.desired;
        desired.stamps_ns.drain(rows.clone());
        for values in [&mut desired.q, &mut desired.dq, &mut desired.tau] {
            if !values.is_empty() {
                values.drain(rows.start * dof..rows.end * dof);
            }
        }
    }

    #[test]
    fn a_clip_without_faults_is_taken_as_it_is() {
        for kind in [ClipKind::Excitation, ClipKind::ControlHitSlide] {
            let (cell, arm, clip) = of_the_shipped_arm(kind);
            let (taken, remarks) = for_diagnosis(clip.clone(), &cell, Some(&arm)).expect("a usable clip");
            assert_eq!((&taken.measured, &taken.object), (&clip.measured, &clip.object));
            assert!(remarks.is_empty(), "{remarks:?}");
        }
    }

    #[test]
    fn of_a_motion_with_a_hole_in_its_commands_the_longest_piece_is_taken_and_a_stroke_is_left_out() {
        let (cell, arm, mut clip) = of_the_shipped_arm(ClipKind::Excitation);
        let rows = clip.desired.len();
        without_commands(&mut clip, rows / 4..rows / 4 + 200);
        let (taken, remarks) = for_diagnosis(clip, &cell, Some(&arm)).expect("a usable clip");
        assert!((rows / 2..rows * 3 / 4).contains(&taken.measured.len()), "{} of {rows}", taken.measured.len());
        assert!(remarks.iter().any(|remark| remark.contains("no commands for 0.20")), "{remarks:?}");
        let (cell, arm, mut clip) = of_the_shipped_arm(ClipKind::ControlHitSlide);
        without_commands(&mut clip, rows / 4..rows / 4 + 200);
        let why = for_diagnosis(clip, &cell, Some(&arm)).expect_err("a reason");
        assert!(why.contains("no commands for 0.20") && why.contains("record it again"), "{why}");
    }

    #[test]
    fn a_dead_joint_is_a_reason_and_poses_elsewhere_are_a_remark() {
        let (cell, arm, mut clip) = of_the_shipped_arm(ClipKind::Excitation);
        let stays = clip.measured.q[3];
        clip.measured.q.iter_mut().skip(3).step_by(7).for_each(|q| *q = stays);
        let why = for_diagnosis(clip, &cell, Some(&arm)).expect_err("a reason");
        assert!(why.contains("joint 4") && why.contains("enabled"), "{why}");
        let (cell, arm, mut clip) = of_the_shipped_arm(ClipKind::ControlHitSlide);
        for pose in &mut clip.object.poses {
            *pose = Pose::from_isometry(Translation3::new(0.0, 0.4, 0.0) * pose.isometry());
        }
        let (_, remarks) = for_diagnosis(clip.clone(), &cell, Some(&arm)).expect("a clip");
        assert!(remarks.iter().any(|remark| remark.contains("never comes nearer")), "{remarks:?}");
        // A diagnosis may find why; an identification of the object has nothing to begin with.
        let why = for_object(clip, &cell, Some(&arm)).expect_err("a reason");
        assert!(why.contains("never comes nearer"), "{why}");
    }
}
