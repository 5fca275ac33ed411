//! Where the flange and the tip are, and how the joints move a point of the last link.
#![allow(non_snake_case)] // O_T_EE is the Franka Control Interface's own symbol

use super::kernel::{Chain, Frame, first, with_dof};
use super::spatial::{Spatial, add, cross};
use super::{ArmModel, Joints, MAX_JOINTS};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use shared_mem::frames::{Base, Flange, Pose, Tip};

/// Columns of a Jacobian, one a joint: linear velocity x, y, z [m/s], then angular velocity [rad/s], at unit joint
/// velocity, in the base frame. Columns from `dof` on are 0.
pub type Jacobian = [[f64; 6]; MAX_JOINTS];

impl ArmModel {
    /// The flange in the base frame.
    pub fn flange(&self, q: &Joints) -> Pose<Base, Flange> {
        Pose::from_isometry(isometry(&self.last_frame(q)) * self.flange)
    }

    /// The end of the tool, axes parallel to the flange's; the flange itself without a tool.
    pub fn tip(&self, q: &Joints) -> Pose<Base, Tip> {
        Pose::from_isometry(self.flange(q).isometry() * Translation3::new(0.0, 0.0, self.tool_length))
    }

    /// The flange in the base frame as the robot reports it: homogeneous 4x4, column-major [m].
    pub fn O_T_EE(&self, q: &Joints) -> [f64; 16] {
        let matrix = self.flange(q).isometry().to_homogeneous();
        let mut out = [0.0; 16];
        out.copy_from_slice(matrix.as_slice());
        out
    }

    /// Jacobian of the point of the last link that lies at `point` in the base frame [m].
    ///
    /// ```
    /// use twin::arm::ArmModel;
    ///
    /// let arm = ArmModel::fr3();
    /// let (q, mut moved) = (*arm.ready(), *arm.ready());
    /// moved[1] += 1e-6; // rad
    /// let point = arm.flange(&q).position();
    /// let columns = arm.jacobian(&q, point);
    /// let z = arm.flange(&moved).position()[2] - point[2];
    /// assert!((z / 1e-6 - columns[1][2]).abs() < 1e-5); // m/rad
    /// ```
    pub fn jacobian(&self, q: &Joints, point: [f64; 3]) -> Jacobian {
        let mut out = [[0.0; 6]; MAX_JOINTS];
        for (column, axis) in out.iter_mut().zip(self.axes(q)).take(self.dof) {
            let linear = add(axis.linear, cross(axis.angular, point));
            *column = [linear[0], linear[1], linear[2], axis.angular[0], axis.angular[1], axis.angular[2]];
        }
        out
    }

    /// Origin of every joint's frame in the base frame [m]: on the joint's axis, where the next link begins.
    pub fn joint_origins(&self, q: &Joints) -> [[f64; 3]; MAX_JOINTS] {
        with_dof!(self, N => {
            let mut out = [[0.0; 3]; MAX_JOINTS];
            for (o, frame) in out.iter_mut().zip(&Chain::<N>::at(first(&self.links), first(q)).frames) {
                *o = frame.origin;
            }
            out
        })
    }

    /// Frame of every link behind a joint, in the base frame: z along the joint's axis. Identity from `dof` on.
    pub fn link_frames(&self, q: &Joints) -> [Isometry3<f64>; MAX_JOINTS] {
        with_dof!(self, N => {
            let mut out = [Isometry3::identity(); MAX_JOINTS];
            for (o, frame) in out.iter_mut().zip(&Chain::<N>::at(first(&self.links), first(q)).frames) {
                *o = isometry(frame);
            }
            out
        })
    }

    fn last_frame(&self, q: &Joints) -> Frame {
        with_dof!(self, N => Chain::<N>::at(first(&self.links), first(q)).frames[N - 1])
    }

    pub(super) fn axes(&self, q: &Joints) -> [Spatial; MAX_JOINTS] {
        with_dof!(self, N => {
            let mut out = [Spatial::default(); MAX_JOINTS];
            out[..N].copy_from_slice(&Chain::<N>::at(first(&self.links), first(q)).axes);
            out
        })
    }
}

pub(super) fn isometry(frame: &Frame) -> Isometry3<f64> {
    let [x, y, z] = &frame.rotation;
    let matrix = Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Isometry3::from_parts(Translation3::from(Vector3::from(frame.origin)), rotation)
}
