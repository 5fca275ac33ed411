//! Typed rigid transforms. `Pose<To, From>` maps coordinates in `From` to coordinates in `To`, so poses multiply only
//! where the inner frames agree: `base_from_camera * camera_from_object` is a `Pose<Base, Object>`.
//!
//! Names read left to right in the same order: `base_from_flange`. All frames are right-handed, metres.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

/// The robot's base: `robot.base_frame` of cell.toml, z up, x to the front. The cell's world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base;
/// The mounting flange of the last link, z outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flange;
/// The end of the tool, axes parallel to the flange's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip;
/// The colour camera's optical frame: z forward, x right, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera;
/// The object: axes along a box's edges as listed in `object.size`, or those of the mesh's file; origin in its geometric
/// centre. That is the middle of its bounding box along these axes, of a box and of a mesh alike: neither the origin of the
/// mesh's file nor the centroid of its corners or of its volume. Poses of the object, its centre of mass and its ranges all
/// count from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object;

/// A rigid transform from frame `From` to frame `To`.
///
/// Inner frames must agree, or the program does not compile:
///
/// ```
/// use nalgebra::Point3;
/// use shared_mem::frames::{Base, Camera, Object, Pose};
///
/// // The camera hangs one metre above the base and looks down: its z is minus the base's.
/// let base_from_camera = Pose::<Base, Camera>::from_parts([0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]).expect("a direction");
/// let camera_from_object = Pose::<Camera, Object>::from_parts([0.2, 0.0, 0.9], [1.0, 0.0, 0.0, 0.0]).expect("a direction");
/// let base_from_object: Pose<Base, Object> = base_from_camera * camera_from_object;
/// let [x, y, z] = base_from_object.position(); // m
/// assert!((x - 0.2).abs() < 1e-12 && y.abs() < 1e-12 && (z - 0.1).abs() < 1e-12);
///
/// let corner = base_from_object.transform_point(&Point3::new(0.0, 0.0, 0.05));
/// assert!((corner.z - 0.05).abs() < 1e-12);
/// ```
pub struct Pose<To, From> {
    isometry: Isometry3<f64>,
    frames: PhantomData<(To, From)>,
}

impl<To, From> Pose<To, From> {
    /// The frames coincide.
    pub fn identity() -> Self {
        Self::from_isometry(Isometry3::identity())
    }

    /// Names the frames of a raw transform: for physics, rendering and file formats, which speak raw transforms.
    pub fn from_isometry(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// From a position in metres and a quaternion `w, x, y, z`, which is normalised. `None` when the quaternion has no
    /// direction or a number is not finite.
    pub fn from_parts(position: [f64; 3], wxyz: [f64; 4]) -> Option<Self> {
        let finite = position.iter().chain(&wxyz).all(|v| v.is_finite());
        let q = Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
        (finite && q.norm() > 1e-9).then(|| {
            Self::from_isometry(Isometry3::from_parts(
                Translation3::from(Vector3::from(position)),
                UnitQuaternion::from_quaternion(q),
            ))
        })
    }

    /// The raw transform.
    pub fn isometry(&self) -> Isometry3<f64> {
        self.isometry
    }

    /// Origin of `From` in `To` [m].
    pub fn position(&self) -> [f64; 3] {
        self.isometry.translation.vector.into()
    }

    /// Rotation from `From` to `To` as `w, x, y, z`.
    pub fn wxyz(&self) -> [f64; 4] {
        let q = self.isometry.rotation.quaternion();
        [q.w, q.i, q.j, q.k]
    }

    /// The transform the other way round.
    pub fn inverse(&self) -> Pose<From, To> {
        Pose::from_isometry(self.isometry.inverse())
    }

    /// A point given in `From`, expressed in `To` [m].
    pub fn transform_point(&self, point: &Point3<f64>) -> Point3<f64> {
        self.isometry.transform_point(point)
    }

    /// Angle of the rotation between this pose and another [rad], 0 to pi.
    pub fn angle_to(&self, other: &Self) -> f64 {
        self.isometry.rotation.angle_to(&other.isometry.rotation)
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;
    fn mul(self, rhs: Pose<B, C>) -> Pose<A, C> {
        Pose::from_isometry(self.isometry * rhs.isometry)
    }
}

// Derived implementations would ask the markers for the same traits.
impl<To, From> Clone for Pose<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Pose<To, From> {}
impl<To, From> PartialEq for Pose<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.isometry == other.isometry
    }
}
impl<To, From> fmt::Debug for Pose<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pose").field("position", &self.position()).field("wxyz", &self.wxyz()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pose_times_its_inverse_is_identity(
            p in prop::array::uniform3(-2.0..2.0f64), q in prop::array::uniform4(-1.0..1.0f64),
        ) {
            prop_assume!(q.iter().map(|v| v * v).sum::<f64>() > 1e-3);
            let base_from_object = Pose::<Base, Object>::from_parts(p, q).expect("a usable quaternion");
            let identity = base_from_object * base_from_object.inverse();
            prop_assert!(identity.isometry().translation.vector.norm() < 1e-12);
            prop_assert!(identity.isometry().rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn a_quaternion_without_direction_is_refused() {
        assert!(Pose::<Base, Object>::from_parts([0.0; 3], [0.0; 4]).is_none());
        assert!(Pose::<Base, Object>::from_parts([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).is_none());
    }
}
