//! The plane that a pixel looks at, and where other views see it.
//!
//! Inverse depth is linear over the picture of a plane, so a plane is its inverse depth at the pixel and a slope. A slanted window is
//! then seen by another view through a homography that needs no normal (Hartley and Zisserman, Multiple View Geometry, 2003, section 13.1).

use crate::camera::{Camera, View};
use nalgebra::{Matrix3, Vector3};

/// A plane through what a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    /// Inverse depth at the pixel [1/m].
    pub(crate) inverse: f32,
    /// Its change from pixel to pixel [1/m].
    pub(crate) slope: [f32; 2],
}

/// A surface is not seen at a smaller cosine between its normal and the ray: 84 degrees.
const GRAZING: f32 = 0.1;

/// A camera in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lens {
    focal: [f32; 2],
    centre: [f32; 2],
}

impl Lens {
    pub(crate) fn of(camera: &Camera) -> Self {
        Self { focal: camera.focal.map(|f| f as f32), centre: camera.centre.map(|c| c as f32) }
    }

    /// The ray through a place of the picture, as long as 1 along the axis.
    pub(crate) fn ray(&self, at: [f32; 2]) -> Vector3<f32> {
        let [x, y] = [0, 1].map(|i| (at[i] - self.centre[i]) / self.focal[i]);
        Vector3::new(x, y, 1.0)
    }
}

impl Plane {
    /// Perpendicular to a normal of any length and sign: of the plane `normal · p = k`, inverse depth along the ray `r` is `normal · r / k`.
    pub(crate) fn facing(normal: &Vector3<f32>, inverse: f32, at: [f32; 2], lens: &Lens) -> Self {
        let per_inverse = inverse / normal.dot(&lens.ray(at));
        Self { inverse, slope: [0, 1].map(|i| normal[i] * per_inverse / lens.focal[i]) }
    }

    /// The same plane as a pixel so far away has it.
    pub(crate) fn moved(&self, [x, y]: [f32; 2]) -> Self {
        Self { inverse: self.inverse + self.slope[0] * x + self.slope[1] * y, slope: self.slope }
    }

    /// Its normal times inverse distance from the camera, away from the camera.
    fn away(&self, at: [f32; 2], lens: &Lens) -> Vector3<f32> {
        let [x, y] = [0, 1].map(|i| lens.focal[i] * self.slope[i]);
        let ray = lens.ray(at);
        Vector3::new(x, y, self.inverse - x * ray.x - y * ray.y)
    }

    /// Of length 1, towards the camera.
    pub(crate) fn normal(&self, at: [f32; 2], lens: &Lens) -> [f32; 3] {
        (-self.away(at, lens).normalize()).into()
    }

    /// Whether a surface may be seen so.
    pub(crate) fn is_seen(&self, at: [f32; 2], lens: &Lens, range: [f32; 2]) -> bool {
        let across = self.away(at, lens).norm() * lens.ray(at).norm();
        self.inverse >= range[0] && self.inverse <= range[1] && self.inverse > GRAZING * across
    }
}

/// Where a place of one view is seen in another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    turn: [[f32; 3]; 3],
    shift: [f32; 3],
}

/// A pixel with what is seen there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Column and row.
    pub(crate) at: [f32; 2],
    /// Inverse depth [1/m].
    pub(crate) inverse: f32,
}

impl Pair {
    /// From one view to another, whose pictures are reduced so: a place at inverse depth w at the pixel p appears at `K' (R K^-1 p + w t)`.
    pub(crate) fn new(from: &View, to: &View, by: usize) -> Self {
        let across = to.camera_from_world * from.camera_from_world.inverse();
        let [own, other] = [from, to].map(|view| matrix(&view.camera.reduced(by)));
        let back = own.try_inverse().unwrap_or_else(Matrix3::zeros);
        let turn = other * across.rotation.to_rotation_matrix().matrix() * back;
        let shift = other * across.translation.vector;
        Self {
            turn: [0, 1, 2].map(|row| [0, 1, 2].map(|column| turn[(row, column)] as f32)),
            shift: shift.map(|v| v as f32).into(),
        }
    }

    /// Where the other view sees a place; `None` behind it.
    pub(crate) fn place(&self, [x, y]: [f32; 2], inverse: f32) -> Option<Place> {
        let ([t_u, t_v, t_q], [s_u, s_v, s_q]) = (&self.turn, &self.shift);
        let u = t_u[0] * x + t_u[1] * y + t_u[2] + s_u * inverse;
        let v = t_v[0] * x + t_v[1] * y + t_v[2] + s_v * inverse;
        let q = t_q[0] * x + t_q[1] * y + t_q[2] + s_q * inverse;
        (q > 1e-6).then(|| Place { at: [u / q, v / q], inverse: inverse / q })
    }

    /// The homography of a plane's window: rows of what is multiplied with (1, dx, dy).
    pub(crate) fn homography(&self, [x, y]: [f32; 2], plane: &Plane) -> [[f32; 3]; 3] {
        let mut rows = [[0.0; 3]; 3];
        for ((row, turn), shift) in rows.iter_mut().zip(&self.turn).zip(self.shift) {
            row[0] = turn[0] * x + turn[1] * y + turn[2] + shift * plane.inverse;
            row[1] = turn[0] + shift * plane.slope[0];
            row[2] = turn[1] + shift * plane.slope[1];
        }
        rows
    }
}

fn matrix(camera: &Camera) -> Matrix3<f64> {
    let ([fx, fy], [cx, cy]) = (camera.focal, camera.centre);
    Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
}
