//! The cell with everything that was identified, in numbers that every simulator means the same by: each with its source.
//! The writers of the formats read this and nothing else.

use super::known::{Known, LeftOut};
use super::look::Look;
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Camera, Cell, ControllerKind, GRAVITY, Tool};
use shared_mem::theta::{EffectTheta, Theta};
use twin::arm::{ArmModel, Part};
use twin::contact_law::ContactLaw;
use twin::effects::{Change, Effects, find};
use twin::physics::Outline;
use twin::physics::hit::ContactMotion;
use twin::scene::{ObjectModel, ObjectShape};

pub(super) const CELL: &str = "cell.toml";
/// Of numbers that nobody has identified or weighed.
const UNMEASURED: &str = "no measurement (the middle of its range in cell.toml, or a usual value)";
pub(super) const THETA: &str = "theta.toml";

/// Everything that goes into a model file.
#[derive(Debug, Clone)]
pub(super) struct CellModel {
    pub(super) arm: Option<Arm>,
    pub(super) gravity: [Known; 3],
    pub(super) table: Option<f64>,
    pub(super) object: Option<Object>,
    pub(super) camera: Option<CameraModel>,
    /// How much older a tracked pose is than its stamp [s].
    pub(super) latency: Known,
    /// What it looks like, where it is to be seen.
    pub(super) look: Option<Look>,
    /// What no format holds.
    pub(super) beyond: Vec<LeftOut>,
}

/// Arm, tool, what hangs on the flange, and the way of the command.
#[derive(Debug, Clone)]
pub(super) struct Arm {
    pub(super) base_frame: String,
    pub(super) has_geometry: bool,
    pub(super) joints: Vec<Joint>,
    pub(super) flange: Isometry3<f64>,
    pub(super) tool: Option<Tool>,
    /// Where the tool sits, in the flange frame [m].
    pub(super) tool_at: [Known; 3],
    /// The share of the tool's mass that sits there.
    pub(super) carried: f64,
    pub(super) loads: Vec<Load>,
    /// Whether the controller compensates gravity and Coriolis torques.
    pub(super) compensates: bool,
    /// Whether its damper is given the desired velocity.
    pub(super) follows_velocity: bool,
    pub(super) command_delay: Known,
    pub(super) command_lag: Known,
}

/// A joint, on top of what the arm's model has.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub(super) part: Part,
    pub(super) armature: Known,
    pub(super) dry: Known,
    /// Speed over which dry friction builds up [rad/s].
    pub(super) creep: f64,
    pub(super) damping: Known,
    pub(super) torque_limit: Known,
    /// Of the controller; not known where nobody has stated or found it.
    pub(super) stiffness: Known,
    pub(super) gain_damping: Known,
    pub(super) torque_gain: Known,
    pub(super) constant: Known,
    pub(super) encoder: Known,
    /// One over the inertia that the joint moves alone, at position 0 [1/(kg m²)].
    pub(super) mobility: f64,
}

/// A point mass on the flange.
#[derive(Debug, Clone)]
pub(super) struct Load {
    /// Of its body.
    pub(super) name: String,
    pub(super) mass: Known,
    pub(super) centre: [f64; 3],
}

/// The object and its contacts.
#[derive(Debug, Clone)]
pub(super) struct Object {
    pub(super) half_extents: Option<Vector3<f64>>,
    pub(super) outline: Outline,
    pub(super) mass: Known,
    pub(super) centre_of_mass: [Known; 3],
    /// About z; its source stands for the whole inertia.
    pub(super) inertia: Known,
    /// Along the base's x and y axes.
    pub(super) friction: [Known; 2],
    pub(super) tip_friction: Known,
    pub(super) reach: Known,
    pub(super) law: ContactLaw,
    pub(super) hit: ContactMotion,
    pub(super) hit_from: Known,
}

/// The camera where it truly stands.
#[derive(Debug, Clone)]
pub(super) struct CameraModel {
    pub(super) camera: Camera,
    /// The optical frame in the base frame.
    pub(super) pose: Isometry3<f64>,
    pub(super) pose_from: Known,
}

impl CellModel {
    /// # Errors
    /// Robot, mesh, or effect that cannot be used; one line with the remedy.
    pub(super) fn of(cell: &Cell, theta: &Theta) -> anyhow::Result<Self> {
        let arm = cell.robot.is_some().then(|| Arm::of(cell, theta)).transpose()?;
        let dof = arm.as_ref().map_or(7, |arm| arm.joints.len());
        let effects = Effects::from_theta(&theta.effects, dof)?;
        let mut model = Self {
            arm,
            gravity: [0.0, 0.0, -GRAVITY].map(Known::by_default),
            table: cell.table.map(|table| table.height),
            object: Object::of(cell, theta, &effects)?,
            camera: CameraModel::of(cell, &effects),
            latency: match &cell.camera {
                Some(camera) if camera.latency > 0.0 => Known::new(camera.latency, CELL),
                _ => Known::default(),
            },
            look: None,
            beyond: Vec::new(),
        };
        let stated = twin::effects::stated(cell.controller.as_ref());
        let replaced = |block: &&EffectTheta| theta.effects.iter().any(|given| given.name == block.name);
        for block in stated.iter().filter(|block| !replaced(block)).chain(&theta.effects) {
            model.take(block, cell);
        }
        Ok(model)
    }

    fn take(&mut self, block: &EffectTheta, cell: &Cell) {
        let Some(effect) = find(&block.name) else { return };
        let numbers = |name: &str| block.numbers(name);
        let from = format!("{THETA} ({})", block.name);
        let advice = effect.remedy(cell, &numbers).in_model;
        for change in effect.changes(cell, &numbers) {
            if let Err(what) = self.apply(&change, &from) {
                self.beyond.push(LeftOut { what: format!("{}: {what}", block.name), why: advice.clone() });
            }
        }
    }

    /// # Errors
    /// What of it has no place here.
    fn apply(&mut self, change: &Change, from: &str) -> Result<(), String> {
        match change {
            Change::Beyond(what) => return Err((*what).to_owned()),
            Change::ArmGravity(gravity) => {
                let compensates = self.arm.as_ref().is_none_or(|arm| arm.compensates);
                if compensates || self.object.is_some() {
                    return Err(
                        "gravity on the arm alone that leans, against which an upright one is compensated".into()
                    );
                }
                set(&mut self.gravity, gravity, from);
            }
            Change::ObjectGravity(gravity) => {
                if self.arm.as_ref().is_some_and(|arm| !arm.compensates) {
                    return Err("gravity on the object alone that leans".into());
                }
                set(&mut self.gravity, gravity, from);
            }
            Change::PoseLatency(latency) => self.latency.add(*latency, from),
            Change::CameraTurn { .. } | Change::CameraShift(_) => match &mut self.camera {
                Some(camera) => camera.pose_from.add(0.0, from),
                None => return Err("the place of a camera of which cell.toml has no block".into()),
            },
            _ => {
                let of_object = self.object.as_mut().is_some_and(|object| object.apply(change, from));
                let of_arm = self.arm.as_mut().is_some_and(|arm| arm.apply(change, from));
                if !of_object && !of_arm {
                    return Err("arm or object of which cell.toml has no block".into());
                }
            }
        }
        Ok(())
    }
}

fn set(known: &mut [Known; 3], values: &[f64; 3], from: &str) {
    known.iter_mut().zip(values).for_each(|(known, value)| known.becomes(*value, from));
}

impl Arm {
    fn of(cell: &Cell, theta: &Theta) -> anyhow::Result<Self> {
        // The tool is a body of its own in a model file.
        let bare = ArmModel::from_cell(&Cell { tool: None, ..cell.clone() })?;
        let inverse = bare.mobilities();
        let controller = cell.controller.clone().unwrap_or_default();
        let stated = |values: &[f64], own: f64, i: usize| match values.get(i) {
            Some(value) => Known::new(*value, CELL),
            None if own.is_finite() && own != 0.0 => Known::new(own, "the robot's model"),
            None => Known::default(),
        };
        let gain = |found: Option<&Vec<f64>>, nominal: &[f64], i: usize| match found.and_then(|all| all.get(i)) {
            Some(value) => Known::new(*value, THETA),
            None => nominal.get(i).map_or_else(Known::default, |value| Known::new(*value, CELL)),
        };
        let found = theta.arm.as_ref();
        let joint = |(i, part): (usize, Part)| Joint {
            armature: stated(&controller.rotor_inertia, part.rotor_inertia, i),
            dry: Known::default(),
            creep: 0.0,
            damping: Known::default(),
            torque_limit: stated(&controller.torque_limit, part.torque, i),
            stiffness: gain(found.map(|arm| &arm.stiffness), &controller.stiffness, i),
            gain_damping: gain(found.map(|arm| &arm.damping), &controller.damping, i),
            torque_gain: Known::by_default(1.0),
            constant: Known::default(),
            encoder: Known::default(),
            mobility: inverse[i],
            part,
        };
        Ok(Self {
            base_frame: cell.base_frame().to_owned(),
            has_geometry: bare.has_geometry(),
            flange: bare.flange_on_last_part(),
            joints: bare.parts().into_iter().enumerate().map(joint).collect(),
            tool: cell.tool.clone(),
            tool_at: Default::default(),
            carried: 1.0,
            loads: Vec::new(),
            compensates: controller.kind != ControllerKind::JointPd,
            follows_velocity: !matches!(controller.kind, ControllerKind::JointPd | ControllerKind::CompensatedPd),
            command_delay: Known::default(),
            command_lag: Known::default(),
        })
    }

    /// Whether it is a change of the arm.
    fn apply(&mut self, change: &Change, from: &str) -> bool {
        let each =
            |joints: &mut [Joint], values: &[f64], field: fn(&mut Joint) -> &mut Known, set: fn(f64, f64) -> f64| {
                for (i, joint) in joints.iter_mut().enumerate() {
                    let (value, known) = (values.get(i).or(values.first()).copied().unwrap_or(0.0), field(joint));
                    let after = set(known.value, value);
                    if after != known.value {
                        known.becomes(after, from);
                    }
                }
            };
        let joints = &mut self.joints;
        match change {
            Change::Armature(more) => each(joints, more, |j| &mut j.armature, |a, b| (a + b).max(0.0)),
            Change::Damping(more) => each(joints, more, |j| &mut j.damping, |a, b| a + b),
            Change::DryFriction { level, creep } => {
                each(joints, level, |j| &mut j.dry, |a, b| a + b);
                for (i, joint) in joints.iter_mut().enumerate() {
                    joint.creep = creep.get(i).or(creep.first()).copied().unwrap_or(0.0);
                }
            }
            Change::ConstantTorque(torque) => each(joints, torque, |j| &mut j.constant, |a, b| a + b),
            Change::TorqueGain(gain) => each(joints, gain, |j| &mut j.torque_gain, |a, b| a * b),
            Change::EncoderOffset(offset) => each(joints, offset, |j| &mut j.encoder, |a, b| a + b),
            Change::TorqueLimit(limit) => {
                each(joints, limit, |j| &mut j.torque_limit, |a, b| if a == 0.0 { b } else { a.min(b) });
            }
            Change::CommandDelay(delay) => self.command_delay.add(*delay, from),
            Change::CommandLag(lag) => self.command_lag.add(*lag, from),
            Change::FlangeLoad { mass, centre } => {
                let before = self.loads.len();
                let name = if before == 0 { "payload".to_owned() } else { format!("payload_{}", before + 1) };
                self.loads.push(Load { name, mass: Known::new(*mass, from), centre: *centre });
            }
            Change::ToolShift { offset, carried } if self.tool.is_some() => {
                set(&mut self.tool_at, offset, from);
                self.carried = *carried;
            }
            _ => return false,
        }
        true
    }
}

impl Object {
    fn of(cell: &Cell, theta: &Theta, effects: &Effects) -> anyhow::Result<Option<Self>> {
        let Some(model) = ObjectModel::new(cell, Some(theta))? else { return Ok(None) };
        model.check()?;
        let found = theta.object.clone().unwrap_or_default();
        let stated = |value: f64, found: bool, weighed: bool| {
            Known::new(
                value,
                if found {
                    THETA
                } else if weighed {
                    CELL
                } else {
                    UNMEASURED
                },
            )
        };
        let of = |value: f64, found: bool| stated(value, found, false);
        let weighed = cell.object().is_some_and(|object| object.mass.is_some());
        let law = effects.hit.real_law(ContactLaw::nominal(model.tip_friction));
        let centre = found.centre_of_mass.is_some();
        let outline = Outline::of(&model, &effects.material(model.parameters()))?;
        Ok(Some(Self {
            half_extents: match &model.shape {
                ObjectShape::Box { half_extents } => Some(*half_extents),
                ObjectShape::Mesh { .. } => None,
            },
            mass: stated(model.mass, found.mass.is_some(), weighed),
            centre_of_mass: [0, 1, 2].map(|i| of(model.centre_of_mass[i], centre)),
            inertia: stated(outline.inertia[(2, 2)], found.mass.is_some(), weighed),
            friction: [of(model.friction, found.friction.is_some()), of(model.friction, found.friction.is_some())],
            tip_friction: of(law.friction, found.tip_friction.is_some()),
            reach: Known::new(1.0, CELL),
            hit: law.motion(model.mass),
            hit_from: Known::new(0.0, "the twin's nominal contact"),
            law,
            outline,
        }))
    }

    /// Whether it is a change of the object.
    fn apply(&mut self, change: &Change, from: &str) -> bool {
        match change {
            Change::Compliance(_) | Change::Restitution(_) => self.hit_from.add(0.0, from),
            Change::TipFriction(_) => self.tip_friction.add(0.0, from),
            Change::YawInertia(_) => self.inertia.add(0.0, from),
            Change::PressureReach(reach) => self.reach.becomes(*reach, from),
            Change::FrictionAlong { size, axis } => {
                let more = size * (2.0 * axis).cos();
                let [x, y] = &mut self.friction;
                x.becomes(x.value * (1.0 + more), from);
                y.becomes(y.value * (1.0 - more), from);
            }
            _ => return false,
        }
        true
    }
}

impl CameraModel {
    fn of(cell: &Cell, effects: &Effects) -> Option<Self> {
        let camera = cell.camera.clone()?;
        let stated = camera.base_from_camera()?.isometry();
        Some(Self {
            // What seems to be moved is seen from where the camera truly stands.
            pose: effects.camera.misplaced().inverse() * stated,
            pose_from: Known::new(0.0, CELL),
            camera,
        })
    }
}
