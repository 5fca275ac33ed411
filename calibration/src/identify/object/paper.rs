//! The loss of the paper this follows: ADD plus ADD-S on points of the object's surface, mean over the poses of a clip.
//!
//! Every pose is one residual whose square is its loss, so that whatever searches by sums of squares searches by this.

use inference::estimate::{ClipModel, Impossible};
use inference::likelihood::object::ObjectClips;
use nalgebra::{Isometry3, Vector6};
use shared_mem::frames::{Base, Object, Pose};
use twin::metrics::SurfacePoints;
use twin::scene::ObjectShape;

/// Poses of a clip that count, evenly spaced (a choice): more do not move the mean.
const POSES_OF_A_CLIP: usize = 40;

/// A simulated pose in the measured object's frame: how far it lies off [m] and its turn [rad], axis times angle.
pub(super) type Slip = Vector6<f64>;

/// Of how many poses of a clip one counts.
fn every(poses: usize) -> usize {
    poses.div_ceil(POSES_OF_A_CLIP).max(1)
}

/// Clips, judged by their surface's points alone.
pub(super) struct SurfaceLoss<'a> {
    clips: &'a ObjectClips,
    points: SurfacePoints,
}

impl<'a> SurfaceLoss<'a> {
    pub(super) fn new(clips: &'a ObjectClips, shape: &ObjectShape) -> Self {
        Self { clips, points: SurfacePoints::new(shape) }
    }

    /// Mean over all poses of the clips [m], all clips counting alike.
    pub(super) fn mean(&self, numbers: &[f64]) -> Result<f64, Impossible> {
        Ok(self.mean_of(&self.slips(numbers)?, &vec![1.0; self.clips.clips()]))
    }

    /// Where poses lie so far from the measured ones, clip by clip: the mean, each clip as much as it counts [m].
    pub(super) fn mean_of(&self, slips: &[Vec<Slip>], weights: &[f64]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (slips, weight) in slips.iter().zip(weights) {
            sum += weight * slips.iter().map(|slip| self.of_slip(slip)).sum::<f64>();
            count += weight * slips.len() as f64;
        }
        sum / count.max(f64::MIN_POSITIVE)
    }

    /// How far the simulated object lies from the measured one, clip by clip, pose by pose that counts.
    pub(super) fn slips(&self, numbers: &[f64]) -> Result<Vec<Vec<Slip>>, Impossible> {
        (0..self.clips.clips()).map(|clip| self.of_clip(clip, numbers)).collect()
    }

    fn of_clip(&self, clip: usize, numbers: &[f64]) -> Result<Vec<Slip>, Impossible> {
        let predicted = self.clips.predict(clip, numbers, &[])?.poses;
        let measured = &self.clips.clip(clip).object.poses;
        let slip = |(predicted, measured): (&Pose<Base, Object>, &Pose<Base, Object>)| {
            let slip = measured.isometry().inverse() * predicted.isometry();
            let (by, turn) = (slip.translation.vector, slip.rotation.scaled_axis());
            Slip::new(by.x, by.y, by.z, turn.x, turn.y, turn.z)
        };
        Ok(predicted.iter().zip(measured).step_by(every(measured.len())).map(slip).collect())
    }

    /// Loss of a pose that lies so far from the measured one [m].
    fn of_slip(&self, slip: &Slip) -> f64 {
        let there = Isometry3::new(slip.fixed_rows::<3>(0).into(), slip.fixed_rows::<3>(3).into());
        let [there, here] = [there, Isometry3::identity()].map(Pose::from_isometry);
        self.points.add(&there, &here) + self.points.add_s(&there, &here)
    }
}

impl ClipModel for SurfaceLoss<'_> {
    fn clips(&self) -> usize {
        self.clips.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        out.clear();
        out.extend(self.of_clip(clip, shared)?.iter().map(|slip| self.of_slip(slip).sqrt()));
        Ok(())
    }
}
