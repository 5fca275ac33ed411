//! A joint's logged velocity beside the slope of its position: another unit, or a filter that makes it late.
//!
//! Over windows the integral of dq is held against the way of q: `integral of dq = a (q_b - q_a) - delay (dq_b - dq_a)`. Of a
//! velocity that is the slope of q the factor is 1 and the delay 0; a low pass of time constant T has the delay T.

use super::noise;
use crate::estimate::plane::{Slope, plane};
use crate::statistics::{extent, median};
use shared_mem::recording::JointSeries;
use shared_mem::time::seconds_between;

/// Motion must exceed the noise of a channel so many times before a ratio is formed from it [1]: the error of the ratio is then
/// below 5 %.
pub const MOTION_OVER_NOISE: f64 = 20.0;
/// A joint moves when it leaves its mean by this, one sigma over the clip [rad].
pub const LEAST_MOTION: f64 = 1e-3;
/// Velocities are compared with slopes over windows of so many rows, and at least of this length [s]: long enough that the
/// noise of two positions is small beside the way between them, short beside the motions of an arm (below 10 Hz).
const WINDOW_ROWS: usize = 8;
const WINDOW: f64 = 0.04;
/// A velocity that comes later than the slope by more than so many steps of its log [1] and by more than this [s] was
/// filtered. Half a step is what a difference of two rows is late by, a whole one what a log that is written before the
/// state is updated adds.
const FILTER_STEPS: f64 = 1.6;
const FILTER_DELAY: f64 = 2.5e-3;

/// A slope this far from 1 is none of the same quantity [1]: filters and noise stay within a tenth, conversions begin at 2 pi.
pub const NOT_ITS_SLOPE: f64 = 0.5;

/// One joint of a log.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// [s]
    pub t: &'a [f64],
    /// Positions [rad].
    pub q: &'a [f64],
    /// Velocities as logged [rad/s].
    pub dq: &'a [f64],
    /// One sigma of the positions' noise [rad].
    pub noise: f64,
}

/// A joint's velocity beside its slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// The joint, from 0.
    pub joint: usize,
    /// How many times the slope it is [1].
    pub factor: Slope,
    /// How much later it comes [s].
    pub delay: Slope,
}

/// Velocities that were filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Late {
    /// How much later than the slopes they come, the middle of the joints [s].
    pub delay: f64,
    /// The least and the most of any joint [s].
    pub interval: [f64; 2],
}

impl Motion<'_> {
    /// The comparison; `None` for a joint that does not move enough to compare.
    pub fn compared(&self, joint: usize) -> Option<Compared> {
        let Self { t, q, dq, noise } = *self;
        let rows = WINDOW_ROWS.max((WINDOW / step(t).max(1e-12)).round() as usize).min(t.len() / 4);
        if rows < 2 {
            return None;
        }
        let ends = (0..t.len() - rows).step_by(rows).map(|from| (from, from + rows));
        let window = |(a, b): (usize, usize)| {
            let way = (a..b).map(|i| 0.5 * (dq[i] + dq[i + 1]) * (t[i + 1] - t[i])).sum::<f64>();
            [q[b] - q[a], dq[a] - dq[b], way]
        };
        let windows: Vec<[f64; 3]> = ends.map(window).collect();
        let moved = (windows.iter().map(|w| w[0] * w[0]).sum::<f64>() / windows.len().max(1) as f64).sqrt();
        if moved <= MOTION_OVER_NOISE * noise || spread(q) < LEAST_MOTION {
            return None;
        }
        // Windows at rest agree with any factor.
        let moving: Vec<[f64; 3]> = windows.into_iter().filter(|window| window[0].abs() > 0.1 * moved).collect();
        let [factor, delay] = plane(&moving)?;
        Some(Compared { joint, factor, delay })
    }
}

/// Whether most joints' velocities come so late that they were filtered; `step`: of the log [s].
pub fn late(joints: &[Compared], step: f64) -> Option<Late> {
    let delays: Vec<f64> = joints.iter().map(|c| c.delay.value).collect();
    let interval = extent(delays.iter().copied());
    let delay = median(delays)?;
    let sure = |c: &&Compared| c.delay.value - 2.0 * c.delay.sigma > 0.5 * FILTER_DELAY;
    let most = joints.iter().filter(sure).count() * 3 >= joints.len() * 2;
    (most && delay > FILTER_DELAY.max(FILTER_STEPS * step)).then_some(Late { delay, interval })
}

/// The same of a log.
pub(super) fn late_in(log: &JointSeries) -> Option<Late> {
    late(&compared_in(log), step(&seconds(log)))
}

/// Whether the velocities of a log, joint by joint, are no slopes of its positions: of another unit, scale or joint.
pub(super) fn contradict_positions(log: &JointSeries) -> bool {
    compared_in(log).iter().any(Compared::is_not_its_slope)
}

impl Compared {
    /// Whether the velocity is no slope of this joint's position.
    pub fn is_not_its_slope(&self) -> bool {
        (self.factor.value - 1.0).abs() > NOT_ITS_SLOPE.max(5.0 * self.factor.sigma)
    }
}

/// Every joint of a log that moves enough to compare.
fn compared_in(log: &JointSeries) -> Vec<Compared> {
    if log.dq.is_empty() {
        return Vec::new();
    }
    let t = seconds(log);
    let column = |values: &[f64], joint: usize| values.iter().skip(joint).step_by(log.dof).copied().collect::<Vec<_>>();
    let of = |joint: usize| {
        let (q, dq) = (column(&log.q, joint), column(&log.dq, joint));
        Motion { t: &t, q: &q, dq: &dq, noise: noise::sigma(&q) }.compared(joint)
    };
    (0..log.dof).filter_map(of).collect()
}

fn seconds(log: &JointSeries) -> Vec<f64> {
    let first = log.stamps_ns.first().copied().unwrap_or_default();
    log.stamps_ns.iter().map(|stamp| seconds_between(first, *stamp)).collect()
}

fn step(t: &[f64]) -> f64 {
    median(t.windows(2).map(|w| w[1] - w[0])).unwrap_or(0.0)
}

/// One sigma about the mean.
fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (squares / values.len().saturating_sub(1).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that swings at 1.3 Hz, logged at `rate` [Hz] with velocities that come `delay` later [s].
    fn log(rate: f64, delay: f64) -> JointSeries {
        let (w, rows) = (8.0, (6.0 * rate) as usize);
        let time = |row: usize| row as f64 / rate;
        JointSeries {
            dof: 1,
            stamps_ns: (0..rows).map(|row| (time(row) * 1e9) as u64).collect(),
            q: (0..rows).map(|row| 0.4 * (w * time(row)).sin()).collect(),
            dq: (0..rows).map(|row| 0.4 * w * (w * (time(row) - delay)).cos()).collect(),
            tau: Vec::new(),
        }
    }

    #[test]
    fn a_filtered_velocity_is_late_by_its_delay_and_a_slope_is_not() {
        for rate in [200.0, 1000.0] {
            assert_eq!(late_in(&log(rate, 0.0)), None);
            let found = late_in(&log(rate, 0.02)).expect("late");
            assert!((found.delay - 0.02).abs() < 1e-3, "{found:?}");
        }
        assert_eq!(late_in(&JointSeries { dq: Vec::new(), ..log(200.0, 0.02) }), None);
    }

    #[test]
    fn velocities_of_another_scale_are_told_from_late_ones() {
        let scaled = |factor: f64| {
            let log = log(200.0, 0.0);
            JointSeries { dq: log.dq.iter().map(|dq| factor * dq).collect(), ..log }
        };
        assert!(contradict_positions(&scaled(2.3)) && contradict_positions(&scaled(-1.0)));
        assert!(!contradict_positions(&scaled(1.0)) && !contradict_positions(&log(200.0, 0.02)));
        assert!(!contradict_positions(&JointSeries { dq: Vec::new(), ..scaled(2.3) }));
    }
}
