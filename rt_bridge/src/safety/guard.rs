//! The verdict on the next set point. A set point is admitted when it lies inside every limit *and* braking from it, as
//! [`crate::motion::Brake`] does it, stays inside them too, and arm and tool inside the workspace all the way: so whatever
//! comes next, there is always a way to stop. The arm that is there has to stay in the workspace as well on that way, which it
//! trails and overshoots: see [`Measured`]. A set point that is not admitted leaves the way from the one before it.

use super::{JointLimits, Limits, Measured, Outside, Trace, Trailing, Workspace};
use shared_mem::msg::motion::SetPoint;
use std::fmt;

/// Kept between a commanded position and the joint's end [rad]: covers the last, jerk-limited moment of a stop.
const END_MARGIN: f64 = 1e-4;
/// What is forgiven to rounding, as a share of a limit.
const ROUNDING: f64 = 1e-6;

/// Why a set point was not sent. Joints are counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Violation {
    /// A number is not finite.
    NotFinite { joint: u8 },
    /// Too near to the end of the joint's range, or beyond it.
    Position { joint: u8 },
    /// Too fast, here or for the way that is left to the end of the range.
    Velocity { joint: u8 },
    /// Speeds up or slows down too hard.
    Acceleration { joint: u8 },
    /// The acceleration jumps.
    Jerk { joint: u8 },
    /// `dq_d` is not the derivative of `q_d`.
    Inconsistent { joint: u8 },
    /// Arm or tool would leave the space they may be in, here or on the way to a stop.
    Workspace,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { joint } => write!(f, "joint {joint}: a number is not finite"),
            Self::Position { joint } => write!(f, "joint {joint} would leave its range"),
            Self::Velocity { joint } => write!(f, "joint {joint} would be too fast for where it is"),
            Self::Acceleration { joint } => write!(f, "joint {joint} would exceed its acceleration limit"),
            Self::Jerk { joint } => write!(f, "joint {joint} would exceed its jerk limit"),
            Self::Inconsistent { joint } => write!(f, "joint {joint}: dq_d is not the derivative of q_d"),
            Self::Workspace => f.write_str("arm or tool could not stop inside the workspace (table or reach)"),
        }
    }
}

/// Limits in force and the control period.
#[derive(Debug, Clone)]
pub struct Guard {
    pub limits: Limits,
    /// Where arm and tool may be.
    pub workspace: Workspace,
    /// How the arm comes after its commands; `None` where no law is known that says so.
    pub trailing: Option<Trailing>,
    /// Control period [s].
    pub period_s: f64,
}

impl Guard {
    /// Admits `point` after `last`, or says what is wrong with it. `outside` is how far the arm was outside the workspace
    /// when it last came to rest; `arm` is what was measured of it, where that is known.
    ///
    /// # Errors
    /// The first [`Violation`] found, joint by joint, then the workspace.
    pub fn check(
        &self,
        last: &Trace,
        point: &SetPoint,
        outside: &Outside,
        arm: Option<&Measured>,
    ) -> Result<Trace, Violation> {
        let next = last.after(&point.q_d, self.period_s);
        for (i, limits) in self.limits.counted().enumerate() {
            self.check_joint(i, limits, last, &next, point)?;
        }
        let holds = next == Trace::at_rest(last.q);
        let keeps = || self.workspace.keeps(&next, &self.limits, self.period_s, outside) && self.keeps_arm(&next, arm);
        if holds || keeps() { Ok(next) } else { Err(Violation::Workspace) }
    }

    /// Whether the arm itself stays in the workspace while it is commanded to stop from `next` on.
    fn keeps_arm(&self, next: &Trace, arm: Option<&Measured>) -> bool {
        arm.is_none_or(|arm| match &self.trailing {
            Some(trailing) => arm.keeps(next, trailing, &self.workspace, &self.limits, self.period_s),
            None => arm.keeps_its_gap(next, &self.workspace, &self.limits, self.period_s),
        })
    }

    fn check_joint(
        &self,
        i: usize,
        limits: &JointLimits,
        last: &Trace,
        next: &Trace,
        point: &SetPoint,
    ) -> Result<(), Violation> {
        let joint = u8::try_from(i + 1).unwrap_or(u8::MAX);
        let [Some(q), Some(dq), Some(v), Some(a), Some(a_before)] =
            [point.q_d.get(i), point.dq_d.get(i), next.v.get(i), next.a.get(i), last.a.get(i)]
        else {
            return Err(Violation::NotFinite { joint });
        };
        let (jerk, slack) = ((a - a_before) / self.period_s, 1.0 + ROUNDING);
        if !(q.is_finite() && dq.is_finite() && jerk.is_finite()) {
            return Err(Violation::NotFinite { joint });
        }
        if *q == point_before(last, i) && *v == 0.0 && *a == 0.0 && *dq == 0.0 {
            return Ok(()); // holding is always allowed, wherever the arm was when the bridge took over
        }
        if jerk.abs() > limits.jerk * slack {
            return Err(Violation::Jerk { joint });
        }
        if a.abs() > limits.acceleration * slack {
            return Err(Violation::Acceleration { joint });
        }
        // The derivative at a sample and the difference before it are half a period apart.
        if (dq - v).abs() > limits.acceleration * self.period_s {
            return Err(Violation::Inconsistent { joint });
        }
        // The law acts on `dq_d` itself, so being near to an admitted difference is not enough.
        if dq.abs() > limits.velocity * slack {
            return Err(Violation::Velocity { joint });
        }
        self.check_stoppable(limits, *q, next.velocity_now(i, self.period_s), *a)
            .map_err(|at_end| if at_end { Violation::Position { joint } } else { Violation::Velocity { joint } })
    }

    /// `Ok` when a stop from (q, v, a) stays inside range and speed limits; `Err(true)` when the position is the reason.
    ///
    /// Braking first takes the acceleration to the limit's negative (`reaction` seconds, at full jerk). Until then the
    /// speed stays below `peak` and the way below `peak * reaction`; from there on the speed falls faster than the
    /// position-dependent limit does.
    fn check_stoppable(&self, limits: &JointLimits, q: f64, v: f64, a: f64) -> Result<(), bool> {
        if q < limits.q_min || q > limits.q_max {
            return Err(true);
        }
        for direction in [1.0, -1.0] {
            let speeding = (direction * a).max(0.0);
            let peak = direction * v + speeding * speeding / (2.0 * limits.jerk);
            if peak <= 0.0 {
                continue;
            }
            let reaction = (speeding + limits.acceleration) / limits.jerk;
            let ahead = q + direction * (peak * (reaction + self.period_s) + END_MARGIN);
            if peak > limits.speed_towards(direction, ahead, limits.stopping()) {
                return Err(peak <= limits.speed_towards(direction, q, limits.deceleration));
            }
        }
        Ok(())
    }
}

fn point_before(last: &Trace, i: usize) -> f64 {
    last.q.get(i).copied().unwrap_or(f64::NAN)
}
