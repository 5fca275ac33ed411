//! Where a frame on the flange is and how the joints move it. Base frame, SI.

use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, UnitQuaternion, Vector6};
use twin::arm::{ArmModel, JointState, Joints};

/// Columns of a Jacobian, one a joint: linear velocity, then angular, at unit joint velocity.
pub(super) type Jacobian = SMatrix<f64, 6, 7>;

/// A frame that is fixed to the flange of an arm.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) model: &'a ArmModel,
    /// From the flange to the frame.
    pub(super) on_flange: Isometry3<f64>,
}

impl Frame<'_> {
    /// The frame in the base frame, for an arm at `q`.
    pub(super) fn pose(&self, q: &Joints) -> Isometry3<f64> {
        self.model.flange(q).isometry() * self.on_flange
    }

    /// Jacobian of the frame's origin, for an arm at `q`.
    pub(super) fn jacobian(&self, q: &Joints) -> Jacobian {
        let columns = self.model.jacobian(q, self.pose(q).translation.vector.into());
        Jacobian::from_fn(|row, column| columns[column][row])
    }

    /// Joint positions near `from` with the frame at `target` and, where given, the elbow's joint at `elbow` [rad]; `None` where
    /// there are none.
    pub(super) fn reach(&self, from: &Joints, target: &Isometry3<f64>, elbow: Option<f64>) -> Option<Joints> {
        self.model.reach(from, &self.on_flange, target, elbow.map(|position| (ELBOW, position)))
    }

    /// Velocity of the frame's origin [m/s], then angular velocity [rad/s].
    pub(super) fn twist(&self, state: &JointState) -> Vector6<f64> {
        self.jacobian(&state.q) * seven(&state.dq)
    }
}

/// The joints that count, as a vector.
pub(super) fn seven(joints: &Joints) -> SVector<f64, 7> {
    SVector::from_column_slice(&joints[..7])
}

/// A wrench or twist in other axes.
pub(super) fn turned(rotation: &UnitQuaternion<f64>, pair: &Vector6<f64>) -> Vector6<f64> {
    let (linear, angular) = (rotation * pair.fixed_rows::<3>(0), rotation * pair.fixed_rows::<3>(3));
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Least stretch of a Jacobian [m, 1]: how near the arm is to a pose in which it cannot move in some direction.
pub(super) fn least_stretch(jacobian: &Jacobian) -> f64 {
    let square: Matrix6<f64> = jacobian * jacobian.transpose();
    square.symmetric_eigenvalues().min().max(0.0).sqrt()
}

/// Elbow of an arm at `q`: position of joint 3 [rad], and on which side the elbow is.
pub(super) fn elbow(q: &Joints) -> [f64; 2] {
    /// Position of joint 4 at which forearm and upper arm are in line [rad]: atan2 of the elbow's offsets, twice.
    const FLIP: f64 = -0.467_002_423_653_011;
    [
        q[ELBOW],
        if q[3] > FLIP {
            1.0
        } else if q[3] < FLIP {
            -1.0
        } else {
            0.0
        },
    ]
}

/// The elbow's joint, counted from 0.
pub(super) const ELBOW: usize = 2;
