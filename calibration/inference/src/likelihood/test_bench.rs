//! Objects whose truth is known, to try residuals on: a box that slides by itself, and one that an arm pushes. SI units.

use super::Settings;
use super::arm::ArmClips;
use super::cell::CellClips;
use super::object::ObjectClips;
use super::setting::{Setting, complete};
use crate::estimate::ClipModel;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind, PoseNoise, Table};
use shared_mem::frames::Pose;
use shared_mem::origin::Origins;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::theta::{ObjectTheta, Theta};
use std::path::Path;
use twin::arm::{ArmModel, JointState};
use twin::control::CommandTrack;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};

pub(super) const NOISE: PoseNoise = PoseNoise { position: 5e-4, rotation: 3e-3 };
/// What a cell is simulated with where it states no range.
pub(super) const FRICTION: f64 = 0.3;
/// Poses of a slide, and the time between two of them [ns].
pub(super) const POSES: usize = 60;
pub(super) const POSE_NS: u64 = 10_000_000;
const START_NS: u64 = 1_000_000_000;

/// A table and a box of 8 x 6 x 5 cm, whose poses are so noisy.
pub(super) fn sliding_cell(noise: PoseNoise) -> Cell {
    let text = format!(
        "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.05]\nmass = 0.3\n\
         pose_noise = {{ position = {}, rotation = {} }}\n",
        noise.position, noise.rotation
    );
    Cell::parse(&text, Path::new("cell.toml")).expect("a cell")
}

/// A box that slides and turns until it rests, seen at 100 Hz without noise.
pub(super) fn slide() -> Clip {
    slide_under(&Theta::default(), 0.0, 0.8)
}

/// The same under hidden parameters, in a heading [rad], turning so fast at first [rad/s].
pub(super) fn slide_under(hidden: &Theta, heading: f64, spin: f64) -> Clip {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let pose = Isometry3::from_parts(
        Vector3::new(0.4, 0.0, 0.025).into(),
        turned * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7),
    );
    let state = ObjectState {
        pose: Pose::from_isometry(pose),
        velocity: turned * Vector3::new(0.5, 0.2, 0.0),
        angular_velocity: Vector3::z() * spin,
    };
    let stamps_ns: Vec<u64> = (0..POSES as u64).map(|row| START_NS + row * POSE_NS).collect();
    let mut rollout = CellRollout::new(&sliding_cell(NOISE), Some(hidden)).expect("a cell");
    rollout.start(stamps_ns[0], None, Some(&state), None);
    let mut trace = CellTrace::default();
    rollout.run(&Course { commands: None, joints_ns: &[], poses_ns: &stamps_ns }, &mut trace);
    Clip { kind: ClipKind::FreeMotion, object: ObjectSeries { stamps_ns, poses: trace.poses }, ..empty("slide.mcap") }
}

fn empty(file: &str) -> Clip {
    Clip {
        file: file.into(),
        kind: ClipKind::Excitation,
        joint_names: Vec::new(),
        desired: JointSeries::default(),
        measured: JointSeries::default(),
        torques_end_at_rows: true,
        object: ObjectSeries::default(),
        others: Vec::new(),
        origins: Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// Slides under numbers that are searched; the cell's own parameters are those that are not.
pub(super) fn slides(noise: PoseNoise, clips: Vec<Clip>, searched: &[Setting]) -> ObjectClips {
    let cell = sliding_cell(noise);
    let settings = Settings::new(complete(&cell, None).expect("a cell"), searched.to_vec());
    ObjectClips::new(&cell, clips, settings).expect("a cell that can be simulated")
}

/// Parameters that go with numbers, of clips without an arm.
pub(super) type NoArm = fn(&[f64]) -> Theta;

/// The same slides as a diagnosis sees them: each with a friction of its own, and paths that deviate.
pub(super) fn diagnosed_slides(clips: Vec<Clip>, searched: &[Setting]) -> CellClips<'static, NoArm> {
    CellClips::new(None::<ArmClips<NoArm>>, slides(NOISE, clips, searched), |_: &[f64]| Vec::new())
}

/// The shipped cell, and what its arm does to a box that stands beside its tool: its first joint swings the tool into it and back.
pub(super) struct Stroke {
    pub(super) cell: Cell,
    pub(super) hidden: Theta,
    pub(super) clip: Clip,
}

/// Control periods of a stroke.
const STROKE_PERIODS: u64 = 900;

impl Stroke {
    pub(super) fn new() -> Self {
        let text = include_str!("../../../../config/fr3_cell.toml");
        let mut cell = Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped cell");
        cell.controller.as_mut().expect("a controller").torque_limit.clear();
        let arm = ArmModel::from_cell(&cell).expect("an arm");
        let tool = cell.tool.as_ref().expect("a tool");
        let tip = arm.flange(arm.ready()).isometry() * Point3::new(0.0, 0.0, tool.length);
        cell.table = Some(Table { height: tip.z - 0.05 });
        // Half of its width, the tool's radius, and a gap that takes a quarter of a second.
        let standing = Isometry3::translation(tip.x, tip.y + 0.03 + tool.radius + 0.03, tip.z);
        let object = ObjectTheta { friction: Some(0.35), mass: Some(0.4), ..ObjectTheta::default() };
        let base = complete(&cell, None).expect("a complete cell");
        let hidden = Theta { object: Some(object), arm: base.arm, ..Theta::default() };
        let clip = Self::recorded(&cell, &hidden, &arm, standing);
        Self { cell, hidden, clip }
    }

    fn recorded(cell: &Cell, hidden: &Theta, arm: &ArmModel, standing: Isometry3<f64>) -> Clip {
        let (ready, dof) = (*arm.ready(), arm.dof());
        let joints_ns: Vec<u64> = (0..STROKE_PERIODS).map(|row| START_NS + row * 1_000_000).collect();
        let poses_ns: Vec<u64> = joints_ns.iter().copied().step_by(16).collect();
        let mut desired = JointSeries { dof, stamps_ns: joints_ns.clone(), ..JointSeries::default() };
        for row in 0..STROKE_PERIODS {
            let (mut q, mut dq, t) = (ready, [0.0; shared_mem::msg::MAX_JOINTS], row as f64 * 1e-3);
            (q[0], dq[0]) = (q[0] + 0.11 * (1.0 - (8.0 * t).cos()), 0.11 * 8.0 * (8.0 * t).sin());
            desired.q.extend(&q[..dof]);
            desired.dq.extend(&dq[..dof]);
        }
        let commands = CommandTrack::new(&desired).expect("commands");
        let mut rollout = CellRollout::new(cell, Some(hidden)).expect("a cell");
        let object = ObjectState::at_rest(Pose::from_isometry(standing));
        rollout.start(START_NS, Some(&JointState::at_rest(ready)), Some(&object), Some(&commands));
        let mut trace = CellTrace::default();
        rollout.run(&Course { commands: Some(&commands), joints_ns: &joints_ns, poses_ns: &poses_ns }, &mut trace);
        let q = trace.joints.iter().flat_map(|reading| reading.state.q[..dof].to_vec()).collect();
        let dq = trace.joints.iter().flat_map(|reading| reading.state.dq[..dof].to_vec()).collect();
        Clip {
            kind: ClipKind::ControlHitSlide,
            joint_names: arm.joint_names().to_vec(),
            measured: JointSeries { q, dq, ..desired.clone() },
            desired,
            object: ObjectSeries { stamps_ns: poses_ns, poses: trace.poses },
            ..empty("stroke.mcap")
        }
    }
}

/// Residuals of a clip.
pub(super) fn residuals(model: &impl ClipModel, clip: usize, shared: &[f64], own: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    model.residuals(clip, shared, own, &mut out).expect("it can be simulated");
    out
}

pub(super) fn largest(residuals: impl IntoIterator<Item = f64>) -> f64 {
    residuals.into_iter().fold(0.0, |largest, residual| largest.max(residual.abs()))
}
