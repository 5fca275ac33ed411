//! Robot, twin and object as Foxglove primitives. Base frame, metres.

use crate::arm::{Joints, ModelError};
use crate::scene::{ArmOutline, ObjectModel};
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, JointState, JointStates, Pose, PoseInFrame, Quaternion, SceneEntity,
    SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use nalgebra::{Isometry3, Translation3};
use shared_mem::cell::Cell;

/// Whose picture it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// The real cell: solid.
    Real,
    /// The twin: a blue ghost, a hair larger, so that it shows where the two agree.
    Twin,
}

/// What does not change while it is shown.
pub(super) struct Scene {
    outline: ArmOutline,
    object_size: Option<nalgebra::Vector3<f64>>,
    base_frame: String,
}

/// Share by which the twin is drawn larger.
const GHOST: f64 = 1.01;

impl Scene {
    pub(super) fn new(cell: &Cell) -> Result<Self, ModelError> {
        let outline = ArmOutline::new(cell)?;
        // A mesh that cannot be read was refused when the twin was made.
        let object = ObjectModel::new(cell, None).ok().flatten();
        Ok(Self {
            base_frame: outline.model().base_frame().to_owned(),
            object_size: object.map(|model| model.shape.half_extents() * 2.0),
            outline,
        })
    }

    pub(super) fn base_frame(&self) -> &str {
        &self.base_frame
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

    /// The arm: a cylinder and two balls for each capsule.
    pub(super) fn arm(&self, time: Timestamp, look: Look, q: &Joints) -> SceneUpdate {
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
        SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
    }

    /// The object's bounding box; `None` where the cell has no object.
    pub(super) fn object(&self, time: Timestamp, look: Look, place: &Isometry3<f64>) -> Option<SceneUpdate> {
        let size = self.object_size? * if look == Look::Twin { GHOST } else { 1.0 };
        let mut entity = self.entity(time, look, "object");
        entity.cubes.push(CubePrimitive {
            pose: Some(pose(place)),
            size: Some(Vector3 { x: size.x, y: size.y, z: size.z }),
            color: color(look, [0.87, 0.44, 0.16]),
        });
        Some(SceneUpdate { deletions: Vec::new(), entities: vec![entity] })
    }

    pub(super) fn pose_in_base(&self, time: Timestamp, place: &Isometry3<f64>) -> PoseInFrame {
        PoseInFrame { timestamp: Some(time), frame_id: self.base_frame.clone(), pose: Some(pose(place)) }
    }

    fn entity(&self, time: Timestamp, look: Look, what: &str) -> SceneEntity {
        let whose = if look == Look::Real { "real" } else { "twin" };
        SceneEntity {
            timestamp: Some(time),
            frame_id: self.base_frame.clone(),
            id: format!("{whose}/{what}"),
            ..SceneEntity::default()
        }
    }
}

fn color(look: Look, [r, g, b]: [f64; 3]) -> Option<Color> {
    Some(match look {
        Look::Real => Color { r, g, b, a: 1.0 },
        Look::Twin => Color { r: 0.2 * r, g: 0.5 * g, b: 1.0, a: 0.45 },
    })
}

/// Position and orientation in Foxglove's types.
pub(super) fn parts(isometry: &Isometry3<f64>) -> (Vector3, Quaternion) {
    let (p, q) = (isometry.translation.vector, isometry.rotation.quaternion());
    (Vector3 { x: p.x, y: p.y, z: p.z }, Quaternion { x: q.i, y: q.j, z: q.k, w: q.w })
}

fn pose(isometry: &Isometry3<f64>) -> Pose {
    let (position, orientation) = parts(isometry);
    Pose { position: Some(position), orientation: Some(orientation) }
}
