//! What is set on the robot before a motion: how it reacts to collisions, how stiff its own controller is, what it carries.
//! Made from cell.toml; sent by [`super::Fr3`] before each motion, because the robot accepts it only while idle.

use super::session::Session;
use crate::arm::ArmFault;
use franka::wire::robot::v10::{Command, SetCollisionBehaviorRequest, SetJointImpedanceRequest, SetLoadRequest};
use shared_mem::cell::{Cell, Tool};
use shared_mem::msg::arm::CommandInterface;
use std::f64::consts::PI;
use std::time::Duration;
use zerocopy::IntoBytes;

/// How long the robot may take over one setting.
const PATIENCE: Duration = Duration::from_secs(1);

/// Where the state begins to show a contact [N m]: the vendor's motion examples.
const CONTACT_TORQUE: [f64; 7] = [20.0, 20.0, 18.0, 18.0, 16.0, 14.0, 12.0];
/// Where the state begins to show a contact [N, N m].
const CONTACT_FORCE: [f64; 6] = [20.0, 20.0, 20.0, 25.0, 25.0, 25.0];
/// Where the robot stops itself, as a multiple of the contact thresholds. The vendor's examples stop at 1; an arm that
/// pokes objects and is excited to be identified would stop all the time there, and twice that is still a push that does
/// not hurt.
const STOP_FACTOR: f64 = 2.0;

/// A load at the flange, as the robot wants it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    /// [kg].
    mass: f64,
    /// In the flange frame [m].
    centre_of_mass: [f64; 3],
    /// About the centre of mass, column-major [kg m²].
    inertia: [f64; 9],
}

/// Settings of one cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Settings {
    stiffness: Option<[f64; 7]>,
    load: Option<Load>,
}

impl Settings {
    /// What `cell` says about tool and stiffness; the robot keeps its own where the cell is silent.
    pub(super) fn of_cell(cell: &Cell) -> Self {
        let stiffness = cell.controller.as_ref().and_then(|c| c.stiffness.as_slice().try_into().ok());
        Self { stiffness, load: cell.tool.as_ref().map(load_of) }
    }

    /// Tells the robot. `declared_mass` is that of the end effector declared in the robot's web page [kg]: where one is
    /// declared it is taken to be the tool, which must not be compensated twice.
    pub(super) fn send(
        &self,
        session: &Session,
        interface: CommandInterface,
        declared_mass: f64,
    ) -> Result<(), ArmFault> {
        let (stop_torque, stop_force) =
            (CONTACT_TORQUE.map(|t| t * STOP_FACTOR), CONTACT_FORCE.map(|f| f * STOP_FACTOR));
        let collision = SetCollisionBehaviorRequest::new(
            &CONTACT_TORQUE,
            &stop_torque,
            &CONTACT_TORQUE,
            &stop_torque,
            &CONTACT_FORCE,
            &stop_force,
            &CONTACT_FORCE,
            &stop_force,
        );
        session.request(Command::SetCollisionBehavior, collision.as_bytes(), PATIENCE)?;
        if let (CommandInterface::JointPosition, Some(stiffness)) = (interface, &self.stiffness) {
            let request = SetJointImpedanceRequest::new(stiffness);
            session.request(Command::SetJointImpedance, request.as_bytes(), PATIENCE)?;
        }
        if let Some(load) = self.load.filter(|_| declared_mass <= 0.0) {
            let request = SetLoadRequest::new(load.mass, &load.centre_of_mass, &load.inertia);
            session.request(Command::SetLoad, request.as_bytes(), PATIENCE)?;
        }
        Ok(())
    }
}

/// The tool as a homogeneous capsule along the flange's z axis: a cylinder of length `l` between the centres of two
/// half-balls of radius `r`, masses in proportion to their volumes.
fn load_of(tool: &Tool) -> Load {
    let (r, l) = (tool.radius, tool.length - tool.radius);
    let (cylinder, ball) = (PI * r * r * l, 4.0 / 3.0 * PI * r * r * r);
    let m_cylinder = tool.mass * cylinder / (cylinder + ball);
    let m_ball = tool.mass - m_cylinder;
    let along = m_cylinder * r * r / 2.0 + m_ball * 0.4 * r * r;
    // The half-balls' own centres lie 3/8 r beyond the ends of the cylinder.
    let across = m_cylinder * (l * l / 12.0 + r * r / 4.0) + m_ball * (0.4 * r * r + l * l / 4.0 + 0.375 * l * r);
    Load {
        mass: tool.mass,
        centre_of_mass: [0.0, 0.0, l / 2.0],
        inertia: [across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, along],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_load_of_a_tool_approaches_the_ball_and_the_rod_it_may_be() {
        let ball = load_of(&Tool { mass: 2.0, length: 0.1 + 1e-9, radius: 0.1 });
        assert!((ball.inertia[0] - 0.4 * 2.0 * 0.01).abs() < 1e-9 && (ball.inertia[8] - ball.inertia[0]).abs() < 1e-9);
        let rod = load_of(&Tool { mass: 3.0, length: 1.0, radius: 1e-4 });
        assert!((rod.inertia[0] - 3.0 / 12.0).abs() < 1e-3 && rod.inertia[8] < 1e-6);
        assert!((rod.centre_of_mass[2] - 0.5).abs() < 1e-3);
    }

    #[test]
    fn a_cell_without_tool_and_gains_leaves_the_robots_own() {
        assert_eq!(Settings::of_cell(&Cell::default()), Settings { stiffness: None, load: None });
    }
}
