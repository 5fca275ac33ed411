//! What each joint of the arm may do: position, speed, acceleration, jerk and torque. Units: rad, s, N m.
//!
//! Called by the planner. Ranges, speeds and torques are the arm model's; here is what only the vendor of the FR3 says:
//! the speed limit falls towards the stops, so that the arm can always be braked before it reaches one.

use super::body::Body;
use super::excess::{Excess, Quantity};
use super::plan::RATE;
use shared_mem::cell::Cell;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::JointState;

/// Share of each limit a motion may use; the rest is for the arm that does not follow exactly.
pub const SHARE: f64 = 0.9;

/// Acceleration of every joint of an FR3, also taken where nothing is known [rad/s²].
const ACCELERATION: f64 = 10.0;
/// Jerk of every joint of an FR3, also taken where nothing is known [rad/s³].
const JERK: f64 = 5000.0;
/// FR3, specification page for system images from 5.9 on: speed offset [rad/s] and deceleration [rad/s²] by joint.
const FR3_BRAKING: [[f64; 2]; 7] =
    [[0.6599, 6.0], [0.2517, 2.585], [0.2000, 3.5], [0.3533, 4.0], [0.5757, 17.0], [0.4878, 5.5], [0.4628, 17.0]];

/// Limits of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Lower stop [rad].
    pub q_min: f64,
    /// Upper stop [rad].
    pub q_max: f64,
    /// Fastest anywhere [rad/s].
    pub dq_max: f64,
    /// How far the allowed speed stays below the speed that can just be braked [rad/s].
    pub dq_offset: f64,
    /// Deceleration the speed limit near a stop reckons with [rad/s²].
    pub deceleration: f64,
    /// Largest acceleration [rad/s²].
    pub ddq_max: f64,
    /// Largest jerk [rad/s³].
    pub dddq_max: f64,
    /// Largest torque at the joint, gravity included [N m].
    pub tau_max: f64,
}

impl JointLimits {
    /// Slowest (most negative) and fastest allowed speed at position `q` [rad/s].
    ///
    /// `upper(q) = min(dq_max, max(0, sqrt(2 deceleration (q_max - q)) - dq_offset))`; the lower bound mirrors it.
    #[must_use]
    pub fn speed_bounds(&self, q: f64) -> [f64; 2] {
        let brakeable =
            |room: f64| ((2.0 * self.deceleration * room.max(0.0)).sqrt() - self.dq_offset).clamp(0.0, self.dq_max);
        [-brakeable(q - self.q_min), brakeable(self.q_max - q)]
    }
}

/// Limits of the cell's arm, joint by joint.
#[must_use]
pub fn of(cell: &Cell, body: &Body) -> Vec<JointLimits> {
    let is_fr3 = cell.robot.as_ref().is_some_and(|robot| robot.model.as_deref() == Some("fr3"));
    let model = body.model();
    (0..model.dof())
        .map(|joint| {
            let [dq_offset, deceleration] = if is_fr3 { FR3_BRAKING[joint] } else { [0.0, ACCELERATION] };
            JointLimits {
                q_min: model.q_min()[joint],
                q_max: model.q_max()[joint],
                dq_max: model.velocity_limit()[joint],
                dq_offset,
                deceleration,
                ddq_max: ACCELERATION,
                dddq_max: JERK,
                tau_max: model.torque_limit()[joint],
            }
        })
        .collect()
}

/// The first limit that set points, one a control cycle, break; torque is asked of a body where there is one.
#[must_use]
pub fn first_excess(points: &[SetPoint], limits: &[JointLimits], body: Option<&Body>) -> Option<Excess> {
    points.windows(3).find_map(|w| {
        let [before, now, after] = [&w[0], &w[1], &w[2]];
        let ddq: Joints = std::array::from_fn(|i| 0.5 * RATE * (after.dq_d[i] - before.dq_d[i]));
        let tau = body.map(|body| body.torque(&JointState { q: now.q_d, dq: now.dq_d }, &ddq));
        (0..limits.len().min(MAX_JOINTS)).find_map(|joint| {
            let (limits, q, dq) = (&limits[joint], now.q_d[joint], now.dq_d[joint]);
            let jerk = RATE * RATE * (after.dq_d[joint] - 2.0 * dq + before.dq_d[joint]);
            let [slowest, fastest] = limits.speed_bounds(q);
            let torque = tau.map_or(0.0, |tau| tau[joint].abs());
            let checks = [
                (Quantity::Position, q, limits.q_max),
                (Quantity::Position, -q, -limits.q_min),
                (Quantity::Speed, dq, SHARE * fastest),
                (Quantity::Speed, -dq, -SHARE * slowest),
                (Quantity::Acceleration, ddq[joint].abs(), SHARE * limits.ddq_max),
                (Quantity::Jerk, jerk.abs(), SHARE * limits.dddq_max),
                (Quantity::Torque, torque, SHARE * limits.tau_max),
            ];
            let broken = checks.into_iter().find(|(_, value, limit)| value > limit);
            broken.map(|(quantity, value, limit)| Excess { joint: Some(joint), quantity, value, limit })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::Robot;

    #[test]
    fn speed_is_free_in_the_middle_and_nought_at_the_stops() {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let limits = of(&cell, &Body::of(&cell).expect("an FR3"));
        assert_eq!(limits.len(), 7);
        for limits in limits {
            let [_, at_stop] = limits.speed_bounds(limits.q_max);
            let [at_other_stop, _] = limits.speed_bounds(limits.q_min);
            let [lo, hi] = limits.speed_bounds(0.5 * (limits.q_min + limits.q_max));
            assert_eq!((at_stop, at_other_stop.abs()), (0.0, 0.0));
            assert!(hi > 1.0 && (hi + lo).abs() < 1e-12);
        }
    }

    #[test]
    fn an_arm_of_which_only_names_are_known_has_finite_acceleration_and_no_stops() {
        let cell = Cell { robot: Some(Robot { joints: vec!["pan".into()], ..Robot::default() }), ..Cell::default() };
        let [limits] = of(&cell, &Body::of(&cell).expect("one joint"))[..] else { panic!("one joint") };
        assert_eq!(limits.speed_bounds(1.0), [f64::NEG_INFINITY, f64::INFINITY]);
        assert!(limits.ddq_max.is_finite());
    }
}
