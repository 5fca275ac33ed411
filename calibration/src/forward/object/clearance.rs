//! How far tool and object are apart, told from encoders and tracked poses alone: no simulation, no parameters.

use nalgebra::Vector3;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::joints_from;
use shared_mem::recording::Clip;
use twin::arm::ArmModel;
use twin::effects::Effects;
use twin::physics::TableObject;
use twin::physics::touch::Capsule;
use twin::scene::ObjectModel;

/// Tool and object are apart when the tracked gap is wider than this [m]: several sigmas of any usable tracker.
const APART: f64 = 4e-3;
/// Rows of the arm between two looks: at a metre a second the tool moves by the width above [1].
const STRIDE: usize = 4;

/// Tool, arm and object of a cell.
pub(super) struct Clearance {
    arm: ArmModel,
    tool: Capsule,
    object: TableObject,
}

impl Clearance {
    /// `None` where the cell has no arm, no tool or no object.
    pub(super) fn new(cell: &Cell) -> Option<Self> {
        let arm = ArmModel::from_cell(cell).ok()?;
        let tool = cell.tool.as_ref()?;
        let tool = Capsule { segment: tool.length - tool.radius, radius: tool.radius };
        let model = ObjectModel::new(cell, None).ok()??;
        let object = TableObject::new(&model, None, &Effects::default()).ok()?;
        Some(Self { arm, tool, object })
    }

    /// Whether the tool at `q` is clear of the object at a tracked pose.
    pub(super) fn apart(&mut self, q: &[f64], pose: &Pose<Base, Object>) -> bool {
        self.object.set(pose, Vector3::zeros(), Vector3::zeros());
        -self.object.touch(&self.tool, &self.arm.flange(&joints_from(q)).isometry()).depth > APART
    }

    /// The clip's joints in the model's order.
    pub(super) fn in_order(&self, clip: &Clip) -> Option<Clip> {
        clip.clone().reorder(self.arm.joint_names()).ok()
    }
}

/// Stamp of the first measured row at which the tool may touch the object where it stood at first; `None` where it never
/// comes near, or the cell cannot tell.
#[must_use]
pub fn first_near(cell: &Cell, clip: &Clip) -> Option<u64> {
    let mut clearance = Clearance::new(cell)?;
    let clip = clearance.in_order(clip)?;
    let stands = clip.object.poses.first()?;
    let near =
        (0..clip.measured.len()).step_by(STRIDE).find(|row| !clearance.apart(clip.measured.q_row(*row), stands))?;
    Some(clip.measured.stamps_ns[near.saturating_sub(STRIDE)])
}
