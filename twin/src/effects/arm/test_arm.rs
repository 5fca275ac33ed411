//! A single joint to try effects on: about the vertical, so that gravity does not act.

use super::ArmEffects;
use crate::arm::{ArmModel, JointState, Joints, MAX_JOINTS, MassProperties};
use crate::effects::Effects;
use shared_mem::cell::{Cell, Controller, Robot};
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use std::path::Path;

/// Rotor inertia of the joint [kg m²].
pub(super) const ROTOR: f64 = 0.03;

/// The effects of `[[effect]]` blocks, for one joint.
pub(super) fn effects(blocks: &str) -> ArmEffects {
    let theta: Theta = shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml");
    Effects::from_theta(&theta.effects, 1).expect("known effects").arm
}

/// The joint with a body of `inertia` [kg m²] behind its gear.
pub(super) fn joint(inertia: f64) -> ArmModel {
    let cell = Cell {
        robot: Some(Robot { joints: vec!["joint".into()], ..Robot::default() }),
        controller: Some(Controller { rotor_inertia: vec![ROTOR], ..Controller::default() }),
        ..Cell::default()
    };
    let mut arm = ArmModel::from_cell(&cell).expect("one joint");
    arm.add_at_flange(&MassProperties::new(0.0, [0.0; 3], [inertia, inertia, inertia, 0.0, 0.0, 0.0]));
    arm
}

/// One number in a joint array.
pub(super) fn first(value: f64) -> Joints {
    let mut out = [0.0; MAX_JOINTS];
    out[0] = value;
    out
}

/// States of the joint at every tick under a torque that holds for each tick, the start first.
pub(super) fn run(
    arm: &ArmModel,
    effects: &ArmEffects,
    start: JointState,
    ticks: usize,
    torque: impl Fn(usize, &JointState) -> f64,
) -> Vec<JointState> {
    let (mut state, mut memory) = effects.start(arm, &start, &start.q, &[0.0; MAX_JOINTS]);
    let mut states = vec![state];
    for tick in 0..ticks {
        let tau = effects.motor_torque(&mut memory, &first(torque(tick, &state)), &[0.0; MAX_JOINTS]);
        effects.advance(&mut memory, arm, &mut state, (&tau, &[0.0; MAX_JOINTS]), TICK);
        states.push(state);
    }
    states
}

/// The joint at 0, turning at `dq` [rad/s].
pub(super) fn turning(dq: f64) -> JointState {
    JointState { q: [0.0; MAX_JOINTS], dq: first(dq) }
}
