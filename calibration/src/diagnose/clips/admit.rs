//! Whether the recorded clips can be diagnosed at all; if not, what is missing.

use super::ground::Ground;
use super::torques::{self, is_tracking};
use super::{length, split};
use crate::identify::object::screen::{Screened, screened};
use crate::identify::remarks::grouped;
use inference::likelihood::arm::one_piece;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, JointSeries, ReadError, Session};
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
        let groups = split::by_command(&clips);
        Self { commands: groups.len(), groups, clips, files, with_object, warnings: Vec::new() }
    }

    /// Whether objects move by themselves in all clips: tosses and slides.
    pub fn objects_alone(&self) -> bool {
        self.clips.iter().all(|clip| clip.kind == ClipKind::FreeMotion)
    }

    /// Where the objects slid; `None` where it is the arm that the clips are for.
    pub fn ground(&self) -> Option<Ground> {
        Ground::of(&self.clips).filter(|_| self.with_object)
    }
}

/// Why a session cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// Nothing can be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// Torques cannot be predicted.
    #[error(
        "torques can be predicted from a model with masses alone: give cell.toml a [controller], and a `urdf` or `model` under [robot] in place of `joints`"
    )]
    NoModel,
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
    if session.cell.robot.is_none() && session.cell.object().is_none() {
        let why = "cell.toml has neither [robot] nor [object]; add the block of what moves in the clips";
        return Err(Refused::NotTestable(why.into()));
    }
    let arm = session.cell.robot.as_ref().map(|_| ArmModel::from_cell(&session.cell)).transpose()?;
    let (mut clips, mut files, mut out, mut remarks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for entry in &session.clips {
        let file = entry.file.to_string_lossy().into_owned();
        let read = session.read(entry).map_err(|error| error.to_string());
        match read.and_then(|clip| looked_at(clip, &session.cell, arm.as_ref())) {
            Ok((clip, odd)) => {
                clips.push(clip);
                remarks.extend(odd.into_iter().map(|remark| (file.clone(), remark)));
                files.push(file);
            }
            Err(why) => out.push((file, why)),
        }
    }
    let reasons = grouped(out.iter().map(|(file, why)| (file.as_str(), why.as_str()))).join("; ");
    if clips.is_empty() && !out.is_empty() {
        return Err(Refused::NotTestable(format!("no clip can be used: {reasons}")));
    }
    check_channels(&clips, is_tracking(&session.cell))?;
    let groups = split::by_command(&clips);
    if groups.len() < FEWEST {
        let without = if out.is_empty() { String::new() } else { format!(" (left out: {reasons})") };
        return Err(Refused::NotTestable(format!(
            "too few different commands: {} among the clips that can be used ({} of {}){without}; at least {FEWEST} are needed to \
             fit, to choose and to confirm on clips of their own: record more clips with other motions",
            groups.len(),
            clips.len(),
            clips.len() + out.len()
        )));
    }
    let mut warnings = grouped(remarks.iter().map(|(file, remark)| (file.as_str(), remark.as_str())));
    if !out.is_empty() {
        let all = out.len() + clips.len();
        warnings.insert(0, format!("{} of {all} clips were left out: {reasons}", out.len()));
    }
    warnings.extend(length::liveliest(&mut clips));
    let tracking = is_tracking(&session.cell);
    if tracking {
        // Not before clips are grouped by their commands: two motions of one command differ by noise.
        let all: Option<Vec<Clip>> = clips.into_iter().map(torques::followed).collect();
        let short = || Refused::NotTestable("clips are too short for their motion to be smoothed".into());
        clips = all.ok_or_else(short)?;
    }
    let all = |kind: ClipKind| clips.iter().all(|clip| clip.kind == kind);
    let with_object = !tracking && (all(ClipKind::ControlHitSlide) || all(ClipKind::FreeMotion));
    let commands = groups.len();
    Ok(Admitted { clips, files, groups, commands, with_object, warnings })
}

/// The clip with what could be mended mended and its joints in the model's order, and what is odd about it; the reason why
/// it cannot be used otherwise. `arm`: the cell's, where there is one.
pub(crate) fn looked_at(mut clip: Clip, cell: &Cell, arm: Option<&ArmModel>) -> Result<(Clip, Vec<String>), String> {
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
    let Screened { clip, remarks: odd, unusable, elsewhere } = screened(clip, cell);
    // Poses elsewhere than the tool may be what is to be found: a camera that looks from another place.
    remarks.extend(odd.into_iter().chain(elsewhere));
    unusable.map_or(Ok((clip, remarks)), Err)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark::session::record;
    use crate::benchmark::world::{Fault, Kind, World};
    use nalgebra::Translation3;
    use shared_mem::frames::Pose;
    use shared_mem::toml_file;
    use std::path::Path;

    fn recorded(kind: Kind) -> (Cell, ArmModel, Clip) {
        let text = include_str!("../../../../config/fr3_cell.toml");
        let cell = toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
        let world = World::draw(3, kind, Fault::Nothing, &cell);
        let clip = record(&world, 1).expect("a session").swap_remove(0);
        let arm = ArmModel::from_cell(&world.cell).expect("an arm");
        (world.cell, arm, clip)
    }

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
        for kind in [Kind::Excitation, Kind::Strokes] {
            let (cell, arm, clip) = recorded(kind);
            let (taken, remarks) = looked_at(clip.clone(), &cell, Some(&arm)).expect("a usable clip");
            assert_eq!((&taken.measured, &taken.object), (&clip.measured, &clip.object));
            assert!(remarks.is_empty(), "{remarks:?}");
        }
    }

    #[test]
    fn of_a_motion_with_a_hole_in_its_commands_the_longest_piece_is_taken_and_a_stroke_is_left_out() {
        let (cell, arm, mut clip) = recorded(Kind::Excitation);
        let rows = clip.desired.len();
        without_commands(&mut clip, rows / 4..rows / 4 + 200);
        let (taken, remarks) = looked_at(clip, &cell, Some(&arm)).expect("a usable clip");
        assert!((rows / 2..rows * 3 / 4).contains(&taken.measured.len()), "{} of {rows}", taken.measured.len());
        assert!(remarks.iter().any(|remark| remark.contains("no commands for 0.20")), "{remarks:?}");
        let (cell, arm, mut clip) = recorded(Kind::Strokes);
        without_commands(&mut clip, rows / 4..rows / 4 + 200);
        let why = looked_at(clip, &cell, Some(&arm)).expect_err("a reason");
        assert!(why.contains("no commands for 0.20") && why.contains("record it again"), "{why}");
    }

    #[test]
    fn a_dead_joint_is_a_reason_and_poses_elsewhere_are_a_remark() {
        let (cell, arm, mut clip) = recorded(Kind::Excitation);
        let stays = clip.measured.q[3];
        clip.measured.q.iter_mut().skip(3).step_by(7).for_each(|q| *q = stays);
        let why = looked_at(clip, &cell, Some(&arm)).expect_err("a reason");
        assert!(why.contains("joint 4") && why.contains("enabled"), "{why}");
        let (cell, arm, mut clip) = recorded(Kind::Strokes);
        for pose in &mut clip.object.poses {
            *pose = Pose::from_isometry(Translation3::new(0.0, 0.4, 0.0) * pose.isometry());
        }
        let (_, remarks) = looked_at(clip, &cell, Some(&arm)).expect("a clip");
        assert!(remarks.iter().any(|remark| remark.contains("never comes nearer")), "{remarks:?}");
    }
}
