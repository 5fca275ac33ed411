//! A film between object and table drags in proportion to the speed.
//!
//! - Equation: `F = -drag v` of each place of the base, spread evenly over it; it acts at the table's height.
//! - Source: Couette flow in a thin film.
//! - Unit: N s/m for the whole base. Plausible: 0 to 2 (dry air: 0; oil: the upper end).
//! - Signature (S4): deceleration linear in speed, and twice as much for half the mass.
//! - Confused with: velocity-dependent friction (the same for one mass).

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "viscous_sliding_drag",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[Parameter::size("drag", "N s/m", [0.0, 2.0], 0.0).within(0.0, f64::MAX)],
    confusable_with: &["velocity_dependent_friction", "stribeck_sliding_friction"],
    install: |values, effects| {
        effects.slide.viscous_sliding_drag = Some(ViscousSlidingDrag { drag: values.number("drag") });
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ViscousSlidingDrag {
    pub(super) drag: f64,
}
