//! Time series of a clip: joints and object, as plain arrays. Units SI, stamps integer nanoseconds.

use crate::frames::{Base, Object, Pose};
use std::ops::RangeInclusive;

/// Joint positions over time, with velocities and torques where they were logged.
///
/// Arrays are row-major, `len() x dof`; `dq` and `tau` are empty when not logged.
///
/// ```
/// use shared_mem::recording::JointSeries;
///
/// // Two joints, sampled at 1 kHz.
/// let stamps_ns = vec![0, 1_000_000, 2_000_000];
/// let q = vec![0.0, 1.0, 0.1, 1.1, 0.2, 1.2]; // rad, one row after the other
/// let series = JointSeries { stamps_ns, dof: 2, q, ..JointSeries::default() };
/// assert_eq!(series.q_row(1), [0.1, 1.1]);
/// assert_eq!(series.dq_row(1), None, "velocities were not logged");
/// assert_eq!(series.between(1_000_000..=2_000_000).len(), 2);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointSeries {
    /// One stamp a row, strictly increasing [ns].
    pub stamps_ns: Vec<u64>,
    /// Joints in a row.
    pub dof: usize,
    /// Positions [rad].
    pub q: Vec<f64>,
    /// Velocities [rad/s].
    pub dq: Vec<f64>,
    /// Torques [N m]: `tau_J` (with gravity) of a measured series, `tau_J_d` (without) of a desired one.
    pub tau: Vec<f64>,
}

impl JointSeries {
    /// Rows.
    pub fn len(&self) -> usize {
        self.stamps_ns.len()
    }

    /// True when there are no rows.
    pub fn is_empty(&self) -> bool {
        self.stamps_ns.is_empty()
    }

    /// Positions of row `i` [rad]; empty beyond the end.
    pub fn q_row(&self, i: usize) -> &[f64] {
        row(&self.q, self.dof, i).unwrap_or(&[])
    }

    /// Velocities of row `i` [rad/s]; `None` when not logged.
    pub fn dq_row(&self, i: usize) -> Option<&[f64]> {
        row(&self.dq, self.dof, i)
    }

    /// Torques of row `i` [N m]; `None` when not logged.
    pub fn tau_row(&self, i: usize) -> Option<&[f64]> {
        row(&self.tau, self.dof, i)
    }

    /// From the first stamp to the last [s].
    pub fn duration(&self) -> f64 {
        duration(&self.stamps_ns)
    }

    /// The same rows with only `columns`, in that order; a column beyond `dof` reads as 0.
    pub(super) fn select_columns(&self, columns: &[usize]) -> Self {
        let pick = |values: &[f64]| -> Vec<f64> {
            let rows = values.chunks_exact(self.dof.max(1));
            rows.flat_map(|row| columns.iter().map(|&c| row.get(c).copied().unwrap_or(0.0))).collect()
        };
        Self {
            stamps_ns: self.stamps_ns.clone(),
            dof: columns.len(),
            q: pick(&self.q),
            dq: pick(&self.dq),
            tau: pick(&self.tau),
        }
    }

    /// The rows with these stamps [ns].
    pub fn between(&self, stamps_ns: RangeInclusive<u64>) -> Self {
        let from = self.stamps_ns.partition_point(|stamp| stamp < stamps_ns.start());
        let to = self.stamps_ns.partition_point(|stamp| stamp <= stamps_ns.end());
        self.select_rows(&(from..to).collect::<Vec<_>>())
    }

    /// The rows listed in `rows`, in that order; numbers beyond the end are passed over.
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        let pick = |values: &[f64]| -> Vec<f64> {
            rows.iter().filter_map(|&i| row(values, self.dof, i)).flatten().copied().collect()
        };
        Self {
            stamps_ns: rows.iter().filter_map(|&i| self.stamps_ns.get(i).copied()).collect(),
            dof: self.dof,
            q: pick(&self.q),
            dq: pick(&self.dq),
            tau: pick(&self.tau),
        }
    }
}

/// Poses of the object over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObjectSeries {
    /// One stamp a pose, strictly increasing [ns].
    pub stamps_ns: Vec<u64>,
    /// Geometric centre of the object in the base frame.
    pub poses: Vec<Pose<Base, Object>>,
}

impl ObjectSeries {
    /// Poses.
    pub fn len(&self) -> usize {
        self.stamps_ns.len()
    }

    /// True when there are no poses.
    pub fn is_empty(&self) -> bool {
        self.stamps_ns.is_empty()
    }

    /// From the first stamp to the last [s].
    pub fn duration(&self) -> f64 {
        duration(&self.stamps_ns)
    }

    /// The poses listed in `rows`, in that order; numbers beyond the end are passed over.
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        let there = rows.iter().copied().filter(|row| *row < self.len().min(self.poses.len()));
        let (stamps_ns, poses) = there.map(|row| (self.stamps_ns[row], self.poses[row])).unzip();
        Self { stamps_ns, poses }
    }
}

fn row(values: &[f64], dof: usize, i: usize) -> Option<&[f64]> {
    let start = i.checked_mul(dof)?;
    values.get(start..start.checked_add(dof)?).filter(|row| !row.is_empty())
}

fn duration(stamps_ns: &[u64]) -> f64 {
    match (stamps_ns.first(), stamps_ns.last()) {
        (Some(&first), Some(&last)) => crate::time::seconds_between(first, last),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_number_and_unlogged_values_are_none() {
        let series = JointSeries {
            stamps_ns: vec![0, 500_000_000],
            dof: 2,
            q: vec![1.0, 2.0, 3.0, 4.0],
            dq: vec![],
            tau: vec![5.0, 6.0, 7.0, 8.0],
        };
        assert_eq!(series.q_row(1), [3.0, 4.0]);
        assert_eq!(series.q_row(2), [0.0; 0]);
        assert_eq!(series.dq_row(0), None);
        assert_eq!(series.tau_row(0), Some(&[5.0, 6.0][..]));
        assert!((series.duration() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn columns_and_rows_can_be_picked_in_any_order() {
        let series =
            JointSeries { stamps_ns: vec![10, 20], dof: 2, q: vec![1.0, 2.0, 3.0, 4.0], ..JointSeries::default() };
        assert_eq!(series.select_columns(&[1, 0]).q, [2.0, 1.0, 4.0, 3.0]);
        let last = series.select_rows(&[1]);
        assert_eq!((last.stamps_ns, last.q), (vec![20], vec![3.0, 4.0]));
        let pose = Pose::from_isometry(nalgebra::Isometry3::translation(1.0, 0.0, 0.0));
        let poses = ObjectSeries {
            stamps_ns: vec![10, 20],
            poses: vec![Pose::from_isometry(nalgebra::Isometry3::identity()), pose],
        };
        assert_eq!(poses.select_rows(&[1, 2]), ObjectSeries { stamps_ns: vec![20], poses: vec![pose] });
    }
}
