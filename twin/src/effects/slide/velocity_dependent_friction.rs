//! The table's friction changes with speed.
//!
//! - Equation: `mu0 + slope v`, never below 0.
//! - Source: first order of any smooth dependence.
//! - Unit: s/m. Plausible: -0.3 to 0.3.
//! - Signature (S2): deceleration bends over speed; the same for light and heavy objects.
//! - Confused with: viscous sliding drag (the same for one mass), Stribeck friction, camera distortion.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "velocity_dependent_friction",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[Parameter::size("slope", "s/m", [-0.3, 0.3], 0.0)],
    confusable_with: &["viscous_sliding_drag", "stribeck_sliding_friction"],
    separated: &[Separation {
        from: "viscous_sliding_drag",
        by: "fix a known weight on top of the object, put its mass into a cell.toml of its own, and record the same kind of slides",
        record: &[Experiment::StrokesWeighted],
    }],
    install: |values, effects| {
        effects.slide.velocity_dependent_friction = Some(VelocityDependentFriction { slope: values.number("slope") });
    },
    remedy: |found| {
        let slope = found.number("slope");
        Remedy::new(
            "Nothing is broken: the pair of materials does this. A dry, hard sole on a dry, hard table does it least.",
            format!("Friction mu + v {} s/m, never below 0, instead of mu.", short(slope)),
        )
    },
    model: |_| vec![Change::Beyond("friction that changes with speed")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct VelocityDependentFriction {
    slope: f64,
}

impl VelocityDependentFriction {
    #[inline]
    pub(super) fn more(&self, speed: f64) -> f64 {
        self.slope * speed
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_slide::mu;

    #[test]
    fn friction_grows_along_a_line_and_never_pushes() {
        let at = |slope: f64, speed: f64| {
            let block = format!("[[effect]]\nname = \"velocity_dependent_friction\"\nslope = {slope:?}");
            mu(&block, [0.0; 2], [speed, 0.0])
        };
        assert!((at(0.05, 0.8) - 0.34).abs() < 1e-15);
        assert_eq!(at(-0.5, 0.8), 0.0);
    }
}
