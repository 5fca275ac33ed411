//! The state an arm was in when its recording begins, from noisy rows.

use super::{ArmRollout, CommandTrack};
use crate::arm::{JointState, MAX_JOINTS};
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;

/// Rows within this time of the first one count [ns]: long enough to average noise, short against a joint's response.
const WINDOW_NS: u64 = 20_000_000;
/// With fewer rows in the window a resolver's steps would pass for velocity, and the logged velocity is better.
const ENOUGH_ROWS: usize = 10;
/// Each pass corrects the start by what the pass before left over; three leave less than 1e-7 rad.
const PASSES: usize = 3;

impl ArmRollout<'_> {
    /// Where the arm was and how fast at row `from` of `measured`; `None` when there is no such row.
    ///
    /// A first guess, the row itself, is simulated for 20 ms; the straight line through what the measurement is ahead of
    /// the simulation corrects position and velocity. So a motion that sets off within these 20 ms does not pass for
    /// initial velocity.
    #[must_use]
    pub fn start_state(&self, measured: &JointSeries, from: usize, commands: &CommandTrack) -> Option<JointState> {
        let first = *measured.stamps_ns.get(from)?;
        let rows = measured.stamps_ns[from..].iter().take_while(|stamp| **stamp - first <= WINDOW_NS).count();
        let stamps_ns = &measured.stamps_ns[from..from + rows];
        let mut start = first_guess(measured, from);
        if rows < ENOUGH_ROWS {
            return Some(start);
        }
        let mut simulated = vec![JointState::default(); rows];
        for _ in 0..PASSES {
            self.run(&start, first, commands, stamps_ns, &mut simulated);
            for joint in 0..measured.dof.min(MAX_JOINTS) {
                let ahead = simulated.iter().zip(stamps_ns).enumerate().map(|(row, (state, stamp))| {
                    ((stamp - first) as f64 * 1e-9, measured.q_row(from + row)[joint] - state.q[joint])
                });
                let (position, velocity) = line(&ahead.collect::<Vec<_>>());
                start.q[joint] += position;
                start.dq[joint] += velocity;
            }
        }
        Some(start)
    }
}

/// The row itself; where no velocities were logged, the slope to the next one.
fn first_guess(measured: &JointSeries, from: usize) -> JointState {
    let mut state = JointState::at_rest(joints_from(measured.q_row(from)));
    if let Some(dq) = measured.dq_row(from) {
        state.dq = joints_from(dq);
    } else if let [a, b, ..] = measured.stamps_ns[from..] {
        let dt = (b - a) as f64 * 1e-9;
        for (joint, dq) in state.dq.iter_mut().enumerate().take(measured.dof) {
            *dq = (measured.q_row(from + 1)[joint] - measured.q_row(from)[joint]) / dt;
        }
    }
    state
}

/// Value at 0 and slope of the straight line through points `(t, y)`; slope 0 through a single one.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (t, y) = points.iter().fold((0.0, 0.0), |(t, y), p| (t + p.0 / n, y + p.1 / n));
    let (tt, ty) = points.iter().fold((0.0, 0.0), |(tt, ty), p| (tt + (p.0 - t).powi(2), ty + (p.0 - t) * (p.1 - y)));
    let slope = if tt > 0.0 { ty / tt } else { 0.0 };
    (y - slope * t, slope)
}
