//! What an object and the table under it are, in the numbers of the laws. Whoever knows what is special about a cell fills
//! them in; the laws do not ask why.

use crate::scene::ObjectParameters;
use crate::sliding::Coulomb;
use nalgebra::Vector3;
use shared_mem::cell::GRAVITY;

/// Everything about an object's physics that is not its shape, with a law of friction `F` between base and table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material<F> {
    pub parameters: ObjectParameters,
    /// Inertia about the object's z axis over that of the homogeneous body.
    pub yaw_inertia_factor: f64,
    pub friction: F,
    /// In the table's axes [m/s²].
    pub gravity: Vector3<f64>,
    /// Force of a viscous film under a standing body's base over its velocity [N s/m].
    pub drag: f64,
    /// Reach of the pressure from the middle of the base, over the nominal one.
    pub pressure_reach: f64,
    /// Distance from the middle of the base of what a tipping object pivots about, over that of its corners.
    pub pivot_reach: f64,
}

impl Material<Coulomb> {
    /// A homogeneous body on a level, dry table that is the same everywhere.
    pub fn nominal(parameters: ObjectParameters) -> Self {
        Self {
            parameters,
            yaw_inertia_factor: 1.0,
            friction: Coulomb(parameters.friction),
            gravity: Vector3::new(0.0, 0.0, -GRAVITY),
            drag: 0.0,
            pressure_reach: 1.0,
            pivot_reach: 1.0,
        }
    }
}
