//! Links and joints of a URDF: what the dynamics of an arm need of one, and what an object on joints touches with, for `twin` and for
//! `franka-rs`.
//!
//! The names and shapes are those of the published `urdf-rs` 0.9, as far as `franka-rs` uses them, so that one reader serves
//! the whole tree; `line`, `mimicked`, `collisions`, `friction` and `damping` are our own. Meaning and defaults follow `urdfdom` (<http://wiki.ros.org/urdf/XML>),
//! versions 1.0 to 1.2 of the format: lengths in m, angles in rad, masses in kg, inertias in kg m² about the inertial frame's
//! axes. Of an element that stands where one is expected twice the first counts, as there. Materials, transmissions and
//! everything else are passed over.
//!
//! | file | what it owns |
//! |---|---|
//! | `lib` | what a URDF says of links and joints |
//! | `tree` | from the stream of tags to links and joints, and which tags must be there |
//! | `tag` | the attributes of one tag: names and numbers |
//! | `dynamics` | a joint's friction and limits written into a file |
//! | `elements` | links and joints added to a file or taken out of it |
//! | `files` | meshes and textures named otherwise |

mod dynamics;
mod elements;
mod files;
mod tag;
#[cfg(test)]
mod tests;
mod tree;

pub use dynamics::{with_dynamics, with_numbers};
pub use elements::with_elements;
pub use files::with_files;

/// A robot: its links and joints in file order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Robot {
    /// Name of the robot; empty where the file gives none.
    pub name: String,
    /// Bodies. No two have the same name.
    pub links: Vec<Link>,
    /// What connects them. No two have the same name.
    pub joints: Vec<Joint>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Link {
    pub name: String,
    /// Its mass properties; all zero where the file gives none.
    pub inertial: Inertial,
    /// What it touches with.
    pub collisions: Vec<Collision>,
    /// Where it stands in the file, from 1.
    pub line: usize,
}

/// A shape with which a link touches.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Collision {
    /// The shape's frame in the link's.
    pub origin: Pose,
    /// The shape; `None` for one that the format does not know, or whose numbers are none.
    pub shape: Option<Shape>,
    /// Where it stands in the file, from 1.
    pub line: usize,
}

/// A shape around the origin of its frame [m].
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    Box([f64; 3]),
    Cylinder {
        radius: f64,
        length: f64,
    },
    /// Of this radius.
    Sphere(f64),
    Mesh {
        /// As it is named.
        file: String,
        /// Along its axes.
        scale: [f64; 3],
    },
}

/// Mass properties of a link.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inertial {
    /// The inertial frame in the link's; its origin is the centre of mass.
    pub origin: Pose,
    pub mass: Mass,
    /// The inertia about the centre of mass, along the inertial frame's axes.
    pub inertia: Inertia,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Mass {
    /// [kg]
    pub value: f64,
}

/// The six numbers of a symmetric inertia [kg m²].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[allow(missing_docs)] // the names are the format's own
pub struct Inertia {
    pub ixx: f64,
    pub ixy: f64,
    pub ixz: f64,
    pub iyy: f64,
    pub iyz: f64,
    pub izz: f64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vec3(pub [f64; 3]);

/// Where a frame stands in the one it hangs on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pose {
    /// Its origin [m].
    pub xyz: Vec3,
    /// Roll, pitch and yaw about the fixed x, y and z axes, in this order [rad].
    pub rpy: Vec3,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Joint {
    pub name: String,
    /// How it moves.
    pub joint_type: JointType,
    /// The joint's frame at 0 in the parent link's.
    pub origin: Pose,
    /// The link that it hangs on.
    pub parent: LinkName,
    /// The link that it carries.
    pub child: LinkName,
    /// Dry friction [N m or N]; 0 where the file gives none.
    pub friction: f64,
    /// Viscous friction [N m s/rad or N s/m]; 0 where the file gives none.
    pub damping: f64,
    pub axis: Axis,
    pub limit: JointLimit,
    /// The joint whose position it follows (`<mimic>`), if it does.
    pub mimicked: Option<String>,
    /// Where it stands in the file, from 1.
    pub line: usize,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(missing_docs)] // the names are the format's own
pub enum JointType {
    Revolute,
    Continuous,
    Prismatic,
    #[default]
    Fixed,
    Floating,
    Planar,
    Spherical,
}

/// A link, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LinkName {
    pub link: String,
}

/// The axis of a joint in the joint's frame, of any length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    pub xyz: Vec3,
}

impl Default for Axis {
    fn default() -> Self {
        Self { xyz: Vec3([1.0, 0.0, 0.0]) }
    }
}

/// Limits of a joint [rad, rad/s, N m, or m, m/s, N]. Before version 1.2 a limit that the file leaves out is 0, from then on
/// it is infinite.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointLimit {
    pub lower: f64,
    pub upper: f64,
    /// Largest torque or force.
    pub effort: f64,
    pub velocity: f64,
}

/// What is wrong with a URDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct UrdfError {
    /// The line, from 1.
    pub line: usize,
    /// Element and what is wrong with it, in one line.
    pub what: String,
}

/// Reads a URDF. Time and memory grow with its length and with nothing else that it says: no tag calls for recursion, and
/// entities stand for single characters.
///
/// # Errors
/// The first thing that is no XML, or that a link or a joint lacks, or that is no number, or a name that is given twice.
///
/// # Example
/// ```
/// use urdf_rs::{JointType, read_from_string};
///
/// let text = r#"<robot name="lever">
///   <link name="base"/>
///   <link name="rod"><inertial>
///     <mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
///   </inertial></link>
///   <joint name="hinge" type="revolute">
///     <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
///     <limit lower="-1" upper="1" effort="10" velocity="2"/>
///   </joint>
/// </robot>"#;
/// let robot = read_from_string(text)?;
/// let hinge = &robot.joints[0];
/// assert_eq!((hinge.joint_type, hinge.limit.upper), (JointType::Revolute, 1.0)); // rad
/// assert_eq!(robot.links[1].inertial.mass.value, 0.5); // kg
///
/// // What is wrong is named with its line.
/// let error = read_from_string("<robot>\n<link/>\n</robot>").unwrap_err();
/// assert_eq!(error.line, 2);
/// # Ok::<(), urdf_rs::UrdfError>(())
/// ```
pub fn read_from_string(text: &str) -> Result<Robot, UrdfError> {
    tree::read(text)
}
