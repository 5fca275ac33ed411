//! The table leans. The object alone feels it; in its own axes the table stays where cell.toml puts it.
//!
//! - Equation: `gravity = R(tilt)^-1 (0, 0, -g)`, `tilt` turning the table about the base's x and y axes.
//! - Source: geometry.
//! - Unit: rad. Plausible: -0.1 to 0.1 (a careful set-up: 0.01, which is 0.1 m/s^2).
//! - Signature (S6): faster one way and slower the other; paths across bend.
//! - Confused with: a yaw of the camera, anisotropic friction (repeats after half a turn), friction patch.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, gravity, leaning, list};
use crate::effects::separation::{Experiment, Separation};
use nalgebra::{Rotation3, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "table_tilt",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[Parameter::size("tilt", "rad", [-0.1, 0.1], 0.0).vector(2).within(-1.5, 1.5)],
    confusable_with: &["camera_extrinsic_rotation", "anisotropic_friction", "friction_patch"],
    separated: &[
        Separation {
            from: "anisotropic_friction",
            by: "slides in eight headings through the same place",
            record: &[Experiment::Headings],
        },
        Separation {
            from: "base_tilt",
            by: "rest the arm in eight poses, and slide in eight headings",
            record: &[Experiment::Holds, Experiment::Headings],
        },
    ],
    install: |values, effects| effects.slide.table_tilt = Some(TableTilt { tilt: values.vector("tilt") }),
    remedy: |found| {
        let tilt = found.vector("tilt");
        Remedy::new(
            format!("Level the table {}.", leaning(tilt)),
            format!(
                "Turn the table by {} rad about the base's x and y axes, or let gravity be {} m/s^2 for the object.",
                list(&tilt),
                list(&gravity(tilt))
            ),
        )
    },
    model: |found| vec![Change::ObjectGravity(gravity(found.vector("tilt")))],
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

#[cfg(test)]
mod tests {
    use super::super::test_slide::slid;

    #[test]
    fn the_box_slides_down_from_the_friction_angle_on_and_stays_exactly_below_it() {
        let on = |tilt: f64| {
            slid(&format!("[[effect]]\nname = \"table_tilt\"\ntilt = [0.0, {tilt:?}]"), 0.3, 0.0, 0.0, 0.5).0
        };
        let limit = 0.3f64.atan();
        assert_eq!(on(0.99 * limit), nalgebra::Vector3::zeros());
        let down = on(1.1 * limit);
        let expected = 0.5 * 9.81 * ((1.1 * limit).sin() - 0.3 * (1.1 * limit).cos()) * 0.25;
        assert!((down.x / expected - 1.0).abs() < 5e-3, "{} m instead of {expected} m", down.x);
        assert!(down.y.abs() < 1e-6, "{down}");
    }
}
