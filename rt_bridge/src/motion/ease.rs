//! Back to a plan that was left: what is off, with its speed and its acceleration, fades out without a jump in any of them.
//! Pure; runs in the control thread.

use crate::safety::{Limits, Trace};
use shared_mem::msg::{Joints, MAX_JOINTS};

/// Lengths that are tried [s].
const LENGTHS: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
/// Share of the limits of acceleration and jerk that fading takes: plans leave a tenth.
const SHARE: f64 = 0.05;
/// Places along the way that are looked at.
const LOOKS: u32 = 16;

/// What is off, joint by joint, as a polynomial of time that ends at nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ease {
    /// Off by, per unit of time (the length) once and twice: value, slope, half the curvature.
    start: [[f64; 3]; MAX_JOINTS],
    length: f64,
    elapsed: f64,
}

impl Ease {
    /// Nothing is off.
    pub(super) fn over() -> Self {
        Self { start: [[0.0; 3]; MAX_JOINTS], length: LENGTHS[0], elapsed: LENGTHS[0] }
    }

    /// From `real` to `plan`, both where they are now; the shortest fading that is calm, or the longest.
    pub(super) fn between(real: &Trace, plan: &Trace, limits: &Limits, period_s: f64) -> Self {
        let calm = |ease: &Self| {
            (0..limits.dof).all(|i| {
                let joint = &limits.joints[i];
                let begin = ease.at(i, 0.0)[2].abs();
                (0..=LOOKS).all(|k| {
                    let [_, _, a, jerk] = ease.at(i, f64::from(k) / f64::from(LOOKS));
                    a.abs() <= begin.max(SHARE * joint.acceleration) && jerk.abs() <= SHARE * joint.jerk
                })
            })
        };
        let of = |length: f64| {
            let mut start = [[0.0; 3]; MAX_JOINTS];
            for (i, start) in start.iter_mut().enumerate() {
                let v = real.velocity_now(i, period_s) - plan.velocity_now(i, period_s);
                *start = [real.q[i] - plan.q[i], v * length, 0.5 * (real.a[i] - plan.a[i]) * length * length];
            }
            Self { start, length, elapsed: 0.0 }
        };
        let [first, rest @ ..] = LENGTHS;
        rest.into_iter().fold(of(first), |ease, length| if calm(&ease) { ease } else { of(length) })
    }

    /// Whether nothing is off any more.
    pub(super) fn is_over(&self) -> bool {
        self.elapsed >= self.length
    }

    /// A period on: positions and speeds that are to be added to the plan's.
    pub(super) fn step(&mut self, period_s: f64) -> [Joints; 2] {
        self.elapsed += period_s;
        let share = (self.elapsed / self.length).min(1.0);
        let mut off = [[0.0; MAX_JOINTS]; 2];
        let [positions, speeds] = &mut off;
        for (i, (q, dq)) in positions.iter_mut().zip(speeds).enumerate() {
            [*q, *dq, ..] = self.at(i, share);
        }
        off
    }

    /// Joint `i`'s value, speed, acceleration and jerk at a share of the length: the one polynomial of fifth order that
    /// begins as asked and ends in nothing.
    fn at(&self, i: usize, share: f64) -> [f64; 4] {
        let [e, v, c] = self.start[i];
        let (c3, c4, c5) = (-10.0 * e - 6.0 * v - 3.0 * c, 15.0 * e + 8.0 * v + 3.0 * c, -6.0 * e - 3.0 * v - c);
        let (s, t) = (share, self.length);
        [
            e + s * (v + s * (c + s * (c3 + s * (c4 + s * c5)))),
            (v + s * (2.0 * c + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / t,
            (2.0 * c + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (t * t),
            (6.0 * c3 + s * (24.0 * c4 + s * 60.0 * c5)) / (t * t * t),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_begins_where_it_is_and_ends_in_nothing_smoothly(
            (off, v, a) in (-0.02..0.02_f64, -0.02..0.02_f64, -3.0..3.0_f64),
        ) {
            let period_s = 1e-3;
            let plan = Trace::at_rest([0.3; MAX_JOINTS]);
            let mut real = plan;
            (real.q[2], real.v[2], real.a[2]) = (real.q[2] + off, v, a);
            let mut ease = Ease::between(&real, &plan, &Limits::fr3(), period_s);
            let mut trace = real;
            while !ease.is_over() {
                let [q, dq] = ease.step(period_s);
                let next = trace.after(&std::array::from_fn(|i| plan.q[i] + q[i]), period_s);
                let jerk = (next.a[2] - trace.a[2]) / period_s;
                prop_assert!(jerk.abs() < 1000.0, "{jerk}");
                prop_assert!((dq[2] - next.velocity_now(2, period_s)).abs() < 1e-3);
                trace = next;
            }
            prop_assert!((trace.q[2] - plan.q[2]).abs() < 1e-12 && trace.v[2].abs() < 1e-4);
            prop_assert_eq!(trace.q[0], plan.q[0]);
        }
    }

    #[test]
    fn nothing_is_off_when_it_is_over() {
        let mut ease = Ease::over();
        assert!(ease.is_over());
        assert_eq!(ease.step(1e-3), [[0.0; MAX_JOINTS]; 2]);
    }
}
