//! How far tool and object are apart, estimated from encoders and tracked poses alone: no simulation, no parameters.

use nalgebra::Vector3;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::joints_from;
use shared_mem::recording::Clip;
use twin::arm::ArmModel;
use twin::physics::touch::Capsule;
use twin::physics::{Material, TableObject};
use twin::replay::in_model_order;
use twin::scene::ObjectModel;
use twin::sliding::Coulomb;

/// Tool and object are apart when the tracked gap is wider than this [m]: several sigmas of any usable tracker.
const APART_GAP: f64 = 4e-3;
/// Nearer than this the arm may be touching already [m]: a tool, a camera's pose or its scale off by as much as is
/// plausible moves the first touch, and a single row of touch in what counts as the arm's own names a fault of the arm.
const MAY_TOUCH: f64 = 0.02;
/// Rows of the arm between two looks [1]: at a metre a second and 1 kHz the tool moves by the gap above.
const STRIDE_ROWS: usize = 4;

/// An object moves that is seen so far from where it stood [m]: beyond the noise of trackers.
pub const SEEN_MOTION: f64 = 6e-3;
/// Before the object is seen to move, the tool has touched it already for at most this long [ns].
const TOUCH_MARGIN_NS: u64 = 60_000_000;

/// Tool, arm and object of a cell, and a clip of it.
pub struct Clearance {
    arm: ArmModel,
    tool: Capsule,
    object: TableObject<Coulomb>,
    clip: Clip,
}

impl Clearance {
    /// `None` where the cell has no arm, no tool or no object, or the clip is of another robot.
    pub fn new(cell: &Cell, clip: &Clip) -> Option<Self> {
        let arm = ArmModel::from_cell(cell).ok()?;
        let tool = cell.tool.as_ref()?;
        let tool = Capsule { segment: tool.length - tool.radius, radius: tool.radius };
        let model = ObjectModel::new(cell, None).ok()??;
        let object = TableObject::new(&model, Material::nominal(model.parameters()), None).ok()?;
        let clip = in_model_order(clip.clone(), &arm).ok()?;
        (!clip.measured.is_empty()).then_some(Self { arm, tool, object, clip })
    }

    /// Gap between tool and object when pose `row` was taken [m]; negative where they overlap.
    pub fn gap(&mut self, row: usize) -> f64 {
        let (measured, object) = (&self.clip.measured, &self.clip.object);
        let at = measured.stamps_ns.partition_point(|stamp| *stamp < object.stamps_ns[row]);
        self.between(at.min(measured.len() - 1), row)
    }

    /// The same between the tool at one measured row of the arm and the object at one of its poses.
    fn between(&mut self, arm_row: usize, pose_row: usize) -> f64 {
        let q = joints_from(self.clip.measured.q_row(arm_row));
        self.object.set(&self.clip.object.poses[pose_row], Vector3::zeros(), Vector3::zeros());
        -self.object.touch(&self.tool, &self.arm.flange(&q).isometry()).depth
    }

    /// Whether they are apart when pose `row` was taken.
    pub(super) fn apart(&mut self, row: usize) -> bool {
        self.gap(row) > APART_GAP
    }
}

/// Until which stamp [ns] the arm of a clip surely moves alone; beyond the end where there is no object. Encoders and the object's
/// first place show it to the millisecond, unless the camera sees the object elsewhere; then it is seen to move.
pub fn alone_until(cell: &Cell, clip: &Clip) -> u64 {
    if clip.kind == ClipKind::Excitation || clip.object.is_empty() {
        return u64::MAX;
    }
    let place = |row: usize| Vector3::from(clip.object.poses[row].position());
    let start = place(0);
    let moved = (0..clip.object.len()).find(|row| (place(*row) - start).norm() > SEEN_MOTION);
    let seen = moved.map_or(u64::MAX, |row| clip.object.stamps_ns[row].saturating_sub(TOUCH_MARGIN_NS));
    first_near(cell, clip).map_or(seen, |near| near.min(seen))
}

/// Stamp of the first measured row at which the tool may touch the object where it stood at first; `None` where it never
/// comes near, or where the cell is too little known.
fn first_near(cell: &Cell, clip: &Clip) -> Option<u64> {
    let mut clearance = Clearance::new(cell, clip)?;
    if clip.object.is_empty() {
        return None;
    }
    let reach = MAY_TOUCH.min(0.5 * clearance.between(0, 0)).max(APART_GAP);
    let near = (0..clip.measured.len()).step_by(STRIDE_ROWS).find(|row| clearance.between(*row, 0) <= reach)?;
    Some(clip.measured.stamps_ns[near.saturating_sub(STRIDE_ROWS)])
}
