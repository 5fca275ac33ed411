//! Effects on the slide: what the table's friction depends on, where the base presses, what else pushes the object.
//! Asked once when a cell is made ([`super::Effects::material`]), but for the friction itself: [`TableFriction`] is asked for
//! every place and slip.

pub(super) mod anisotropic_friction;
pub(super) mod friction_patch;
pub(super) mod pressure_distribution;
pub(super) mod stribeck_sliding_friction;
pub(super) mod table_tilt;
#[cfg(test)]
pub(super) mod test_slide;
pub(super) mod velocity_dependent_friction;
pub(super) mod viscous_sliding_drag;

use crate::physics::Material;
use crate::sliding::{Coulomb, SlidingFriction};
use nalgebra::Vector2;

/// The effects on a slide that are installed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SlideEffects {
    pub(super) anisotropic_friction: Option<anisotropic_friction::AnisotropicFriction>,
    pub(super) stribeck_sliding_friction: Option<stribeck_sliding_friction::StribeckSlidingFriction>,
    pub(super) velocity_dependent_friction: Option<velocity_dependent_friction::VelocityDependentFriction>,
    pub(super) viscous_sliding_drag: Option<viscous_sliding_drag::ViscousSlidingDrag>,
    pub(super) table_tilt: Option<table_tilt::TableTilt>,
    pub(super) friction_patch: Option<friction_patch::FrictionPatch>,
    pub(super) pressure_distribution: Option<pressure_distribution::PressureDistribution>,
}

impl SlideEffects {
    /// An object on the real table.
    pub(super) fn material(&self, nominal: Material<Coulomb>) -> Material<TableFriction> {
        let Material { parameters, yaw_inertia_factor, gravity, drag, pressure_reach, pivot_reach, .. } = nominal;
        let effects = (*self != Self::default()).then_some(*self);
        Material {
            parameters,
            yaw_inertia_factor,
            friction: TableFriction { nominal: nominal.friction.0, effects },
            gravity: self.table_tilt.map_or(gravity, |effect| effect.gravity(gravity)),
            drag: self.viscous_sliding_drag.map_or(drag, |effect| effect.drag),
            pressure_reach: self.pressure_distribution.map_or(pressure_reach, |effect| effect.reach),
            pivot_reach: self.pressure_distribution.map_or(pivot_reach, |effect| effect.pivot),
        }
    }
}

/// Friction of the real table: a coefficient and what it depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableFriction {
    /// The coefficient without any effect.
    pub nominal: f64,
    /// What changes it; `None` saves asking.
    pub effects: Option<SlideEffects>,
}

impl SlidingFriction for TableFriction {
    #[inline]
    fn mu(&self, point: Vector2<f64>, velocity: Vector2<f64>) -> f64 {
        self.effects.as_ref().map_or(self.nominal, |effects| effects.mu(self.nominal, point, velocity))
    }

    #[inline]
    fn aside(&self, _point: Vector2<f64>, velocity: Vector2<f64>) -> f64 {
        let rough = self.effects.as_ref().and_then(|effects| effects.anisotropic_friction.as_ref());
        rough.map_or(0.0, |effect| self.nominal * effect.aside(velocity))
    }

    #[inline]
    fn turns_aside(&self) -> bool {
        self.effects.is_some_and(|effects| effects.anisotropic_friction.is_some())
    }
}

impl SlideEffects {
    fn mu(&self, nominal: f64, point: Vector2<f64>, velocity: Vector2<f64>) -> f64 {
        let speed = velocity.norm();
        let mut mu = nominal
            + self.stribeck_sliding_friction.map_or(0.0, |effect| effect.more(speed))
            + self.velocity_dependent_friction.map_or(0.0, |effect| effect.more(speed));
        if let Some(effect) = &self.anisotropic_friction {
            mu *= effect.factor(velocity);
        }
        if let Some(effect) = &self.friction_patch {
            mu *= effect.factor(point);
        }
        mu.max(0.0)
    }
}
