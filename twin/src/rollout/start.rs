//! The state an arm was in when its recording begins, from noisy rows.

use crate::arm::JointState;
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;

/// Rows within this time of the first one count [ns]: long enough to average noise, short against a joint's response.
const WINDOW_NS: u64 = 20_000_000;

/// Position of the first row; velocity at it by a straight line through the velocities of the first 20 ms, or through
/// the positions where no velocities were logged. `None` when the series is empty.
#[must_use]
pub fn start_state(measured: &JointSeries) -> Option<JointState> {
    let first = *measured.stamps_ns.first()?;
    let rows = measured.stamps_ns.iter().take_while(|stamp| **stamp - first <= WINDOW_NS).count();
    let seconds = |i: usize| (measured.stamps_ns[i] - first) as f64 * 1e-9;
    let mut state = JointState::at_rest(joints_from(measured.q_row(0)));
    for (joint, dq) in state.dq.iter_mut().enumerate().take(measured.dof) {
        let logged = (0..rows).map(|i| measured.dq_row(i).map(|row| (seconds(i), row[joint])));
        *dq = match logged.collect::<Option<Vec<_>>>() {
            Some(velocities) => line(&velocities).0,
            None => {
                line(
                    &(0..rows.max(2).min(measured.len()))
                        .map(|i| (seconds(i), measured.q_row(i)[joint]))
                        .collect::<Vec<_>>(),
                )
                .1
            }
        };
    }
    Some(state)
}

/// Value at 0 and slope of the straight line through points `(t, y)`; slope 0 through a single one.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (t, y) = points.iter().fold((0.0, 0.0), |(t, y), p| (t + p.0 / n, y + p.1 / n));
    let (tt, ty) = points.iter().fold((0.0, 0.0), |(tt, ty), p| (tt + (p.0 - t).powi(2), ty + (p.0 - t) * (p.1 - y)));
    let slope = if tt > 0.0 { ty / tt } else { 0.0 };
    (y - slope * t, slope)
}
