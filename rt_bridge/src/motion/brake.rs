//! From any admitted motion to rest, inside acceleration and jerk limits, each joint as fast as it can: the way that the
//! guard looked along when it admitted the motion.

use crate::safety::{Limits, Stopping, Trace};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::motion::SetPoint;

/// A stop in progress.
#[derive(Debug)]
pub struct Brake {
    way: Stopping,
    limits: Limits,
    period_s: f64,
    periods: u32,
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
    /// A brake for an arm with `limits`, at rest.
    pub fn new(limits: Limits, period_s: f64) -> Self {
        let way = Stopping::of(&Trace::at_rest([0.0; MAX_JOINTS]), &limits, period_s);
        Self { way, limits, period_s, periods: 0 }
    }

    /// Begins the stop of what moves as `trace`. Its numbers must be finite.
    pub fn begin(&mut self, trace: &Trace) {
        (self.way, self.periods) = (Stopping::of(trace, &self.limits, self.period_s), 0);
    }

    /// The next set point of the stop.
    pub fn step(&mut self) -> BrakeStep {
        self.periods = self.periods.saturating_add(1);
        let t = f64::from(self.periods) * self.period_s;
        let moment = self.way.at(t);
        // Two periods beyond the end, so that differences of the commanded positions have come to rest as well.
        let at_rest = t > self.way.duration() + 2.0 * self.period_s;
        BrakeStep { point: SetPoint { q_d: moment.q, dq_d: moment.dq }, at_rest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rsruckig::prelude::*;

    const T: f64 = 1e-3;

    /// The stop of one joint by a library that plans between any two states.
    fn planned(v: f64, a: f64, joint: &crate::safety::JointLimits) -> Trajectory<1> {
        let mut input = InputParameter::<1>::new(None);
        input.control_interface = ControlInterface::Velocity;
        (input.current_velocity[0], input.current_acceleration[0]) = (v, a);
        (input.max_velocity[0], input.max_acceleration[0], input.max_jerk[0]) = (1e3, joint.acceleration, joint.jerk);
        let (mut planner, mut plan) = (Ruckig::<1, IgnoreErrorHandler>::new(None, T), Trajectory::new(None));
        assert!(matches!(planner.calculate(&input, &mut plan), Ok(RuckigResult::Working)));
        plan
    }

    proptest! {
        #[test]
        fn each_joint_takes_the_fastest_way_to_rest(v in -5.0..5.0_f64, a in -10.0..10.0_f64) {
            let limits = Limits::fr3();
            let mut trace = Trace::at_rest([0.0; MAX_JOINTS]);
            (trace.v[2], trace.a[2]) = (v - 0.5 * T * a, a);
            let plan = planned(v, a, &limits.joints[2]);
            let mut brake = Brake::new(limits, T);
            brake.begin(&trace);
            let mut t = 0.0;
            loop {
                let step = brake.step();
                t += T;
                let (mut q, mut dq) = (DataArrayOrVec::Stack([0.0]), DataArrayOrVec::Stack([0.0]));
                plan.at_time(t, &mut Some(&mut q), &mut Some(&mut dq), &mut None, &mut None, &mut None);
                let (off, off_speed) = (step.point.q_d[2] - q[0], step.point.dq_d[2] - dq[0]);
                prop_assert!(off.abs() < 1e-9 && off_speed.abs() < 1e-9, "after {} s: {} and {}", t, off, off_speed);
                if step.at_rest {
                    break;
                }
            }
            prop_assert!(t < plan.get_duration() + 4.0 * T);
        }
    }
}
