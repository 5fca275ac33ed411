//! Three-vectors and rotations as plain arrays, written out so that the compiler keeps them in registers: the arm's
//! equations of motion are evaluated millions of times a minute. Called by the other files of [`crate::arm`] only.

pub(super) type Vec3 = [f64; 3];
/// A rotation by its rows: `rows[r][c]`.
pub(super) type Rot3 = [[f64; 3]; 3];

#[inline(always)]
pub(super) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(super) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `r v`.
#[inline(always)]
pub(super) fn rotate(r: &Rot3, v: Vec3) -> Vec3 {
    [dot(r[0], v), dot(r[1], v), dot(r[2], v)]
}

/// `a b`.
#[inline(always)]
pub(super) fn product(a: &Rot3, b: &Rot3) -> Rot3 {
    let mut out = [[0.0; 3]; 3];
    for r in 0..3 {
        for c in 0..3 {
            out[r][c] = a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
        }
    }
    out
}

/// `r Rz(angle)`, the angle given by its sine and cosine.
#[inline(always)]
pub(super) fn turn_about_z(r: &Rot3, sin: f64, cos: f64) -> Rot3 {
    let row = |v: &Vec3| [v[0] * cos + v[1] * sin, v[1] * cos - v[0] * sin, v[2]];
    [row(&r[0]), row(&r[1]), row(&r[2])]
}

/// A motion or a force about the base origin: angular part (rotation, moment) and linear part (velocity of the body
/// point at the origin, force).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spatial {
    pub(super) angular: Vec3,
    pub(super) linear: Vec3,
}

impl Spatial {
    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self { angular: add(self.angular, other.angular), linear: add(self.linear, other.linear) }
    }

    #[inline(always)]
    pub(super) fn times(self, s: f64) -> Self {
        Self { angular: scale(self.angular, s), linear: scale(self.linear, s) }
    }

    /// Power of a force on a motion, or the component of a force along a joint's motion.
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> f64 {
        dot(self.angular, other.angular) + dot(self.linear, other.linear)
    }

    /// Rate of change of `motion` when it is carried along by the motion `self`.
    #[inline(always)]
    pub(super) fn carry_motion(self, motion: Self) -> Self {
        Self {
            angular: cross(self.angular, motion.angular),
            linear: add(cross(self.angular, motion.linear), cross(self.linear, motion.angular)),
        }
    }

    /// Rate of change of `force` when it is carried along by the motion `self`.
    #[inline(always)]
    pub(super) fn carry_force(self, force: Self) -> Self {
        Self {
            angular: add(cross(self.angular, force.angular), cross(self.linear, force.linear)),
            linear: cross(self.angular, force.linear),
        }
    }
}
