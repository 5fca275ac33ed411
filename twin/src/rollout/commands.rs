//! A recorded command series, laid out for the control loop.

use super::TICK_NS;
use crate::arm::{Joints, MAX_JOINTS};
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;

/// Commands over time. The newest one is held, as a robot holds it whose next packet is late.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandTrack {
    stamps_ns: Vec<u64>,
    q_d: Vec<Joints>,
    dq_d: Vec<Joints>,
}

impl CommandTrack {
    /// From a recorded series; `None` when it is empty.
    ///
    /// Desired velocities that were not logged are the difference to the command before: what a controller can do
    /// that is given positions alone.
    #[must_use]
    pub fn new(desired: &JointSeries) -> Option<Self> {
        if desired.is_empty() {
            return None;
        }
        let rows = 0..desired.len();
        let q_d: Vec<Joints> = rows.clone().map(|i| joints_from(desired.q_row(i))).collect();
        let stamps_ns = desired.stamps_ns.clone();
        let logged = rows.map(|i| desired.dq_row(i).map(joints_from)).collect::<Option<Vec<_>>>();
        let dq_d = logged.unwrap_or_else(|| differences(&stamps_ns, &q_d));
        Some(Self { stamps_ns, q_d, dq_d })
    }

    /// Row in force at the tick `now_ns`, searched from row `from` on, which must not be later.
    ///
    /// A command belongs to the tick nearest to its stamp: stamps of a 1 kHz log jitter around the ticks they belong
    /// to. Before the first command the first one holds.
    #[must_use]
    #[inline]
    pub fn in_force(&self, now_ns: u64, from: usize) -> usize {
        let mut row = from;
        while self.stamps_ns.get(row + 1).is_some_and(|stamp| *stamp <= now_ns + TICK_NS / 2) {
            row += 1;
        }
        row
    }

    /// Desired positions of a row [rad].
    #[must_use]
    #[inline]
    pub fn q_d(&self, row: usize) -> &Joints {
        &self.q_d[row]
    }

    /// Desired velocities of a row [rad/s].
    #[must_use]
    #[inline]
    pub fn dq_d(&self, row: usize) -> &Joints {
        &self.dq_d[row]
    }
}

fn differences(stamps_ns: &[u64], q: &[Joints]) -> Vec<Joints> {
    let mut out = vec![[0.0; MAX_JOINTS]; q.len()];
    for i in 1..q.len() {
        let dt = (stamps_ns[i] - stamps_ns[i - 1]) as f64 * 1e-9;
        out[i] = std::array::from_fn(|j| (q[i][j] - q[i - 1][j]) / dt);
    }
    out
}
