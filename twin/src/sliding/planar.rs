//! State of a body that stands flat on the table, in world axes.

use nalgebra::Vector2;

/// Place and rates of a standing body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarState {
    /// Centre of mass above the table, world x and y [m].
    pub position: Vector2<f64>,
    /// Turn about the vertical since the footing was found [rad].
    pub yaw: f64,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector2<f64>,
    /// Yaw rate [rad/s].
    pub yaw_rate: f64,
}

impl PlanarState {
    /// At rest at a place.
    pub fn at_rest(position: Vector2<f64>, yaw: f64) -> Self {
        Self { position, yaw, velocity: Vector2::zeros(), yaw_rate: 0.0 }
    }

    /// Whether nothing moves. Exact: the law sets the rates of a stopped body to zero.
    pub fn is_at_rest(&self) -> bool {
        self.velocity == Vector2::zeros() && self.yaw_rate == 0.0
    }

    /// Moves on by `dt` with rates that are constant meanwhile.
    pub(super) fn advance(&mut self, velocity: Vector2<f64>, yaw_rate: f64, dt: f64) {
        self.position += velocity * dt;
        self.yaw += yaw_rate * dt;
    }
}

/// `z × r` in the plane: `r` turned by a quarter to the left.
#[inline]
pub(super) fn left_of(r: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-r.y, r.x)
}
