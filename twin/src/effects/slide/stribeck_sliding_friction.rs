//! The table holds a slow object more than a fast one.
//!
//! - Equation: `mu + excess exp(-(v / velocity)^2)`; at rest `mu + excess`.
//! - Source: Stribeck curve in Gaussian form, as for joints.
//! - Units: excess 1; velocity m/s. Plausible: excess -0.2 to 0.2; velocity 0.02 to 0.3.
//! - Signature (S3): only the last centimetres of a slide are shorter.
//! - Confused with: the object's friction, tracker smoothing (rounds the stop), velocity-dependent friction.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "stribeck_sliding_friction",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[
        Parameter::size("excess", "1", [-0.2, 0.2], 0.0).within(-10.0, 10.0),
        Parameter::form("velocity", "m/s", [0.02, 0.3], 0.1).within(1e-6, f64::MAX).begun_at(&[
            &[0.05],
            &[0.1],
            &[0.2],
        ]),
    ],
    confusable_with: &["velocity_dependent_friction", "tracker_smoothing"],
    separated: &[],
    install: |values, effects| {
        effects.slide.stribeck_sliding_friction =
            Some(StribeckSlidingFriction { excess: values.number("excess"), velocity: values.number("velocity") });
    },
    remedy: |found| {
        let (excess, velocity) = (found.number("excess"), found.number("velocity"));
        Remedy::new(
            "Clean table and object: a film or soft soles hold what is slow. What stays belongs to the materials.",
            format!("Friction mu + {} exp(-(v / {} m/s)^2) instead of mu.", short(excess), short(velocity)),
        )
    },
    model: |_| vec![Change::Beyond("friction of a slow slide that is another than that of a fast one")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct StribeckSlidingFriction {
    excess: f64,
    velocity: f64,
}

impl StribeckSlidingFriction {
    #[inline]
    pub(super) fn more(&self, speed: f64) -> f64 {
        let ratio = speed / self.velocity;
        self.excess * (-ratio * ratio).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_slide::mu;

    #[test]
    fn the_excess_is_full_at_rest_and_gone_in_motion() {
        let block = "[[effect]]\nname = \"stribeck_sliding_friction\"\nexcess = 0.1\nvelocity = 0.05";
        let at = |speed: f64| mu(block, [0.0; 2], [0.0, speed]);
        assert!((at(0.0) - 0.4).abs() < 1e-15);
        assert!((at(0.05) - 0.3 - 0.1 / std::f64::consts::E).abs() < 1e-12);
        assert!((at(0.5) - 0.3).abs() < 1e-12);
    }
}
