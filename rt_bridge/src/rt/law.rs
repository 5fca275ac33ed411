//! The joint-impedance law as the bridge runs it: `tau_J_d = k (q_d - q) + d (dq_d - dq) + coriolis(q, dq)`. The arm adds
//! gravity itself, real and simulated alike. Gains are those of cell.toml; the model is the nominal one.
#![allow(non_snake_case)] // tau_J_d is the field's own symbol

use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{ArmModel, ControlLaw, JointState, Trailing};

/// Gains and the model behind the Coriolis term.
#[derive(Debug, Clone)]
pub struct TorquePd {
    stiffness: Joints,
    damping: Joints,
    arm: ArmModel,
}

impl TorquePd {
    /// The gains of `law` on `arm`.
    pub fn new(law: &ControlLaw, arm: ArmModel) -> Self {
        Self { stiffness: law.stiffness, damping: law.damping, arm }
    }

    /// How the arm comes after its commands under this law.
    pub fn trailing(&self) -> Option<Trailing> {
        Trailing::impedance(&self.arm, &self.stiffness, &self.damping)
    }

    /// The torque that answers a state, without gravity [N m].
    pub fn torque(&self, state: &JointState, point: &SetPoint) -> Joints {
        let coriolis = self.arm.coriolis(state);
        let mut tau_J_d = [0.0; MAX_JOINTS];
        for (i, tau) in tau_J_d.iter_mut().enumerate().take(self.arm.dof()) {
            *tau = self.stiffness[i] * (point.q_d[i] - state.q[i])
                + self.damping[i] * (point.dq_d[i] - state.dq[i])
                + coriolis[i];
        }
        tau_J_d
    }
}
