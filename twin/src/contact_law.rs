//! Numbers of the contact between tool and object: what effects change of it, and what [`crate::physics::hit`] follows.

/// The law's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Stiffness of tip and object in series [N/m].
    pub stiffness: f64,
    /// Share of the approach speed with which the two part again, 0 to 1.
    pub restitution: f64,
    /// Coulomb friction between tool and object.
    pub friction: f64,
}

/// A hard tip on a hard box: 0.3 kg part from the tool after 1 to 2 ms. Half or twice as much moves the mean gap of the
/// clips in `tests/simulation/sliding_clips.rs` by up to 0.6 mm.
pub const STIFFNESS: f64 = 2.0e6;
/// Such tips and boxes bounce little. 0.135, that of a critically damped contact, and 0.3 move the same gap by up to 1 mm.
pub const RESTITUTION: f64 = 0.25;
/// What a contact returns that is a spring and a damper and cannot pull (the law of [`crate::physics::hit`]), at damping ratios from 1 to
/// 0.6: `exp(-2)` to a quarter, and a fiftieth to either side for what a fit is off by (a choice) [1].
pub const RESTITUTION_OF_ENGINES: [f64; 2] = [0.115, 0.27];
/// In series with it at most a contact of 3 ms under half a kilogram: `(3e-3 s)^2 / 0.45 kg` [m/N].
pub const COMPLIANCE_OF_ENGINES: [f64; 2] = [0.0, 2e-5];

impl ContactLaw {
    /// The nominal law with an object's friction.
    pub fn nominal(friction: f64) -> Self {
        Self { stiffness: STIFFNESS, restitution: RESTITUTION, friction }
    }

    /// Puts another spring in series with the contact's [m/N].
    pub fn yield_by(&mut self, compliance: f64) {
        self.stiffness = 1.0 / (1.0 / self.stiffness + compliance);
    }
}
