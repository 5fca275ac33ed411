//! The table as an obstacle of the arm: a stiff, rough plane under the tool and under the joints' housings. Its push is
//! taken at the start of a period and holds for it. Base frame, SI. Called by [`super::SimCell`] where that was asked for.

use crate::arm::{ArmModel, JointState, Joints, MAX_JOINTS};
use nalgebra::Vector3;
use shared_mem::cell::{Table, Tool};

/// Stiffness of a touch [N/m]: a wooden top under a steel tip gives by a millimetre under 30 N. With the tip's own mass
/// (about 1 kg) a tenth of what a push that holds for a millisecond could stand.
const STIFFNESS: f64 = 3e4;
/// Damping of a touch [N s/m]: about half of critical for that mass.
const DAMPING: f64 = 200.0;
/// Coulomb friction of metal on a painted table top.
const FRICTION: f64 = 0.3;
/// Speed below which friction falls in proportion to it [m/s]: so slow that a period does not turn the motion round.
const CREEP: f64 = 0.05;
/// Radius of the housing around a joint's axis [m]: the FR3's wrist, rounded.
const HOUSING: f64 = 0.06;
/// The first joint whose housing can come down to the table: those before it sit on the base.
const FIRST_FREE: usize = 3;

#[derive(Debug, Clone)]
pub(super) struct SolidTable {
    height: f64,
    /// Centres of the tool's two caps along the flange's z axis, and their radius [m].
    tool: Option<([f64; 2], f64)>,
}

impl SolidTable {
    pub(super) fn new(table: &Table, tool: Option<&Tool>) -> Self {
        let tool = tool.map(|tool| ([0.0, tool.length - tool.radius], tool.radius));
        Self { height: table.height, tool }
    }

    /// Joint torques with which the table pushes the arm away [N m]; zeros where nothing touches it.
    pub(super) fn push(&self, model: &ArmModel, state: &JointState) -> Joints {
        let mut push = [0.0; MAX_JOINTS];
        if !model.has_geometry() {
            return push;
        }
        let flange = model.flange(&state.q).isometry();
        let last = model.dof() - 1;
        let origins = model.joint_origins(&state.q);
        let housings = (FIRST_FREE..model.dof()).map(|i| (i, Vector3::from(origins[i]), HOUSING));
        let caps = self.tool.iter().flat_map(|(along, radius)| along.map(|z| (z, *radius)));
        let caps = caps.map(|(z, radius)| (last, (flange * nalgebra::Point3::new(0.0, 0.0, z)).coords, radius));
        for (link, centre, radius) in housings.chain(caps) {
            self.touch(model, state, link, centre - Vector3::z() * radius, &mut push);
        }
        push
    }

    /// Adds what the table does to `point` of a link.
    fn touch(&self, model: &ArmModel, state: &JointState, link: usize, point: Vector3<f64>, push: &mut Joints) {
        let depth = self.height - point.z;
        if depth <= 0.0 {
            return;
        }
        // Joints behind the link do not move it.
        let jacobian = model.jacobian(&state.q, point.into());
        let columns = jacobian.iter().take(link + 1).map(|c| Vector3::new(c[0], c[1], c[2]));
        let velocity: Vector3<f64> = columns.clone().zip(&state.dq).map(|(column, dq)| column * *dq).sum();
        let normal = (STIFFNESS * depth - DAMPING * velocity.z).max(0.0);
        let along = Vector3::new(velocity.x, velocity.y, 0.0);
        let force = Vector3::z() * normal - along * (FRICTION * normal / along.norm().max(CREEP));
        for (torque, column) in push.iter_mut().zip(columns) {
            *torque += column.dot(&force);
        }
    }
}
