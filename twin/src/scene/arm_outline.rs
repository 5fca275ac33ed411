//! The arm as an eye sees it: capsules from joint to joint, and the tool. Drawn by the camera and by the viewer.

use crate::arm::{ArmModel, Joints, MAX_JOINTS, ModelError};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;

/// Link radius at the base and at the flange [m]: an FR3's.
const LINK_RADIUS: [f64; 2] = [0.065, 0.042];

/// The outline of an arm.
#[derive(Debug, Clone)]
pub struct ArmOutline {
    model: ArmModel,
    parts: Vec<Part>,
    /// For every part the point it begins at, of base, joints, flange.
    begins: Vec<usize>,
}

/// One capsule along the z axis of its own frame, from the origin to `length`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Length of the axis [m].
    pub length: f64,
    /// Radius [m].
    pub radius: f64,
    /// The tool, not a link.
    pub is_tool: bool,
}

impl ArmOutline {
    /// The outline of a cell's arm; without parts where only joint names are known.
    ///
    /// # Errors
    /// [`ModelError`] when cell.toml describes no usable arm.
    pub fn new(cell: &Cell) -> Result<Self, ModelError> {
        let model = ArmModel::from_cell(cell)?;
        let (mut parts, mut begins) = (Vec::new(), Vec::new());
        if model.has_geometry() {
            let flange = model.dof() + 1;
            let (points, _) = points(&model, model.ready());
            for from in 0..flange {
                let length = (points[from + 1] - points[from]).norm();
                // Joints whose axes meet in one point have no link between them.
                if length > 1e-3 {
                    let share = from as f64 / (flange - 1) as f64;
                    let radius = LINK_RADIUS[0] * (1.0 - share) + LINK_RADIUS[1] * share;
                    parts.push(Part { length, radius, is_tool: false });
                    begins.push(from);
                }
            }
            if let Some(tool) = &cell.tool {
                parts.push(Part { length: tool.length - tool.radius, radius: tool.radius, is_tool: true });
                begins.push(flange);
            }
        }
        Ok(Self { model, parts, begins })
    }

    /// The capsules, from base to tool.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Calls `place` with every capsule's number and its frame in the base, for joint positions `q` [rad].
    pub fn for_each(&self, q: &Joints, mut place: impl FnMut(usize, Isometry3<f64>)) {
        let (points, base_from_flange) = points(&self.model, q);
        for (number, (part, from)) in self.parts.iter().zip(&self.begins).enumerate() {
            if part.is_tool {
                place(number, base_from_flange);
                continue;
            }
            let (a, b) = (points[*from], points[from + 1]);
            // A capsule looks the same from all sides, so any turn that brings z to the link will do.
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(b - a))
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
            place(number, Isometry3::from_parts(Translation3::from(a.coords), turn));
        }
    }

    /// The arm's model.
    pub fn model(&self) -> &ArmModel {
        &self.model
    }
}

/// Base origin, joint origins and flange origin in the base frame, `dof + 2` of them [m]; and the flange's frame.
fn points(model: &ArmModel, q: &Joints) -> ([Point3<f64>; MAX_JOINTS + 2], Isometry3<f64>) {
    let flange = model.flange(q).isometry();
    let mut points = [Point3::origin(); MAX_JOINTS + 2];
    for (point, origin) in points[1..].iter_mut().zip(&model.joint_origins(q)[..model.dof()]) {
        *point = Point3::from(*origin);
    }
    points[model.dof() + 1] = Point3::from(flange.translation.vector);
    (points, flange)
}
