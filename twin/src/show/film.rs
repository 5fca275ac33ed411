//! A recorded clip and what the twin makes of its commands, moment by moment.

use crate::arm::{Joints, MAX_JOINTS};
use crate::replay::Prediction;
use nalgebra::Isometry3;
use serde::Serialize;
use shared_mem::recording::Clip;
use shared_mem::time::seconds_between;

/// Moments a second: more than a page shows of joints.
const RATE: f64 = 50.0;
/// Most moments of a clip: of one that lasts longer there are fewer a second.
const MOST: usize = 6000;

/// Robot and twin at one moment.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moment {
    /// Measured and simulated joint positions [rad]; `None` of an object alone.
    pub(super) joints: Option<[Joints; 2]>,
    /// Measured and simulated pose of the object, base frame; `None` where it is not simulated.
    pub(super) object: Option<[Isometry3<f64>; 2]>,
}

/// A clip, robot and twin.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    file: String,
    /// Since the first moment [s].
    times: Vec<f64>,
    moments: Vec<Moment>,
    dof: usize,
}

/// What a page is given of a film: times [s], the gap of each joint [mrad] and of the object [mm], measured less simulated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Numbers<'a> {
    file: &'a str,
    times: &'a [f64],
    joints: Vec<Vec<f64>>,
    object: Option<Vec<f64>>,
}

impl Film {
    /// Of a clip with its joints in the model's order; `None` where nothing of it is simulated.
    pub fn of(file: &str, clip: &Clip, prediction: &Prediction) -> Option<Self> {
        let joints: Vec<u64> = clip.measured.stamps_ns.iter().take(prediction.joints.len()).copied().collect();
        let poses: Vec<u64> = clip.object.stamps_ns.iter().take(prediction.object.len()).copied().collect();
        let stamps = if joints.is_empty() { &poses } else { &joints };
        let (first, last) = (*stamps.first()?, *stamps.last()?);
        let apart = (seconds_between(first, last) / MOST as f64).max(RATE.recip());
        let mut film = Self { file: file.to_owned(), times: Vec::new(), moments: Vec::new(), dof: clip.measured.dof };
        for (row, stamp) in stamps.iter().enumerate() {
            let at = seconds_between(first, *stamp);
            if film.times.last().is_some_and(|before| at < before + apart - 1e-9) {
                continue;
            }
            let both = |row: usize| {
                let mut measured = [0.0; MAX_JOINTS];
                let q = clip.measured.q_row(row);
                measured[..q.len()].copy_from_slice(q);
                [measured, prediction.joints[row].state.q]
            };
            let pose = poses.partition_point(|pose| pose <= stamp).checked_sub(1);
            let pose = pose.or(if poses.is_empty() { None } else { Some(0) });
            film.times.push(at);
            film.moments.push(Moment {
                joints: (!joints.is_empty()).then(|| both(row)),
                object: pose.map(|k| [clip.object.poses[k].isometry(), prediction.object[k].isometry()]),
            });
        }
        Some(film)
    }

    /// The moment at which the joints are furthest apart.
    pub fn widest(&self) -> usize {
        let gap = |moment: &Moment| {
            let of = |[real, twin]: [Joints; 2]| real.iter().zip(twin).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            moment.joints.map_or(0.0, of)
        };
        (0..self.moments.len()).max_by(|a, b| gap(&self.moments[*a]).total_cmp(&gap(&self.moments[*b]))).unwrap_or(0)
    }

    pub(super) fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// What the page draws of it.
    pub(super) fn numbers(&self) -> Numbers<'_> {
        let rounded = |value: f64| (1e4 * value).round() / 1e4;
        let of_joint = |joint: usize| {
            let gap =
                |moment: &Moment| moment.joints.map_or(0.0, |[real, twin]| rounded(1e3 * (real[joint] - twin[joint])));
            self.moments.iter().map(gap).collect()
        };
        let has_joints = self.moments.iter().any(|moment| moment.joints.is_some());
        let apart = |moment: &Moment| {
            let of = |[real, twin]: [Isometry3<f64>; 2]| (real.translation.vector - twin.translation.vector).norm();
            moment.object.map(|both| rounded(1e3 * of(both)))
        };
        let object: Option<Vec<f64>> = self.moments.iter().map(apart).collect();
        Numbers {
            file: &self.file,
            times: &self.times,
            joints: if has_joints { (0..self.dof).map(of_joint).collect() } else { Vec::new() },
            object,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::arm::JointState;
    use crate::control::Reading;
    use crate::shipped::shipped;
    use shared_mem::cell::ClipKind;
    use shared_mem::recording::JointSeries;

    /// Two seconds at 1 kHz in which joint 2 of the twin comes late by a hundredth of what it moves.
    pub(in crate::show) fn film() -> Film {
        let model = crate::arm::ArmModel::from_cell(&shipped()).expect("an arm");
        let (ready, rows) = (*model.ready(), 2000_usize);
        let at = |k: usize, share: f64| {
            let mut q = ready;
            q[1] += 0.3 * share * (1e-3 * k as f64 * std::f64::consts::PI).sin();
            q
        };
        let q = (0..rows).flat_map(|k| at(k, 1.0)[..7].to_vec()).collect();
        let stamps_ns = (0..rows as u64).map(|k| 5_000_000_000 + k * 1_000_000).collect();
        let series = JointSeries { stamps_ns, dof: 7, q, ..JointSeries::default() };
        let clip = Clip { measured: series, ..nothing() };
        let reading =
            |k| Reading { state: JointState { q: at(k, 0.99), ..JointState::default() }, ..Reading::default() };
        let prediction = Prediction { joints: (0..rows).map(reading).collect(), ..Prediction::default() };
        Film::of("clip_00.mcap", &clip, &prediction).expect("a film")
    }

    fn nothing() -> Clip {
        Clip {
            file: "clip_00.mcap".into(),
            kind: ClipKind::Excitation,
            joint_names: Vec::new(),
            desired: JointSeries::default(),
            measured: JointSeries::default(),
            torques_end_at_rows: false,
            object: Default::default(),
            others: Vec::new(),
            origins: Default::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn a_film_has_fifty_moments_a_second_and_the_gap_of_each_joint() {
        let film = film();
        assert_eq!(film.moments().len(), 100);
        let numbers = film.numbers();
        assert_eq!((numbers.joints.len(), numbers.object.is_none()), (7, true));
        let largest = |joint: usize| numbers.joints[joint].iter().fold(0.0, |most: f64, gap| most.max(gap.abs()));
        assert!((largest(1) - 3.0).abs() < 0.01 && largest(0) == 0.0, "{} mrad", largest(1));
        assert!([25, 75].contains(&film.widest()), "a quarter of the period: {}", film.widest());
        assert!(Film::of("x", &nothing(), &Prediction::default()).is_none());
    }
}
