//! Robot, twin and object as Foxglove primitives, metres: what hangs on a link in the link's frame, all else in the base frame.

use super::frames::{Frames, Look, object_frame, parts};
use crate::arm::{Joints, ModelError};
use crate::render::{Hand, Mesh, RobotSurface};
use crate::scene::{ArmOutline, CellBody, ObjectShape, cell_bodies};
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, FrameTransforms, JointState, JointStates, Point3, Pose, PoseInFrame,
    SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, TriangleListPrimitive, Vector3,
};
use nalgebra::{Isometry3, Translation3};
use shared_mem::cell::Cell;
use shared_mem::msg::object::ObjectName;

/// What does not change while it is shown.
pub(super) struct Scene {
    outline: ArmOutline,
    /// The robot's own shapes, where they are known.
    surface: Option<RobotSurface>,
    frames: Frames,
    /// Names of the bodies on the table, the first object first, and how they are shown.
    objects: Vec<(ObjectName, Form)>,
}

/// How a body on the table is shown.
enum Form {
    /// A rigid object as its bounding box [m].
    Box(nalgebra::Vector3<f64>),
    /// A link as it is.
    Link(Mesh),
}

impl Form {
    fn of(body: &CellBody) -> Self {
        match (&body.link, body.surface()) {
            (None, shape) => Self::Box(shape.half_extents() * 2.0),
            (Some(_), ObjectShape::Box { half_extents }) => Self::Box(half_extents * 2.0),
            (Some(_), shape) => Self::Link(Mesh::new(shape.triangles(), OBJECT)),
        }
    }
}

const OBJECT: [u8; 3] = [222, 112, 40];

/// Share by which the twin is drawn larger.
const GHOST: f64 = 1.01;

impl Scene {
    pub(super) fn new(cell: &Cell) -> Result<Self, ModelError> {
        let outline = ArmOutline::new(cell)?;
        // A mesh that cannot be read was refused when the twin was made.
        let objects = cell_bodies(cell).unwrap_or_default().iter().map(|body| (body.name, Form::of(body))).collect();
        let surface = RobotSurface::new(cell, Hand::None)?;
        Ok(Self {
            frames: Frames::of(cell, outline.model()),
            surface: surface.is_measured().then_some(surface),
            objects,
            outline,
        })
    }

    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    pub(super) fn joints(&self, time: Timestamp, q: &Joints, dq: &Joints, tau: &Joints) -> JointStates {
        let joints = self.outline.model().joint_names().iter().enumerate().map(|(i, name)| JointState {
            name: name.clone(),
            position: Some(q[i]),
            velocity: Some(dq[i]),
            acceleration: None,
            effort: Some(tau[i]),
        });
        JointStates { timestamp: Some(time), joints: joints.collect() }
    }

    /// The frames of the arm at joint positions `q` [rad].
    pub(super) fn transforms(&self, time: Timestamp, look: Look, q: &Joints) -> FrameTransforms {
        self.frames.arm(time, look, self.outline.model(), q)
    }

    /// The shapes of the robot's links and of its tool, each fixed to its link's frame: sent to everybody who comes, and moved by
    /// the frames from then on. Nothing where only the joints' places are known.
    pub(super) fn shapes(&self, time: Timestamp) -> Option<SceneUpdate> {
        let surface = self.surface.as_ref()?;
        let mut entities = Vec::new();
        for look in [Look::Real, Look::Twin] {
            let of_links = (0..=surface.model().dof() + 1).map(|link| {
                let mut entity = self.entity(time, look, &format!("link{link}"));
                entity.frame_id = self.frames.link(look, link);
                entity.frame_locked = true;
                let parts = surface.parts().iter().zip(surface.links()).filter(|(_, of)| *of == link);
                entity.triangles = parts.map(|(mesh, _)| triangles(mesh, look)).collect();
                entity
            });
            entities.extend(of_links.filter(|entity| !entity.triangles.is_empty()));
        }
        Some(SceneUpdate { deletions: Vec::new(), entities })
    }

    /// An arm whose shapes are not known: a cylinder and two balls for each capsule from joint to joint, in the base frame.
    pub(super) fn capsules(&self, time: Timestamp, look: Look, q: &Joints) -> Option<SceneUpdate> {
        if self.surface.is_some() {
            return None;
        }
        let mut entity = self.entity(time, look, "arm");
        self.outline.for_each(q, |number, base_from_part| {
            let part = self.outline.parts()[number];
            let color = color(look, if part.is_tool { [0.36, 0.4, 0.46] } else { [0.93, 0.94, 0.95] });
            let width = 2.0 * part.radius * if look == Look::Twin { GHOST } else { 1.0 };
            let at = |z: f64| Some(pose(&(base_from_part * Translation3::new(0.0, 0.0, z))));
            entity.cylinders.push(CylinderPrimitive {
                pose: at(0.5 * part.length),
                size: Some(Vector3 { x: width, y: width, z: part.length }),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color,
            });
            let size = Some(Vector3 { x: width, y: width, z: width });
            entity.spheres.extend([0.0, part.length].map(|z| SpherePrimitive { pose: at(z), size, color }));
        });
        Some(SceneUpdate { deletions: Vec::new(), entities: vec![entity] })
    }

    /// Names of the bodies, the first object first.
    pub(super) fn names(&self) -> impl Iterator<Item = ObjectName> {
        self.objects.iter().map(|(name, _)| *name)
    }

    /// A body by its number, of a rigid one the bounding box; `None` where the cell has no such body.
    pub(super) fn object(
        &self,
        time: Timestamp,
        look: Look,
        number: usize,
        place: &Isometry3<f64>,
    ) -> Option<SceneUpdate> {
        let (name, form) = self.objects.get(number)?;
        let mut entity = self.entity(time, look, &object_frame(number, name));
        match form {
            Form::Box(size) => {
                let size = size * if look == Look::Twin { GHOST } else { 1.0 };
                entity.cubes.push(CubePrimitive {
                    pose: Some(pose(place)),
                    size: Some(Vector3 { x: size.x, y: size.y, z: size.z }),
                    color: color(look, OBJECT.map(|value| f64::from(value) / 255.0)),
                });
            }
            Form::Link(mesh) => {
                entity.triangles.push(TriangleListPrimitive { pose: Some(pose(place)), ..triangles(mesh, look) });
            }
        }
        Some(SceneUpdate { deletions: Vec::new(), entities: vec![entity] })
    }

    pub(super) fn pose_in_base(&self, time: Timestamp, place: &Isometry3<f64>) -> PoseInFrame {
        PoseInFrame { timestamp: Some(time), frame_id: self.frames.base().to_owned(), pose: Some(pose(place)) }
    }

    fn entity(&self, time: Timestamp, look: Look, what: &str) -> SceneEntity {
        let whose = if look == Look::Real { "real" } else { "twin" };
        SceneEntity {
            timestamp: Some(time),
            frame_id: self.frames.base().to_owned(),
            id: format!("{whose}/{what}"),
            ..SceneEntity::default()
        }
    }
}

/// A part of the robot in its link's frame; the twin's is grown around its middle.
fn triangles(mesh: &Mesh, look: Look) -> TriangleListPrimitive {
    let points = mesh.points.iter().map(|point| point.cast::<f64>().coords);
    let middle = points.clone().sum::<nalgebra::Vector3<f64>>() / mesh.points.len().max(1) as f64;
    let grown = if look == Look::Twin { GHOST } else { 1.0 };
    let place = |point: nalgebra::Vector3<f64>| middle + (point - middle) * grown;
    TriangleListPrimitive {
        pose: Some(pose(&Isometry3::identity())),
        points: points.map(place).map(|p| Point3 { x: p.x, y: p.y, z: p.z }).collect(),
        color: color(look, mesh.color.map(|value| f64::from(value) / 255.0)),
        colors: Vec::new(),
        indices: mesh.triangles.iter().flatten().copied().collect(),
    }
}

fn color(look: Look, [r, g, b]: [f64; 3]) -> Option<Color> {
    Some(match look {
        Look::Real => Color { r, g, b, a: 1.0 },
        Look::Twin => Color { r: 0.2 * r, g: 0.5 * g, b: 1.0, a: 0.45 },
    })
}

fn pose(isometry: &Isometry3<f64>) -> Pose {
    let (position, orientation) = parts(isometry);
    Pose { position: Some(position), orientation: Some(orientation) }
}
