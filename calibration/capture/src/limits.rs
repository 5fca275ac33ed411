//! What a planned motion is held to: a share of what each joint of the arm may do. Units: rad, s, N m.

use super::body::Body;
use super::excess::{Excess, Quantity};
use super::rate::RATE;
use shared_mem::cell::Cell;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{JointLimits, JointState, Limits};

/// Share of each limit a motion may use; the rest is for the arm that does not follow exactly.
pub const LIMITS_SHARE: f64 = 0.9;

/// Limits of the cell's arm, joint by joint.
pub fn of(cell: &Cell, body: &Body) -> Vec<JointLimits> {
    Limits::of(cell, body.model()).counted().copied().collect()
}

/// The shipped cell's arm and its limits, for tests.
#[cfg(test)]
pub(crate) fn shipped() -> (Body, Vec<JointLimits>) {
    let text = include_str!("../../../config/fr3_cell.toml");
    let cell: Cell = shared_mem::toml_file::parse(text, "fr3_cell.toml".as_ref()).expect("the shipped file");
    let body = Body::of(&cell).expect("the shipped cell has an arm");
    let limits = of(&cell, &body);
    (body, limits)
}

/// The first limit that set points, one a control cycle, break; torque is asked of a body where there is one.
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
            let position = if limits.slides { Quantity::Travel } else { Quantity::Position };
            let checks = [
                (position, q, limits.q_max),
                (position, -q, -limits.q_min),
                (Quantity::Speed, dq, LIMITS_SHARE * fastest),
                (Quantity::Speed, -dq, -LIMITS_SHARE * slowest),
                (Quantity::Acceleration, ddq[joint].abs(), LIMITS_SHARE * limits.acceleration),
                (Quantity::Jerk, jerk.abs(), LIMITS_SHARE * limits.jerk),
                (Quantity::Torque, torque, LIMITS_SHARE * limits.torque),
            ];
            let broken = checks.into_iter().find(|(_, value, limit)| value > limit);
            broken.map(|(quantity, value, limit)| Excess { joint: Some(joint), quantity, value, limit })
        })
    })
}
