//! One clip in the twin: the arm comes, hits, the object slides until it rests. Base frame, SI, stamps of the recording.

use super::clip::ObjectClip;
use super::own::{Axis, Own, Values};
use crate::estimate::Impossible;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::theta::{ObjectTheta, Theta};
use twin::arm::{ArmModel, ControlLaw, JointState};
use twin::effects::Effects;
use twin::replay::object_start;
use twin::rollout::{ArmRollout, CommandTrack};
use twin::scene::ObjectModel;
use twin::sim::{Drive, PERIOD_NS, SimCell};

/// The simulation ends when the object has rested for so many periods and no recorded pose moves any more.
const REST_PERIODS: usize = 50;

/// The object over time, one pose a period from `start_ns` on; after the last it rests there.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    pub(super) start_ns: u64,
    pub(super) poses: Vec<Isometry3<f64>>,
    /// From the clip's start to the first touch [s].
    pub(super) contact_time: Option<f64>,
    pub(super) effects: Effects,
}

impl Trace {
    /// The pose at a time, between periods on the straight way.
    pub(super) fn at(&self, stamp_ns: f64) -> Isometry3<f64> {
        let along = (stamp_ns - self.start_ns as f64) / PERIOD_NS as f64;
        let last = self.poses.len() - 1;
        if along <= 0.0 {
            return self.poses[0];
        }
        if along >= last as f64 {
            return self.poses[last];
        }
        let (row, share) = (along.floor() as usize, along.fract());
        self.poses[row].lerp_slerp(&self.poses[row + 1], share)
    }
}

/// Simulates a clip with its own numbers.
pub(super) fn run(cell: &Cell, clip: &ObjectClip, theta: &Theta, own: &Values) -> Result<Trace, Impossible> {
    let fail = |error: &dyn std::fmt::Display| Impossible(error.to_string());
    let theta = with_own_friction(cell, theta, own).map_err(|e| fail(&e))?;
    let object = ObjectModel::new(cell, Some(&theta)).map_err(|e| fail(&e))?;
    let object = object.ok_or_else(|| Impossible("the cell has no object".into()))?;
    match clip.recorded.kind {
        ClipKind::FreeMotion => alone(cell, clip, &theta, &object, own),
        ClipKind::ControlHitSlide | ClipKind::Excitation => hit(cell, clip, &theta, &object, own),
    }
}

fn with_own_friction(cell: &Cell, theta: &Theta, own: &Values) -> Result<Theta, twin::scene::MeshFileError> {
    let mut theta = theta.clone();
    let friction = ObjectModel::new(cell, Some(&theta))?.map_or(0.0, |object| object.friction);
    let object = theta.object.get_or_insert_with(ObjectTheta::default);
    object.friction = Some(friction * own.of(Own::LnFriction).exp());
    Ok(theta)
}

fn hit(cell: &Cell, clip: &ObjectClip, theta: &Theta, object: &ObjectModel, own: &Values) -> Result<Trace, Impossible> {
    let fail = |error: &dyn std::fmt::Display| Impossible(error.to_string());
    let effects = effects(cell, theta)?;
    let commands = CommandTrack::new(&clip.recorded.desired).ok_or_else(|| Impossible("no commands".into()))?;
    let start = arm_start(cell, clip, theta, &effects, &commands)?;
    let mut sim = SimCell::new(cell, Some(theta)).map_err(|e| fail(&e))?;
    sim.set_arm(&start.q, &start.dq);
    let series = clip.undistorted(&effects.camera);
    let pose = object_start::resting(&series, object, cell).ok_or_else(|| Impossible("no poses".into()))?;
    let moved = moved(&pose.isometry(), own);
    sim.set_object(&Pose::from_isometry(moved), Vector3::zeros(), Vector3::zeros());
    let start_ns = clip.recorded.measured.stamps_ns[0];
    let mut trace = Trace { start_ns, poses: vec![moved], contact_time: None, effects };
    let (mut now_ns, mut row, mut rested, mut kicked) = (start_ns, 0, 0, false);
    while now_ns < clip.end_ns && !(rested > REST_PERIODS && now_ns > clip.rest_ns) {
        row = commands.in_force(now_ns, row);
        sim.step(&Drive::JointImpedance { q_d: *commands.q_d(row), dq_d: *commands.dq_d(row) });
        now_ns += PERIOD_NS;
        if let (Some(first), false) = (sim.first_contact_ns(), kicked) {
            trace.contact_time = Some(first as f64 * 1e-9);
            if sim.contact_force() == 0.0 {
                kick(&mut sim, own);
                kicked = true;
            }
        }
        trace.poses.push(object_pose(&sim)?);
        let still = sim.object_velocity().is_some_and(|(v, w)| v == Vector3::zeros() && w == Vector3::zeros());
        rested = if still && kicked { rested + 1 } else { 0 };
    }
    Ok(trace)
}

fn alone(
    cell: &Cell,
    clip: &ObjectClip,
    theta: &Theta,
    object: &ObjectModel,
    own: &Values,
) -> Result<Trace, Impossible> {
    let effects = effects(cell, theta)?;
    let series = clip.undistorted(&effects.camera);
    let motion = object_start::moving(&series, object, cell).ok_or_else(|| Impossible("too few poses".into()))?;
    let cell = Cell { robot: None, controller: None, tool: None, ..cell.clone() };
    let mut sim = SimCell::new(&cell, Some(theta)).map_err(|e| Impossible(e.to_string()))?;
    let axes = [Axis::X, Axis::Y, Axis::Z];
    let velocity = motion.velocity + Vector3::from(axes.map(|axis| own.of(Own::Velocity(axis))));
    let spin = motion.angular_velocity + Vector3::from(axes.map(|axis| own.of(Own::Spin(axis))));
    let pose = moved(&motion.pose.isometry(), own);
    sim.set_object(&Pose::from_isometry(pose), velocity, spin);
    let start_ns = clip.recorded.object.stamps_ns[0];
    let mut trace = Trace { start_ns, poses: vec![pose], contact_time: None, effects };
    let (mut now_ns, mut rested) = (start_ns, 0);
    while now_ns < clip.end_ns && rested <= REST_PERIODS {
        sim.step(&Drive::Torque { tau_J_d: [0.0; MAX_JOINTS] });
        now_ns += PERIOD_NS;
        trace.poses.push(object_pose(&sim)?);
        let still = sim.object_velocity().is_some_and(|(v, w)| v == Vector3::zeros() && w == Vector3::zeros());
        rested = if still { rested + 1 } else { 0 };
    }
    Ok(trace)
}

fn effects(cell: &Cell, theta: &Theta) -> Result<Effects, Impossible> {
    let dof = match &cell.robot {
        None => 0,
        Some(_) => ArmModel::from_cell(cell).map_err(|e| Impossible(e.to_string()))?.dof(),
    };
    Effects::from_theta(&theta.effects, dof).map_err(|e| Impossible(e.to_string()))
}

fn arm_start(
    cell: &Cell,
    clip: &ObjectClip,
    theta: &Theta,
    effects: &Effects,
    commands: &CommandTrack,
) -> Result<JointState, Impossible> {
    let nominal = ArmModel::from_cell(cell).map_err(|e| Impossible(e.to_string()))?;
    let law = ControlLaw::new(cell.controller.as_ref(), theta.arm.as_ref(), &nominal);
    let law = law.map_err(|e| Impossible(e.to_string()))?;
    let real = effects.arm.real_arm(&nominal);
    let hidden = (!effects.arm.is_none()).then_some(&effects.arm);
    let arm = if hidden.is_some() { &real } else { &nominal };
    ArmRollout { arm, nominal: &nominal, law: &law, effects: hidden }
        .start_state(&clip.recorded.measured, 0, commands)
        .ok_or_else(|| Impossible("no measured joints".into()))
}

fn object_pose(sim: &SimCell) -> Result<Isometry3<f64>, Impossible> {
    let pose = sim.object().ok_or_else(|| Impossible("the cell has no object".into()))?.isometry();
    let sane = pose.translation.vector.iter().all(|v| v.abs() < 1e3);
    if sane { Ok(pose) } else { Err(Impossible("the simulated object flew away".into())) }
}

fn moved(pose: &Isometry3<f64>, own: &Values) -> Isometry3<f64> {
    let shift = Vector3::new(own.of(Own::StartX), own.of(Own::StartY), 0.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), own.of(Own::StartYaw));
    Isometry3::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation)
}

/// What the real hit gave besides the simulated one.
fn kick(sim: &mut SimCell, own: &Values) {
    let [speed, heading, spin] = [Own::ReleaseSpeed, Own::ReleaseHeading, Own::ReleaseSpin].map(|o| own.of(o));
    let (Some(pose), Some((velocity, angular))) = (sim.object(), sim.object_velocity()) else { return };
    if [speed, heading, spin] == [0.0; 3] {
        return;
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    sim.set_object(&pose, turn * velocity * speed.exp(), angular * speed.exp() + Vector3::z() * spin);
}
