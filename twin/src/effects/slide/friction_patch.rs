//! The table is smoother or rougher in one place.
//!
//! - Equation: `mu factor` inside a disc of `radius` whose edge lies `distance` from the base's origin in `direction` and
//!   whose middle lies beyond; without a radius everything beyond that line.
//! - Source: two materials, a worn or wet spot.
//! - Units: factor 1; direction rad from the base's x axis; distance, radius m. Plausible: factor 0.5 to 1.5.
//! - Signature (S8): follows the place, whatever the heading and speed.
//! - Confused with: anisotropic friction and table tilt, where all slides go the same way.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{OnTable, Parameter, Search};
use crate::effects::remedy::{Remedy, degrees, short};
use nalgebra::Vector2;
use std::f64::consts::PI;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "friction_patch",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[
        Parameter::size("factor", "1", [0.5, 1.5], 1.0).within(0.0, 100.0),
        Parameter::form("direction", "rad", [-PI, PI], 0.0).searched(Search::OnTable(OnTable::Direction)),
        Parameter::form("distance", "m", [-0.8, 0.8], 0.0).searched(Search::OnTable(OnTable::Distance)),
        Parameter::form("radius", "m", [0.02, 0.5], f64::INFINITY)
            .within(0.0, f64::MAX)
            .searched(Search::OnTable(OnTable::Radius)),
    ],
    confusable_with: &["anisotropic_friction", "table_tilt"],
    separated: &[],
    install: |values, effects| {
        let direction = values.number("direction");
        effects.slide.friction_patch = Some(FrictionPatch {
            factor: values.number("factor"),
            direction: [direction.cos(), direction.sin()],
            distance: values.number("distance"),
            radius: values.number("radius"),
        });
    },
    remedy: |found| {
        let (factor, direction) = (found.number("factor"), found.number("direction"));
        let (distance, radius) = (found.number("distance"), found.number("radius"));
        let place = if radius.is_finite() {
            let middle = distance + radius;
            format!(
                "within {} m of x {} m, y {} m",
                short(radius),
                short(middle * direction.cos()),
                short(middle * direction.sin())
            )
        } else {
            format!("beyond the line {} m from the base towards {}", short(distance), degrees(direction))
        };
        let kind = if factor > 1.0 { "rougher" } else { "smoother" };
        Remedy::new(
            format!("The table is {kind} {place}: clean or cover it there, or keep the object away."),
            format!("Friction times {} {place}.", short(factor)),
        )
    },
    model: |_| vec![Change::Beyond("friction that differs from place to place")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct FrictionPatch {
    factor: f64,
    direction: [f64; 2],
    distance: f64,
    radius: f64,
}

impl FrictionPatch {
    #[inline]
    pub(super) fn factor(&self, point: Vector2<f64>) -> f64 {
        let direction = Vector2::from(self.direction);
        let inside = if self.radius.is_finite() {
            (point - direction * (self.distance + self.radius)).norm() < self.radius
        } else {
            point.dot(&direction) > self.distance
        };
        if inside { self.factor } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_slide::mu;

    #[test]
    fn another_friction_begins_beyond_the_line() {
        let at = |point| mu("[[effect]]\nname = \"friction_patch\"\nfactor = 0.5\ndistance = 0.6", point, [1.0, 0.0]);
        assert_eq!((at([0.59, 3.0]), at([0.61, -3.0])), (0.3, 0.15));
    }

    #[test]
    fn with_a_radius_it_is_a_disc_that_begins_there() {
        let block = "[[effect]]\nname = \"friction_patch\"\nfactor = 0.5\ndistance = 0.6\nradius = 0.1";
        let at = |point| mu(block, point, [1.0, 0.0]);
        assert_eq!((at([0.59, 0.0]), at([0.61, 0.0]), at([0.79, 0.0]), at([0.81, 0.0])), (0.3, 0.15, 0.15, 0.3));
        assert_eq!((at([0.7, 0.09]), at([0.7, 0.11])), (0.15, 0.3));
    }
}
