//! What an arm is: a chain of joints with bodies, limits and a flange, and how cell.toml, a tool and a payload make one.
//! Built once by the bridge, the simulation and every rollout; then only read.

use super::chain::{Chain, HeldJoint, Joint};
use super::error::ModelError;
use super::inertia::{MassProperties, TenParameters};
use super::kernel::Link;
use super::spatial::{Rot3, Vec3};
use super::{JointState, Joints, MAX_JOINTS, fr3, urdf};
use nalgebra::{Isometry3, Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, Controller, GRAVITY, Robot};
use shared_mem::msg::joints_from;
use std::path::Path;

/// Free fall in the base frame [m/s²].
pub(crate) const FREE_FALL: Vec3 = [0.0, 0.0, -GRAVITY];

/// Inertia of a joint where no model is known, or the model gives it none [kg m²]: the reflected rotor of a common hobby servo (Feetech STS3215,
/// 0.028 after Rhoban's BAM identification). Only its ratio to the gains matters, and those are identified.
const UNKNOWN_INERTIA: f64 = 0.03;

/// An arm. Cloning copies a few kilobytes and allocates only for names.
///
/// ```
/// use twin::arm::ArmModel;
///
/// let arm = ArmModel::fr3();
/// assert_eq!(arm.dof(), 7);
/// let flange = arm.flange(arm.ready()); // in the base frame
/// let [x, y, z] = flange.position(); // m
/// assert!(x > 0.2 && y.abs() < 1e-9 && z > 0.3, "before the robot, in its middle, above the table");
/// let tau = arm.gravity(arm.ready()); // N m that hold it
/// assert!(tau[0].abs() < 1e-9, "the first axis is vertical");
/// assert!(tau[3] > 5.0 || tau[3] < -5.0, "{tau:?}");
/// ```
#[derive(Debug, Clone)]
pub struct ArmModel {
    pub(super) dof: usize,
    pub(super) links: [Link; MAX_JOINTS],
    pub(super) gravity: Vec3,
    /// The flange in the last link's frame, z along the last joint.
    pub(super) flange: Isometry3<f64>,
    pub(super) tool_length: f64,
    /// The tool in the flange frame; no mass without a tool.
    pub(super) tool: MassProperties,
    has_geometry: bool,
    joint_names: Vec<String>,
    /// Those in the arm's own file, where recordings call them otherwise.
    described_names: Option<Vec<String>>,
    /// Names of the links behind the joints, and each one's frame here in that of its source.
    link_names: Vec<String>,
    turns: Vec<UnitQuaternion<f64>>,
    held_joints: Vec<HeldJoint>,
    doubts: Vec<String>,
    /// Joints that would move no inertia without the rotor that stands in for it.
    without_inertia: Vec<usize>,
    q_min: Joints,
    q_max: Joints,
    velocity_limit: Joints,
    torque_limit: Joints,
    ready: Joints,
}

impl ArmModel {
    /// The Franka FR3 without a hand.
    pub fn fr3() -> Self {
        Self::from_chain(fr3::chain()).expect("the built-in chain has seven joints with inertia")
    }

    /// The arm of a URDF's text, as a robot publishes it; `name` stands for the file in errors. `joints` say which of the URDF's are
    /// the arm's, where they are its names, else what recordings call them; nothing is said by none. Where a joint moves no inertia, a
    /// rotor stands in for it, which a cell.toml then has to name: see [`Self::joints_without_inertia`].
    ///
    /// # Errors
    /// [`ModelError`] naming joint or link, and the remedy.
    ///
    /// # Example
    /// ```
    /// use std::path::Path;
    /// use twin::arm::{ArmModel, MAX_JOINTS};
    ///
    /// let text = r#"<robot name="lever">
    ///   <link name="base"/>
    ///   <link name="rod"><inertial>
    ///     <origin xyz="0.2 0 0"/><mass value="0.5"/>
    ///     <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    ///   </inertial></link>
    ///   <joint name="hinge" type="revolute">
    ///     <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
    ///     <limit lower="-1" upper="1" effort="10" velocity="2"/>
    ///   </joint>
    /// </robot>"#;
    /// let arm = ArmModel::from_urdf(text, Path::new("lever.urdf"), &[])?;
    /// assert_eq!(arm.joint_names(), ["hinge"]);
    /// // 0.5 kg at 0.2 m: 0.98 N m about an axis that points along y.
    /// assert!((arm.gravity(&[0.0; MAX_JOINTS])[0].abs() - 0.5 * 0.2 * 9.81).abs() < 1e-9);
    ///
    /// // Two names for one joint are refused with the remedy.
    /// let error = ArmModel::from_urdf(text, Path::new("lever.urdf"), &["elbow".into(), "wrist".into()]).unwrap_err();
    /// assert!(error.to_string().contains("give one for each"), "{error}");
    /// # Ok::<(), twin::arm::ModelError>(())
    /// ```
    pub fn from_urdf(text: &str, name: &Path, joints: &[String]) -> Result<Self, ModelError> {
        let mut arm = Self::unchecked(urdf::chain_of(text, name, joints)?)?;
        while let Some(joint) = arm.massless_joint().filter(|joint| !arm.without_inertia.contains(joint)) {
            arm.links[joint].rotor = UNKNOWN_INERTIA;
            arm.without_inertia.push(joint);
        }
        arm.check_inertia()?;
        arm.call_by(joints)?;
        Ok(arm)
    }

    /// Joints of a URDF's text that move no inertia; a rotor stands in for it.
    pub fn joints_without_inertia(&self) -> Vec<&str> {
        self.without_inertia.iter().map(|joint| self.joint_names[*joint].as_str()).collect()
    }

    /// The arm of a cell.toml: robot, rotor inertia and torque limits of its controller, tool.
    ///
    /// # Errors
    /// [`ModelError`] naming file, joint or key, and the remedy.
    pub fn from_cell(cell: &Cell) -> Result<Self, ModelError> {
        let robot = cell.robot.as_ref().ok_or(ModelError::NoRobot)?;
        let mut chain = match &robot.urdf {
            Some(file) => urdf::chain(&cell.folder.join(file), &robot.joints)?,
            None if robot.joints_only() => joints_only(robot),
            None => fr3::chain(),
        };
        if let Some(controller) = &cell.controller {
            apply_controller(&mut chain, controller)?;
        }
        let mut arm = Self::from_chain(chain)?;
        arm.has_geometry = !robot.joints_only();
        if robot.urdf.is_some() {
            arm.call_by(&robot.joints)?;
        }
        if let Some(tool) = &cell.tool {
            arm.tool = MassProperties::of_tool(tool);
            arm.tool_length = tool.length;
            arm.add_at_flange(&arm.tool.clone());
        }
        Ok(arm)
    }

    pub(super) fn from_chain(chain: Chain) -> Result<Self, ModelError> {
        let arm = Self::unchecked(chain)?;
        arm.check_inertia()?;
        Ok(arm)
    }

    /// Of any chain, whether it can move or not.
    fn unchecked(chain: Chain) -> Result<Self, ModelError> {
        let dof = chain.joints.len();
        if dof == 0 || dof > MAX_JOINTS {
            return Err(ModelError::Joints(dof));
        }
        let per_joint = |value: fn(&Joint) -> f64| {
            let mut out = [0.0; MAX_JOINTS];
            for (o, joint) in out.iter_mut().zip(&chain.joints) {
                *o = value(joint);
            }
            out
        };
        let (links, last) = lay_out(&chain.joints);
        Ok(Self {
            dof,
            links,
            gravity: FREE_FALL,
            flange: last.inverse() * chain.flange,
            tool_length: 0.0,
            tool: MassProperties::default(),
            has_geometry: true,
            q_min: per_joint(|j| j.position[0]),
            q_max: per_joint(|j| j.position[1]),
            velocity_limit: per_joint(|j| j.velocity),
            torque_limit: per_joint(|j| j.torque),
            ready: per_joint(|j| j.ready),
            turns: chain.joints.iter().map(|j| z_onto(&j.axis).into()).collect(),
            link_names: chain.joints.iter().map(|j| j.link.clone()).collect(),
            joint_names: chain.joints.into_iter().map(|j| j.name).collect(),
            described_names: None,
            held_joints: chain.held,
            doubts: chain.doubts,
            without_inertia: Vec::new(),
        })
    }

    /// Gives the joints other names, where there are some.
    fn call_by(&mut self, names: &[String]) -> Result<(), ModelError> {
        if names.is_empty() || names == self.joint_names { Ok(()) } else { self.call_joints(names) }
    }

    /// Gives the joints, from base to flange, the names that recordings have for them.
    ///
    /// # Errors
    /// [`ModelError::Length`] where there are more or fewer names than joints.
    pub fn call_joints(&mut self, names: &[String]) -> Result<(), ModelError> {
        if names.len() != self.dof {
            return Err(ModelError::Length { key: "robot.joints", given: names.len(), dof: self.dof });
        }
        self.described_names = Some(std::mem::replace(&mut self.joint_names, names.to_vec()));
        Ok(())
    }

    fn check_inertia(&self) -> Result<(), ModelError> {
        self.massless_joint().map_or(Ok(()), |joint| Err(ModelError::Massless(self.joint_names[joint].clone())))
    }

    fn massless_joint(&self) -> Option<usize> {
        // A pose off the zero pose: there a chain of pure point masses is regular if it is anywhere.
        let mut q = self.ready;
        for (i, q) in q.iter_mut().enumerate() {
            *q += 0.1 + 0.05 * i as f64;
        }
        self.first_massless_joint(&JointState::at_rest(q))
    }

    /// Hangs a body, given in the flange frame, rigidly on the flange.
    pub fn add_at_flange(&mut self, body: &MassProperties) {
        let last = &mut self.links[self.dof - 1];
        last.body = last.body.plus(&TenParameters::from_properties(&body.seen_from(&self.flange)));
    }

    /// Hangs the tool `offset` [m, flange frame] beside where it is; without a tool nothing changes.
    pub fn shift_tool(&mut self, offset: Vector3<f64>) {
        let tool = self.tool;
        self.tool.centre += offset;
        // Bodies add up in these parameters, so a negative body takes one away.
        self.add_at_flange(&MassProperties { mass: -tool.mass, inertia: -tool.inertia, ..tool });
        self.add_at_flange(&self.tool.clone());
    }

    /// Adds to the rotor inertia seen at each joint [kg m²]; what would be negative becomes 0.
    pub fn add_rotor_inertia(&mut self, more: &Joints) {
        for (link, more) in self.links.iter_mut().zip(more).take(self.dof) {
            link.rotor = (link.rotor + more).max(0.0);
        }
    }

    /// Leans the base: `turn` is the rotation of the base frame against the level [rad].
    pub fn lean_base(&mut self, turn: Vector3<f64>) {
        let level = Rotation3::new(turn).inverse() * Vector3::from(self.gravity);
        self.gravity = level.into();
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Names of the joints from base to flange, as recordings have them.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// The same as the arm's URDF has them.
    pub fn described_joint_names(&self) -> &[String] {
        self.described_names.as_deref().unwrap_or(&self.joint_names)
    }

    /// Name of each link behind a joint and its frame in the base at joint positions `q` [rad], as the arm's source names and
    /// turns them: for a URDF those that ROS has, too.
    pub fn named_links(&self, q: &Joints) -> impl Iterator<Item = (&str, Isometry3<f64>)> {
        let turned = self.link_frames(q).into_iter().zip(&self.turns).map(|(frame, turn)| frame * turn.inverse());
        self.link_names.iter().map(String::as_str).zip(turned)
    }

    /// Name of the link behind each joint.
    pub(super) fn link_names(&self) -> &[String] {
        &self.link_names
    }

    /// The frame of each joint here in that of its source.
    pub(super) fn turns(&self) -> &[UnitQuaternion<f64>] {
        &self.turns
    }

    /// Movable joints of the URDF that are no joints of the arm: fingers and the like, which are held where they are at 0, or as
    /// near to it as their limits allow.
    pub fn held_joints(&self) -> &[HeldJoint] {
        &self.held_joints
    }

    /// What may be meant otherwise by the URDF, one sentence each: a last joint that may be a finger's.
    pub fn doubts(&self) -> &[String] {
        &self.doubts
    }

    /// `false` where only joint names are known: then positions in space mean nothing.
    pub fn has_geometry(&self) -> bool {
        self.has_geometry
    }

    /// Whether the links between the joints are those of `other`, to two centimetres and three degrees: more than any arm is off
    /// from its drawing. How the base stands and what is mounted at the end does not count.
    pub fn is_built_like(&self, other: &Self) -> bool {
        let near = |a: &[f64], b: &[f64], off: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < off);
        let alike = |(a, b): (&Link, &Link)| {
            a.slides == b.slides
                && near(&a.translation, &b.translation, 0.02)
                && near(a.rotation.as_flattened(), b.rotation.as_flattened(), 0.05)
        };
        self.has_geometry
            && self.dof == other.dof
            && self.links.iter().zip(&other.links).take(self.dof).skip(1).all(alike)
    }

    /// Lowest joint positions [rad].
    pub fn q_min(&self) -> &Joints {
        &self.q_min
    }

    /// Highest joint positions [rad].
    pub fn q_max(&self) -> &Joints {
        &self.q_max
    }

    /// Highest joint speeds [rad/s]; infinite where not known.
    pub fn velocity_limit(&self) -> &Joints {
        &self.velocity_limit
    }

    /// Largest joint torques [N m]; infinite where not known.
    pub fn torque_limit(&self) -> &Joints {
        &self.torque_limit
    }

    /// A pose to start from, inside the limits [rad].
    pub fn ready(&self) -> &Joints {
        &self.ready
    }

    /// Rotor inertia seen at each joint [kg m²].
    pub fn rotor_inertia(&self) -> Joints {
        self.links.map(|link| link.rotor)
    }

    /// Mass of all links and what is mounted on them [kg]; 0 where only joints are known.
    pub fn moving_mass(&self) -> f64 {
        self.links.iter().take(self.dof).map(|link| link.body.mass).sum()
    }

    /// Flange to the end of the tool along the flange's z axis [m]; 0 without a tool.
    pub fn tool_length(&self) -> f64 {
        self.tool_length
    }
}

/// Turns every joint's frame so that its z axis is the joint's axis. Also returns the last of these frames as it lies
/// in the frame its source gave it.
fn lay_out(joints: &[Joint]) -> ([Link; MAX_JOINTS], Isometry3<f64>) {
    let mut links = [Link::default(); MAX_JOINTS];
    let mut before = Isometry3::identity();
    for (link, joint) in links.iter_mut().zip(joints) {
        let aligned = Isometry3::from_parts(nalgebra::Translation3::identity(), z_onto(&joint.axis).into());
        let step = before.inverse() * joint.origin * aligned;
        *link = Link {
            rotation: rows(&step.rotation.to_rotation_matrix()),
            translation: step.translation.vector.into(),
            slides: joint.slides,
            body: TenParameters::from_properties(&joint.body.seen_from(&aligned.inverse())),
            rotor: joint.rotor_inertia,
        };
        before = aligned;
    }
    (links, before)
}

fn z_onto(axis: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    Rotation3::rotation_between(&Vector3::z(), axis)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

fn rows(r: &Rotation3<f64>) -> Rot3 {
    let m: &Matrix3<f64> = r.matrix();
    [0, 1, 2].map(|i| [m[(i, 0)], m[(i, 1)], m[(i, 2)]])
}

/// One second-order model a joint: all axes through one point, bodies without mass, only rotors.
fn joints_only(robot: &Robot) -> Chain {
    let joints = robot
        .joints
        .iter()
        .map(|name| Joint {
            name: name.clone(),
            link: name.clone(),
            slides: false,
            origin: Isometry3::identity(),
            axis: Vector3::z_axis(),
            body: MassProperties::default(),
            position: [f64::NEG_INFINITY, f64::INFINITY],
            velocity: f64::INFINITY,
            torque: f64::INFINITY,
            rotor_inertia: UNKNOWN_INERTIA,
            ready: 0.0,
        })
        .collect();
    Chain { joints, flange: Isometry3::identity(), held: Vec::new(), doubts: Vec::new() }
}

fn apply_controller(chain: &mut Chain, controller: &Controller) -> Result<(), ModelError> {
    let dof = chain.joints.len();
    for (key, values) in
        [("controller.rotor_inertia", &controller.rotor_inertia), ("controller.torque_limit", &controller.torque_limit)]
    {
        if !values.is_empty() && values.len() != dof {
            return Err(ModelError::Length { key, given: values.len(), dof });
        }
    }
    let (rotor, torque) = (joints_from(&controller.rotor_inertia), joints_from(&controller.torque_limit));
    for (i, joint) in chain.joints.iter_mut().enumerate().take(MAX_JOINTS) {
        if !controller.rotor_inertia.is_empty() {
            joint.rotor_inertia = rotor[i];
        }
        if !controller.torque_limit.is_empty() {
            joint.torque = torque[i];
        }
    }
    Ok(())
}
