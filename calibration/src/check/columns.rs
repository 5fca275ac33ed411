//! A clip as typed columns: seconds from its first row, one list of numbers a joint. SI, base frame.

use inference::likelihood::arm::noise;
use nalgebra::Vector3;
use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::time::seconds_between;

/// What one topic says about joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Signals {
    /// From the clip's first row [s].
    pub(super) t: Vec<f64>,
    /// Positions by joint [rad].
    pub(super) q: Vec<Vec<f64>>,
    /// Velocities by joint [rad/s]; empty where not logged.
    pub(super) dq: Vec<Vec<f64>>,
    /// Torques by joint [N m]; empty where not logged.
    pub(super) tau: Vec<Vec<f64>>,
    /// One sigma of the noise of each joint's positions, from these [rad].
    pub(super) noise: Vec<f64>,
}

/// An object that is so far from its first place was pushed [m]: several times a tracker's noise.
const PUSHED: f64 = 5e-3;
/// It is touched so much earlier, at the speeds of strokes [s].
const EARLIER: f64 = 0.05;

#[derive(Debug, Clone)]
pub(super) struct Columns {
    /// Its file, as cell.toml lists it.
    pub(super) file: String,
    pub(super) kind: ClipKind,
    /// What the arm did.
    pub(super) measured: Signals,
    /// What the arm was asked for.
    pub(super) desired: Signals,
    /// When each pose was taken [s].
    pub(super) pose_t: Vec<f64>,
    pub(super) object: ObjectSeries,
    /// Names of the joints.
    pub(super) names: Vec<String>,
    /// What the reader of the file noticed.
    pub(super) noticed: Vec<String>,
    /// What of the file could not be read.
    pub(super) damage: Option<String>,
}

impl Columns {
    pub(super) fn of(file: &str, clip: &Clip) -> Self {
        let firsts = [&clip.measured.stamps_ns, &clip.desired.stamps_ns, &clip.object.stamps_ns];
        let zero_ns = firsts.into_iter().filter_map(|stamps| stamps.first()).min().copied().unwrap_or(0);
        Self {
            file: file.to_owned(),
            kind: clip.kind,
            measured: Signals::of(&clip.measured, zero_ns),
            desired: Signals::of(&clip.desired, zero_ns),
            pose_t: clip.object.stamps_ns.iter().map(|stamp| seconds_between(zero_ns, *stamp)).collect(),
            object: clip.object.clone(),
            names: clip.joint_names.clone(),
            noticed: clip.warnings.clone(),
            damage: clip.damage.clone(),
        }
    }

    /// Until when the arm pushes nothing, as far as poses show: the object stands where it was first seen [s]; for ever where
    /// there is none. What the object's weight and friction do to torques is not in the arm's model.
    pub(super) fn before_contact(&self) -> f64 {
        let places: Vec<Vector3<f64>> = self.object.poses.iter().map(|pose| pose.position().into()).collect();
        let moved = places.iter().position(|place| (place - places[0]).norm() > PUSHED);
        moved.and_then(|row| self.pose_t.get(row)).map_or(f64::INFINITY, |t| t - EARLIER)
    }

    /// A joint in words: its number and name.
    pub(super) fn joint(&self, joint: usize) -> String {
        match self.names.get(joint).filter(|name| !name.is_empty()) {
            Some(name) => format!("joint {} `{name}`", joint + 1),
            None => format!("joint {}", joint + 1),
        }
    }

    /// Both topics with their names.
    pub(super) fn topics(&self) -> [(&'static str, &Signals); 2] {
        [("measured", &self.measured), ("desired", &self.desired)]
    }

    /// The same clip if its clock had counted in another unit.
    pub(super) fn with_clock(mut self, factor: f64) -> Self {
        for t in [&mut self.measured.t, &mut self.desired.t, &mut self.pose_t] {
            t.iter_mut().for_each(|t| *t *= factor);
        }
        self
    }
}

impl Signals {
    fn of(series: &JointSeries, zero_ns: u64) -> Self {
        let dof = series.dof;
        let by_joint = |values: &[f64]| -> Vec<Vec<f64>> {
            if values.is_empty() || dof == 0 {
                return Vec::new();
            }
            (0..dof).map(|joint| values.iter().skip(joint).step_by(dof).copied().collect()).collect()
        };
        let q = by_joint(&series.q);
        Self {
            t: series.stamps_ns.iter().map(|stamp| seconds_between(zero_ns, *stamp)).collect(),
            noise: q.iter().map(|q| noise::sigma(q)).collect(),
            q,
            dq: by_joint(&series.dq),
            tau: by_joint(&series.tau),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.t.len()
    }

    pub(super) fn dof(&self) -> usize {
        self.q.len()
    }

    /// Usual distance of two rows [s]; 0 of fewer than two.
    pub(super) fn step(&self) -> f64 {
        super::statistics::median(self.t.windows(2).map(|w| w[1] - w[0]).collect())
    }

    pub(super) fn duration(&self) -> f64 {
        self.t.last().zip(self.t.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// A joint's position at a time, on the straight line between two rows; `None` outside.
    pub(super) fn q_at(&self, joint: usize, t: f64) -> Option<f64> {
        between(&self.t, &self.q[joint], t)
    }
}

/// A quantity at a time, on the straight line between two rows; `None` outside.
pub(super) fn between(t: &[f64], values: &[f64], at: f64) -> Option<f64> {
    let next = t.partition_point(|t| *t < at);
    let (b, vb) = (*t.get(next)?, *values.get(next)?);
    if next == 0 {
        return (b == at).then_some(vb);
    }
    let (a, va) = (t[next - 1], values[next - 1]);
    Some(if b > a { va + (at - a) / (b - a) * (vb - va) } else { vb })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantity_is_known_between_rows_and_not_beyond_them() {
        let (t, v) = ([0.0, 1.0, 3.0], [1.0, 2.0, 0.0]);
        assert_eq!([0.0, 0.5, 2.0, 3.0].map(|at| between(&t, &v, at)), [Some(1.0), Some(1.5), Some(1.0), Some(0.0)]);
        assert_eq!([-0.1, 3.1].map(|at| between(&t, &v, at)), [None, None]);
    }
}
