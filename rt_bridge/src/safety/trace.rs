//! Velocity and acceleration of the commanded positions by backward differences, which is how the robot judges them:
//! `v = (q - q') / T`, `a = (v - v') / T`.

use shared_mem::msg::{Joints, MAX_JOINTS};

/// What was commanded last, and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trace {
    /// Positions [rad].
    pub q: Joints,
    /// Backward difference of the positions [rad/s].
    pub v: Joints,
    /// Backward difference of the velocities [rad/s²].
    pub a: Joints,
}

impl Trace {
    /// At rest at `q`.
    pub fn at_rest(q: Joints) -> Self {
        Self { q, v: [0.0; MAX_JOINTS], a: [0.0; MAX_JOINTS] }
    }

    /// The trace after `q` was commanded, a period `period_s` after this one.
    pub fn after(&self, q: &Joints, period_s: f64) -> Self {
        let mut next = Self::at_rest(*q);
        for (i, (q, q_before)) in q.iter().zip(&self.q).enumerate() {
            next.v[i] = (q - q_before) / period_s;
            next.a[i] = (next.v[i] - self.v[i]) / period_s;
        }
        next
    }

    /// A period on at the same acceleration: what an FCI robot does where no command comes.
    pub fn onward(&self, period_s: f64) -> Self {
        let mut next = *self;
        for (i, a) in self.a.iter().enumerate() {
            next.v[i] += a * period_s;
            next.q[i] += next.v[i] * period_s;
        }
        next
    }

    /// Velocity at the last sample [rad/s]: the difference speaks of the middle of its period, half a period ago.
    pub fn velocity_now(&self, joint: usize, period_s: f64) -> f64 {
        self.v[joint] + 0.5 * period_s * self.a[joint]
    }

    /// `true` when the last three positions of the joints that count were the same to a nanoradian.
    pub fn is_at_rest(&self, dof: usize, period_s: f64) -> bool {
        let still = |v: &f64| v.abs() * period_s < 1e-9;
        self.v.iter().take(dof).all(still) && self.a.iter().take(dof).all(|a| still(&(a * period_s)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_of_a_parabola_give_its_acceleration_and_its_velocity_now() {
        let (a, t) = (4.0, 1e-3);
        let position = |k: f64| [0.5 * a * (k * t) * (k * t); MAX_JOINTS];
        let mut trace = Trace::at_rest(position(0.0));
        for k in 1..=10 {
            trace = trace.after(&position(f64::from(k)), t);
        }
        assert!((trace.a[0] - a).abs() < 1e-6);
        assert!((trace.velocity_now(0, t) - a * 10.0 * t).abs() < 1e-9);
        assert!(!trace.is_at_rest(7, t));
        assert!(Trace::at_rest([0.3; MAX_JOINTS]).is_at_rest(7, t));
    }
}
