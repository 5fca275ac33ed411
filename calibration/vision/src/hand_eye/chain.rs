//! From the camera to the board over the arm: `camera_from_board = X⁻¹ M B`, with the camera's mount `X`, the board's place `B`
//! and, of every picture, what the arm says, `M`. A camera that the arm holds: `X` in the end effector, `B` in the base,
//! `M = O_T_EE⁻¹`. A camera that stands and a board that the arm holds: `X` in the base, `B` in the end effector, `M = O_T_EE`.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Translation3, Vector3, Vector6};
use shared_mem::hand_eye::Mount;
use twin::pose_fit::moved;

/// Mount and board: six numbers each, turn [rad] before shift [m].
pub type Twelve = SMatrix<f64, 12, 1>;
/// How the six numbers of an arm's error go with the twelve.
pub type Slopes = SMatrix<f64, 6, 12>;

/// What all pictures share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chain {
    /// Who holds the camera.
    pub mount: Mount,
    /// The camera's mount: end effector or base from camera.
    pub camera: Isometry3<f64>,
    /// The board's place: base or end effector from board.
    pub board: Isometry3<f64>,
}

/// What the arm says of a picture: `M`.
pub fn link(mount: Mount, base_from_end_effector: &Isometry3<f64>) -> Isometry3<f64> {
    match mount {
        Mount::EyeInHand => base_from_end_effector.inverse(),
        Mount::FixedCamera => *base_from_end_effector,
    }
}

/// A move by six numbers about `pivot`, along axes that `turn` takes into the camera's: the same move as the camera sees it, its turn
/// about the camera's origin.
fn seen_by_camera(turn: &Matrix3<f64>, pivot: &Vector3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(turn);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&(pivot.cross_matrix() * turn));
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
    out
}

impl Chain {
    /// Where the end effector is, in the frame that the camera is mounted in: an error of the arm turns it about there.
    fn pivot(&self, link: &Isometry3<f64>) -> Vector3<f64> {
        match self.mount {
            Mount::EyeInHand => Vector3::zeros(),
            Mount::FixedCamera => link.translation.vector,
        }
    }

    /// The board in the camera's frame if the arm's pose is as it says.
    pub fn camera_from_board(&self, link: &Isometry3<f64>) -> Isometry3<f64> {
        self.camera.inverse() * link * self.board
    }

    /// The same if the end effector is off by `error`: turned [rad] about its origin, then shifted [m].
    pub fn camera_from_board_with(&self, link: &Isometry3<f64>, error: &Vector6<f64>) -> Isometry3<f64> {
        self.camera.inverse() * moved(&(link * self.board), &self.pivot(link).into(), error)
    }

    /// The arm's error that explains a board's pose whole.
    pub fn error_of(&self, link: &Isometry3<f64>, camera_from_board: &Isometry3<f64>) -> Vector6<f64> {
        let pivot = Translation3::from(self.pivot(link));
        let moved = self.camera * camera_from_board * self.board.inverse() * link.inverse();
        let moved = pivot.inverse() * moved * pivot;
        let turn = moved.rotation.scaled_axis();
        let shift = moved.translation.vector;
        Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
    }

    /// How the board moves in the camera's frame with an error of the arm.
    pub fn error_slopes(&self, link: &Isometry3<f64>) -> Matrix6<f64> {
        let camera_from_mount = self.camera.inverse();
        let pivot = camera_from_mount * nalgebra::Point3::from(self.pivot(link));
        seen_by_camera(camera_from_mount.rotation.to_rotation_matrix().matrix(), &pivot.coords)
    }

    /// How it moves with the twelve numbers: the mount's turn about the camera's origin and its shift, along the axes of the frame it
    /// is mounted in; the board's turn about its origin and its shift, along the axes of the frame it lies in.
    pub fn slopes(&self, link: &Isometry3<f64>) -> Slopes {
        let camera_from_mount = self.camera.inverse();
        let turn = camera_from_mount.rotation.to_rotation_matrix();
        let to_board = (camera_from_mount * link).rotation.to_rotation_matrix();
        let board = self.camera_from_board(link).translation.vector;
        let mut out = Slopes::zeros();
        out.fixed_view_mut::<6, 6>(0, 0).copy_from(&-seen_by_camera(turn.matrix(), &Vector3::zeros()));
        out.fixed_view_mut::<6, 6>(0, 6).copy_from(&seen_by_camera(to_board.matrix(), &board));
        out
    }

    /// After a step of the twelve numbers.
    pub fn stepped(&self, by: &Twelve) -> Self {
        let about_itself = |pose: &Isometry3<f64>, by| moved(pose, &pose.translation.vector.into(), &by);
        Self {
            mount: self.mount,
            camera: about_itself(&self.camera, by.fixed_rows::<6>(0).into_owned()),
            board: about_itself(&self.board, by.fixed_rows::<6>(6).into_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(shift: [f64; 3], turn: [f64; 3]) -> Isometry3<f64> {
        Isometry3::new(shift.into(), turn.into())
    }

    /// A small move between two poses, as the camera sees it.
    fn between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
        let moved = to * from.inverse();
        let (turn, shift) = (moved.rotation.scaled_axis(), moved.translation.vector);
        Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
    }

    #[test]
    fn slopes_are_those_of_finite_differences() {
        for mount in [Mount::EyeInHand, Mount::FixedCamera] {
            let camera = pose([0.05, -0.02, 0.04], [0.1, -0.2, 1.5]);
            let chain = Chain { mount, camera, board: pose([0.4, 0.1, 0.2], [2.0, 0.3, 0.1]) };
            let link = link(mount, &pose([0.5, 0.2, 0.4], [3.0, 0.2, -0.3]));
            let (here, size) = (chain.camera_from_board(&link), 1e-6);
            for k in 0..12 {
                let mut step = Twelve::zeros();
                step[k] = size;
                let found = between(&here, &chain.stepped(&step).camera_from_board(&link)) / size;
                assert!((found - chain.slopes(&link).column(k)).amax() < 1e-5, "{mount:?} {k}");
            }
            for k in 0..6 {
                let mut error = Vector6::zeros();
                error[k] = size;
                let there = chain.camera_from_board_with(&link, &error);
                let found = between(&here, &there) / size;
                assert!((found - chain.error_slopes(&link).column(k)).amax() < 1e-5, "{mount:?} {k}");
                assert!((chain.error_of(&link, &there) - error).amax() < 1e-12);
            }
        }
    }
}
