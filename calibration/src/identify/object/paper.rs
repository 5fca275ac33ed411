//! The loss of the paper this follows: ADD plus ADD-S on points of the object's surface, mean over the poses of a clip.
//!
//! Every pose is one residual whose square is its loss, so that whatever searches by sums of squares searches by this.

use crate::estimate::{ClipModel, Impossible};
use crate::forward::object::ObjectClips;
use shared_mem::frames::{Base, Object, Pose};
use twin::metrics::SurfacePoints;
use twin::scene::ObjectShape;

/// Poses of a clip that count, evenly spaced: more do not move the mean.
const POSES: usize = 40;

/// Clips, judged by their surface's points alone.
pub(super) struct SurfaceLoss<'a> {
    clips: &'a ObjectClips,
    points: SurfacePoints,
}

impl<'a> SurfaceLoss<'a> {
    pub(super) fn new(clips: &'a ObjectClips, shape: &ObjectShape) -> Self {
        Self { clips, points: SurfacePoints::new(shape) }
    }

    /// Mean over all poses of the clips [m], each clip as much as it counts.
    ///
    /// # Errors
    /// [`Impossible`] where the twin has no answer.
    pub(super) fn mean(&self, numbers: &[f64], weights: &[f64]) -> Result<f64, Impossible> {
        let (mut sum, mut rows, mut out) = (0.0, 0.0, Vec::new());
        for (clip, weight) in weights.iter().enumerate() {
            self.residuals(clip, numbers, &[], &mut out)?;
            sum += weight * out.iter().map(|r| r * r).sum::<f64>();
            rows += weight * out.len() as f64;
        }
        Ok(sum / rows.max(f64::MIN_POSITIVE))
    }

    fn loss(&self, a: &Pose<Base, Object>, b: &Pose<Base, Object>) -> f64 {
        self.points.add(a, b) + self.points.add_s(a, b)
    }
}

impl ClipModel for SurfaceLoss<'_> {
    fn clips(&self) -> usize {
        self.clips.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let predicted = self.clips.predict(clip, shared, &[])?.poses;
        let measured = &self.clips.clip(clip).object.poses;
        let every = measured.len().div_ceil(POSES).max(1);
        out.clear();
        let pairs = predicted.iter().zip(measured).step_by(every);
        out.extend(pairs.map(|(predicted, measured)| self.loss(predicted, measured).sqrt()));
        Ok(())
    }
}
