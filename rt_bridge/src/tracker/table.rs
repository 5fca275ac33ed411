//! The table as a plane, and what it tells of the depth. Where the table is, cell.toml knows; where it is measured tells by
//! which factor a stereo camera's distances are off (a per cent is common), and all depths are corrected by it. Rays and
//! the camera's pose are taken to be right: they come from colour pictures, which are sharper.

use super::view::{Frame, View};
use nalgebra::{Matrix3, Vector3};
use shared_mem::statistics::robust_sigma;

/// Every so many pixels along rows and columns one is asked.
const EVERY: usize = 8;
/// Measurements this far from cell.toml's table are not the table's [m].
const BAND: f32 = 0.03;
/// Distances are never off by more than this factor.
const MOST_WRONG: f32 = 1.05;
/// Fewer measurements than these say nothing about the table.
const MIN_MEASUREMENTS: usize = 100;
/// Pictures over which the plane is averaged: camera and table stand still.
const MEMORY: f32 = 20.0;
/// Least noise of the inverse depth [1/m].
const LEAST_NOISE: f32 = 2e-4;

/// The plane `normal . P = 1` for points of the camera frame, so that `normal . ray` is a pixel's inverse depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Table {
    pub(super) normal: Vector3<f32>,
    /// Noise of the inverse depth, one sigma [1/m].
    pub(super) noise: f32,
    /// The same plane as it is measured.
    measured: Vector3<f32>,
    /// Pictures behind that.
    pictures: f32,
}

impl Table {
    /// Where cell.toml says it is: `height` over the base frame's origin [m].
    pub(super) fn new(view: &View, height: f64) -> Option<Self> {
        let camera_from_base = view.base_from_camera.inverse();
        let up = camera_from_base * Vector3::z();
        let point = camera_from_base * nalgebra::Point3::new(0.0, 0.0, height);
        let distance = up.dot(&point.coords);
        // A camera below the table sees nothing of it.
        let normal = (distance < -1e-3).then(|| up / distance)?.cast();
        Some(Self { normal, noise: 2e-3, measured: normal, pictures: 0.0 })
    }

    /// The inverse depth of the table along a ray [1/m]; not positive where the ray misses it.
    #[inline]
    pub(super) fn inverse_depth(&self, ray: &Vector3<f32>) -> f32 {
        self.normal.dot(ray)
    }

    /// A measured inverse depth, as it would be if the table were measured where it is [1/m].
    #[inline]
    pub(super) fn corrected(&self, ray: &Vector3<f32>, seen: f32) -> f32 {
        let measured = self.measured.dot(ray).max(1e-3);
        seen * (self.normal.dot(ray) / measured).clamp(1.0 / MOST_WRONG, MOST_WRONG)
    }

    /// How far off distances to the table are on the camera's axis, as a share of them; positive: measured too long.
    pub(super) fn too_long(&self) -> f32 {
        self.normal.z / self.measured.z - 1.0
    }

    /// The direction away from the table, camera frame.
    pub(super) fn up(&self) -> Vector3<f64> {
        -self.normal.cast::<f64>().normalize()
    }

    /// How far a point of the camera frame is over the table [m].
    pub(super) fn height(&self, point: &Vector3<f64>) -> f64 {
        let normal = self.normal.cast::<f64>();
        (1.0 - normal.dot(point)) / normal.norm()
    }

    /// Looks at one more picture.
    pub(super) fn look(&mut self, view: &View, frame: &Frame) {
        let mut samples = Vec::with_capacity(view.width * view.height / (EVERY * EVERY));
        // A step off the plane by the band changes the inverse depth by this share of itself.
        let band = BAND * self.normal.norm();
        for v in (EVERY / 2..view.height).step_by(EVERY) {
            for u in (EVERY / 2..view.width).step_by(EVERY) {
                let (seen, ray) = (frame.inverse_depth(view, u, v), view.ray(u as f32, v as f32));
                let expected = self.normal.dot(&ray);
                if seen > 0.0 && expected > 0.0 && (1.0 - expected / seen).abs() < band {
                    samples.push((ray, seen));
                }
            }
        }
        if samples.len() < MIN_MEASUREMENTS {
            return;
        }
        let mut normal = self.measured;
        for _ in 0..3 {
            self.noise = spread(&samples, &normal).max(LEAST_NOISE).max(0.3 * frame.scale() * normal.z * normal.z);
            normal = fitted(&samples, &normal, 3.0 * self.noise).unwrap_or(normal);
        }
        self.pictures = (self.pictures + 1.0).min(MEMORY);
        self.measured += (normal - self.measured) / self.pictures;
    }
}

/// Median of the residuals' size, as one sigma.
fn spread(samples: &[(Vector3<f32>, f32)], normal: &Vector3<f32>) -> f32 {
    robust_sigma(samples.iter().map(|(ray, seen)| f64::from(seen - normal.dot(ray)))).unwrap_or(0.0) as f32
}

/// Least squares over the samples within `reach` of the plane so far.
fn fitted(samples: &[(Vector3<f32>, f32)], normal: &Vector3<f32>, reach: f32) -> Option<Vector3<f32>> {
    let (mut square, mut right) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
    for (ray, seen) in samples.iter().filter(|(ray, seen)| (seen - normal.dot(ray)).abs() < reach) {
        let ray = ray.cast::<f64>();
        square += ray * ray.transpose();
        right += ray * f64::from(*seen);
    }
    Some(square.cholesky()?.solve(&right).cast())
}
