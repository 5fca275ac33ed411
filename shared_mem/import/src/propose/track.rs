//! Numbers of joints over time, as far as a mapping gives them so far.

use crate::log::{HEADER, Table};
use crate::mapping::{Factor, JointColumns};
use shared_mem::time::seconds_between;
use std::f64::consts::TAU;

/// Rows that are looked at: evenly taken ones of a longer log would hide fast motion, so its first are.
const MOST_ROWS: usize = 60_000;

/// Positions, velocities and torques in SI, joint by joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Track {
    /// From the table's first stamp, or from 1970 where that is how they count [s].
    pub(super) t: Vec<f64>,
    /// [rad], or as far as its unit is known.
    pub(super) q: Vec<Vec<f64>>,
    /// As logged; empty where there is none.
    pub(super) dq: Vec<Vec<f64>>,
    /// [N m]; empty where there is none.
    pub(super) tau: Vec<Vec<f64>>,
}

impl Track {
    /// `None` where there are no positions or no clock.
    pub(super) fn of(table: &Table, columns: &JointColumns) -> Option<Self> {
        let rows = table.rows().min(MOST_ROWS);
        let t: Vec<f64> = match (&columns.stamps, columns.rate) {
            (Some(name), _) if name == HEADER => {
                table.stamps_ns.as_ref()?.iter().take(rows).map(|stamp| seconds_between(0, *stamp)).collect()
            }
            (Some(name), _) => {
                table.column(name)?.values.iter().take(rows).map(|v| v * columns.stamp_unit.seconds()).collect()
            }
            (None, Some(rate)) => (0..rows).map(|row| row as f64 / rate).collect(),
            (None, None) => return None,
        };
        let sign = |i: usize| columns.sign.get(i).copied().unwrap_or(1.0);
        let pick = |names: &[String], unit: f64, factor: &Factor| -> Option<Vec<Vec<f64>>> {
            let of = |(i, name): (usize, &String)| {
                let factor = unit * factor.of(i) * sign(i);
                Some(table.column(name)?.values.iter().take(rows).map(|v| v * factor).collect::<Vec<f64>>())
            };
            names.iter().enumerate().map(of).collect()
        };
        let q = pick(&columns.q, columns.q_unit.si(), &columns.q_factor).filter(|q| !q.is_empty())?;
        let (dq, tau) = (pick(&columns.dq, 1.0, &columns.dq_factor)?, pick(&columns.tau, 1.0, &columns.tau_factor)?);
        // Rows of other tables' stamps, or without position, are none of this one's.
        let good: Vec<usize> = (0..t.len())
            .filter(|row| t[*row].is_finite() && q.iter().all(|column| column.get(*row).is_some_and(|v| v.is_finite())))
            .collect();
        let at =
            |values: &[f64]| good.iter().map(|row| values.get(*row).copied().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        let all = |columns: &[Vec<f64>]| columns.iter().map(|column| at(column)).collect();
        (good.len() > 2).then(|| Self { t: at(&t), q: all(&q), dq: all(&dq), tau: all(&tau) })
    }

    /// Usual time from row to row [s].
    pub(super) fn step(&self) -> f64 {
        crate::lag::usual_step(&self.t)
    }

    /// Some of its rows, of the positions alone.
    pub(super) fn rows(&self, rows: std::ops::Range<usize>) -> Self {
        let q = self.q.iter().map(|q| q[rows.clone()].to_vec()).collect();
        Self { t: self.t[rows].to_vec(), q, ..Self::default() }
    }

    /// The same without jumps by a whole turn, as a driver makes them that keeps its angles within one.
    pub(super) fn continuous(&self) -> Self {
        let unwrapped = |q: &Vec<f64>| {
            let mut turns = 0.0;
            let one = |(row, value): (usize, &f64)| {
                let step = row.checked_sub(1).map_or(0.0, |before| value - q[before]);
                turns -= turned(step);
                value + turns * TAU
            };
            q.iter().enumerate().map(one).collect()
        };
        Self { q: self.q.iter().map(unwrapped).collect(), ..self.clone() }
    }

    /// Slopes of a joint's positions, in the middle between the rows around each [1/s]; NaN at both ends.
    pub(super) fn slopes(&self, joint: usize) -> Vec<f64> {
        let q = &self.q[joint];
        let mut slopes = vec![f64::NAN; q.len()];
        for i in 1..q.len().saturating_sub(1) {
            let dt = self.t[i + 1] - self.t[i - 1];
            if dt > 0.0 {
                let step = q[i + 1] - q[i - 1];
                slopes[i] = (step - turned(step) * TAU) / dt;
            }
        }
        slopes
    }

    /// A joint's positions at other times [s], in between linear; NaN beyond the ends.
    pub(super) fn at(&self, joint: usize, times: &[f64]) -> Vec<f64> {
        let q = &self.q[joint];
        let one = |time: &f64| {
            let next = self.t.partition_point(|t| t < time);
            match (next.checked_sub(1), next < self.t.len()) {
                (_, true) if self.t[next] == *time => q[next],
                (Some(before), true) => {
                    let share = (time - self.t[before]) / (self.t[next] - self.t[before]);
                    q[before] + share * (q[next] - q[before])
                }
                _ => f64::NAN,
            }
        };
        times.iter().map(one).collect()
    }
}

/// Whole turns in a step from row to row: 1, 0 or -1.
fn turned(step: f64) -> f64 {
    if (step.abs() - TAU).abs() < NEAR_TURN { step.signum() } else { 0.0 }
}

/// How near to a whole turn a step comes that is one [rad]: more than any joint moves between two rows, as in reading clips.
const NEAR_TURN: f64 = 0.5;

/// Root of the mean square of what is finite.
pub(super) fn rms<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0), |(sum, count), v| (sum + v * v, count + 1));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_that_is_kept_within_a_turn_goes_on_and_its_slope_stays() {
        let t: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.05).collect();
        let kept = |q: f64| (q + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        let track = Track { q: vec![t.iter().map(|t| kept(0.9 * t)).collect()], t, ..Track::default() };
        let whole = track.continuous();
        assert!(whole.q[0].iter().zip(&track.t).all(|(q, t)| (q - 0.9 * t).abs() < 1e-9));
        assert!(track.slopes(0)[1..399].iter().all(|slope| (slope - 0.9).abs() < 1e-9));
    }
}
