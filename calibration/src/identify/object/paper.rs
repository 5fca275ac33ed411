//! The loss of the paper this follows: ADD plus ADD-S on points of the object's surface, mean over the poses of a clip.
//!
//! Every pose is one residual whose square is its loss, so that whatever searches by sums of squares searches by this.

use crate::estimate::{ClipModel, Impossible};
use crate::forward::object::ObjectClips;
use nalgebra::Point3;
use shared_mem::frames::{Base, Object, Pose};
use twin::metrics::SurfacePoints;
use twin::scene::ObjectShape;

/// Poses of a clip that count, evenly spaced: more do not move the mean.
const POSES: usize = 40;
/// Edge of the square grid of points on each face of the box around the object.
const GRID: usize = 4;

/// Clips, judged by their surface's points alone.
pub(super) struct SurfaceLoss<'a> {
    clips: &'a ObjectClips,
    points: SurfacePoints,
}

impl<'a> SurfaceLoss<'a> {
    pub(super) fn new(clips: &'a ObjectClips, shape: &ObjectShape) -> Self {
        Self { clips, points: SurfacePoints::from_points(points(shape)) }
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

/// Points on the faces of a box, or the corners of a mesh thinned out.
fn points(shape: &ObjectShape) -> Vec<Point3<f64>> {
    match shape {
        ObjectShape::Box { half_extents } => {
            let share = |i: usize| (2.0 * i as f64 + 1.0) / GRID as f64 - 1.0;
            let mut points = Vec::new();
            for axis in 0..3 {
                for side in [-1.0, 1.0] {
                    for i in 0..GRID * GRID {
                        let mut point = Point3::origin();
                        point[axis] = side * half_extents[axis];
                        point[(axis + 1) % 3] = share(i / GRID) * half_extents[(axis + 1) % 3];
                        point[(axis + 2) % 3] = share(i % GRID) * half_extents[(axis + 2) % 3];
                        points.push(point);
                    }
                }
            }
            points
        }
        ObjectShape::Mesh { points, .. } => {
            points.iter().step_by(points.len().div_ceil(6 * GRID * GRID).max(1)).copied().collect()
        }
    }
}
