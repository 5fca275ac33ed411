//! The equations of motion of a serial chain, `M(q) ddq + bias(q, dq) = tau`, for a number of joints known at compile
//! time. Everything is expressed in the base frame about the base origin: bodies then add up without transforms.
//!
//! Composite rigid bodies for `M`, Newton-Euler for `bias` (Featherstone, Rigid Body Dynamics Algorithms, 2008,
//! chapters 5 and 6), `L D L'` to solve. Called by [`super::dynamics`], which chooses the number of joints.

use super::inertia::TenParameters;
use super::spatial::{Rot3, Spatial, Vec3, add, cross, product, rotate, scale, turn_about_z};
use super::{Joints, MAX_JOINTS};

/// Evaluates an expression with the arm's number of joints as the constant `$N`.
macro_rules! with_dof {
    ($arm:expr, $N:ident => $body:expr) => {
        with_dof!(@ $arm, $N, $body, 1 2 3 4 5 6 7; 8)
    };
    (@ $arm:expr, $N:ident, $body:expr, $($n:literal)*; $most:literal) => {
        match $arm.dof {
            $($n => { const $N: usize = $n; $body })*
            _ => { const $N: usize = $most; $body }
        }
    };
}
pub(super) use with_dof;

/// The first `N` of [`MAX_JOINTS`] entries.
#[inline(always)]
pub(super) fn first<const N: usize, T>(all: &[T; MAX_JOINTS]) -> &[T; N] {
    all.first_chunk().expect("no arm has more joints than MAX_JOINTS")
}

/// `N` entries, filled up with zeros.
#[inline(always)]
pub(super) fn filled<const N: usize>(values: &[f64; N]) -> Joints {
    let mut out = [0.0; MAX_JOINTS];
    out[..N].copy_from_slice(values);
    out
}

/// One joint and the body behind it, in a frame whose z axis is the joint's axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Link {
    /// Rotation from the joint's frame at 0 to the frame of the link before.
    pub(super) rotation: Rot3,
    /// Origin of the joint's frame in the frame of the link before [m].
    pub(super) translation: Vec3,
    /// 1 when the joint slides along its axis, 0 when it turns about it.
    pub(super) slides: bool,
    /// The body behind the joint.
    pub(super) body: TenParameters,
    /// Rotor inertia seen at the joint [kg m²].
    pub(super) rotor: f64,
}

/// Frame of a link in the base.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frame {
    pub(super) rotation: Rot3,
    pub(super) origin: Vec3,
}

/// Where the links are and how each joint moves what lies behind it.
pub(super) struct Chain<const N: usize> {
    pub(super) frames: [Frame; N],
    /// Motion of the bodies behind a joint at unit velocity, about the base origin.
    pub(super) axes: [Spatial; N],
}

/// Sines and cosines of the joints' positions.
#[derive(Clone, Copy)]
pub(super) struct Angles<const N: usize> {
    sin: [f64; N],
    cos: [f64; N],
}

/// Turns by less than this are taken from the series of sine and cosine, whose next term is then below rounding [rad].
const SMALL_TURN: f64 = 0.02;

impl<const N: usize> Angles<N> {
    #[inline(always)]
    pub(super) fn of(q: &[f64; N]) -> Self {
        let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (sin[i], cos[i]) = q[i].sin_cos();
        }
        Self { sin, cos }
    }

    /// Those of positions that are `turn` further.
    #[inline(always)]
    pub(super) fn turned(&self, q: &[f64; N], turn: &[f64; N]) -> Self {
        if !turn.iter().all(|turn| turn.abs() < SMALL_TURN) {
            return Self::of(&std::array::from_fn(|i| q[i] + turn[i]));
        }
        let mut out = *self;
        for (i, turn) in turn.iter().enumerate() {
            let square = turn * turn;
            let sin =
                turn * (1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0))));
            // The cosine less 1: a small number that keeps its digits.
            let off = -0.5 * square * (1.0 - square * (1.0 / 12.0) * (1.0 - square * (1.0 / 30.0)));
            out.sin[i] += self.sin[i] * off + self.cos[i] * sin;
            out.cos[i] += self.cos[i] * off - self.sin[i] * sin;
        }
        out
    }
}

impl<const N: usize> Chain<N> {
    #[inline(always)]
    pub(super) fn at(links: &[Link; N], q: &[f64; N]) -> Self {
        Self::turned(links, q, &Angles::of(q))
    }

    /// The chain at positions whose sines and cosines are known.
    #[inline(always)]
    pub(super) fn turned(links: &[Link; N], q: &[f64; N], angles: &Angles<N>) -> Self {
        let mut frames = [Frame::default(); N];
        let mut axes = [Spatial::default(); N];
        let mut rotation: Rot3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut origin: Vec3 = [0.0; 3];
        for i in 0..N {
            let link = &links[i];
            origin = add(origin, rotate(&rotation, link.translation));
            let at_zero = product(&rotation, &link.rotation);
            let axis = [at_zero[0][2], at_zero[1][2], at_zero[2][2]];
            if link.slides {
                rotation = at_zero;
                origin = add(origin, scale(axis, q[i]));
                axes[i] = Spatial { angular: [0.0; 3], linear: axis };
            } else {
                rotation = turn_about_z(&at_zero, angles.sin[i], angles.cos[i]);
                axes[i] = Spatial { angular: axis, linear: cross(origin, axis) };
            }
            frames[i] = Frame { rotation, origin };
        }
        Self { frames, axes }
    }

    /// Bodies of the links in the base frame.
    #[inline(always)]
    pub(super) fn bodies(&self, links: &[Link; N]) -> [TenParameters; N] {
        let mut bodies = [TenParameters::default(); N];
        for i in 0..N {
            bodies[i] = links[i].body.seen_from_base(&self.frames[i].rotation, self.frames[i].origin);
        }
        bodies
    }

    /// Joint torques that hold `gravity` and the velocity-dependent forces: Newton-Euler at zero joint acceleration.
    #[inline(always)]
    pub(super) fn bias(&self, bodies: &[TenParameters; N], dq: &[f64; N], gravity: Vec3) -> [f64; N] {
        self.torques(bodies, dq, &[0.0; N], gravity)
    }

    /// Joint torques, but for those of the rotors, under which the joints accelerate by `ddq`: Newton-Euler.
    #[inline(always)]
    pub(super) fn torques(
        &self,
        bodies: &[TenParameters; N],
        dq: &[f64; N],
        ddq: &[f64; N],
        gravity: Vec3,
    ) -> [f64; N] {
        let mut velocity = Spatial::default();
        // Gravity acts like an acceleration of the base the other way.
        let mut acceleration = Spatial { angular: [0.0; 3], linear: scale(gravity, -1.0) };
        let mut forces = [Spatial::default(); N];
        for i in 0..N {
            let joint = self.axes[i].times(dq[i]);
            acceleration = acceleration.plus(velocity.carry_motion(joint)).plus(self.axes[i].times(ddq[i]));
            velocity = velocity.plus(joint);
            let momentum = bodies[i].momentum(velocity);
            forces[i] = bodies[i].momentum(acceleration).plus(velocity.carry_force(momentum));
        }
        let mut torques = [0.0; N];
        let mut behind = Spatial::default();
        for i in (0..N).rev() {
            behind = behind.plus(forces[i]);
            torques[i] = self.axes[i].dot(behind);
        }
        torques
    }

    /// Joint torques that hold the chain still against `gravity`.
    #[inline(always)]
    pub(super) fn gravity(&self, bodies: &[TenParameters; N], gravity: Vec3) -> [f64; N] {
        let mut torques = [0.0; N];
        let (mut mass, mut moment) = (0.0, [0.0; 3]);
        for i in (0..N).rev() {
            mass += bodies[i].mass;
            moment = add(moment, bodies[i].moment);
            let weight = Spatial { angular: cross(moment, gravity), linear: scale(gravity, mass) };
            torques[i] = -self.axes[i].dot(weight);
        }
        torques
    }

    /// Lower triangle of the mass matrix, rotor inertia on the diagonal.
    #[inline(always)]
    pub(super) fn mass_matrix(&self, bodies: &[TenParameters; N], links: &[Link; N]) -> [[f64; N]; N] {
        let mut mass = [[0.0; N]; N];
        let mut behind = TenParameters::default();
        for i in (0..N).rev() {
            behind = behind.plus(&bodies[i]);
            let momentum = behind.momentum(self.axes[i]);
            for (entry, axis) in mass[i].iter_mut().zip(&self.axes[..=i]) {
                *entry = axis.dot(momentum);
            }
            mass[i][i] += links[i].rotor;
        }
        mass
    }
}

/// Factors a symmetric positive definite matrix, given by its lower triangle, into `L D L'` in place: `L` below the
/// diagonal, `1 / D` on it.
#[inline(always)]
pub(super) fn factor<const N: usize>(a: &mut [[f64; N]; N]) {
    for j in 0..N {
        // Row j holds L(j, k) D(k) until its own diagonal is known, so that each product is formed once.
        let mut d = a[j][j];
        for k in 0..j {
            let scaled = a[j][k];
            let l = scaled * a[k][k];
            d -= scaled * l;
            a[j][k] = l;
            for row in &mut a[j + 1..] {
                row[j] -= row[k] * l;
            }
        }
        a[j][j] = 1.0 / d;
    }
}

/// Solves `L D L' x = b` with the output of [`factor`].
#[inline(always)]
pub(super) fn solve<const N: usize>(factors: &[[f64; N]; N], b: &[f64; N]) -> [f64; N] {
    let mut x = *b;
    for i in 0..N {
        for j in 0..i {
            x[i] -= factors[i][j] * x[j];
        }
    }
    for i in (0..N).rev() {
        x[i] *= factors[i][i];
        for j in i + 1..N {
            x[i] -= factors[j][i] * x[j];
        }
    }
    x
}
