//! The table leans. The object alone feels it; in its own axes the table stays where cell.toml puts it.
//!
//! - Equation: `gravity = R(tilt)^-1 (0, 0, -g)`, `tilt` turning the table about the base's x and y axes.
//! - Source: geometry.
//! - Unit: rad. Plausible: -0.1 to 0.1 (a careful set-up: 0.01, which is 0.1 m/s^2).
//! - Signature (S6): faster one way and slower the other; paths across bend.
//! - Confused with: a yaw of the camera, anisotropic friction (repeats after half a turn), friction patch.

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};
use nalgebra::{Rotation3, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "table_tilt",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[Parameter::size("tilt", "rad", [-0.1, 0.1], 0.0).vector(2).within(-1.5, 1.5)],
    confusable_with: &["camera_extrinsic_rotation", "anisotropic_friction", "friction_patch"],
    install: |values, effects| effects.slide.table_tilt = Some(TableTilt { tilt: values.vector("tilt") }),
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TableTilt {
    /// About the base's x and y axes [rad].
    tilt: [f64; 2],
}

impl TableTilt {
    pub(super) fn gravity(&self, level: Vector3<f64>) -> Vector3<f64> {
        Rotation3::new(Vector3::new(self.tilt[0], self.tilt[1], 0.0)).inverse() * level
    }
}
