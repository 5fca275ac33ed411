//! One clip in the twin: the arm alone, the arm hitting the object, or the object alone.

use super::object_start::{self, Motion};
use super::report::{ClipGap, Gap};
use crate::arm::{ArmModel, ControlLaw, GainError, JointState, ModelError};
use crate::effects::{CameraEffects, CameraMemory, EffectError, Effects};
use crate::metrics::{SurfacePoints, joint_rms};
use crate::rollout::{ArmRollout, CommandTrack, Hole, between};
use crate::scene::{MeshFileError, ObjectModel};
use crate::sim::{Drive, PERIOD_NS, SimCell, SimError};
use nalgebra::Vector3;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::{Clip, ObjectSeries, ReadError};
use shared_mem::theta::Theta;
use shared_mem::time::seconds_between;

/// The twin of a cell, ready to replay its clips.
#[derive(Debug, Clone)]
pub struct Replayer {
    cell: Cell,
    theta: Option<Theta>,
    arm: Option<(ArmModel, ControlLaw)>,
    /// The arm that moves, where it is another than the controller's.
    real_arm: Option<ArmModel>,
    effects: Effects,
    object: Option<(ObjectModel, SurfacePoints)>,
}

/// What the twin did under the commands of a clip.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prediction {
    /// Joint states, one for each measured row. Empty without an arm.
    pub joints: Vec<JointState>,
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
    /// The arm.
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// Its controller.
    #[error(transparent)]
    Gains(#[from] GainError),
    /// An effect.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The object's mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// The cell.
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
        let arm = match &cell.robot {
            None => None,
            Some(_) => {
                let model = ArmModel::from_cell(cell)?;
                let gains = theta.and_then(|t| t.arm.as_ref());
                let law = ControlLaw::new(cell.controller.as_ref(), gains, &model)?;
                Some((model, law))
            }
        };
        let object = ObjectModel::new(cell, theta)?.map(|model| {
            let surface = SurfacePoints::new(&model.shape);
            (model, surface)
        });
        let dof = arm.as_ref().map_or(0, |(model, _)| model.dof());
        let effects = Effects::from_theta(theta.map_or(&[], |t| &t.effects), dof)?;
        let real_arm = arm.as_ref().filter(|_| !effects.arm.is_none()).map(|(model, _)| effects.arm.real_arm(model));
        Ok(Self { cell: cell.clone(), theta: theta.cloned(), arm, real_arm, effects, object })
    }

    /// What is known about the cell.
    #[must_use]
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// The identified parameters in force.
    #[must_use]
    pub fn theta(&self) -> Option<&Theta> {
        self.theta.as_ref()
    }

    /// Points on the object's surface, where there is an object.
    #[must_use]
    pub fn surface(&self) -> Option<&SurfacePoints> {
        self.object.as_ref().map(|(_, surface)| surface)
    }

    /// Simulates a clip and holds it against what was measured.
    ///
    /// # Errors
    /// [`ReplayError`] naming the clip and the remedy.
    pub fn replay(&self, clip: Clip) -> Result<(Clip, Prediction, ClipGap), ReplayError> {
        let clip = self.in_model_order(clip)?;
        let prediction = self.predict(&clip)?;
        let gap = self.gap(&clip, &prediction);
        let finite = gap.joint_rms_rad.iter().flatten().chain(&gap.object_add_m).all(|v| v.is_finite());
        if !finite {
            return Err(ReplayError::Diverged(name(&clip)));
        }
        let mut warnings = clip.warnings.clone();
        warnings.extend(clip.damage.iter().chain(&prediction.warnings).cloned());
        let report = ClipGap { file: name(&clip), gap, warnings };
        Ok((clip, prediction, report))
    }

    /// Joints in the model's order. Own recordings of an arm whose joints have no names of their own number them.
    fn in_model_order(&self, mut clip: Clip) -> Result<Clip, ReplayError> {
        let Some((arm, _)) = &self.arm else { return Ok(clip) };
        let numbered = (1..=arm.dof()).map(|i| format!("joint{i}"));
        if clip.joint_names.iter().eq(numbered.collect::<Vec<_>>().iter()) {
            clip.joint_names = arm.joint_names().to_vec();
        }
        if clip.measured.is_empty() { Ok(clip) } else { Ok(clip.reorder(arm.joint_names())?) }
    }

    fn predict(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        match clip.kind {
            ClipKind::Excitation => self.arm_alone(clip),
            ClipKind::ControlHitSlide => self.arm_and_object(clip),
            ClipKind::FreeMotion => self.object_alone(clip),
        }
    }

    fn arm_alone(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        let (rollout, commands) = self.arm_inputs(clip)?;
        let stamps_ns = &clip.measured.stamps_ns;
        let mut joints = vec![JointState::default(); stamps_ns.len()];
        let starts = starts(clip, &commands);
        for (i, &from) in starts.iter().enumerate() {
            let to = starts.get(i + 1).copied().unwrap_or(stamps_ns.len());
            let start = start_state(&rollout, clip, from, &commands)?;
            rollout.run(&start, stamps_ns[from], &commands, &stamps_ns[from..to], &mut joints[from..to]);
        }
        Ok(Prediction { joints, warnings: hole_warnings(clip, &commands), ..Prediction::default() })
    }

    fn arm_and_object(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        let (rollout, commands) = self.arm_inputs(clip)?;
        let (object, _) = self.object.as_ref().ok_or_else(|| ReplayError::NoObject(name(clip)))?;
        let mut cell = SimCell::new(&self.cell, self.theta.as_ref())?;
        let start = start_state(&rollout, clip, 0, &commands)?;
        cell.set_arm(&start.q, &start.dq);
        let resting = object_start::resting(&self.undistorted(&clip.object), object, &self.cell)
            .ok_or_else(|| ReplayError::TooShort(name(clip), "no object poses"))?;
        cell.set_object(&resting, Vector3::zeros(), Vector3::zeros());
        let stamps_ns = &clip.measured.stamps_ns;
        let mut run = CellRun::new(cell, clip, stamps_ns[0], &self.effects.camera);
        let mut restarts = starts(clip, &commands).into_iter().skip(1).peekable();
        let mut command = 0;
        while run.unfinished() {
            if let Some(row) = restarts.next_if(|row| stamps_ns[*row] <= run.now_ns) {
                let state = start_state(&rollout, clip, row, &commands)?;
                run.cell.set_arm(&state.q, &state.dq);
            }
            command = commands.in_force(run.now_ns, command);
            run.period(&Drive::JointImpedance { q_d: *commands.q_d(command), dq_d: *commands.dq_d(command) });
        }
        let contact_time = run.cell.first_contact_ns().map(|ns| ns as f64 * 1e-9);
        let warnings = hole_warnings(clip, &commands);
        Ok(Prediction { joints: run.joints, object: run.object, contact_time, warnings })
    }

    fn arm_inputs(&self, clip: &Clip) -> Result<(ArmRollout<'_>, CommandTrack), ReplayError> {
        let (nominal, law) = self.arm.as_ref().ok_or_else(|| ReplayError::NoArm(name(clip)))?;
        let (arm, effects) = match &self.real_arm {
            Some(real) => (real, Some(&self.effects.arm)),
            None => (nominal, None),
        };
        let commands =
            CommandTrack::new(&clip.desired).ok_or_else(|| ReplayError::TooShort(name(clip), "no commands"))?;
        Ok((ArmRollout { arm, nominal, law, effects }, commands))
    }

    fn object_alone(&self, clip: &Clip) -> Result<Prediction, ReplayError> {
        let (object, _) = self.object.as_ref().ok_or_else(|| ReplayError::NoObject(name(clip)))?;
        let Motion { pose, velocity, angular_velocity } =
            object_start::moving(&self.undistorted(&clip.object), object, &self.cell)
                .ok_or_else(|| ReplayError::TooShort(name(clip), "fewer than three object poses"))?;
        let alone = Cell { robot: None, controller: None, tool: None, ..self.cell.clone() };
        let mut cell = SimCell::new(&alone, self.theta.as_ref())?;
        cell.set_object(&pose, velocity, angular_velocity);
        let mut run = CellRun::new(cell, clip, clip.object.stamps_ns[0], &self.effects.camera);
        while run.unfinished() {
            run.period(&Drive::Torque { tau_J_d: [0.0; MAX_JOINTS] });
        }
        Ok(Prediction { object: run.object, ..Prediction::default() })
    }

    /// The poses as they were, under effects that report them elsewhere.
    fn undistorted(&self, poses: &ObjectSeries) -> ObjectSeries {
        let mut poses = poses.clone();
        if !self.effects.camera.is_none() {
            for pose in &mut poses.poses {
                *pose = Pose::from_isometry(self.effects.camera.undistorted(&pose.isometry()));
            }
        }
        poses
    }

    fn gap(&self, clip: &Clip, prediction: &Prediction) -> Gap {
        let dof = clip.measured.dof;
        let joints = || joint_rms(&prediction.joints, &clip.measured.q, dof)[..dof].to_vec();
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

/// ADD or ADD-S.
type Distance = fn(&SurfacePoints, &Pose<Base, Object>, &Pose<Base, Object>) -> f64;

/// A cell on its way through a clip: keeps what it does at the clip's stamps.
struct CellRun<'a> {
    cell: SimCell,
    clip: &'a Clip,
    now_ns: u64,
    camera: &'a CameraEffects,
    reported: CameraMemory,
    joints: Vec<JointState>,
    object: Vec<Pose<Base, Object>>,
}

impl<'a> CellRun<'a> {
    /// Stamps up to the start get the start.
    fn new(cell: SimCell, clip: &'a Clip, start_ns: u64, camera: &'a CameraEffects) -> Self {
        let (joints, object) = (Vec::with_capacity(clip.measured.len()), Vec::with_capacity(clip.object.len()));
        let reported = CameraMemory::default();
        let mut run = Self { cell, clip, now_ns: start_ns, camera, reported, joints, object };
        let (state, pose) = (run.joint_state(), run.cell.object());
        run.keep(start_ns, |_| state, |_| pose);
        run
    }

    fn unfinished(&self) -> bool {
        self.joints.len() < self.clip.measured.len() || self.object.len() < self.clip.object.len()
    }

    fn period(&mut self, drive: &Drive) {
        let (before, pose_before, start_ns) = (self.joint_state(), self.cell.object(), self.now_ns);
        self.cell.step(drive);
        self.now_ns += PERIOD_NS;
        let (after, pose_after) = (self.joint_state(), self.cell.object());
        let share = |stamp: u64| stamp.saturating_sub(start_ns) as f64 / PERIOD_NS as f64;
        self.keep(
            start_ns + PERIOD_NS,
            |stamp| between(&before, &after, share(stamp)),
            |stamp| {
                let (a, b) = (pose_before?.isometry(), pose_after?.isometry());
                Some(Pose::from_isometry(a.lerp_slerp(&b, share(stamp))))
            },
        );
    }

    /// Keeps the prediction for every stamp up to `until_ns` that has none yet.
    fn keep(
        &mut self,
        until_ns: u64,
        joints: impl Fn(u64) -> JointState,
        object: impl Fn(u64) -> Option<Pose<Base, Object>>,
    ) {
        let Clip { measured, object: poses, .. } = self.clip;
        while let Some(stamp) = measured.stamps_ns.get(self.joints.len()).filter(|s| **s <= until_ns) {
            self.joints.push(joints(*stamp));
        }
        let latency = self.camera.latency_ns();
        while let Some(stamp) = poses.stamps_ns.get(self.object.len()).filter(|s| s.saturating_sub(latency) <= until_ns)
        {
            let Some(pose) = object(stamp.saturating_sub(latency)) else { break };
            self.object.push(self.camera.seen(&mut self.reported, *stamp, pose));
        }
    }

    fn joint_state(&self) -> JointState {
        self.cell.joint_reading()
    }
}

/// Measured rows at which the twin is set onto the robot: the first, and the first behind each hole in the commands.
fn starts(clip: &Clip, commands: &CommandTrack) -> Vec<usize> {
    let stamps_ns = &clip.measured.stamps_ns;
    let behind = commands.holes().iter().map(|hole| stamps_ns.partition_point(|stamp| *stamp < hole.to_ns));
    let mut rows: Vec<usize> = std::iter::once(0).chain(behind.filter(|row| *row < stamps_ns.len())).collect();
    rows.dedup();
    rows
}

fn start_state(
    rollout: &ArmRollout<'_>,
    clip: &Clip,
    from: usize,
    commands: &CommandTrack,
) -> Result<JointState, ReplayError> {
    rollout
        .start_state(&clip.measured, from, commands)
        .ok_or_else(|| ReplayError::TooShort(name(clip), "no measured joints"))
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
