//! The seam between the sliding law and what the table is made of: the coefficient at one place and one slip velocity.
//!
//! [`Coulomb`] is the nominal table. A table that is rougher along one axis, beyond a line or at low speed is another
//! type with the same method; the law around it stays as it is.

use nalgebra::Vector2;

/// Coefficient of friction between base and table.
pub trait SlidingFriction: Copy + PartialEq {
    /// Coefficient where the base slips over `point` (world, on the table [m]) with `velocity` (world [m/s]).
    ///
    /// It must be finite and not negative. At rest `velocity` is zero and the coefficient is the one that has to be
    /// overcome. This part of the friction force always points against `velocity`.
    fn mu(&self, point: Vector2<f64>, velocity: Vector2<f64>) -> f64;

    /// Force across the slip over the load, positive where it pushes to the right of `velocity`: what a table that is rougher
    /// along one axis turns a slip aside by.
    #[inline]
    fn aside(&self, _point: Vector2<f64>, _velocity: Vector2<f64>) -> f64 {
        0.0
    }

    /// Whether [`SlidingFriction::aside`] may be other than 0.
    #[inline]
    fn turns_aside(&self) -> bool {
        false
    }
}

/// The same everywhere, in all directions, at all speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb(pub f64);

impl SlidingFriction for Coulomb {
    #[inline]
    fn mu(&self, _point: Vector2<f64>, _velocity: Vector2<f64>) -> f64 {
        self.0
    }
}
