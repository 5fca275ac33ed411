//! A recorded command series, laid out for the control loop.

use crate::arm::{Joints, MAX_JOINTS};
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;
use shared_mem::statistics::usual_step_ns;
use shared_mem::time::TICK_NS;

/// A log at most this far apart is the control loop's own: a missing row was lost on its way to the log, not to the
/// robot [ns].
const CONTROL_RATE_NS: u64 = 1_500_000;
/// So many usual steps without a command are a hole: what the robot was commanded in there cannot be guessed.
const HOLE_STEPS: u64 = 20;

/// Commands over time. The newest one is held, as a servo holds it between packets; single rows that a 1 kHz log lost
/// are filled in on the straight line between their neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandTrack {
    stamps_ns: Vec<u64>,
    q_d: Vec<Joints>,
    dq_d: Vec<Joints>,
    holes: Vec<Hole>,
}

/// A stretch without commands, from the last one before it to the first one behind it [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Stamp of the last command before it.
    pub from_ns: u64,
    /// Stamp of the first command behind it.
    pub to_ns: u64,
}

impl CommandTrack {
    /// From a recorded series; `None` when it is empty.
    ///
    /// Desired velocities that were not logged are the difference to the command before: what a controller can do
    /// that is given positions alone.
    pub fn new(desired: &JointSeries) -> Option<Self> {
        if desired.is_empty() {
            return None;
        }
        let rows = 0..desired.len();
        let q_d: Vec<Joints> = rows.clone().map(|i| joints_from(desired.q_row(i))).collect();
        let stamps_ns = desired.stamps_ns.clone();
        let logged = rows.map(|i| desired.dq_row(i).map(joints_from)).collect::<Option<Vec<_>>>();
        let dq_d = logged.unwrap_or_else(|| differences(&stamps_ns, &q_d));
        Some(Self { stamps_ns, q_d, dq_d, holes: Vec::new() }.filled())
    }

    /// Stretches too long to fill or to hold through.
    pub fn holes(&self) -> &[Hole] {
        &self.holes
    }

    fn filled(self) -> Self {
        let Some(usual) = usual_step_ns(&self.stamps_ns) else { return self };
        let mut out = Self { stamps_ns: Vec::new(), q_d: Vec::new(), dq_d: Vec::new(), holes: Vec::new() };
        for row in 0..self.stamps_ns.len() {
            out.push(self.stamps_ns[row], self.q_d[row], self.dq_d[row]);
            let Some(&next_ns) = self.stamps_ns.get(row + 1) else { break };
            let from_ns = self.stamps_ns[row];
            let step = next_ns - from_ns;
            if step > HOLE_STEPS * usual {
                out.holes.push(Hole { from_ns, to_ns: next_ns });
            } else if usual <= CONTROL_RATE_NS {
                let missing = (step + usual / 2) / usual;
                for k in 1..missing {
                    let share = k as f64 / missing as f64;
                    let blend = |a: &Joints, b: &Joints| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share);
                    let stamp_ns = from_ns + step * k / missing;
                    let (q_d, dq_d) =
                        (blend(&self.q_d[row], &self.q_d[row + 1]), blend(&self.dq_d[row], &self.dq_d[row + 1]));
                    out.push(stamp_ns, q_d, dq_d);
                }
            }
        }
        out
    }

    fn push(&mut self, stamp_ns: u64, q_d: Joints, dq_d: Joints) {
        self.stamps_ns.push(stamp_ns);
        self.q_d.push(q_d);
        self.dq_d.push(dq_d);
    }

    /// Row in force at the tick `now_ns`, searched from row `from` on, which must not be later.
    ///
    /// A command belongs to the tick nearest to its stamp: stamps of a 1 kHz log jitter around the ticks they belong
    /// to. Before the first command the first one holds.
    #[inline]
    pub fn in_force(&self, now_ns: u64, from: usize) -> usize {
        let mut row = from;
        while self.stamps_ns.get(row + 1).is_some_and(|stamp| *stamp <= now_ns + TICK_NS / 2) {
            row += 1;
        }
        row
    }

    /// [`CommandTrack::in_force`] without knowing where to begin.
    pub fn at(&self, now_ns: u64) -> usize {
        self.stamps_ns.partition_point(|stamp| *stamp <= now_ns + TICK_NS / 2).saturating_sub(1)
    }

    /// Desired positions of a row [rad].
    #[inline]
    pub fn q_d(&self, row: usize) -> &Joints {
        &self.q_d[row]
    }

    /// Desired velocities of a row [rad/s].
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

#[cfg(test)]
mod tests {
    use super::*;

    fn track(stamps_ms: &[u64]) -> CommandTrack {
        let stamps_ns: Vec<u64> = stamps_ms.iter().map(|ms| 5_000_000_000 + ms * TICK_NS).collect();
        let q = stamps_ms.iter().map(|ms| *ms as f64).collect();
        CommandTrack::new(&JointSeries { stamps_ns, dof: 1, q, ..JointSeries::default() }).expect("rows")
    }

    fn in_force(track: &CommandTrack, at_us: u64) -> f64 {
        track.q_d(track.in_force(5_000_000_000 + at_us * 1000, 0))[0]
    }

    #[test]
    fn the_newest_command_is_held() {
        let slow = track(&[0, 20, 40, 60]);
        assert_eq!([0, 19_000, 20_000, 39_000, 500_000].map(|us| in_force(&slow, us)), [0.0, 0.0, 20.0, 20.0, 60.0]);
        assert_eq!(slow.holes(), []);
    }

    #[test]
    fn a_command_acts_from_the_tick_nearest_to_its_stamp() {
        let track = track(&[0, 1, 2, 3]);
        assert_eq!([600, 1_400, 1_600].map(|us| in_force(&track, us)), [1.0, 1.0, 2.0]);
    }

    #[test]
    fn searching_from_anywhere_finds_the_same_row() {
        let track = track(&[0, 1, 2, 6, 7, 8, 108, 109]);
        for at_ns in (4_999_000_000u64..5_111_000_000).step_by(250_000) {
            assert_eq!(track.at(at_ns), track.in_force(at_ns, 0));
        }
    }

    #[test]
    fn velocities_that_were_not_logged_are_differences() {
        let track = track(&[0, 2, 4]);
        assert_eq!([0, 1, 2].map(|row| track.dq_d(row)[0]), [0.0, 1000.0, 1000.0]);
    }

    #[test]
    fn rows_that_a_control_log_lost_are_filled_and_long_holes_are_told() {
        let track = track(&[0, 1, 2, 6, 7, 8, 108, 109]);
        assert_eq!([3_000, 4_000, 5_000, 50_000].map(|us| in_force(&track, us)), [3.0, 4.0, 5.0, 8.0]);
        let [Hole { from_ns, to_ns }] = *track.holes() else { panic!("{:?}", track.holes()) };
        assert_eq!((from_ns, to_ns), (5_008_000_000, 5_108_000_000));
    }
}
