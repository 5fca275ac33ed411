//! What the planner asks of the arm's body: how low it reaches and which torque a movement takes. Base frame, SI.
//!
//! Rests on the nominal model of cell.toml; called once for every set point of a plan.

use nalgebra::{Isometry3, Point3};
use shared_mem::cell::{Cell, Tool};
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{ArmBalls, ArmModel, JointState, ModelError};

/// Balls of a link are joined by balls no farther apart than their radius, or this where nobody knows how thick it is [m].
const MAX_BALL_SPACING: f64 = 0.01;
/// A ball that holds a depth camera with its mount: half the length of the longest, a D455's 124 mm [m].
const CAMERA_RADIUS: f64 = 0.065;

/// The nominal arm with its tool.
#[derive(Debug, Clone)]
pub struct Body {
    model: ArmModel,
    tool: Option<Tool>,
    hull: Option<ArmBalls>,
    camera: Option<Isometry3<f64>>,
}

impl Body {
    /// The body that cell.toml describes.
    ///
    /// # Errors
    /// [`ModelError`] when it describes no arm.
    pub fn of(cell: &Cell) -> Result<Self, ModelError> {
        let model = ArmModel::from_cell(cell)?;
        Ok(Self { hull: ArmBalls::of(cell, &model), model, tool: cell.tool.clone(), camera: None })
    }

    /// The same with a camera on its flange.
    pub fn with_camera(self, flange_from_camera: Isometry3<f64>) -> Self {
        Self { camera: Some(flange_from_camera), ..self }
    }

    pub fn model(&self) -> &ArmModel {
        &self.model
    }

    /// Height of the lowest point of flange and tool above the base frame's origin [m]; infinite where the arm's geometry is not known.
    pub fn lowest_point(&self, q: &Joints) -> f64 {
        if !self.model.has_geometry() {
            return f64::INFINITY;
        }
        let flange = self.model.flange(q).isometry();
        let at = |z: f64| (flange * nalgebra::Point3::new(0.0, 0.0, z)).z;
        match &self.tool {
            Some(tool) => at(0.0).min(at(tool.length - tool.radius)) - tool.radius,
            None => at(0.0),
        }
    }

    /// Balls that fill flange, tool, camera and the links behind the shoulder, centre and radius [m]; none where the arm's geometry is not
    /// known. Of an arm unlike an FR3 the links are lines between its joints.
    pub fn balls(&self, q: &Joints) -> Vec<(Point3<f64>, f64)> {
        let Some(hull) = &self.hull else { return Vec::new() };
        let balls: Vec<(usize, Point3<f64>, f64)> =
            hull.balls(q).into_iter().map(|(link, centre, radius)| (link, centre.into(), radius)).collect();
        let tool = balls.len().saturating_sub(2);
        let mut all = Vec::with_capacity(4 * balls.len());
        let camera = self.camera.map(|mount| (self.model.flange(q).isometry() * mount).translation.vector);
        all.extend(camera.map(|centre| (centre.into(), CAMERA_RADIUS)));
        for (i, (link, centre, radius)) in balls.iter().enumerate() {
            all.push((*centre, *radius));
            for (k, (of, other, wide)) in balls.iter().enumerate().skip(i + 1) {
                let is_line = *radius == 0.0 && k == i + 1;
                if (of == link && (i >= tool) == (k >= tool)) || is_line {
                    let steps = ((other - centre).norm() / radius.min(*wide).max(MAX_BALL_SPACING)).ceil() as u32;
                    all.extend((1..steps).map(|step| {
                        let share = f64::from(step) / f64::from(steps);
                        (centre + (other - centre) * share, radius + (wide - radius) * share)
                    }));
                }
            }
        }
        all
    }

    /// Torque that moves the arm like this, `M(q) ddq + bias(q, dq)` with gravity and rotors [N m].
    pub fn torque(&self, state: &JointState, ddq: &Joints) -> Joints {
        let mass = self.model.mass_matrix(&state.q);
        let mut tau = self.model.bias(state);
        for (tau, row) in tau.iter_mut().zip(&mass) {
            *tau += (0..MAX_JOINTS).map(|j| row[j] * ddq[j]).sum::<f64>();
        }
        tau
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shipped() -> Body {
        let path = std::path::Path::new("fr3_cell.toml");
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = shared_mem::toml_file::parse(text, path).expect("the shipped file");
        Body::of(&cell).expect("the shipped cell has an arm")
    }

    #[test]
    fn the_tool_reaches_its_length_below_the_flange_in_the_ready_pose() {
        let body = shipped();
        let q = *body.model().ready();
        let flange = body.model().flange(&q).isometry().translation.z;
        // The flange looks straight down there.
        assert!((flange - body.lowest_point(&q) - 0.16).abs() < 1e-6);
    }

    #[test]
    fn standing_still_takes_gravity_and_speeding_up_takes_inertia() {
        let body = shipped();
        let state = JointState::at_rest(*body.model().ready());
        let still = body.torque(&state, &[0.0; MAX_JOINTS]);
        let gravity = body.model().gravity(&state.q);
        assert!(still.iter().zip(&gravity).all(|(a, b)| (a - b).abs() < 1e-9), "{still:?} is not {gravity:?}");
        let mut ddq = [0.0; MAX_JOINTS];
        ddq[0] = 2.0;
        let sped_up = body.torque(&state, &ddq);
        assert!(sped_up[0] - still[0] > 2.0 * 0.195, "the rotor alone takes 0.39 N m, not {}", sped_up[0] - still[0]);
    }
}
