//! The arm that carries a moved body: which joints its way takes, and what of it the arm cannot do. Without gains it is kinematics
//! alone: the body is where it is commanded to be, and so are the joints. With gains the joints are commanded, and what touches
//! the body moves them.

use super::file::ArmEntry;
use super::surface::pose;
use crate::arm::{ArmModel, JointState, Joints, Limits, Nearest};
use crate::world::{ArmPlan, World};
use nalgebra::{Isometry3, Translation3, Vector6};
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::msg::joints_from;
use std::sync::Arc;

/// A Franka FR3, and what hangs on its flange.
#[derive(Debug, Clone)]
pub(super) struct Carrier {
    model: ArmModel,
    limits: Limits,
    /// The body that it carries.
    pub(super) body: usize,
    flange_from_body: Isometry3<f64>,
    base_from_world: Isometry3<f64>,
    /// Stiffness and damping of an arm that gives way.
    gains: Option<[Joints; 2]>,
}

/// What the arm of a carrier is commanded, and what it cannot do of that.
#[derive(Debug, Clone, Default)]
pub(super) struct CarrierCommand {
    q: Option<Joints>,
    dq: Joints,
    /// What the encoders read, where the arm is not where it is commanded to be.
    reading: Option<JointState>,
    /// What it cannot do, at first.
    pub(super) fault: Option<String>,
}

impl CarrierCommand {
    pub(super) fn at_rest(q: Joints) -> Self {
        Self { q: Some(q), ..Self::default() }
    }

    /// Goes on to joints [rad] at their speeds [rad/s].
    pub(super) fn go(&mut self, q: Joints, dq: Joints) {
        (self.q, self.dq) = (Some(q), dq);
    }

    /// The encoders of an arm that is not where it is commanded to be read this.
    pub(super) fn read(&mut self, reading: JointState) {
        self.reading = Some(reading);
    }

    /// Commanded speeds of the joints [rad/s].
    pub(super) fn speeds(&self) -> &Joints {
        &self.dq
    }

    /// Where the joints are commanded to be [rad]; `None` before it has reached anything.
    pub(super) fn joints(&self) -> Option<&Joints> {
        self.q.as_ref()
    }
}

impl Carrier {
    pub(super) fn new(entry: &ArmEntry, body: usize) -> Self {
        let base = Translation3::from(entry.base).inverse();
        let (model, limits) = (ArmModel::fr3(), Limits::fr3());
        let flange_from_body = pose(entry.position, entry.rotation);
        let base_from_world = Isometry3::from_parts(base, nalgebra::one());
        let gains = entry
            .stiffness
            .zip(entry.damping)
            .map(|(stiffness, damping)| [stiffness, damping].map(|all| joints_from(&all)));
        Self { model, limits, body, flange_from_body, base_from_world, gains }
    }

    /// How an arm that gives way carries its body, whose pose this is at the start; `None` for an arm that does not give way, and
    /// where it cannot be.
    pub(super) fn plan(&self, body: &Isometry3<f64>) -> Option<ArmPlan> {
        let [stiffness, damping] = self.gains?;
        Some(ArmPlan {
            model: Arc::new(self.model.clone()),
            base: self.world_from_base(),
            flange_from_body: self.flange_from_body,
            start: self.joints_at(body)?,
            stiffness,
            damping,
        })
    }

    /// Where its base is in the world.
    pub(super) fn world_from_base(&self) -> Isometry3<f64> {
        self.base_from_world.inverse()
    }

    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The flange at these joints, in the arm's base.
    pub(super) fn flange(&self, q: &Joints) -> Isometry3<f64> {
        self.model.flange(q).isometry()
    }

    /// The carried body at these joints, in the world.
    pub(super) fn body_at(&self, q: &Joints) -> Isometry3<f64> {
        self.base_from_world.inverse() * self.flange(q) * self.flange_from_body
    }

    /// Joints that have the body at a pose in the world, near to the robot's ready pose.
    pub(super) fn joints_at(&self, body: &Isometry3<f64>) -> Option<Joints> {
        self.model.reach(self.model.ready(), &self.flange_from_body, &(self.base_from_world * body), None)
    }

    /// The flange in the arm's base with which the carried body is at a pose in the world.
    pub(super) fn flange_for(&self, body: &Isometry3<f64>) -> Isometry3<f64> {
        self.base_from_world * body * self.flange_from_body.inverse()
    }

    /// Joints near to others that bring the flange as near to a pose in the arm's base as they can.
    pub(super) fn nearest(&self, from: &Joints, flange: &Isometry3<f64>) -> Nearest {
        self.model.nearest(&self.limits, from, flange)
    }

    pub(super) fn joint_names(&self) -> &[String] {
        self.model.joint_names()
    }

    /// Goes on to where the body is at a time [s]; `next` is where it is `step` seconds later.
    pub(super) fn follow(
        &self,
        command: &mut CarrierCommand,
        [now, next]: [&Isometry3<f64>; 2],
        (time, step): (f64, f64),
    ) {
        let target = self.base_from_world * now;
        let from = command.q.unwrap_or(*self.model.ready());
        let Some(q) = self.model.reach(&from, &self.flange_from_body, &target, None) else {
            let [x, y, z] = target.translation.vector.into();
            let at = format!("({x:.3}, {y:.3}, {z:.3}) m");
            command.fault.get_or_insert_with(|| format!("it does not reach {at} at {time:.2} s"));
            return;
        };
        let shift = (next.translation.vector - now.translation.vector) / step;
        let turn = (next.rotation * now.rotation.inverse()).scaled_axis() / step;
        let twist = Vector6::from_iterator(shift.iter().chain(turn.iter()).copied());
        let dq = self.model.joints_for(&q, target.translation.vector.into(), &twist);
        for (i, limits) in self.limits.joints[..self.model.dof()].iter().enumerate() {
            let name = &self.model.joint_names()[i];
            let (at, speed, [slowest, fastest]) = (q[i], dq[i], limits.speed_bounds(q[i]));
            if !(limits.q_min..=limits.q_max).contains(&at) {
                let (low, high) = (limits.q_min, limits.q_max);
                let what = || format!("{name} is at {at:.3} rad at {time:.2} s, beyond {low:.3} to {high:.3}");
                command.fault.get_or_insert_with(what);
            } else if !(slowest..=fastest).contains(&speed) {
                let what = || {
                    format!(
                        "{name} turns at {speed:.2} rad/s at {time:.2} s, beyond {slowest:.2} to {fastest:.2} there"
                    )
                };
                command.fault.get_or_insert_with(what);
            }
        }
        (command.q, command.dq) = (Some(q), dq);
    }

    /// As a robot reports itself; its stamps do not count. `None` before it has reached anything.
    pub(super) fn state(&self, command: &CarrierCommand, world: &World) -> Option<ArmState> {
        let (q_d, dq_d) = (command.q?, command.dq);
        let reading = command.reading.or_else(|| world.arm(self.body));
        let JointState { q, dq } = reading.unwrap_or(JointState { q: q_d, dq: dq_d });
        Some(ArmState {
            dof: self.model.dof() as u32,
            mode: ArmMode::Move,
            q,
            dq,
            q_d,
            dq_d,
            O_T_EE: self.model.O_T_EE(&q),
            success_rate: 1.0,
            ..ArmState::default()
        })
    }
}
