//! The 1377 bytes that leave the robot each millisecond, filled from what it knows. Units and frames are the protocol's:
//! SI, base frame where a name begins with O, matrices column-major, single precision.
//!
//! What this robot does not have: motor-side encoders (`theta` is `q`), accelerometers (zeros).
#![allow(non_snake_case)] // the field's own symbols

use super::generator::Surroundings;
use super::generator::cartesian::CartesianTrace;
use super::kinematics::elbow;
use super::observer::Touched;
use super::settings::{Settings, matrix};
use super::wire::{ControllerMode, MotionGeneratorMode, RobotMode, WireState};
use crate::arm::ReflexErrors;
use crate::safety::Trace;
use nalgebra::Vector6;
use shared_mem::cell::GRAVITY;
use shared_mem::msg::arm::ArmState;
use twin::arm::{JointState, Joints, MassProperties};
use zerocopy::little_endian::F32;

/// Which modes a state shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Modes {
    pub(super) robot: RobotMode,
    pub(super) generator: MotionGeneratorMode,
    pub(super) controller: ControllerMode,
}

/// All that a state tells.
pub(super) struct Facts<'a> {
    pub(super) id: u64,
    pub(super) modes: Modes,
    pub(super) around: Surroundings<'a>,
    pub(super) settings: &'a Settings,
    pub(super) measured: &'a ArmState,
    /// Torques a period ago [N m].
    pub(super) tau_J_before: &'a Joints,
    /// How the joints are to move.
    pub(super) desired: &'a Trace,
    /// How the end effector was commanded to, where it was.
    pub(super) commanded: Option<&'a CartesianTrace>,
    /// Estimated torque from outside [N m].
    pub(super) tau_ext: &'a Joints,
    /// Estimated wrench at the stiffness frame, in base axes, then in its own.
    pub(super) wrench: &'a [Vector6<f64>; 2],
    pub(super) touched: &'a Touched,
    pub(super) errors: ReflexErrors,
    pub(super) reflex_reason: ReflexErrors,
    pub(super) success_rate: f64,
}

/// Fills all of `wire`.
pub(super) fn fill(wire: &mut WireState, facts: &Facts) {
    *wire = WireState::default();
    wire.message_id = facts.id.into();
    wire.motion_generator_mode = facts.modes.generator.to_u8();
    wire.controller_mode = facts.modes.controller.to_u8();
    wire.robot_mode = facts.modes.robot.to_u8();
    wire.errors = flags(facts.errors);
    wire.reflex_reason = flags(facts.reflex_reason);
    wire.control_command_success_rate = F32::new(facts.success_rate as f32);
    fill_joints(wire, facts);
    fill_end_effector(wire, facts);
    fill_bodies(wire, facts.settings);
    fill_touch(wire, facts);
}

fn fill_joints(wire: &mut WireState, facts: &Facts) {
    let (measured, desired) = (facts.measured, facts.desired);
    wire.q = floats(&measured.q);
    wire.dq = floats(&measured.dq);
    (wire.theta, wire.dtheta) = (wire.q, wire.dq);
    wire.q_d = floats(&desired.q);
    wire.dq_d = floats(&desired.v);
    wire.ddq_d = floats(&desired.a);
    wire.tau_J = floats(&measured.tau_J);
    wire.tau_J_d = floats(&measured.tau_J_d);
    let rate: Joints = std::array::from_fn(|i| (measured.tau_J[i] - facts.tau_J_before[i]) / 1e-3);
    wire.dtau_J = floats(&rate);
    wire.tau_ext_hat_filtered = floats(facts.tau_ext);
    wire.elbow = elbow(&measured.q).map(|x| F32::new(x as f32));
    wire.elbow_d = elbow(&desired.q).map(|x| F32::new(x as f32));
    wire.elbow_c = wire.elbow_d;
    wire.delbow_c[0] = F32::new(desired.v[2] as f32);
    wire.ddelbow_c[0] = F32::new(desired.a[2] as f32);
}

fn fill_end_effector(wire: &mut WireState, facts: &Facts) {
    let Facts { around: Surroundings { ee, .. }, settings, measured, desired, .. } = facts;
    wire.O_T_EE = floats(&matrix(&ee.pose(&measured.q)));
    wire.F_T_EE = floats(&matrix(&settings.F_T_EE()));
    wire.EE_T_K = floats(&matrix(&settings.EE_T_K));
    wire.F_T_NE = floats(&matrix(&settings.F_T_NE));
    wire.NE_T_EE = floats(&matrix(&settings.NE_T_EE));
    match facts.commanded {
        Some(commanded) => {
            wire.O_T_EE_d = floats(&matrix(&commanded.pose));
            wire.O_dP_EE_d = six(&commanded.twist);
            wire.O_ddP_EE_c = six(&commanded.acceleration);
            wire.O_dP_EE_c = wire.O_dP_EE_d;
        }
        // A client that begins a Cartesian motion begins at `O_T_EE_c`, so it is reported even where nothing is commanded.
        None => {
            wire.O_T_EE_d = floats(&matrix(&ee.pose(&desired.q)));
            wire.O_dP_EE_d = six(&ee.twist(&JointState { q: desired.q, dq: desired.v }));
        }
    }
    wire.O_T_EE_c = wire.O_T_EE_d;
    wire.O_ddP_O = floats(&[0.0, 0.0, -GRAVITY]);
}

fn fill_bodies(wire: &mut WireState, settings: &Settings) {
    let inertia = |body: &MassProperties| -> [F32; 9] { floats(body.inertia.as_slice()) };
    wire.m_ee = F32::new(settings.end_effector.mass as f32);
    wire.F_x_Cee = floats(settings.end_effector.centre.as_slice());
    wire.I_ee = inertia(&settings.end_effector);
    wire.m_load = F32::new(settings.load.mass as f32);
    wire.F_x_Cload = floats(settings.load.centre.as_slice());
    wire.I_load = inertia(&settings.load);
}

fn fill_touch(wire: &mut WireState, facts: &Facts) {
    let ones = |flag: bool| F32::new(f32::from(u8::from(flag)));
    let touched = facts.touched;
    wire.joint_contact = touched.joint_contact.map(ones);
    wire.cartesian_contact = touched.cartesian_contact.map(ones);
    wire.joint_collision = touched.joint_collision.map(ones);
    wire.cartesian_collision = touched.cartesian_collision.map(ones);
    let [in_base, in_frame] = facts.wrench;
    wire.O_F_ext_hat_K = six(in_base);
    wire.K_F_ext_hat_K = six(in_frame);
}

/// The first `N` of `values`, rounded.
fn floats<const N: usize>(values: &[f64]) -> [F32; N] {
    std::array::from_fn(|i| F32::new(values.get(i).map_or(0.0, |x| *x as f32)))
}

fn six(values: &Vector6<f64>) -> [F32; 6] {
    floats(values.as_slice())
}

fn flags(errors: ReflexErrors) -> [u8; 41] {
    std::array::from_fn(|i| u8::from(errors.bits() >> i & 1 == 1))
}
