//! A film between object and table drags in proportion to the speed.
//!
//! - Equation: `F = -drag v`, spread over the places of the base as an even pressure is, each against its own velocity `v`,
//!   at the table's height.
//! - Source: Couette flow in a thin film.
//! - Unit: N s/m for the whole base. Plausible: 0 to 2 (dry air: 0; oil: the upper end).
//! - Signature (S4): deceleration linear in speed, and twice as much for half the mass.
//! - Confused with: velocity-dependent friction (the same for one mass).

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, with_unit};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "viscous_sliding_drag",
    stage: Stage::Slide,
    acts_on: Place::Table,
    parameters: &[Parameter::size("drag", "N s/m", [0.0, 2.0], 0.0).within(0.0, f64::MAX)],
    confusable_with: &["velocity_dependent_friction", "stribeck_sliding_friction"],
    separated: &[],
    install: |values, effects| {
        effects.slide.viscous_sliding_drag = Some(ViscousSlidingDrag { drag: values.number("drag") });
    },
    remedy: |found| {
        let drag = with_unit(found.number("drag"), "N s/m");
        Remedy::new(
            format!("Dry and degrease table and object: a film drags with {drag}."),
            format!(
                "A force of -{drag} times its velocity on the object while it lies on the table (MuJoCo: damping of its sliding joints)."
            ),
        )
    },
    model: |_| vec![Change::Beyond("drag in proportion to the speed of a slide")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ViscousSlidingDrag {
    pub(super) drag: f64,
}

#[cfg(test)]
mod tests {
    use super::super::test_slide::{MASS, slid};

    #[test]
    fn on_ice_translation_and_spin_decay_exponentially() {
        let (way, yaw) = slid("[[effect]]\nname = \"viscous_sliding_drag\"\ndrag = 0.5", 0.0, 0.5, 3.0, 0.5);
        let travel = |start: f64, rate: f64| start / rate * (1.0 - (-rate * 0.5).exp());
        let expected = travel(0.5, 0.5 / MASS);
        assert!((way.x / expected - 1.0).abs() < 1e-3, "{} m instead of {expected} m", way.x);
        // On its corners the box has a radius of gyration three times its own, squared.
        let expected = travel(3.0, 3.0 * 0.5 / MASS);
        assert!((yaw / expected - 1.0).abs() < 1e-3, "{yaw} rad instead of {expected} rad");
    }
}
