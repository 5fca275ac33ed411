//! The way in from a URDF file, which `urdf-rs` reads. Finds the one chain of movable joints, folds what is fixed
//! into the link it is fixed to, and names line, joint and remedy where the file is no serial arm.
//!
//! Other joints than the arm's, of fingers, wheels or a base that drives, are held at 0, or at the end of their range that is nearest to
//! it, and what they carry is folded into the link that they hang on. `choice` tells them apart.

mod bodies;
mod choice;
mod doubts;
mod frames;
mod moving_base;

pub use bodies::{UrdfBody, UrdfForm, UrdfJoint, UrdfShape};
pub use frames::{LinkFrame, UrdfFrames};

use super::chain::{Chain, Joint};
use super::error::ModelError;
use super::inertia::MassProperties;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use shared_mem::{input, place};
use std::collections::HashMap;
use std::path::Path;
use urdf_rs::{JointType, Pose, Robot};

/// The text of a URDF with the dry friction [N m or N] and the damping [N m s/rad or N s/m] of a joint, all else as it is; `file` names it
/// in errors.
///
/// # Errors
/// [`ModelError`] with the line, where it is no XML or has no such joint.
pub fn with_joint_friction(
    text: &str,
    file: &Path,
    joint: &str,
    [friction, damping]: [f64; 2],
) -> Result<String, ModelError> {
    let fault = |error: urdf_rs::UrdfError| ModelError::Read { path: file.to_owned(), what: error.to_string() };
    urdf_rs::with_dynamics(text, joint, friction, damping).map_err(fault)
}

/// The text of a URDF with these attributes of `<dynamics>` or `<limit>` of a joint, in the format's units, all else as it is; a `<limit>`
/// that is not there stays away. `file` names it in errors.
///
/// # Errors
/// [`ModelError`] with the line, where it is no XML or has no such joint.
pub fn with_joint_numbers(
    text: &str,
    file: &Path,
    (joint, tag): (&str, &str),
    values: &[(&str, f64)],
) -> Result<String, ModelError> {
    let fault = |error: urdf_rs::UrdfError| ModelError::Read { path: file.to_owned(), what: error.to_string() };
    urdf_rs::with_numbers(text, joint, tag, values).map_err(fault)
}

/// The text of a URDF with `more` before the end of its root, without those of its links and joints for which `drop` holds, by kind and
/// name, and declared as the UTF-8 that it is; all else as it is. `file` names it in errors.
///
/// # Errors
/// [`ModelError`] with the line, where it is no XML.
pub fn with_elements(
    text: &str,
    file: &Path,
    more: &str,
    drop: &dyn Fn(&str, &str) -> bool,
) -> Result<String, ModelError> {
    urdf_rs::with_elements(text, more, drop)
        .map_err(|error| ModelError::Read { path: file.to_owned(), what: error.to_string() })
}

/// The text of the URDF `file` as it finds its meshes and textures from the folder of `out`.
///
/// # Errors
/// [`ModelError`] with the line, where it is no XML.
pub fn with_files_found_from(text: &str, file: &Path, out: &Path) -> Result<String, ModelError> {
    let (from, to) = (place::from_anywhere(file), place::from_anywhere(out));
    if from.parent() == to.parent() {
        return Ok(text.to_owned());
    }
    let folder = from.parent().unwrap_or(Path::new("/"));
    let rename = |name: &str| {
        // package:// and the like are looked up elsewhere.
        let is_relative = !name.contains("://") && Path::new(name).is_relative();
        is_relative.then(|| place::from_anywhere(&folder.join(name)).display().to_string())
    };
    urdf_rs::with_files(text, &rename)
        .map_err(|error| ModelError::Read { path: file.to_owned(), what: error.to_string() })
}

/// Reads the serial chain of a URDF: of the `joints` with these names, or where they are none of its joints' names of those that
/// it tells itself. The flange is the end of the fixed joints behind the last one, following the first of them in file order at each fork.
pub(super) fn chain(file: &Path, joints: &[String]) -> Result<Chain, ModelError> {
    // From the root, so that an error names the folder that was looked in.
    chain_of(&input::text(&place::from_anywhere(file), input::Kind::Robot)?, file, joints)
}

/// The same of a text; `file` names it in errors.
pub(super) fn chain_of(text: &str, file: &Path, joints: &[String]) -> Result<Chain, ModelError> {
    Tree::of(&read(text, file)?, file)?.chain(joints)
}

fn read(text: &str, file: &Path) -> Result<Robot, ModelError> {
    urdf_rs::read_from_string(text).map_err(|error| ModelError::Read { path: file.to_owned(), what: error.to_string() })
}

struct Tree<'a> {
    robot: &'a Robot,
    file: &'a Path,
    root: &'a str,
    /// By link: the joints that start on it, in file order.
    joints: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
    /// By link: joints of an arm on the longest way from it to an end.
    reach: HashMap<&'a str, usize>,
}

impl<'a> Tree<'a> {
    fn of(robot: &'a Robot, file: &'a Path) -> Result<Self, ModelError> {
        let (mut joints, mut parents): (HashMap<_, Vec<_>>, HashMap<&str, &urdf_rs::Joint>) = Default::default();
        for joint in &robot.joints {
            joints.entry(joint.parent.link.as_str()).or_default().push(joint);
            if let Some(other) = parents.insert(&joint.child.link, joint) {
                let what = format!(
                    "link `{}` hangs on joints `{}` (line {}) and `{}`; a link hangs on one joint",
                    joint.child.link, other.name, other.line, joint.name
                );
                return Err(at_line(file, joint.line, &what));
            }
        }
        let mut tree = Self { robot, file, root: root(robot, file, &parents)?, joints, reach: HashMap::new() };
        tree.measure();
        match robot.links.iter().find(|link| !tree.reach.contains_key(link.name.as_str())) {
            Some(link) => {
                Err(tree.error(link.line, &format!("link `{}` hangs in a loop of joints; cut it", link.name)))
            }
            None => Ok(tree),
        }
    }

    /// From the ends to the root. Every link hangs on one joint, so each is met once.
    fn measure(&mut self) {
        let (mut order, mut next) = (vec![self.root], 0);
        while let Some(link) = order.get(next).copied() {
            order.extend(self.behind(link).map(|joint| joint.child.link.as_str()).collect::<Vec<_>>());
            next += 1;
        }
        for link in order.into_iter().rev() {
            let longest = self.behind(link).map(|joint| self.joints_from(joint)).max().unwrap_or(0);
            self.reach.insert(link, longest);
        }
    }

    fn behind(&self, link: &str) -> impl Iterator<Item = &'a urdf_rs::Joint> {
        self.joints.get(link).into_iter().flatten().copied()
    }

    /// Joints of an arm on the longest way that begins with `joint`.
    fn joints_from(&self, joint: &urdf_rs::Joint) -> usize {
        let counts = joint.joint_type != JointType::Fixed && joint.mimicked.is_none();
        usize::from(counts) + self.reach.get(joint.child.link.as_str()).copied().unwrap_or(0)
    }

    fn chain(&self, named: &[String]) -> Result<Chain, ModelError> {
        let choice = self.choose(named)?;
        if choice.joints.is_empty() && !self.robot.joints.iter().any(turns_or_slides) {
            return Err(self.error(1, "no joint of it turns or slides, so that it is no arm; give an arm's URDF"));
        }
        let mut chain = Chain {
            joints: Vec::new(),
            flange: Isometry3::identity(),
            held: self.held_beside(&choice),
            doubts: self.odd_numbers(&choice.joints).into_iter().chain(choice.doubts).collect(),
        };
        let (mut link, mut next) = (self.root, choice.joints.into_iter());
        loop {
            let joint = next.next();
            let rigid = self.rigid_group(link, joint)?;
            if let Some(last) = chain.joints.last_mut() {
                last.body = rigid.body;
            }
            let (Some(joint), Some(at)) = (joint, rigid.next) else {
                chain.flange = rigid.end;
                return Ok(chain);
            };
            chain.joints.push(self.movable(joint, &at)?);
            link = &joint.child.link;
        }
    }

    /// Everything rigid with `link`, joints that are held included: its mass, where `next` starts, and the end of the fixed joints.
    fn rigid_group(&self, link: &str, next: Option<&urdf_rs::Joint>) -> Result<RigidGroup, ModelError> {
        let mut group = RigidGroup::default();
        let mut end = None;
        let mut open = vec![(link, Isometry3::identity(), true)];
        while let Some((name, at, on_path)) = open.pop() {
            group.body = group.body.joined_with(&self.body(name)?.seen_from(&at));
            let mut path_goes_on = false;
            for joint in self.behind(name) {
                let to_joint = at * isometry(&joint.origin);
                if next.is_some_and(|next| next.name == joint.name) {
                    group.next = Some(to_joint);
                } else if joint.joint_type == JointType::Fixed {
                    open.push((&joint.child.link, to_joint, on_path && !path_goes_on));
                    path_goes_on = true;
                } else {
                    open.push((&joint.child.link, to_joint * self.held(joint)?, false));
                }
            }
            if on_path && !path_goes_on {
                end = Some(at);
            }
        }
        group.end = end.unwrap_or_else(Isometry3::identity);
        Ok(group)
    }

    /// Where a joint that is held holds what it carries, in the joint's frame at 0.
    fn held(&self, joint: &urdf_rs::Joint) -> Result<Isometry3<f64>, ModelError> {
        let at = rest(joint);
        if at == 0.0 {
            return Ok(Isometry3::identity());
        }
        let axis = self.axis(joint)?;
        Ok(match joint.joint_type {
            JointType::Prismatic => Translation3::from(axis.into_inner() * at).into(),
            _ => Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, at)),
        })
    }

    fn body(&self, name: &str) -> Result<MassProperties, ModelError> {
        let link = self.robot.links.iter().find(|link| link.name == name).ok_or_else(|| {
            let user = self.robot.joints.iter().find(|joint| joint.child.link == name || joint.parent.link == name);
            let (line, joint) = user.map_or((1, ""), |joint| (joint.line, joint.name.as_str()));
            self.error(line, &format!("link `{name}` is used by joint `{joint}` but not described; add it"))
        })?;
        let i = &link.inertial.inertia;
        let local = MassProperties::new(link.inertial.mass.value, [0.0; 3], [i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz]);
        let numbers = [local.mass, i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz];
        if numbers.iter().any(|v| !v.is_finite()) || numbers[..4].iter().any(|v| *v < 0.0) {
            let what = format!("link `{name}` has a negative or infinite mass or inertia; correct its <inertial>");
            return Err(self.error(link.line, &what));
        }
        Ok(local.seen_from(&isometry(&link.inertial.origin)))
    }

    fn movable(&self, joint: &urdf_rs::Joint, at: &Isometry3<f64>) -> Result<Joint, ModelError> {
        let slides = match joint.joint_type {
            JointType::Revolute | JointType::Continuous => false,
            JointType::Prismatic => true,
            _ => {
                let what = format!(
                    "joint `{}` is neither revolute, continuous, prismatic nor fixed; only those are supported",
                    joint.name
                );
                return Err(self.error(joint.line, &what));
            }
        };
        if let Some(other) = &joint.mimicked {
            let what = format!(
                "joint `{}` follows `{other}` (<mimic>) and carries further joints; only serial arms are supported: make it fixed",
                joint.name
            );
            return Err(self.error(joint.line, &what));
        }
        let axis = self.axis(joint)?;
        let limit = &joint.limit;
        let position = range(joint).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        Ok(Joint {
            name: joint.name.clone(),
            link: joint.child.link.clone(),
            slides,
            origin: *at,
            axis,
            body: MassProperties::default(),
            position,
            velocity: known_limit(limit.velocity),
            torque: known_limit(limit.effort),
            rotor_inertia: 0.0,
            ready: ready(position),
        })
    }

    fn axis(&self, joint: &urdf_rs::Joint) -> Result<Unit<Vector3<f64>>, ModelError> {
        Unit::try_new(Vector3::from(joint.axis.xyz.0), 1e-9).ok_or_else(|| {
            let what =
                format!("joint `{}` has an axis of length 0; give a direction, for example xyz=\"0 0 1\"", joint.name);
            self.error(joint.line, &what)
        })
    }

    fn error(&self, line: usize, what: &str) -> ModelError {
        at_line(self.file, line, what)
    }
}

fn turns_or_slides(joint: &urdf_rs::Joint) -> bool {
    matches!(joint.joint_type, JointType::Revolute | JointType::Continuous | JointType::Prismatic)
}

/// Least and largest position of a joint that has limits [rad or m]; swapped ones are turned round.
fn range(joint: &urdf_rs::Joint) -> Option<[f64; 2]> {
    let (lower, upper) = (joint.limit.lower, joint.limit.upper);
    (joint.joint_type != JointType::Continuous && lower != upper).then(|| [lower.min(upper), lower.max(upper)])
}

/// Where a joint is when nobody says where: at 0, or as near to it as its range allows.
fn rest(joint: &urdf_rs::Joint) -> f64 {
    range(joint).map_or(0.0, |[lower, upper]| 0.0_f64.clamp(lower, upper))
}

/// A joint nearer to an end of its range has no room for a motion to both sides: a share of the range, and a distance [rad or m]. Choices: a
/// capture keeps 0.05 to the ends.
const EDGE: [f64; 2] = [0.1, 0.1];

/// Where an arm begins: at 0, or as near to it as leaves room for a motion to both sides; in the middle of a range without 0.
fn ready([lower, upper]: [f64; 2]) -> f64 {
    let travel = upper - lower;
    if !travel.is_finite() {
        return 0.0_f64.clamp(lower, upper);
    }
    if !(lower..=upper).contains(&0.0) {
        return 0.5 * (lower + upper);
    }
    let edge = (EDGE[0] * travel).max(EDGE[1]).min(0.5 * travel);
    0.0_f64.max(lower + edge).min(upper - edge)
}

fn at_line(file: &Path, line: usize, what: &str) -> ModelError {
    ModelError::Chain { path: file.to_owned(), what: format!("line {line}: {what}") }
}

/// The one link that hangs on nothing.
fn root<'a>(robot: &'a Robot, file: &Path, parents: &HashMap<&str, &urdf_rs::Joint>) -> Result<&'a str, ModelError> {
    let mut roots = robot.links.iter().filter(|link| !parents.contains_key(link.name.as_str()));
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(&root.name),
        (Some(a), Some(b)) => {
            let what = format!(
                "links `{}` (line {}) and `{}` both hang on nothing; join them with a fixed joint",
                a.name, a.line, b.name
            );
            Err(at_line(file, b.line, &what))
        }
        _ => Err(at_line(file, 1, "no link is the root; the joints form a loop, cut it")),
    }
}

#[derive(Default)]
struct RigidGroup {
    body: MassProperties,
    /// Where the arm's next joint starts.
    next: Option<Isometry3<f64>>,
    end: Isometry3<f64>,
}

/// URDF files write 0 where nobody looked the limit up.
fn known_limit(value: f64) -> f64 {
    if value > 0.0 { value } else { f64::INFINITY }
}

/// URDF angles are roll, pitch, yaw about the fixed axes, as nalgebra's are.
fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(pose.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}
