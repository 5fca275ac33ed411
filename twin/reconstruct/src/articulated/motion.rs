//! How the second state comes out of the first: the whole object has another pose, and its part has moved on a joint.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Rotations below this are none [rad].
const NO_TURN: f64 = 1e-6;

/// A joint with one degree of freedom and how far it has moved, in the frame of the first state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Joint {
    Revolute {
        /// A point of its axis [m].
        point: Point3<f64>,
        /// The axis' direction; positive angles turn right-handed about it.
        axis: Unit<Vector3<f64>>,
        /// From the first state to the second [rad].
        angle: f64,
    },
    Prismatic {
        /// From the first state to the second [m].
        travel: Vector3<f64>,
    },
}

impl Joint {
    /// What the part does from the first state to the second.
    pub fn motion(&self) -> Isometry3<f64> {
        match self {
            Self::Revolute { point, axis, angle } => {
                let turn = UnitQuaternion::from_axis_angle(axis, *angle);
                Isometry3::from_parts(Translation3::from(point.coords - turn * point.coords), turn)
            }
            Self::Prismatic { travel } => {
                Isometry3::from_parts(Translation3::from(*travel), UnitQuaternion::identity())
            }
        }
    }

    /// What the part does from position 0 to a position [rad or m].
    pub fn by(&self, position: f64) -> Isometry3<f64> {
        match *self {
            Self::Revolute { point, axis, .. } => Self::Revolute { point, axis, angle: position }.motion(),
            Self::Prismatic { .. } => Self::Prismatic { travel: self.direction().into_inner() * position }.motion(),
        }
    }

    /// How far it goes [rad or m].
    pub fn travel(&self) -> f64 {
        match self {
            Self::Revolute { angle, .. } => *angle,
            Self::Prismatic { travel } => travel.norm(),
        }
    }

    /// The hinge that comes nearest to a rigid motion: its axis is that of the screw, its pitch left out. A motion without rotation
    /// becomes a small one about an axis far away, across the translation. `near` is where the axis' point shall be near to.
    pub fn hinge(motion: &Isometry3<f64>, near: &Point3<f64>) -> Self {
        let shift = motion * near - near;
        let (axis, angle) = match motion.rotation.axis_angle() {
            Some((axis, angle)) if angle > NO_TURN => (axis, angle),
            _ => {
                let across = shift.cross(&Vector3::ith(shift.iamin(), 1.0));
                (Unit::new_normalize(across.try_normalize(1e-12).unwrap_or_else(Vector3::z)), NO_TURN)
            }
        };
        let across = shift - axis.into_inner() * axis.dot(&shift);
        let point = near + (across + axis.cross(&across) / (0.5 * angle).tan()) * 0.5;
        Self::Revolute { point, axis, angle }
    }

    /// The slide that moves a place as a rigid motion does.
    pub fn slide(motion: &Isometry3<f64>, near: &Point3<f64>) -> Self {
        Self::Prismatic { travel: motion * near - near }
    }

    /// The joint as another frame sees it.
    pub fn seen_from(&self, frame: &Isometry3<f64>) -> Self {
        match self {
            Self::Revolute { point, axis, angle } => {
                Self::Revolute { point: frame * point, axis: frame.rotation * axis, angle: *angle }
            }
            Self::Prismatic { travel } => Self::Prismatic { travel: frame.rotation * travel },
        }
    }

    /// The way back.
    pub fn reversed(&self) -> Self {
        match *self {
            Self::Revolute { point, axis, angle } => Self::Revolute { point, axis: -axis, angle },
            Self::Prismatic { travel } => Self::Prismatic { travel: -travel },
        }
    }

    pub fn direction(&self) -> Unit<Vector3<f64>> {
        match self {
            Self::Revolute { axis, .. } => *axis,
            Self::Prismatic { travel } => Unit::new_normalize(*travel),
        }
    }

    /// With the axis' point where the axis comes nearest to a place.
    pub fn near(self, place: &Point3<f64>) -> Self {
        match self {
            Self::Revolute { point, axis, angle } => {
                Self::Revolute { point: point + axis.into_inner() * axis.dot(&(place - point)), axis, angle }
            }
            slide => slide,
        }
    }

    /// Numbers that may change.
    pub(super) fn freedoms(&self) -> usize {
        match self {
            Self::Revolute { .. } => 5,
            Self::Prismatic { .. } => 3,
        }
    }

    /// Changed in one of its numbers; rotations by the arc at the radius `reach` [m].
    fn changed(self, number: usize, by: f64, reach: f64) -> Self {
        match self {
            Self::Prismatic { travel } => Self::Prismatic { travel: travel + Vector3::ith(number, by) },
            Self::Revolute { point, axis, angle } => {
                let aside = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
                let across = [aside, axis.cross(&aside)];
                match number {
                    0 | 1 => {
                        let axis = Unit::new_normalize(axis.into_inner() + across[number] * (by / reach));
                        Self::Revolute { point, axis, angle }
                    }
                    2 | 3 => Self::Revolute { point: point + across[number - 2] * by, axis, angle },
                    _ => Self::Revolute { point, axis, angle: angle + by / reach },
                }
            }
        }
    }
}

/// What may change in a fit.
#[derive(Debug, Clone, Copy)]
pub(super) enum Motion {
    /// One pose of the second state for all points of the first.
    Pose(Isometry3<f64>),
    /// The pose of the whole, and what its part does beforehand.
    Jointed(Isometry3<f64>, Joint),
}

impl Motion {
    /// From points of the first state to the second: of the whole, and of its part if there is one.
    pub(super) fn poses(&self) -> [Isometry3<f64>; 2] {
        match self {
            Self::Pose(pose) => [*pose; 2],
            Self::Jointed(whole, joint) => [*whole, whole * joint.motion()],
        }
    }

    /// The direction in which the part slides, in the first state's frame; `None` for a hinge.
    pub(super) fn slide(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Jointed(_, Joint::Prismatic { travel }) => travel.try_normalize(0.0),
            _ => None,
        }
    }

    pub(super) fn freedoms(&self) -> usize {
        match self {
            Self::Pose(_) => 6,
            Self::Jointed(_, joint) => 6 + joint.freedoms(),
        }
    }

    /// Changed in one of its numbers; rotations of the whole about `middle` of the second state, by the arc at the radius `reach` [m].
    pub(super) fn changed(self, number: usize, by: f64, middle: &Point3<f64>, reach: f64) -> Self {
        let moved = |pose: Isometry3<f64>| {
            if number < 3 {
                return Translation3::from(Vector3::ith(number, by)) * pose;
            }
            let turn = UnitQuaternion::from_scaled_axis(Vector3::ith(number - 3, by / reach));
            let about = Isometry3::from_parts(Translation3::from(middle.coords - turn * middle.coords), turn);
            about * pose
        };
        match self {
            Self::Pose(pose) => Self::Pose(moved(pose)),
            Self::Jointed(whole, joint) if number < 6 => Self::Jointed(moved(whole), joint),
            Self::Jointed(whole, joint) => Self::Jointed(whole, joint.changed(number - 6, by, reach)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hinge_is_found_back_from_its_motion_and_a_slide_is_a_hinge_far_away() {
        let axis = Unit::new_normalize(Vector3::new(0.2, -0.9, 0.1));
        let joint = Joint::Revolute { point: Point3::new(0.1, 0.2, -0.05), axis, angle: 0.7 };
        let near = Point3::new(0.3, 0.1, 0.0);
        let found = Joint::hinge(&joint.motion(), &near);
        let (Joint::Revolute { axis: found_axis, angle, .. }, Joint::Revolute { point, .. }) = (found, joint) else {
            panic!("a hinge")
        };
        assert!((found_axis.into_inner() - axis.into_inner()).norm() < 1e-9 && (angle - 0.7).abs() < 1e-9);
        assert!((found.motion() * point - point).norm() < 1e-9);
        let slide = Joint::Prismatic { travel: Vector3::new(0.0, 0.1, 0.02) };
        let far = Joint::hinge(&slide.motion(), &near).motion();
        assert!((far * near - slide.motion() * near).norm() < 1e-6);
        let frame = Isometry3::new(Vector3::new(0.3, 0.1, 0.2), Vector3::new(0.1, 0.5, 0.2));
        let seen = joint.seen_from(&frame).motion();
        assert!(((seen * (frame * near)) - frame * (joint.motion() * near)).norm() < 1e-9);
    }
}
