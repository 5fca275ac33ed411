//! One clip in the twin: the arm alone, the arm hitting the object, or the object alone.

use super::object_start;
use super::on_table::Buried;
use super::report::{ClipGap, Gap};
use crate::arm::{ArmModel, JointState};
use crate::control::{CommandTrack, Hole, Reading};
use crate::effects::CameraEffects;
use crate::metrics::{SurfacePoints, joint_rms};
use crate::rollout::{CellRollout, CellTrace, Course, ObjectState};
use crate::scene::{MeshFileError, ObjectModel};
use crate::sim::SimError;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::output::OutputError;
use shared_mem::recording::{Clip, ObjectSeries, ReadError};
use shared_mem::theta::Theta;
use shared_mem::time::seconds_between;

/// The twin of a cell, ready to replay its clips.
#[derive(Clone)]
pub struct Replayer {
    cell: Cell,
    theta: Option<Theta>,
    rollout: CellRollout,
    camera: CameraEffects,
    object: Option<(ObjectModel, SurfacePoints)>,
}

/// What the twin did under the commands of a clip.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prediction {
    /// What the arm's sensors read, one for each measured row. Empty without an arm.
    pub joints: Vec<Reading>,
    /// Object poses, one for each recorded pose. Empty where the object was not simulated.
    pub object: Vec<Pose<Base, Object>>,
    /// From the first measured row to the first touch of tool and object [s]; `None` when they did not touch.
    pub contact_time: Option<f64>,
    /// What a reader of the figures has to know, one sentence each.
    pub warnings: Vec<String>,
}

/// A clip or a session cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The object's mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    #[error(transparent)]
    Cell(#[from] SimError),
    /// The clip's kind asks for an arm.
    #[error("{0}: the clip needs an arm; add a [robot] block to cell.toml, or set the clip's kind to \"free_motion\"")]
    NoArm(String),
    /// The clip's kind asks for an object.
    #[error("{0}: the clip needs an object; add an [object] block to cell.toml")]
    NoObject(String),
    /// Too little was recorded.
    #[error("{0}: too short to replay: it holds {1}; record it again or remove it from cell.toml")]
    TooShort(String, &'static str),
    /// Nobody logged what the arm was commanded.
    #[error(
        "{0}: it holds no commands, without which the twin's arm cannot be led: what can be explained are its torques, where it has any, by `calibration diagnose --torques`"
    )]
    NoCommands(String),
    /// The object cannot be where the poses say.
    #[error("{0}: {1}")]
    Buried(String, Buried),
    /// The simulated clip has no place.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The simulation left all bounds.
    #[error(
        "{0}: the simulated arm diverges; the damping may be too large for a 1 kHz controller or the inertia too small: check `damping` and `rotor_inertia`"
    )]
    Diverged(String),
}

impl Replayer {
    /// The twin of a cell, with identified parameters where there are some.
    ///
    /// # Errors
    /// [`ReplayError`] naming key or file and the remedy; an effect in `theta` that this version does not know is one.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, ReplayError> {
        let object = ObjectModel::new(cell, theta)?.map(|model| {
            let surface = SurfacePoints::new(&model.shape);
            (model, surface)
        });
        let rollout = CellRollout::new(cell, theta)?;
        let camera = rollout.cell().camera_effects();
        Ok(Self { cell: cell.clone(), theta: theta.cloned(), rollout, camera, object })
    }

    /// What is known about the cell.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// The identified parameters in force.
    pub fn theta(&self) -> Option<&Theta> {
        self.theta.as_ref()
    }

    /// Points on the object's surface, where there is an object.
    pub fn surface(&self) -> Option<&SurfacePoints> {
        self.object.as_ref().map(|(_, surface)| surface)
    }

    /// Simulates a clip and holds it against what was measured.
    ///
    /// # Errors
    /// [`ReplayError`] naming the clip and the remedy.
    pub fn replay(&self, clip: Clip) -> Result<(Clip, Prediction, ClipGap), ReplayError> {
        self.judge(clip, |clip| self.predict(clip))
    }

    /// The same for what anybody else predicts of the clip, joints in the model's order.
    ///
    /// # Errors
    /// As [`Replayer::replay`], and those of the prediction.
    pub fn judge(
        &self,
        clip: Clip,
        predict: impl FnOnce(&Clip) -> Result<Prediction, ReplayError>,
    ) -> Result<(Clip, Prediction, ClipGap), ReplayError> {
        let clip = match self.rollout.cell().arm_model() {
            Some(arm) => in_model_order(clip, arm)?,
            None => clip,
        };
        let mut prediction = predict(&clip)?;
        prediction.warnings.extend(self.placement(&clip)?);
        let gap = self.gap(&clip, &prediction);
        let finite = gap.joint_rms_rad.iter().flatten().chain(&gap.object_add_m).all(|v| v.is_finite());
        if !finite {
            return Err(ReplayError::Diverged(name(&clip)));
        }
        let mut warnings = clip.warnings.clone();
        warnings.extend(clip.damage.iter().chain(&prediction.warnings).cloned());
        let report = ClipGap { file: name(&clip), gap, origins: clip.origins.clone(), warnings };
        Ok((clip, prediction, report))
    }

    fn predict(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        match clip.kind {
            ClipKind::Excitation => self.with_arm(clip, None),
            ClipKind::ControlHitSlide => {
                let (object, _) = self.object.as_ref().ok_or_else(|| ReplayError::NoObject(name(clip)))?;
                let resting = object_start::resting(&self.undistorted(&clip.object), object, &self.cell)
                    .ok_or_else(|| ReplayError::TooShort(name(clip), "no object poses"))?;
                self.with_arm(clip, Some(&ObjectState::at_rest(resting)))
            }
            ClipKind::FreeMotion => self.object_alone(clip),
        }
    }

    /// What there is to tell about where the poses put the object at the clip's start.
    fn placement(&self, clip: &Clip) -> Result<Option<String>, ReplayError> {
        let Some((object, _)) = self.object.as_ref().filter(|_| clip.kind != ClipKind::Excitation) else {
            return Ok(None);
        };
        object_start::remark(&self.undistorted(&clip.object), clip.kind, object, &self.cell)
            .map_err(|buried| ReplayError::Buried(name(clip), buried))
    }

    fn with_arm(&self, clip: &Clip, object: Option<&ObjectState>) -> Result<Prediction, ReplayError> {
        let arm = self.rollout.arm().ok_or_else(|| ReplayError::NoArm(name(clip)))?;
        let commands =
            CommandTrack::of_cell(&clip.desired, &self.cell).ok_or_else(|| ReplayError::NoCommands(name(clip)))?;
        let (stamps_ns, poses_ns) = (&clip.measured.stamps_ns, &clip.object.stamps_ns);
        let start_state = |row: usize| {
            let state = arm.start_state(&clip.measured, row, &commands);
            state.ok_or_else(|| ReplayError::TooShort(name(clip), "no measured joints"))
        };
        let (mut rollout, mut trace) = (self.rollout.clone(), CellTrace::default());
        let starts = starts(clip, &commands);
        let first = start_state(starts[0])?;
        rollout.start(stamps_ns[0], Some(&first), object, Some(&commands));
        let course = Course { commands: Some(&commands), joints_ns: stamps_ns, poses_ns };
        for row in starts.into_iter().skip(1) {
            rollout.run_until(stamps_ns[row], &course, &mut trace);
            rollout.put_arm(&start_state(row)?, Some(&commands));
        }
        rollout.run(&course, &mut trace);
        let contact_time = trace.contact.map(|contact| seconds_between(stamps_ns[0], contact.start_ns));
        Ok(Prediction {
            joints: trace.joints,
            object: trace.poses,
            contact_time,
            warnings: hole_warnings(clip, &commands),
        })
    }

    fn object_alone(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        let (object, _) = self.object.as_ref().ok_or_else(|| ReplayError::NoObject(name(clip)))?;
        let start = object_start::moving(&self.undistorted(&clip.object), object, &self.cell)
            .ok_or_else(|| ReplayError::TooShort(name(clip), "fewer than three object poses"))?;
        let (mut rollout, mut trace) = (self.rollout.clone(), CellTrace::default());
        let poses_ns = &clip.object.stamps_ns;
        rollout.start(poses_ns[0], None, Some(&start), None);
        rollout.run(&Course { commands: None, joints_ns: &[], poses_ns }, &mut trace);
        Ok(Prediction { object: trace.poses, ..Prediction::default() })
    }

    /// The poses as they were, under effects that report them elsewhere.
    fn undistorted(&self, poses: &ObjectSeries) -> ObjectSeries {
        let mut poses = poses.clone();
        if !self.camera.is_none() {
            for pose in &mut poses.poses {
                *pose = Pose::from_isometry(self.camera.undistorted(&pose.isometry()));
            }
        }
        poses
    }

    fn gap(&self, clip: &Clip, prediction: &Prediction) -> Gap {
        let dof = clip.measured.dof;
        let states: Vec<JointState> = prediction.joints.iter().map(|reading| reading.state).collect();
        let joints = || joint_rms(&states, &clip.measured.q, dof)[..dof].to_vec();
        let poses = || prediction.object.iter().zip(&clip.object.poses);
        let surface = self.surface().filter(|_| poses().len() > 0);
        let mean = |distance: Distance| {
            surface.map(|surface| poses().map(|(a, b)| distance(surface, a, b)).sum::<f64>() / poses().len() as f64)
        };
        Gap {
            joint_rms_rad: (!prediction.joints.is_empty()).then(joints),
            object_add_m: mean(SurfacePoints::add),
            object_add_s_m: mean(SurfacePoints::add_s),
            contact_time_s: prediction.contact_time,
        }
    }
}

/// A clip with its joints in the model's order. Own recordings of an arm whose joints have no names of their own number
/// them.
///
/// # Errors
/// [`ReadError`] naming the joints when the clip has others.
pub fn in_model_order(mut clip: Clip, arm: &ArmModel) -> Result<Clip, ReadError> {
    let numbered = (1..=arm.dof()).map(|i| format!("joint{i}"));
    if clip.joint_names.iter().eq(numbered.collect::<Vec<_>>().iter()) {
        clip.joint_names = arm.joint_names().to_vec();
    }
    if clip.measured.is_empty() { Ok(clip) } else { clip.reorder(arm.joint_names()) }
}

/// ADD or ADD-S.
type Distance = fn(&SurfacePoints, &Pose<Base, Object>, &Pose<Base, Object>) -> f64;

/// Measured rows at which the twin is set onto the robot: the first, and the first behind each hole in the commands.
fn starts(clip: &Clip, commands: &CommandTrack) -> Vec<usize> {
    let stamps_ns = &clip.measured.stamps_ns;
    let behind = commands.holes().iter().map(|hole| stamps_ns.partition_point(|stamp| *stamp < hole.to_ns));
    let mut rows: Vec<usize> = std::iter::once(0).chain(behind.filter(|row| *row < stamps_ns.len())).collect();
    rows.dedup();
    rows
}

fn hole_warnings(clip: &Clip, commands: &CommandTrack) -> Vec<String> {
    let first = clip.measured.stamps_ns.first().copied().unwrap_or(0);
    let sentence = |hole: &Hole| {
        let (at, long) = (seconds_between(first, hole.from_ns), seconds_between(hole.from_ns, hole.to_ns));
        format!("no commands for {long:.3} s from {at:.3} s on; the twin was set back onto the robot behind the hole")
    };
    commands.holes().iter().map(sentence).collect()
}

fn name(clip: &Clip) -> String {
    clip.file.file_name().unwrap_or(clip.file.as_os_str()).to_string_lossy().into_owned()
}
