//! A URDF as bodies on joints, for objects that move in themselves: a laptop, a drawer. What is fixed to a link belongs to it.

use super::{Tree, at_line, isometry, read};
use crate::arm::{MassProperties, ModelError};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};
use std::path::Path;
use urdf_rs::{JointType, Shape};

/// One rigid body of a URDF.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfBody {
    /// Its link; of several that are fixed to each other the one nearest to the root.
    pub link: String,
    /// What carries it; `None` for the root.
    pub joint: Option<UrdfJoint>,
    /// In the link's frame; nothing where the file says nothing.
    pub mass: MassProperties,
    /// What it touches with.
    pub shapes: Vec<UrdfShape>,
}

/// A joint that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfJoint {
    pub name: String,
    /// Place of the body that it hangs on, an earlier one.
    pub parent: usize,
    /// The body's frame in that of the body that it hangs on, at position 0.
    pub at: Isometry3<f64>,
    /// Whether it slides.
    pub slides: bool,
    /// Through the body's origin.
    pub axis: Unit<Vector3<f64>>,
    /// Least and largest position [rad or m].
    pub limits: [f64; 2],
    /// Dry friction [N m or N].
    pub friction: f64,
    /// Viscous friction [N m s/rad or N s/m].
    pub damping: f64,
}

impl UrdfJoint {
    /// The body's frame in that of the body that it hangs on, at a position [rad or m].
    pub fn pose_at(&self, position: f64) -> Isometry3<f64> {
        let moved = match self.slides {
            true => Isometry3::from_parts((self.axis.into_inner() * position).into(), nalgebra::one()),
            false => Isometry3::from_parts(nalgebra::one(), UnitQuaternion::from_axis_angle(&self.axis, position)),
        };
        self.at * moved
    }
}

/// A shape around the origin of its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfShape {
    /// Its frame in the body's.
    pub at: Isometry3<f64>,
    /// What it is.
    pub form: UrdfForm,
}

/// A shape [m].
#[derive(Debug, Clone, PartialEq)]
pub enum UrdfForm {
    Box([f64; 3]),
    Cylinder {
        radius: f64,
        length: f64,
    },
    /// A file, as it is named.
    Mesh(String),
}

impl UrdfBody {
    /// All bodies of a URDF's text, the root first and each behind the one that carries it; `file` names it in errors.
    ///
    /// # Errors
    /// [`ModelError`] with the line, when it is no URDF or no tree of links, a joint has no limits, follows another one or is of
    /// another kind than revolute, prismatic and fixed, or a shape is none of a box, a cylinder and a mesh.
    pub fn of(text: &str, file: &Path) -> Result<Vec<Self>, ModelError> {
        let robot = read(text, file)?;
        let tree = Tree::of(&robot, file)?;
        let root =
            Self { link: tree.root.to_owned(), joint: None, mass: MassProperties::default(), shapes: Vec::new() };
        let mut bodies = vec![root];
        // Links with the body that they belong to, and where they are in it.
        let mut open = vec![(tree.root, 0, Isometry3::identity())];
        while let Some((link, body, at)) = open.pop() {
            bodies[body].mass = bodies[body].mass.joined_with(&tree.body(link)?.seen_from(&at));
            let shapes = tree.shapes(link, &at)?;
            bodies[body].shapes.extend(shapes);
            for joint in tree.behind(link) {
                let there = at * isometry(&joint.origin);
                let child = joint.child.link.as_str();
                if joint.joint_type == JointType::Fixed {
                    open.push((child, body, there));
                    continue;
                }
                let joint = Some(tree.moving(joint, body, there)?);
                bodies.push(Self {
                    link: child.to_owned(),
                    joint,
                    mass: MassProperties::default(),
                    shapes: Vec::new(),
                });
                open.push((child, bodies.len() - 1, Isometry3::identity()));
            }
        }
        Ok(bodies)
    }
}

impl Tree<'_> {
    fn moving(&self, joint: &urdf_rs::Joint, parent: usize, at: Isometry3<f64>) -> Result<UrdfJoint, ModelError> {
        let fail = |what: String| Err(at_line(self.file, joint.line, &format!("joint `{}` {what}", joint.name)));
        if let Some(other) = &joint.mimicked {
            return fail(format!("follows `{other}` (<mimic>); make it fixed, or write the object as [[body]] blocks"));
        }
        let slides = match joint.joint_type {
            JointType::Revolute => false,
            JointType::Prismatic => true,
            JointType::Continuous => return fail("has no limits; make it revolute and give it a <limit>".into()),
            _ => return fail("is neither revolute, prismatic nor fixed; only those are supported".into()),
        };
        let limits = [joint.limit.lower, joint.limit.upper];
        if !(limits[0] < limits[1] && limits.iter().all(|limit| limit.is_finite())) {
            return fail("has no limits; give `lower` and `upper` of its <limit>".into());
        }
        let (friction, damping) = (joint.friction, joint.damping);
        if [friction, damping].iter().any(|value| !(0.0..=1e6).contains(value)) {
            return fail("has a negative or infinite friction or damping; correct its <dynamics>".into());
        }
        let axis = self.axis(joint)?;
        Ok(UrdfJoint { name: joint.name.clone(), parent, at, slides, axis, limits, friction, damping })
    }

    /// What a link touches with, whose frame lies at `at` in its body's.
    fn shapes(&self, link: &str, at: &Isometry3<f64>) -> Result<Vec<UrdfShape>, ModelError> {
        let collisions = self.robot.links.iter().filter(|other| other.name == link).flat_map(|link| &link.collisions);
        let shape = |collision: &urdf_rs::Collision| {
            let form = match &collision.shape {
                Some(Shape::Box(size)) => UrdfForm::Box(*size),
                Some(Shape::Cylinder { radius, length }) => UrdfForm::Cylinder { radius: *radius, length: *length },
                Some(Shape::Mesh { file, scale }) if *scale == [1.0; 3] => UrdfForm::Mesh(file.clone()),
                Some(Shape::Mesh { .. }) => {
                    let what = format!("a mesh of link `{link}` is scaled; scale the file itself");
                    return Err(at_line(self.file, collision.line, &what));
                }
                Some(Shape::Sphere(_)) | None => {
                    let what =
                        format!("a <collision> of link `{link}` is no box, cylinder or mesh; give it one of those");
                    return Err(at_line(self.file, collision.line, &what));
                }
            };
            Ok(UrdfShape { at: at * isometry(&collision.origin), form })
        };
        collisions.map(shape).collect()
    }
}
