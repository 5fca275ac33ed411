//! The robot's body: the simulated arm in its cell and what its sensors and its model conclude from it.
#![allow(non_snake_case)] // the field's own symbols

use super::ServeError;
use super::kinematics::Frame;
use super::observer::{Observer, Touched};
use super::self_collision::SelfCollision;
use super::settings::Settings;
use nalgebra::Vector6;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use twin::arm::{ArmModel, ControlLaw, GainError, JointState, Joints, MassProperties};
use twin::control::Drive;
use twin::sim::SimScene;

/// Deceleration of a joint whose brake has closed [rad/s²]. The vendor publishes none: this one stops a joint at its
/// highest speed within 0.05 s.
const BRAKE: f64 = 100.0;

/// Slower than this a joint stands [rad/s].
const AT_REST: f64 = 1e-3;

pub(super) struct Body {
    /// The cell with all its objects.
    scene: SimScene,
    /// What is known of the arm before anything is declared, so that there is always a model.
    bare: ArmModel,
    /// Stiffness of the robot's joint controller before anybody asks for another [N m/rad].
    stiffness: Joints,
    pub(super) measured: ArmState,
    /// Torques a period ago [N m].
    pub(super) tau_J_before: Joints,
    observer: Observer,
    itself: SelfCollision,
    pub(super) touched: Touched,
    /// Estimated wrench at the stiffness frame, in base axes, then in its own.
    pub(super) wrench: [Vector6<f64>; 2],
}

impl Body {
    /// The arm of a cell where `[simulation]` puts it. `theta` are parameters and effects that are hidden from clients.
    pub(super) fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, ServeError> {
        if cell.robot.as_ref().and_then(|robot| robot.model.as_deref()) != Some("fr3") {
            return Err(ServeError::NotAnFr3);
        }
        if cell.controller.as_ref().is_none_or(|controller| controller.kind != ControllerKind::JointImpedance) {
            return Err(ServeError::NotCompliant);
        }
        let bare = ArmModel::from_cell(cell).map_err(twin::sim::SimError::from)?;
        let law = ControlLaw::new(cell.controller.as_ref(), None, &bare).map_err(twin::sim::SimError::from)?;
        let mut simulated = SimScene::new(cell, theta)?;
        simulated.make_table_solid(cell);
        let mut measured = ArmState::default();
        simulated.read(&mut measured);
        Ok(Self {
            bare,
            stiffness: law.stiffness,
            tau_J_before: measured.tau_J,
            itself: SelfCollision::new(cell).map_err(twin::sim::SimError::from)?,
            observer: Observer::new(&JointState { q: measured.q, dq: measured.dq }),
            touched: Touched::default(),
            wrench: [Vector6::zeros(); 2],
            measured,
            scene: simulated,
        })
    }

    /// The model inside the robot, with the end effector and the load set by the client.
    pub(super) fn model(&self) -> &ArmModel {
        self.scene.cell().plant().map_or(&self.bare, |plant| plant.nominal())
    }

    /// What the encoders read.
    pub(super) fn joints(&self) -> JointState {
        JointState { q: self.measured.q, dq: self.measured.dq }
    }

    /// What they would read without noise.
    pub(super) fn true_reading(&self) -> JointState {
        self.scene.cell().joint_reading()
    }

    /// Estimated torque on the surroundings [N m].
    pub(super) fn tau_ext(&self) -> &Joints {
        self.observer.tau_ext()
    }

    /// Whether the arm is running into itself.
    pub(super) fn threatens_itself(&mut self) -> bool {
        self.itself.threatens(&self.joints())
    }

    /// Lets a millisecond pass under `drive` and takes in what the sensors say then.
    pub(super) fn step(&mut self, drive: &Drive, settings: &Settings) {
        self.scene.step(drive);
        self.tau_J_before = self.measured.tau_J;
        self.scene.read(&mut self.measured);
        let model = self.scene.cell().plant().map_or(&self.bare, |plant| plant.nominal());
        let now = JointState { q: self.measured.q, dq: self.measured.dq };
        self.observer.update(model, &now, &self.measured.tau_J);
        self.wrench = self.observer.wrench(&Frame { model, on_flange: settings.F_T_K() }, &now.q);
    }

    /// Lets a millisecond pass with the brakes closed: each joint comes to rest and stays there, whatever pulls at it.
    pub(super) fn step_braked(&mut self) {
        let JointState { q, dq } = self.true_reading();
        let slower = dq.map(|v| v - v.clamp(-BRAKE * TICK, BRAKE * TICK));
        let stopped: Joints = std::array::from_fn(|i| q[i] + 0.5 * (dq[i] + slower[i]) * TICK);
        // Objects go on; the arm is moved by its brakes alone.
        self.scene.remove_arm();
        let command = self.scene.cell().command();
        self.scene.step(&command);
        self.put_arm(stopped, slower);
        self.tau_J_before = self.measured.tau_J;
        self.scene.read(&mut self.measured);
        // What the sensors say of a joint that is braked is no push from outside.
        self.observer = Observer::new(&self.joints());
        self.wrench = [Vector6::zeros(); 2];
    }

    fn put_arm(&mut self, q: Joints, dq: Joints) {
        let dof = self.bare.dof();
        self.scene.set_arm(&JointState { q, dq }, dof);
    }

    /// Where a body stands, by its number.
    #[cfg(test)]
    pub(super) fn object(&self, number: usize) -> nalgebra::Vector3<f64> {
        self.scene.object(number).expect("a body of this number").isometry().translation.vector
    }

    /// Gives a joint a speed [rad/s], as a push from outside would.
    #[cfg(test)]
    pub(super) fn push_at(&mut self, joint: usize, speed: f64) {
        let JointState { q, mut dq } = self.true_reading();
        dq[joint] = speed;
        self.put_arm(q, dq);
    }

    /// Whether the arm stands still.
    pub(super) fn stands(&self) -> bool {
        self.true_reading().dq.iter().all(|dq| dq.abs() < AT_REST)
    }

    /// Has the robot's joint controller act with the stiffness it had at power-on.
    pub(super) fn restore_stiffness(&mut self) -> Result<(), GainError> {
        self.scene.ask_stiffness(&self.stiffness)
    }

    /// Has the robot's joint controller act with another stiffness [N m/rad].
    pub(super) fn ask_stiffness(&mut self, stiffness: &Joints) -> Result<(), GainError> {
        self.scene.ask_stiffness(stiffness)
    }

    /// Has the robot's model carry `load` beside the end effector.
    pub(super) fn declare_load(&mut self, load: &MassProperties) {
        self.scene.declare_load(load);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Vector3};
    use shared_mem::cell::Object;

    #[test]
    fn every_object_is_there_and_the_tool_pushes_the_one_that_it_meets() {
        let text = include_str!("../../../config/fr3_cell.toml");
        let mut cell = Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell");
        let one = cell.objects[0].clone();
        let named = |name: &str, start| Object { name: Some(name.into()), start: Some(start), ..one.clone() };
        cell.objects = vec![named("cup", [0.4, -0.45]), named("milk_box", [0.5, 0.0])];
        let model = ArmModel::from_cell(&cell).expect("an FR3");
        let [flange, tip] = [model.flange(model.ready()).isometry(), model.tip(model.ready()).isometry()];
        let reach = |x: f64, y: f64, z: f64| {
            let way = Translation3::from(Vector3::new(x, y, z) - tip.translation.vector);
            model.reach(model.ready(), &nalgebra::one(), &(way * flange), None).expect("within reach")
        };
        let (from, to) = (reach(0.5, -0.07, 0.05), reach(0.5, 0.03, 0.05));
        cell.simulation.q = from[..7].to_vec();
        let mut body = Body::new(&cell, None).expect("an FR3");
        let settings = Settings::at_power_on(cell.tool.as_ref());
        let starts = [0, 1].map(|i| body.object(i));
        let mut felt = 0.0_f64;
        for k in 0..1000 {
            let share = f64::from(k) / 1000.0;
            let q_d = std::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
            body.step(&Drive::JointImpedance { q_d, dq_d: std::array::from_fn(|i| to[i] - from[i]) }, &settings);
            felt = felt.max(body.wrench[0].fixed_rows::<3>(0).norm());
        }
        let [cup, milk] = [0, 1].map(|i| (body.object(i) - starts[i]).norm());
        assert!(cup < 1e-6 && milk > 0.04, "the cup went {cup} m, the milk box {milk} m");
        assert!(felt > 0.3, "{felt} N");
        // The brakes stop the arm; what slides goes on by itself and rests.
        (0..1000).for_each(|_| body.step_braked());
        let rested = body.object(1);
        body.step_braked();
        assert!(body.stands() && (body.object(1) - rested).norm() < 1e-6);
    }
}
