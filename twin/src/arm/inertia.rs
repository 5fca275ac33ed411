//! Mass properties of rigid bodies: as people state them ([`MassProperties`], about the centre of mass) and as the
//! equations of motion need them ([`TenParameters`], about a frame's origin, where bodies simply add up).

use super::spatial::{Rot3, Spatial, Vec3, add, cross, dot, scale, sub};
use nalgebra::{Isometry3, Matrix3, Vector3};
use shared_mem::cell::Tool;

/// Mass, centre of mass and inertia of a rigid body in some frame.
///
/// ```
/// use twin::arm::MassProperties;
///
/// // A tool of 0.2 kg at the flange and a load of 0.6 kg a little further out.
/// let tool = MassProperties::new(0.2, [0.0, 0.0, 0.05], [1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0]);
/// let load = MassProperties::new(0.6, [0.0, 0.0, 0.13], [1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0]);
/// let both = tool.joined_with(&load);
/// assert!((both.mass - 0.8).abs() < 1e-12); // kg
/// assert!((both.centre.z - 0.11).abs() < 1e-12); // m
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass [m].
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass, along the frame's axes [kg m²].
    pub inertia: Matrix3<f64>,
}

impl Default for MassProperties {
    fn default() -> Self {
        Self { mass: 0.0, centre: Vector3::zeros(), inertia: Matrix3::zeros() }
    }
}

impl MassProperties {
    /// From the six numbers of a symmetric inertia `[xx, yy, zz, xy, xz, yz]` about the centre of mass.
    pub fn new(mass: f64, centre: [f64; 3], inertia: [f64; 6]) -> Self {
        let [xx, yy, zz, xy, xz, yz] = inertia;
        Self { mass, centre: Vector3::from(centre), inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) }
    }

    /// The same body seen from a frame in which this one lies at `outer_from_inner`.
    pub fn seen_from(&self, outer_from_inner: &Isometry3<f64>) -> Self {
        let r = outer_from_inner.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            centre: r * self.centre + outer_from_inner.translation.vector,
            inertia: r.matrix() * self.inertia * r.matrix().transpose(),
        }
    }

    /// Both bodies as one (parallel-axis theorem).
    pub fn joined_with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self { inertia: self.inertia + other.inertia, ..*self };
        }
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let moved = |body: &Self| {
            let d = body.centre - centre;
            body.inertia + body.mass * (Matrix3::identity() * d.norm_squared() - d * d.transpose())
        };
        Self { mass, centre, inertia: moved(self) + moved(other) }
    }

    /// The same with no principal moment of inertia below `least` [kg m²]: other programs refuse a body without one.
    pub fn with_moments_from(&self, least: f64) -> Self {
        let mut own = self.inertia.symmetric_eigen();
        if own.eigenvalues.iter().all(|moment| *moment >= least) {
            return *self;
        }
        own.eigenvalues.apply(|moment| *moment = moment.max(least));
        Self { inertia: own.recompose(), ..*self }
    }

    /// The tool of cell.toml in the flange frame: a homogeneous capsule whose axis runs along z from the flange's
    /// origin to `length - radius`, closed by half spheres of `radius`.
    pub fn of_tool(tool: &Tool) -> Self {
        let (r, axis) = (tool.radius, tool.length - tool.radius);
        // Volumes over pi r²: the cylinder has `axis`, both half spheres together 4/3 r.
        let cylinder = tool.mass * axis / (axis + 4.0 / 3.0 * r);
        let sphere = tool.mass - cylinder;
        let along = 0.5 * cylinder * r * r + 0.4 * sphere * r * r;
        // A half sphere's centroid lies 3/8 r beyond its base, its inertia across about that base's centre is 2/5 m r².
        let across = cylinder * (axis * axis / 12.0 + r * r / 4.0)
            + sphere * (0.4 * r * r + 0.375 * axis * r + 0.25 * axis * axis);
        Self {
            mass: tool.mass,
            centre: Vector3::new(0.0, 0.0, 0.5 * axis),
            inertia: Matrix3::from_diagonal(&Vector3::new(across, across, along)),
        }
    }
}

/// Mass, first moment and inertia about a frame's origin: linear in the body, so that bodies add up.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TenParameters {
    /// Mass [kg].
    pub(super) mass: f64,
    /// Mass times centre of mass [kg m].
    pub(super) moment: Vec3,
    /// Inertia about the origin: xx, yy, zz, xy, xz, yz [kg m²].
    pub(super) inertia: [f64; 6],
}

impl TenParameters {
    pub(super) fn from_properties(body: &MassProperties) -> Self {
        let (m, c) = (body.mass, body.centre);
        let about_origin = body.inertia + m * (Matrix3::identity() * c.norm_squared() - c * c.transpose());
        let i = |r, k| about_origin[(r, k)];
        Self { mass: m, moment: (c * m).into(), inertia: [i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)] }
    }

    /// Back to the centre of mass.
    pub(super) fn properties(&self) -> MassProperties {
        let (m, [xx, yy, zz, xy, xz, yz]) = (self.mass, self.inertia);
        let centre = if m > 0.0 { Vector3::from(self.moment) / m } else { Vector3::zeros() };
        let moved = m * (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose());
        let about_origin = MassProperties::new(m, centre.into(), [xx, yy, zz, xy, xz, yz]);
        MassProperties { inertia: about_origin.inertia - moved, ..about_origin }
    }

    /// The body seen from the base, when its frame lies there at rotation `r` and origin `p`.
    #[inline(always)]
    pub(super) fn seen_from_base(&self, r: &Rot3, p: Vec3) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        // Columns of r times the local inertia, then times r transposed: only the six distinct entries.
        let t = |row: Vec3| {
            [
                row[0] * xx + row[1] * xy + row[2] * xz,
                row[0] * xy + row[1] * yy + row[2] * yz,
                row[0] * xz + row[1] * yz + row[2] * zz,
            ]
        };
        let (t0, t1, t2) = (t(r[0]), t(r[1]), t(r[2]));
        let moment = super::spatial::rotate(r, self.moment);
        // Moving the reference point from the frame's origin to the base's: 2 (p.h) 1 - p h' - h p' + m (p.p 1 - p p').
        // With k = h + m p / 2 this is 2 (p.k) 1 - p k' - k p'.
        let k = add(moment, scale(p, 0.5 * self.mass));
        let (x, y, z) = (p[0] * k[0], p[1] * k[1], p[2] * k[2]);
        Self {
            mass: self.mass,
            moment: add(moment, scale(p, self.mass)),
            inertia: [
                dot(t0, r[0]) + 2.0 * (y + z),
                dot(t1, r[1]) + 2.0 * (x + z),
                dot(t2, r[2]) + 2.0 * (x + y),
                dot(t0, r[1]) - p[0] * k[1] - p[1] * k[0],
                dot(t0, r[2]) - p[0] * k[2] - p[2] * k[0],
                dot(t1, r[2]) - p[1] * k[2] - p[2] * k[1],
            ],
        }
    }

    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        let mut inertia = self.inertia;
        for (a, b) in inertia.iter_mut().zip(other.inertia) {
            *a += b;
        }
        Self { mass: self.mass + other.mass, moment: add(self.moment, other.moment), inertia }
    }

    /// Momentum of the body under a motion (or force under an acceleration), both about the origin.
    #[inline(always)]
    pub(super) fn momentum(&self, motion: Spatial) -> Spatial {
        let (w, v) = (motion.angular, motion.linear);
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        let turning =
            [xx * w[0] + xy * w[1] + xz * w[2], xy * w[0] + yy * w[1] + yz * w[2], xz * w[0] + yz * w[1] + zz * w[2]];
        Spatial {
            angular: add(turning, cross(self.moment, v)),
            linear: sub(scale(v, self.mass), cross(self.moment, w)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_is_a_homogeneous_capsule() {
        let (length, radius, mass) = (0.16, 0.012, 0.25);
        let tool = MassProperties::of_tool(&Tool { mass, length, radius });
        // Summed over thin discs: radius r inside the axis, a circle's chord in the caps.
        let axis = length - radius;
        let (n, mut volume, mut first, mut along, mut across) = (200_000, 0.0, 0.0, 0.0, 0.0);
        let dz = (axis + 2.0 * radius) / f64::from(n);
        for i in 0..n {
            let z = -radius + (f64::from(i) + 0.5) * dz;
            let beyond = (-z).max(z - axis).max(0.0);
            let r2 = radius * radius - beyond * beyond;
            let dv = std::f64::consts::PI * r2 * dz;
            volume += dv;
            first += dv * z;
            along += dv * r2 / 2.0;
            across += dv * (r2 / 4.0 + (z - axis / 2.0).powi(2));
        }
        assert!((tool.centre.z - first / volume).abs() < 1e-9);
        assert!((tool.inertia[(2, 2)] / (along / volume * mass) - 1.0).abs() < 1e-6);
        assert!((tool.inertia[(0, 0)] / (across / volume * mass) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn joining_two_halves_gives_the_whole() {
        let ball = MassProperties::new(1.0, [0.1, 0.0, 0.0], [0.4, 0.4, 0.4, 0.0, 0.0, 0.0]);
        let other = MassProperties::new(1.0, [-0.1, 0.0, 0.0], [0.4, 0.4, 0.4, 0.0, 0.0, 0.0]);
        let both = ball.joined_with(&other);
        assert!(both.centre.norm() < 1e-15 && (both.mass - 2.0).abs() < 1e-15);
        assert!((both.inertia[(0, 0)] - 0.8).abs() < 1e-12 && (both.inertia[(1, 1)] - 0.82).abs() < 1e-12);
    }
}
