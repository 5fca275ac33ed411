//! A recorded command series, laid out for the control loop.

use crate::arm::{Joints, MAX_JOINTS};
use shared_mem::cell::{BetweenCommands, Cell};
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;
use shared_mem::statistics::usual_step_ns;
use shared_mem::time::TICK_NS;

/// A log at most this far apart is the control loop's own: a missing row was lost on its way to the log, not to the
/// robot [ns].
const CONTROL_RATE_NS: u64 = 1_500_000;
/// Between rows of a slow log that are further apart nothing is filled in [ns] (a choice: within a second a command goes anywhere): where
/// stamps lie by hours, what is filled in would not fit into the memory.
const LONGEST_FILLED_NS: u64 = 1_000_000_000;
/// Rows further away than so many steps between two others say nothing of what lies between those [1]: a choice.
const FAR_ROWS: f64 = 3.0;
/// So many usual steps without a command are a hole: what the robot was commanded in there cannot be guessed.
const HOLE_STEPS: u64 = 20;

/// Commands over time. The newest one is held, as a servo holds it between packets, unless it is said that they went on between the
/// rows of a slower log; single rows that a 1 kHz log lost are filled in on the straight line between their neighbours.
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
        Self::going_on(desired, BetweenCommands::Held)
    }

    /// The same for the controller of a cell, which may be given more than the rows of a slow log.
    pub fn of_cell(desired: &JointSeries, cell: &Cell) -> Option<Self> {
        Self::going_on(desired, cell.controller.as_ref().map_or_else(Default::default, |law| law.between_commands))
    }

    fn going_on(desired: &JointSeries, between: BetweenCommands) -> Option<Self> {
        if desired.is_empty() {
            return None;
        }
        let rows = 0..desired.len();
        let q_d: Vec<Joints> = rows.clone().map(|i| joints_from(desired.q_row(i))).collect();
        let stamps_ns = desired.stamps_ns.clone();
        let logged = rows.map(|i| desired.dq_row(i).map(joints_from)).collect::<Option<Vec<_>>>();
        let known = logged.is_some();
        let dq_d = logged.unwrap_or_else(|| differences(&stamps_ns, &q_d));
        let mut track = Self { stamps_ns, q_d, dq_d, holes: Vec::new() }.filled(between);
        if !known && is_slow(&desired.stamps_ns) && goes_on(between) {
            track.dq_d = differences(&track.stamps_ns, &track.q_d);
        }
        Some(track)
    }

    /// Whether a log of commands leaves open what a controller at 1 kHz was given between its rows.
    pub fn is_open_between(desired: &JointSeries) -> bool {
        usual_step_ns(&desired.stamps_ns)
            .is_some_and(|usual| (CONTROL_RATE_NS + 1..=LONGEST_FILLED_NS).contains(&usual))
    }

    /// Stretches too long to fill or to hold through.
    pub fn holes(&self) -> &[Hole] {
        &self.holes
    }

    fn filled(self, between: BetweenCommands) -> Self {
        let Some(usual) = usual_step_ns(&self.stamps_ns) else { return self };
        let slow = is_slow(&self.stamps_ns);
        let mut out = Self { stamps_ns: Vec::new(), q_d: Vec::new(), dq_d: Vec::new(), holes: Vec::new() };
        for row in 0..self.stamps_ns.len() {
            out.push(self.stamps_ns[row], self.q_d[row], self.dq_d[row]);
            let Some(&next_ns) = self.stamps_ns.get(row + 1) else { break };
            let from_ns = self.stamps_ns[row];
            let step = next_ns - from_ns;
            if step > HOLE_STEPS * usual || slow && goes_on(between) && step > LONGEST_FILLED_NS {
                out.holes.push(Hole { from_ns, to_ns: next_ns });
            } else if !slow || goes_on(between) {
                let apart = if slow { TICK_NS } else { usual };
                let missing = (step + apart / 2) / apart;
                for k in 1..missing {
                    let shares = if slow && between == BetweenCommands::Smooth {
                        self.cubic(row, k as f64 / missing as f64)
                    } else {
                        [0.0, 1.0 - k as f64 / missing as f64, k as f64 / missing as f64, 0.0]
                    };
                    out.push(
                        from_ns + step * k / missing,
                        self.mixed(&self.q_d, row, shares),
                        self.mixed(&self.dq_d, row, shares),
                    );
                }
            }
        }
        out
    }

    /// Shares of the rows `row - 1` to `row + 2` in the cubic through them, at a share of the step from `row` to the next (Lagrange);
    /// the straight line at either end and beside a hole.
    fn cubic(&self, row: usize, share: f64) -> [f64; 4] {
        let stamp = |row: usize| self.stamps_ns.get(row).copied();
        let steps = [row.checked_sub(1).and_then(stamp), stamp(row), stamp(row + 1), stamp(row + 2)];
        let line = [0.0, 1.0 - share, share, 0.0];
        let [Some(before_ns), Some(from_ns), Some(to_ns), Some(after_ns)] = steps else { return line };
        let step = (to_ns - from_ns) as f64;
        if (from_ns - before_ns).max(after_ns - to_ns) as f64 > FAR_ROWS * step {
            return line;
        }
        let at = [-((from_ns - before_ns) as f64) / step, 0.0, 1.0, 1.0 + (after_ns - to_ns) as f64 / step];
        std::array::from_fn(|i| {
            let others = (0..at.len()).filter(|j| *j != i);
            others.map(|j| (share - at[j]) / (at[i] - at[j])).product()
        })
    }

    /// Values of the rows `row - 1` to `row + 2` in these shares; a row that has none need not be there.
    fn mixed(&self, values: &[Joints], row: usize, shares: [f64; 4]) -> Joints {
        let near = (0..shares.len()).filter(|k| shares[*k] != 0.0).map(|k| (shares[k], &values[row + k - 1]));
        near.fold([0.0; MAX_JOINTS], |sum, (share, value)| std::array::from_fn(|i| sum[i] + share * value[i]))
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

/// Whether a log has fewer rows than the control loop has periods.
fn is_slow(stamps_ns: &[u64]) -> bool {
    usual_step_ns(stamps_ns).is_some_and(|usual| usual > CONTROL_RATE_NS)
}

fn goes_on(between: BetweenCommands) -> bool {
    matches!(between, BetweenCommands::Line | BetweenCommands::Smooth)
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
    fn commands_of_a_slow_log_go_on_between_its_rows_where_that_is_said() {
        let ms = [0, 4, 8, 12, 16];
        let stamps_ns: Vec<u64> = ms.iter().map(|ms| 5_000_000_000 + ms * TICK_NS).collect();
        let cube = |ms: f64| 1e-3 * ms.powi(3);
        let q: Vec<f64> = ms.iter().map(|ms| cube(*ms as f64)).collect();
        let desired = JointSeries { stamps_ns, dof: 1, dq: q.clone(), q, ..JointSeries::default() };
        let at = |between, us| in_force(&CommandTrack::going_on(&desired, between).expect("rows"), us);
        for (ms, held) in [(4.0, 4.0), (5.0, 4.0), (7.0, 4.0), (8.0, 8.0), (11.0, 8.0)] {
            let us = (ms * 1e3) as u64;
            let line = cube(held) + (cube(held + 4.0) - cube(held)) * (ms - held) / 4.0;
            assert_eq!(at(BetweenCommands::Held, us), cube(held));
            assert!((at(BetweenCommands::Line, us) - line).abs() < 1e-12);
            assert!((at(BetweenCommands::Smooth, us) - cube(ms)).abs() < 1e-12, "{ms}");
        }
        // Velocities that were not logged are the slope of what was filled in.
        let bare = CommandTrack::going_on(&JointSeries { dq: Vec::new(), ..desired.clone() }, BetweenCommands::Line);
        let bare = bare.expect("rows");
        assert!((bare.dq_d(6)[0] - 1e3 * (cube(8.0) - cube(4.0)) / 4.0).abs() < 1e-6);
        // Stamps that are hours apart are no log of a control loop: nothing is filled in.
        let hours = JointSeries { stamps_ns: ms.iter().map(|ms| ms * 3_600_000_000_000).collect(), ..desired.clone() };
        let track = CommandTrack::going_on(&hours, BetweenCommands::Line).expect("rows");
        assert_eq!((track.stamps_ns.len(), track.holes().len()), (5, 4));
        assert!(CommandTrack::is_open_between(&desired) && !CommandTrack::is_open_between(&hours));
        // A log of the control loop itself leaves nothing open.
        let fast = JointSeries { stamps_ns: desired.stamps_ns.iter().map(|ns| ns / 4).collect(), ..desired };
        assert_eq!(CommandTrack::going_on(&fast, BetweenCommands::Smooth), CommandTrack::new(&fast));
    }

    #[test]
    fn rows_that_a_control_log_lost_are_filled_and_long_holes_are_told() {
        let track = track(&[0, 1, 2, 6, 7, 8, 108, 109]);
        assert_eq!([3_000, 4_000, 5_000, 50_000].map(|us| in_force(&track, us)), [3.0, 4.0, 5.0, 8.0]);
        let [Hole { from_ns, to_ns }] = *track.holes() else { panic!("{:?}", track.holes()) };
        assert_eq!((from_ns, to_ns), (5_008_000_000, 5_108_000_000));
    }
}
