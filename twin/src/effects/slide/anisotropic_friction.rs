//! The table is rougher along one axis than across it.
//!
//! - Equation: against the slip `mu(phi) = mu (1 + size cos 2(phi - axis))`, `phi` the heading of the slip; across it `drift`
//!   times `d mu / d phi`, which turns the slip towards the smoother axis.
//! - Source: first even harmonic of direction-dependent friction. With `drift` 1 force and slip are normal to each other's
//!   curves, as where as much as possible is dissipated (Goyal, Ruina & Papadopoulos 1991); with 0 the force stays against
//!   the slip.
//! - Units: size 1; axis rad from the base's x axis; drift 1. Plausible: size 0 to 0.5, axis -pi/2 to pi/2, drift 0 to 1. At
//!   rest the mean counts.
//! - Signature (S7): deceleration repeats twice over a full turn of the heading; paths bend towards the smoother axis.
//! - Confused with: table tilt (repeats once), friction patch (follows the place).

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, degrees, short};
use crate::effects::separation::{Experiment, Separation};
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "anisotropic_friction",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[
        Parameter::size("size", "1", [0.0, 0.5], 0.0).within(-1.0, 1.0),
        Parameter::form("axis", "rad", [-FRAC_PI_2, FRAC_PI_2], 0.0).searched(Search::Angle { quarter: FRAC_PI_4 }),
        Parameter::form("drift", "1", [0.0, 1.0], 1.0)
            .within(0.0, 1.0)
            // Slips that are turned aside as far as they can be, and not at all.
            .begun_at(&[&[1.0], &[0.0]]),
    ],
    confusable_with: &["table_tilt", "friction_patch"],
    separated: &[Separation {
        from: "friction_patch",
        by: "the same place in different headings, and different places",
        record: &[Experiment::Headings, Experiment::Strokes],
    }],
    install: |values, effects| {
        let (size, axis, drift) = (values.number("size"), values.number("axis"), values.number("drift"));
        effects.slide.anisotropic_friction = Some(AnisotropicFriction { size, axis: [axis.cos(), axis.sin()], drift });
    },
    remedy: |found| {
        let (size, axis) = (found.number("size"), found.number("axis"));
        let rough = if size < 0.0 { axis + FRAC_PI_2 } else { axis };
        let [along, across] = [1.0 + size.abs(), 1.0 - size.abs()].map(short);
        Remedy::new(
            format!(
                "The table is roughest along {} from the base's x axis (a grain, a weave, wear in one direction): lay a sheet without grain, or turn the top so that it no longer matters.",
                degrees(rough)
            ),
            format!(
                "Friction {along} times the mean along {} from x and {across} times across it (MuJoCo: a contact pair with two sliding coefficients).",
                degrees(rough)
            ),
        )
    },
    model: |found| {
        let along = Change::FrictionAlong { size: found.number("size"), axis: found.number("axis") };
        // Engines with a friction ellipse turn the slip aside as far as it goes.
        let straight = (found.number("drift") < 0.5).then_some(Change::Beyond("friction that stays against the slip"));
        std::iter::once(along).chain(straight).collect()
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct AnisotropicFriction {
    size: f64,
    axis: [f64; 2],
    drift: f64,
}

impl AnisotropicFriction {
    #[inline]
    pub(super) fn factor(&self, velocity: Vector2<f64>) -> f64 {
        let squared = velocity.norm_squared();
        if squared == 0.0 {
            return 1.0;
        }
        let along = velocity.dot(&Vector2::from(self.axis));
        // cos 2a = 2 cos^2 a - 1
        1.0 + self.size * (2.0 * along * along / squared - 1.0)
    }

    /// The part across the slip, over the coefficient.
    #[inline]
    pub(super) fn aside(&self, velocity: Vector2<f64>) -> f64 {
        let squared = velocity.norm_squared();
        if squared == 0.0 {
            return 0.0;
        }
        let axis = Vector2::from(self.axis);
        // sin 2a = 2 cos a sin a
        -4.0 * self.drift * self.size * velocity.dot(&axis) * axis.perp(&velocity) / squared
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_slide::mu;
    use super::*;

    #[test]
    fn friction_is_most_along_the_axis_both_ways_and_least_across() {
        let at = |heading: f64| {
            let block = "[[effect]]\nname = \"anisotropic_friction\"\nsize = 0.1\naxis = 0.4";
            mu(block, [0.0; 2], [0.7 * heading.cos(), 0.7 * heading.sin()])
        };
        for (heading, expected) in
            [(0.4, 0.33), (0.4 + std::f64::consts::PI, 0.33), (0.4 + std::f64::consts::FRAC_PI_2, 0.27)]
        {
            assert!((at(heading) - expected).abs() < 1e-12, "{heading}: {}", at(heading));
        }
        assert!((at(1.0) - 0.3 * (1.0 + 0.1 * 1.2f64.cos())).abs() < 1e-12);
    }

    #[test]
    fn the_force_across_the_slip_is_the_slope_of_the_coefficient_over_the_heading() {
        let rough = |drift: f64| AnisotropicFriction { size: 0.2, axis: [0.4f64.cos(), 0.4f64.sin()], drift };
        let slip = |heading: f64| Vector2::new(heading.cos(), heading.sin()) * 0.3;
        for heading in [0.1, 1.0, 2.5, -2.0] {
            let slope = (rough(1.0).factor(slip(heading + 1e-6)) - rough(1.0).factor(slip(heading - 1e-6))) / 2e-6;
            assert!((rough(1.0).aside(slip(heading)) - slope).abs() < 1e-8, "{heading}");
            assert!((rough(0.5).aside(slip(heading)) - 0.5 * slope).abs() < 1e-8, "{heading}");
        }
    }
}
