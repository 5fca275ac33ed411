//! What is said about the camera's mount.

use super::fit::{Fit, Open, TURNED};
use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use shared_mem::hand_eye::{HandEye, Mount, MountedPose};

#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// What goes into the file.
    #[serde(flatten)]
    pub hand_eye: HandEye,
    /// What became of each picture.
    pub views: Vec<ViewAnswer>,
    /// Pictures that do not show the board.
    pub without_board: Vec<String>,
    /// Directions of the mount that the pictures leave open.
    pub not_identifiable: Vec<NotIdentifiable>,
    /// What to know about it.
    pub warnings: Vec<String>,
    /// How long it took [s].
    pub seconds: f64,
}

/// What became of a picture.
#[derive(Debug, Clone, Serialize)]
pub struct ViewAnswer {
    pub name: String,
    /// Whether it took part.
    pub used: bool,
    pub corners: usize,
    /// Root mean square of the corners with the arm's pose as it was said [pixel]; absent where the picture fixes no board.
    pub reprojection_px: Option<f64>,
    /// The same with mount and board of the other pictures [pixel].
    pub held_out_px: Option<f64>,
    /// The arm's pose against what mount and board say [m].
    pub off_m: Option<f64>,
    /// The same of its rotation [rad].
    pub off_rad: Option<f64>,
}

/// A direction that the pictures leave open.
#[derive(Debug, Clone, Serialize)]
pub struct NotIdentifiable {
    /// What it is: a shift or a turn, and along what.
    pub parameter: String,
    /// Half the 90 % interval of the shift along it [m].
    pub half_width_m: f64,
    /// And of the turn [rad].
    pub half_width_rad: f64,
    /// Why, and what to do.
    pub why: String,
}

/// A direction with one decimal, its largest part positive.
fn axis(of: &Vector3<f64>) -> String {
    let of = of.normalize();
    let sign = of[of.iamax()].signum();
    let [x, y, z] = [0, 1, 2].map(|k| sign * of[k] + 0.0);
    format!("({x:.1}, {y:.1}, {z:.1})")
}

/// What is open, in words.
pub fn not_identifiable(open: &Open, fit: &Fit) -> NotIdentifiable {
    let part = |from: usize| Vector3::new(open.direction[from], open.direction[from + 1], open.direction[from + 2]);
    let (turn, shift) = (part(0), part(3));
    let frame = if fit.chain.mount == Mount::EyeInHand { "the end effector" } else { "the base" };
    let parameter = if shift.norm() >= turn.norm() {
        format!("shift along {} of {frame}", axis(&shift))
    } else {
        format!("turn about {} of {frame}", axis(&turn))
    };
    let [most, second, _] = fit.spread.map(f64::to_degrees);
    let used = fit.views.iter().filter(|view| view.used).count();
    let why = if fit.spread[0] < TURNED {
        format!(
            "the end effector turns by {most:.1} degrees only between the pictures; turn it by 20 and more about two axes"
        )
    } else if fit.spread[1] < TURNED {
        format!(
            "the end effector turns about one axis only between the pictures ({most:.0} degrees, {second:.1} about any other); turn it by 20 and more about a second one"
        )
    } else {
        format!(
            "{used} pictures, and the arm's poses are off by {:.1} mm and {:.2} degrees; take more pictures from more sides, at rest",
            fit.arm.position * 1e3,
            fit.arm.rotation.to_degrees()
        )
    };
    NotIdentifiable { parameter, half_width_m: open.half_width[1], half_width_rad: open.half_width[0], why }
}

/// The mount with its intervals.
pub fn mounted(fit: &Fit) -> MountedPose {
    let pose: &Isometry3<f64> = &fit.chain.camera;
    let of = |k: usize| {
        [pose.translation.vector[k] - fit.half_width[3 + k], pose.translation.vector[k] + fit.half_width[3 + k]]
    };
    MountedPose {
        position_ci90: Some([of(0), of(1), of(2)]),
        rotation_ci90: Some([0, 1, 2].map(|k| [-fit.half_width[k], fit.half_width[k]])),
        covariance: Some(std::array::from_fn(|i| std::array::from_fn(|j| fit.covariance[(i, j)]))),
        ..MountedPose::new(pose)
    }
}

impl Answer {
    /// The answer for people.
    pub fn in_words(&self) -> String {
        let (name, pose) = match &self.hand_eye {
            HandEye { EE_T_camera: Some(pose), .. } => ("camera in the end effector's frame (EE_T_camera)", pose),
            HandEye { O_T_camera: Some(pose), .. } => ("camera in the base frame (O_T_camera)", pose),
            _ => return String::new(),
        };
        let ([x, y, z], [qw, qx, qy, qz]) = (pose.position, pose.orientation);
        let mut lines =
            vec![format!("{name}: {x:.4}, {y:.4}, {z:.4} m; {qw:.5}, {qx:.5}, {qy:.5}, {qz:.5} (w, x, y, z)")];
        if let (Some(position), Some(rotation)) = (pose.position_ci90, pose.rotation_ci90) {
            let [a, b, c] = position.map(|[lo, hi]| 0.5 * (hi - lo) * 1e3);
            let [d, e, f] = rotation.map(|[_, hi]| hi.to_degrees());
            lines.push(format!("90 % within {a:.2}, {b:.2}, {c:.2} mm and {d:.3}, {e:.3}, {f:.3} degrees"));
        }
        if let Some(left) = &self.hand_eye.residual {
            lines.push(format!(
                "{} pictures: reprojection {:.2} pixels, held out {:.2}, corners themselves {:.2}; the arm's poses are off by {:.2} mm and {:.3} degrees along each axis",
                left.pictures,
                left.reprojection_px,
                left.held_out_px,
                left.corner_sigma_px,
                left.arm_position_sigma * 1e3,
                left.arm_rotation_sigma.to_degrees()
            ));
        }
        for view in self.views.iter().filter(|view| !view.used) {
            let off = view.off_m.zip(view.off_rad).map_or_else(
                || "too few corners".to_owned(),
                |(m, rad)| format!("off by {:.1} mm and {:.2} degrees", m * 1e3, rad.to_degrees()),
            );
            lines.push(format!("left out: {} ({off})", view.name));
        }
        let open = self.not_identifiable.iter();
        lines.extend(open.map(|open| format!("not identifiable: {}: {}", open.parameter, open.why)));
        lines.extend(self.warnings.iter().map(|warning| format!("note: {warning}")));
        lines.join("\n")
    }
}
