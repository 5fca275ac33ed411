//! From command to torque: the joint controllers that cell.toml names. Evaluated once per millisecond and held in
//! between, by the bridge on the real or simulated arm and by every rollout.

mod inverse_dynamics;

use super::gains;
use super::{ArmModel, JointState, Joints, MAX_JOINTS};
use shared_mem::cell::{Controller, ControllerKind, Range};
use shared_mem::msg::joints_from;
use shared_mem::theta::ArmTheta;

/// Pole of the law that keeps joints on a motion [1/s].
const POLE: f64 = 300.0;

/// A joint controller with its gains.
///
/// ```
/// use shared_mem::cell::Cell;
/// use std::path::Path;
/// use twin::arm::{ArmModel, ControlLaw, JointState, MAX_JOINTS};
///
/// let text = r#"
/// [robot]
/// model = "fr3"
/// [controller]
/// kind = "joint_impedance"
/// stiffness = [600, 600, 600, 600, 250, 150, 50] # N m/rad
/// damping = [50, 50, 50, 50, 30, 25, 15]         # N m s/rad
/// "#;
/// let cell = Cell::parse(text, Path::new("cell.toml"))?;
/// let arm = ArmModel::from_cell(&cell)?;
/// let law = ControlLaw::new(cell.controller.as_ref(), None, &arm)?;
///
/// // Asked to be 0.01 rad further, joint 1 gets 600 * 0.01 N m besides what holds its weight.
/// let state = JointState::at_rest(*arm.ready());
/// let mut q_d = state.q;
/// q_d[0] += 0.01;
/// let tau = law.torque(&arm, &state, &q_d, &[0.0; MAX_JOINTS]);
/// assert!((tau[0] - arm.gravity(&state.q)[0] - 6.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlLaw {
    pub kind: ControllerKind,
    /// Stiffness k [N m/rad].
    pub stiffness: Joints,
    /// Damping d [N m s/rad].
    pub damping: Joints,
    /// Largest torque, gravity included [N m]; infinite where not known.
    pub torque_limit: Joints,
}

/// The gains do not fit the arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GainError {
    /// Nothing is known about the controller.
    #[error("cell.toml has no [controller] block; add one with `kind` and `stiffness`, `damping` or their ranges")]
    NoController,
    /// A gain is given neither by value nor by range.
    #[error(
        "cell.toml gives no `controller.{0}`; add it, or `{0}_range = [low, high]`, or pass --parameters theta.toml"
    )]
    Unknown(&'static str),
    /// No controller has such a gain.
    #[error("{key} cannot hold {value}; give 0 or a positive number for each joint")]
    Value { key: &'static str, value: f64 },
    /// A vector does not fit the arm.
    #[error("{key} holds {given} numbers; this arm has {dof} joints: give one for each")]
    Length {
        key: &'static str,
        given: usize,
        /// Joints of the arm.
        dof: usize,
    },
}

impl ControlLaw {
    /// The controller of a cell.toml, with identified gains where there are some.
    ///
    /// A stiffness known only by its range is taken at the range's geometric middle; a damping, at critical damping of
    /// the arm's own inertia in its ready pose, kept inside its range.
    ///
    /// # Errors
    /// [`GainError`] naming the key and the remedy.
    pub fn new(
        controller: Option<&Controller>,
        identified: Option<&ArmTheta>,
        arm: &ArmModel,
    ) -> Result<Self, GainError> {
        let controller = controller.ok_or(GainError::NoController)?;
        if controller.kind == ControllerKind::Tracking {
            return Ok(Self::tracking());
        }
        let (stiffness, damping) = match identified {
            Some(theta) => (
                exactly("arm.stiffness of theta.toml", &theta.stiffness, arm.dof())?,
                exactly("arm.damping of theta.toml", &theta.damping, arm.dof())?,
            ),
            None => nominal(controller, arm)?,
        };
        Ok(Self { kind: controller.kind, stiffness, damping, torque_limit: *arm.torque_limit() })
    }

    /// The law that keeps the joints on the desired motion: a double pole, as fast as steps of a millisecond bear. What it
    /// lags behind an acceleration at 3 Hz is half a percent of it.
    fn tracking() -> Self {
        Self {
            kind: ControllerKind::Tracking,
            stiffness: [POLE * POLE; MAX_JOINTS],
            damping: [2.0 * POLE; MAX_JOINTS],
            torque_limit: [f64::INFINITY; MAX_JOINTS],
        }
    }

    /// Torque for a state and the command in force, gravity included [N m], kept within the torque limit.
    ///
    /// `nominal` is the model inside the controller: what it compensates for, which may differ from the arm.
    #[inline]
    pub fn torque(&self, nominal: &ArmModel, state: &JointState, q_d: &Joints, dq_d: &Joints) -> Joints {
        self.torque_after(nominal, state, (q_d, dq_d), dq_d)
    }

    /// The same where the velocity that was desired a control period before is known, whose change a law may feed forward.
    #[inline]
    pub fn torque_after(
        &self,
        nominal: &ArmModel,
        state: &JointState,
        (q_d, dq_d): (&Joints, &Joints),
        dq_d_before: &Joints,
    ) -> Joints {
        let compensation = match self.kind {
            ControllerKind::JointImpedance
            | ControllerKind::CompensatedPd
            | ControllerKind::JointVelocity
            | ControllerKind::Unstated => nominal.bias(state),
            ControllerKind::JointPd => [0.0; MAX_JOINTS],
            ControllerKind::InverseDynamics => {
                let ddq_d = inverse_dynamics::acceleration(dq_d_before, dq_d);
                let (bias, fed) = (nominal.bias(state), inverse_dynamics::torque(nominal, state, &ddq_d));
                std::array::from_fn(|i| bias[i] + fed[i])
            }
            ControllerKind::Tracking => return self.tracking_torque(nominal, state, q_d, dq_d),
        };
        self.torque_with(state, q_d, dq_d, &compensation)
    }

    /// `M(q) (k (q_d - q) + d (dq_d - dq)) + coriolis(q, dq) + gravity(q)`, k in 1/s² and d in 1/s.
    fn tracking_torque(&self, nominal: &ArmModel, state: &JointState, q_d: &Joints, dq_d: &Joints) -> Joints {
        let (mass, bias) = (nominal.mass_matrix(&state.q), nominal.bias(state));
        let wanted: Joints = std::array::from_fn(|i| {
            self.stiffness[i] * (q_d[i] - state.q[i]) + self.damping[i] * (dq_d[i] - state.dq[i])
        });
        std::array::from_fn(|i| bias[i] + mass[i].iter().zip(&wanted).map(|(m, a)| m * a).sum::<f64>())
    }

    /// Whether a torque follows from the command and `gravity + coriolis` alone.
    pub(crate) fn needs_no_mass(&self) -> bool {
        !matches!(self.kind, ControllerKind::Tracking | ControllerKind::InverseDynamics)
    }

    /// Whether the damping is one that drives have.
    pub(crate) fn damps(&self) -> bool {
        self.kind != ControllerKind::Tracking
    }

    /// The same where the model's `gravity + coriolis` at this state is known already [N m].
    #[inline(always)]
    pub(super) fn torque_with(&self, state: &JointState, q_d: &Joints, dq_d: &Joints, bias: &Joints) -> Joints {
        // A PD law damps the joint's own velocity, and a servo compensates nothing besides.
        let (follow, compensate) = match self.kind {
            ControllerKind::JointImpedance
            | ControllerKind::JointVelocity
            | ControllerKind::InverseDynamics
            | ControllerKind::Unstated => (1.0, 1.0),
            ControllerKind::CompensatedPd => (0.0, 1.0),
            ControllerKind::JointPd => (0.0, 0.0),
            ControllerKind::Tracking => unreachable!("asked for by `needs_no_mass`"),
        };
        std::array::from_fn(|i| {
            let spring = self.stiffness[i] * (q_d[i] - state.q[i]);
            let damper = self.damping[i] * (follow * dq_d[i] - state.dq[i]);
            (spring + damper + compensate * bias[i]).clamp(-self.torque_limit[i], self.torque_limit[i])
        })
    }
}

fn exactly(key: &'static str, values: &[f64], dof: usize) -> Result<Joints, GainError> {
    if values.len() != dof {
        return Err(GainError::Length { key, given: values.len(), dof });
    }
    match values.iter().find(|gain| !(gain.is_finite() && **gain >= 0.0)) {
        Some(value) => Err(GainError::Value { key, value: *value }),
        None => Ok(joints_from(values)),
    }
}

fn nominal(controller: &Controller, arm: &ArmModel) -> Result<(Joints, Joints), GainError> {
    let mut stiffness = [0.0; MAX_JOINTS];
    if controller.stiffness.is_empty() {
        for (joint, stiffness) in stiffness[..arm.dof()].iter_mut().enumerate() {
            let range = gains::stiffness_range(controller, arm, joint).ok_or(GainError::Unknown("stiffness"))?;
            *stiffness = geometric_middle(range);
        }
    } else {
        stiffness = exactly("`controller.stiffness` in cell.toml", &controller.stiffness, arm.dof())?;
    }
    let mut damping = [0.0; MAX_JOINTS];
    if controller.damping.is_empty() {
        let mass = arm.mass_matrix(arm.ready());
        for i in 0..arm.dof() {
            let [lo, hi] = gains::damping_range(controller, arm, i).ok_or(GainError::Unknown("damping"))?;
            damping[i] = (2.0 * (stiffness[i] * mass[i][i]).sqrt()).clamp(lo, hi);
        }
    } else {
        damping = exactly("`controller.damping` in cell.toml", &controller.damping, arm.dof())?;
    }
    Ok((stiffness, damping))
}

/// The middle on a ratio scale; half the upper end where the range starts at 0.
fn geometric_middle([lo, hi]: Range) -> f64 {
    if lo > 0.0 { (lo * hi).sqrt() } else { 0.5 * hi }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pd_control_with_compensation_is_joint_impedance_that_knows_no_desired_velocity() {
        let arm = ArmModel::fr3();
        let state = JointState { q: *arm.ready(), dq: [0.3; MAX_JOINTS] };
        let (q_d, dq_d) = (arm.ready().map(|q| q + 0.01), [0.5; MAX_JOINTS]);
        let torque = |kind, dq_d: &Joints| {
            let (stiffness, damping) = ([100.0; MAX_JOINTS], [10.0; MAX_JOINTS]);
            let law = ControlLaw { kind, stiffness, damping, torque_limit: [f64::INFINITY; MAX_JOINTS] };
            law.torque(&arm, &state, &q_d, dq_d)
        };
        let still = torque(ControllerKind::JointImpedance, &[0.0; MAX_JOINTS]);
        assert_eq!(torque(ControllerKind::CompensatedPd, &dq_d), still);
        assert_ne!(torque(ControllerKind::JointImpedance, &dq_d), still);
        assert_ne!(torque(ControllerKind::JointPd, &dq_d), still, "a servo does not carry the arm's weight");
    }

    #[test]
    fn a_gain_that_no_controller_has_is_refused_in_one_line() {
        let arm = ArmModel::fr3();
        let gains = |first: f64| {
            let mut stiffness = vec![100.0; 7];
            stiffness[0] = first;
            let theta = ArmTheta { stiffness, damping: vec![10.0; 7] };
            ControlLaw::new(Some(&Controller::default()), Some(&theta), &arm)
        };
        assert!(gains(0.0).is_ok());
        for (first, expected) in [(-100.0, "-100"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
            let error = gains(first).expect_err(expected).to_string();
            assert!(error.contains(expected) && error.contains("give 0 or") && !error.contains('\n'), "{error}");
        }
    }
}
