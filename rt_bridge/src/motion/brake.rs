//! From any admitted motion to rest, inside acceleration and jerk limits, each joint as fast as it can.
//!
//! Planned once by `rsruckig` (velocity interface, target 0), then sampled each cycle. Should planning fail, the arm is
//! slowed by a constant deceleration instead: rougher, but it stops.

use crate::safety::{Limits, Trace};
use rsruckig::prelude::*;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};

/// A stop in progress. Holds its planner: made once, before the loop, because that allocates.
#[derive(Debug)]
pub struct Brake {
    planner: Ruckig<MAX_JOINTS, IgnoreErrorHandler>,
    input: InputParameter<MAX_JOINTS>,
    plan: Trajectory<MAX_JOINTS>,
    limits: Limits,
    period_s: f64,
    elapsed_s: f64,
    planned: bool,
    last: SetPoint,
}

/// One cycle of a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrakeStep {
    /// What to command.
    pub point: SetPoint,
    /// `true` when the arm is at rest with this point.
    pub at_rest: bool,
}

impl Brake {
    /// A brake for an arm with `limits`. Allocates.
    #[must_use]
    pub fn new(limits: Limits, period_s: f64) -> Self {
        let mut input = InputParameter::new(None);
        input.control_interface = ControlInterface::Velocity;
        input.synchronization = Synchronization::None;
        for (i, joint) in limits.joints.iter().enumerate() {
            input.max_acceleration[i] = joint.acceleration;
            input.max_jerk[i] = joint.jerk;
            input.max_velocity[i] = 1e3; // not used by the velocity interface, but validated
        }
        Self {
            planner: Ruckig::new(None, period_s),
            input,
            plan: Trajectory::new(None),
            limits,
            period_s,
            elapsed_s: 0.0,
            planned: false,
            last: SetPoint::default(),
        }
    }

    /// Plans the stop of what moves as `trace`. Its numbers must be finite.
    pub fn begin(&mut self, trace: &Trace) {
        self.elapsed_s = 0.0;
        self.last = SetPoint { q_d: trace.q, dq_d: [0.0; MAX_JOINTS] };
        for (i, joint) in self.limits.joints.iter().enumerate().take(self.limits.dof) {
            let velocity = trace.velocity_now(i, self.period_s);
            self.input.current_position[i] = trace.q[i];
            self.input.current_velocity[i] = velocity;
            self.input.current_acceleration[i] = trace.a[i].clamp(-joint.acceleration, joint.acceleration);
            self.last.dq_d[i] = velocity;
        }
        self.planned = matches!(self.planner.calculate(&self.input, &mut self.plan), Ok(RuckigResult::Working));
    }

    /// The next set point of the stop.
    pub fn step(&mut self) -> BrakeStep {
        if self.planned {
            self.elapsed_s += self.period_s;
            if let Some(step) = self.sample() {
                self.last = step.point;
                return step;
            }
            self.planned = false;
        }
        self.ramp()
    }

    /// The plan at the present moment; `None` when its numbers are not finite.
    fn sample(&self) -> Option<BrakeStep> {
        let mut q = DataArrayOrVec::Stack([0.0; MAX_JOINTS]);
        let mut v = DataArrayOrVec::Stack([0.0; MAX_JOINTS]);
        self.plan.at_time(self.elapsed_s, &mut Some(&mut q), &mut Some(&mut v), &mut None, &mut None, &mut None);
        let mut point = SetPoint::default();
        for i in 0..self.limits.dof {
            point.q_d[i] = *q.get(i)?;
            point.dq_d[i] = *v.get(i)?;
        }
        let finite = |values: &Joints| values.iter().all(|x| x.is_finite());
        // Two periods beyond the plan's end, so that differences of the commanded positions have come to rest as well.
        let at_rest = self.elapsed_s > self.plan.get_duration() + 2.0 * self.period_s;
        if at_rest {
            point.dq_d = [0.0; MAX_JOINTS];
        }
        (finite(&point.q_d) && finite(&point.dq_d)).then_some(BrakeStep { point, at_rest })
    }

    /// Constant deceleration from the last set point.
    fn ramp(&mut self) -> BrakeStep {
        let mut at_rest = true;
        for (i, joint) in self.limits.joints.iter().enumerate().take(self.limits.dof) {
            let before = self.last.dq_d[i];
            let change = joint.acceleration * self.period_s;
            let after = before - before.clamp(-change, change);
            self.last.dq_d[i] = after;
            self.last.q_d[i] += 0.5 * (before + after) * self.period_s;
            at_rest &= before == 0.0;
        }
        BrakeStep { point: self.last, at_rest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_plan_the_ramp_stops_within_the_acceleration_limit() {
        let mut brake = Brake::new(Limits::fr3(), 1e-3);
        let trace = Trace { v: [0.7; MAX_JOINTS], ..Trace::at_rest([0.1; MAX_JOINTS]) };
        brake.begin(&trace);
        brake.planned = false;
        let mut last = 0.7;
        for _ in 0..200 {
            let step = brake.step();
            assert!((step.point.dq_d[3] - last).abs() <= 10.0 * 1e-3 + 1e-12);
            last = step.point.dq_d[3];
            if step.at_rest {
                // v² / 2a = 24.5 mm of angle
                assert!((step.point.q_d[3] - 0.1 - 0.0245).abs() < 1e-9);
                return;
            }
        }
        panic!("still moving after 0.2 s");
    }
}
