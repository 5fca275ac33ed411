//! The way in from a URDF file, which `urdf-rs` reads. Finds the one chain of movable joints, folds what is fixed
//! into the link it is fixed to, and names joint and remedy where the file is no serial arm.

use super::inertia::MassProperties;
use super::model::{Chain, Joint, ModelError};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use shared_mem::input;
use std::path::Path;
use urdf_rs::{JointType, Pose, Robot};

/// Reads the serial chain of a URDF. The flange is the end of the fixed joints behind the last movable one, following
/// the first of them in file order at each fork.
pub(super) fn chain(file: &Path) -> Result<Chain, ModelError> {
    let text = input::text(file, input::Kind::Robot)?;
    let robot = urdf_rs::read_from_string(&text)
        .map_err(|error| ModelError::Read { path: file.to_owned(), what: error.to_string() })?;
    Tree { robot: &robot, file }.chain()
}

struct Tree<'a> {
    robot: &'a Robot,
    file: &'a Path,
}

impl Tree<'_> {
    fn chain(&self) -> Result<Chain, ModelError> {
        let root = self.root()?;
        let mut chain = Chain { joints: Vec::new(), base_frame: root.to_owned(), flange: Isometry3::identity() };
        let mut link = root;
        loop {
            let rigid = self.rigid_group(link)?;
            if let Some(last) = chain.joints.last_mut() {
                last.body = rigid.body;
            }
            let [(joint, at)] = &rigid.movable[..] else {
                if let Some((joint, _)) = rigid.movable.first() {
                    let others = rigid.movable[1..].iter().map(|(j, _)| format!("`{}`", j.name)).collect::<Vec<_>>();
                    return Err(self.error(format!(
                        "joints `{}` and {} branch off link `{link}`; only serial arms are supported: make all but one of them fixed",
                        joint.name,
                        others.join(", ")
                    )));
                }
                chain.flange = rigid.end;
                return Ok(chain);
            };
            if chain.joints.len() > self.robot.joints.len() {
                return Err(self.error(format!("joint `{}` closes a loop; only serial arms are supported", joint.name)));
            }
            chain.joints.push(self.movable(joint, at)?);
            link = &joint.child.link;
        }
    }

    fn root(&self) -> Result<&str, ModelError> {
        let mut roots = self.robot.links.iter().filter(|l| self.robot.joints.iter().all(|j| j.child.link != l.name));
        match (roots.next(), roots.next()) {
            (Some(root), None) => Ok(&root.name),
            (Some(a), Some(b)) => Err(self.error(format!(
                "links `{}` and `{}` both hang on nothing; join them with a fixed joint",
                a.name, b.name
            ))),
            _ => Err(self.error("no link is the root; the joints form a loop, cut it".into())),
        }
    }

    /// Everything fixed to `link`: its mass, the movable joints that start on it, and the end of the fixed joints.
    fn rigid_group(&self, link: &str) -> Result<RigidGroup<'_>, ModelError> {
        let mut group = RigidGroup::default();
        let mut end = None;
        let mut open = vec![(link.to_owned(), Isometry3::identity(), true)];
        let mut visited = 0;
        while let Some((name, at, on_path)) = open.pop() {
            visited += 1;
            if visited > self.robot.links.len() {
                return Err(self.error(format!("fixed joints behind link `{link}` form a loop; cut it")));
            }
            group.body = group.body.joined_with(&self.body(&name)?.seen_from(&at));
            let mut path_goes_on = false;
            for joint in self.robot.joints.iter().filter(|j| j.parent.link == name) {
                let to_joint = at * isometry(&joint.origin);
                if joint.joint_type == JointType::Fixed {
                    open.push((joint.child.link.clone(), to_joint, on_path && !path_goes_on));
                    path_goes_on = true;
                } else {
                    group.movable.push((joint, to_joint));
                }
            }
            if on_path && !path_goes_on {
                end = Some(at);
            }
        }
        group.end = end.unwrap_or_else(Isometry3::identity);
        Ok(group)
    }

    fn body(&self, name: &str) -> Result<MassProperties, ModelError> {
        let link = self
            .robot
            .links
            .iter()
            .find(|l| l.name == name)
            .ok_or_else(|| self.error(format!("link `{name}` is used by a joint but not described; add it")))?;
        let i = &link.inertial.inertia;
        let local = MassProperties::new(link.inertial.mass.value, [0.0; 3], [i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz]);
        let numbers = [local.mass, i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz];
        if numbers.iter().any(|v| !v.is_finite()) || numbers[..4].iter().any(|v| *v < 0.0) {
            return Err(
                self.error(format!("link `{name}` has a negative or infinite mass or inertia; correct its <inertial>"))
            );
        }
        Ok(local.seen_from(&isometry(&link.inertial.origin)))
    }

    fn movable(&self, joint: &urdf_rs::Joint, at: &Isometry3<f64>) -> Result<Joint, ModelError> {
        let slides = match joint.joint_type {
            JointType::Revolute | JointType::Continuous => false,
            JointType::Prismatic => true,
            _ => {
                return Err(self.error(format!(
                    "joint `{}` is neither revolute, continuous, prismatic nor fixed; only those are supported",
                    joint.name
                )));
            }
        };
        let axis = Unit::try_new(Vector3::from(joint.axis.xyz.0), 1e-9).ok_or_else(|| {
            self.error(format!(
                "joint `{}` has an axis of length 0; give a direction, for example xyz=\"0 0 1\"",
                joint.name
            ))
        })?;
        let limit = &joint.limit;
        let bounded = joint.joint_type != JointType::Continuous && limit.upper > limit.lower;
        let position = if bounded { [limit.lower, limit.upper] } else { [f64::NEG_INFINITY, f64::INFINITY] };
        Ok(Joint {
            name: joint.name.clone(),
            slides,
            origin: *at,
            axis,
            body: MassProperties::default(),
            position,
            velocity: known_limit(limit.velocity),
            torque: known_limit(limit.effort),
            rotor_inertia: 0.0,
            ready: if position[0] <= 0.0 && 0.0 <= position[1] { 0.0 } else { 0.5 * (position[0] + position[1]) },
        })
    }

    fn error(&self, what: String) -> ModelError {
        ModelError::Chain { path: self.file.to_owned(), what }
    }
}

#[derive(Default)]
struct RigidGroup<'a> {
    body: MassProperties,
    movable: Vec<(&'a urdf_rs::Joint, Isometry3<f64>)>,
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
