//! From a pose that is nearly right to the one that fits best: Gauss and Newton's steps over depth, outline and contact
//! with the table, in the camera's frame, in steps about the object's centre.

use super::colors::Colors;
use super::contour::{self, Crossing};
use super::model::Model;
use super::patch::Patch;
use super::table::Table;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use twin::pose_fit::{Equations, moved, pixel_direction, slope};

/// Pixels whose depth is compared, at most.
const PIXELS: usize = 4000;
/// Surfaces are known to this [m].
const SURFACE: f32 = 0.0015;
/// Pixels that say the same: a stereo camera matches windows, so neighbours share their error.
const SHARED: f64 = 16.0;
/// Lines across the outline that say the same.
const SHARED_LINES: f64 = 2.0;
/// Where a corner that stands on the table is found, one sigma, and from where on it counts as lifted [m].
const CONTACT: f64 = 0.0015;
const LIFTED: f64 = 0.004;
/// What a pose is known to beside the picture, one sigma [m, rad]: it keeps what cannot be seen from running away.
pub(super) const EXPECTED: [f64; 2] = [0.05, 0.5];
/// A step that changes nothing [m, rad].
const SMALLEST_STEP: f64 = 2e-5;

/// How one fit goes on: half length of the lines [pixel] and how far off a depth may be and still count [m], step by step.
pub(super) type Schedule = &'static [(usize, f32)];
/// From a pose some centimetres off.
pub(super) const COARSE: Schedule = &[(14, 0.06), (14, 0.04), (10, 0.03), (10, 0.03), (8, 0.02), (8, 0.02)];
/// While the object is followed.
pub(super) const FINE: Schedule =
    &[(14, 0.04), (10, 0.03), (8, 0.02), (6, 0.015), (5, 0.012), (5, 0.012), (5, 0.012), (5, 0.012)];

/// What a fit found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) camera_from_object: Isometry3<f64>,
    /// Inverse of the covariance of small turn and centre, camera axes.
    pub(super) information: Matrix6<f64>,
}

/// What is compared with what.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) model: &'a Model,
    pub(super) table: &'a Table,
    pub(super) colors: &'a Colors,
}

impl Scene<'_> {
    /// Fits from `start`; `None` where the picture leaves nothing to fit.
    pub(super) fn align(&self, patch: &mut Patch, start: &Isometry3<f64>, schedule: Schedule) -> Option<Fit> {
        let mut pose = *start;
        let mut information = Matrix6::zeros();
        for (reach, gate) in schedule {
            patch.draw(self.model, &pose);
            let mut equations = expected(start, &pose);
            self.depth(patch, &pose, *gate, &mut equations);
            for crossing in contour::crossings(patch, self.table, self.colors, *reach) {
                outline(patch.focal(), &crossing, &pose, &mut equations);
            }
            self.contact(&pose, &mut equations);
            information = equations.information;
            let step = equations.step(0.0, 0.0)?;
            pose = moved(&pose, &pose.translation.vector.into(), &step);
            if step.amax() < SMALLEST_STEP {
                break;
            }
        }
        pose.translation.vector.iter().all(|v| v.is_finite()).then_some(Fit { camera_from_object: pose, information })
    }

    /// Measured against drawn inverse depth, pixel by pixel. A surface through `P` with normal `N`, `N . P = 1`, is seen at
    /// inverse depth `N . ray`, which changes by `-(N . ray) N . v` when its point moves by `v`.
    fn depth(&self, patch: &Patch, pose: &Isometry3<f64>, gate: f32, equations: &mut Equations<6>) {
        let (drawn, width) = (patch.drawn(), patch.width);
        let count = drawn.iter().filter(|d| **d > 0.0).count();
        let every = ((count as f64 / PIXELS as f64).sqrt().ceil() as usize).max(1);
        let centre = pose.translation.vector;
        let shared = SHARED / (every * every) as f64;
        for v in (1..patch.height - 1).step_by(every) {
            for u in (1..width - 1).step_by(every) {
                let at = v * width + u;
                let (m, seen) = (drawn[at], patch.seen[at]);
                if m == 0.0 || seen == 0.0 || patch.arm[at] > m - 0.01 * m * m {
                    continue;
                }
                let Some(normal) = normal_at(patch, u, v) else { continue };
                let sigma = self.table.noise.hypot(SURFACE * m * m);
                let gate = (gate * m * m).max(4.0 * sigma);
                let residual = seen - m;
                let share = residual / gate;
                if share.abs() >= 1.0 {
                    continue;
                }
                // Tukey: what is far off counts little, what is farther nothing.
                let weight = (1.0 - share * share).powi(2) / (sigma * sigma);
                let m = f64::from(m);
                let arm = patch.ray(u, v).cast::<f64>() / m - centre;
                let row = slope(&(normal * -m), &arm);
                equations.add(&row, -f64::from(residual), f64::from(weight) / shared.max(1.0));
            }
        }
    }

    /// The corners nearest to the table lie on it. One that is higher than a few millimetres is lifted and counts no more;
    /// none lies below.
    fn contact(&self, pose: &Isometry3<f64>, equations: &mut Equations<6>) {
        let up = self.table.up();
        let mut touching = 0.0;
        let rows: Vec<_> = self
            .model
            .corners
            .iter()
            .map(|corner| {
                let arm = pose.rotation * corner;
                let height = self.table.height(&(pose.translation.vector + arm));
                let lifted = (height / LIFTED).max(0.0);
                let counts = (1.0 + lifted * lifted).powi(-2);
                touching += counts;
                (slope(&up, &arm), height, counts)
            })
            .collect();
        let share = 1.0 / (CONTACT * CONTACT) / (touching / 4.0_f64).max(1.0);
        for (row, height, counts) in rows {
            equations.add(&row, height, share * counts);
        }
    }
}

/// What is known beside the picture: not far from where the fit began.
fn expected(start: &Isometry3<f64>, pose: &Isometry3<f64>) -> Equations<6> {
    let [place, turn] = EXPECTED.map(|sigma| 1.0 / (sigma * sigma));
    let information = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, place, place, place));
    let shift = pose.translation.vector - start.translation.vector;
    let turned = (pose.rotation * start.rotation.inverse()).scaled_axis();
    let off = Vector6::new(turned.x, turned.y, turned.z, shift.x, shift.y, shift.z);
    Equations { information, gradient: information * off }
}

/// One line across the outline.
fn outline([fx, fy]: [f32; 2], crossing: &Crossing, pose: &Isometry3<f64>, equations: &mut Equations<6>) {
    let Crossing { point, normal, off, variance } = crossing;
    let direction = pixel_direction(&Point3::from(*point), [fx, fy].map(f64::from), [normal.x, normal.y]);
    let row = slope(&direction, &(point - pose.translation.vector));
    // Huber: beyond two pixels a line pulls no harder.
    let robust = (2.0 / off.abs().max(1e-9)).min(1.0);
    equations.add(&row, -off, robust / variance / SHARED_LINES);
}

/// `N` of the drawn surface at a pixel, from how its inverse depth changes; `None` at edges.
#[inline]
fn normal_at(patch: &Patch, u: usize, v: usize) -> Option<Vector3<f64>> {
    let (drawn, at, width) = (patch.drawn(), v * patch.width + u, patch.width);
    let here = drawn[at];
    let slope = |before: f32, after: f32| {
        let straight = before > 0.0 && after > 0.0 && (before + after - 2.0 * here).abs() < 1e-3 * here * here;
        straight.then(|| f64::from(0.5 * (after - before)))
    };
    let [fx, fy] = patch.focal().map(f64::from);
    let nx = slope(drawn[at - 1], drawn[at + 1])? * fx;
    let ny = slope(drawn[at - width], drawn[at + width])? * fy;
    let ray = patch.ray(u, v).cast::<f64>();
    Some(Vector3::new(nx, ny, f64::from(here) - nx * ray.x - ny * ray.y))
}
