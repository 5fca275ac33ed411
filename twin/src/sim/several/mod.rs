//! The simulated cell with everything that stands on its table: what the bridge simulates and `twin shadow` mirrors. The cell of
//! one object ([`SimCell`]) is that one exactly.
//!
//! | state | law |
//! |---|---|
//! | objects are apart, the tool is at one of them at most | that of one object, for each of them: [`crate::physics`] |
//! | two objects are near each other, or the tool is at two | that of many bodies for all: [`crate::world`] (`many`) |
//! | one of them moves in itself | that of many bodies, always |
//!
//! Poses and velocities go over from one to the other; what is behind is the nearest two of all pairs. The laws differ in a hit,
//! which has no restitution among many bodies, and in effects on hit and slide, which act on objects that are apart.

mod linked;
mod many;
mod state;

use super::contact::ToolContact;
use super::{SimCell, SimError, SimObject};
use crate::arm::{GainError, JointState, Joints, MassProperties};
use crate::control::Drive;
use crate::effects::{Stage, find};
use crate::scene::{CellBody, NamedPoses, ObjectModel, SceneSnapshot, cell_bodies, starts};
use linked::linked;
use many::{ManyBodies, Member};
use nalgebra::Vector3;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::ObjectName;
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
pub use state::SceneState;

/// Objects nearer than this, and as much more as they may come nearer in a period, are many bodies [m].
const JOIN_DISTANCE: f64 = 1e-3;
/// They are so until all are farther apart than this [m], which is looked at once in so many periods.
const PART_DISTANCE: f64 = 5e-3;
const LOOK_EVERY: u32 = 20;

/// The simulated cell with all objects.
pub struct SimScene {
    /// Arm and first object.
    cell: SimCell,
    others: Vec<OtherObject>,
    /// Names of all bodies, and the places of their objects among those of the cell.
    names: Vec<ObjectName>,
    objects: Vec<usize>,
    /// All of them in one world, where there are several.
    many: Option<ManyBodies>,
    is_together: bool,
    /// One of them moves in itself, which the law of one object does not know.
    stays_together: bool,
    /// Nothing has moved since all were seen to be apart.
    known_apart: bool,
    periods: u32,
}

/// One of the objects beside the first.
struct OtherObject {
    object: SimObject,
    contact: ToolContact,
}

impl SimScene {
    /// The cell as cell.toml describes it, arm and objects at rest where they start; what `theta` knows replaces cell.toml's
    /// nominal values, of each object by its name.
    ///
    /// # Errors
    /// [`SimError`] naming the object, the key or file and the remedy.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, SimError> {
        let bodies = cell_bodies(cell)?;
        let about = |number: usize| {
            let one = Cell { in_question: number, ..cell.clone() };
            let theta = theta.map(|theta| theta.clone().about(&one));
            (one, theta)
        };
        let articulated = cell.objects.iter().find(|object| object.urdf.is_some());
        if cell.objects.len() < 2 && articulated.is_none() {
            let (first, theta) = about(0);
            return Ok(Self::around(SimCell::new(&first, theta.as_ref())?, &bodies));
        }
        let table = cell.table.ok_or(SimError::NoTable)?.height;
        let mut rigid = Vec::new();
        for number in (0..cell.objects.len()).filter(|number| cell.objects[*number].urdf.is_none()) {
            let (one, theta) = about(number);
            let of_this = |error: SimError| error.of(one.object_name());
            let model = ObjectModel::new(&one, theta.as_ref()).map_err(|error| of_this(error.into()))?;
            let sim = SimCell::new(&one, theta.as_ref()).map_err(of_this)?;
            rigid.push((number, model, sim));
        }
        let starts = starts(cell, &bodies, table);
        let mut plans = Vec::new();
        for (number, object) in cell.objects.iter().enumerate() {
            let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
            let tip_friction = object.nominal_tip_friction();
            match rigid.iter().find(|(of, ..)| *of == number) {
                Some((_, Some(model), SimCell { object: Some(object), .. })) => {
                    plans.push(Member::rigid(own[0].name, object, model, starts[number])?);
                }
                _ => plans.extend(
                    linked(object, &own, starts[number], plans.len())?
                        .into_iter()
                        .map(|plan| Member { plan, tip_friction }),
                ),
            }
        }
        let mut scene = match articulated {
            None => {
                let mut sims = rigid.into_iter().map(|(.., sim)| sim);
                let mut scene = Self::around(sims.next().ok_or(SimError::NoTable)?, &bodies);
                let beside = |SimCell { object, contact, .. }: SimCell| Some(OtherObject { object: object?, contact });
                scene.others = sims.filter_map(beside).collect();
                scene
            }
            Some(object) => {
                let bare = Cell { objects: Vec::new(), ..cell.clone() };
                let sim = SimCell::new(&bare, theta)?;
                refuse_effects(theta, object)?;
                Self { is_together: true, stays_together: true, ..Self::around(sim, &bodies) }
            }
        };
        let tool = cell.tool.as_ref().zip(scene.cell.arm.as_ref());
        let many = ManyBodies::new(table, tool.map(|(tool, arm)| (scene.cell.contact.held_tool(tool), arm)), plans)?;
        if let Some([a, b]) = many.overlap() {
            let [first, second] = [a, b].map(|i| scene.names[i].text().to_owned());
            return Err(SimError::Overlap { first, second });
        }
        if articulated.is_none() {
            for (number, start) in starts.iter().enumerate() {
                scene.set_object(number, &Pose::from_isometry(*start), Vector3::zeros(), Vector3::zeros());
            }
        }
        scene.many = Some(many);
        Ok(scene)
    }

    fn around(cell: SimCell, bodies: &[CellBody]) -> Self {
        Self {
            cell,
            others: Vec::new(),
            names: bodies.iter().map(|body| body.name).collect(),
            objects: bodies.iter().map(|body| body.object).collect(),
            many: None,
            is_together: false,
            stays_together: false,
            known_apart: false,
            periods: 0,
        }
    }

    /// Arm and first object, and what is known of the arm.
    pub fn cell(&self) -> &SimCell {
        &self.cell
    }

    /// Lets the arm collide with the table: [`SimCell::make_table_solid`].
    pub fn make_table_solid(&mut self, cell: &Cell) {
        self.cell.make_table_solid(cell);
    }

    /// Tells the arm's controller what the flange carries: [`SimCell::declare_load`].
    pub fn declare_load(&mut self, load: &MassProperties) {
        self.cell.declare_load(load);
    }

    /// Asks the arm's own controller for another stiffness [N m/rad]: [`SimCell::ask_stiffness`].
    ///
    /// # Errors
    /// [`GainError`] when cell.toml describes no controller.
    pub fn ask_stiffness(&mut self, stiffness: &Joints) -> Result<(), GainError> {
        self.cell.ask_stiffness(stiffness)
    }

    /// Takes the arm's motion out until it is set again. Apart from each other objects do not notice it meanwhile, among many bodies
    /// they give way to its tool.
    pub fn remove_arm(&mut self) {
        self.cell.remove_arm();
    }

    /// Names of all bodies in the order of cell.toml; empty for one object without a name.
    pub fn names(&self) -> &[ObjectName] {
        &self.names
    }

    /// Place among the cell's objects of the one that a body belongs to.
    pub fn object_of(&self, number: usize) -> usize {
        self.objects.get(number).copied().unwrap_or(0)
    }

    /// Whether a body hangs on another one by a joint.
    pub fn is_on_joint(&self, number: usize) -> bool {
        self.many.as_ref().is_some_and(|many| many.is_on_joint(number))
    }

    /// Fills what a robot reports about itself: [`SimCell::read`].
    pub fn read(&mut self, state: &mut shared_mem::msg::arm::ArmState) {
        self.cell.read(state);
    }

    /// Lets one control period of 1 ms pass.
    pub fn step(&mut self, drive: &Drive) {
        if self.many.is_none() {
            return self.cell.step(drive);
        }
        self.periods = self.periods.wrapping_add(1);
        if self.is_together && !self.stays_together && self.periods.is_multiple_of(LOOK_EVERY) {
            self.part();
        }
        if !self.is_together {
            let near = self.at_the_tool();
            if near.len() > 1 || self.are_near() {
                self.join();
            } else {
                return self.step_apart(drive, near.first().copied());
            }
        }
        if let Some(many) = &mut self.many {
            many.step(&mut self.cell, drive);
        }
    }

    /// Objects that the tool may touch within the coming period.
    fn at_the_tool(&mut self) -> Vec<usize> {
        let SimCell { arm, object, contact, takes_part, .. } = &mut self.cell;
        let Some(arm) = arm.as_ref().filter(|_| takes_part.arm) else { return Vec::new() };
        let first = object.as_ref().zip(Some(contact)).into_iter();
        let all = first.chain(self.others.iter_mut().map(|other| (&other.object, &mut other.contact)));
        all.enumerate().filter_map(|(i, (object, contact))| contact.is_near(arm, object).then_some(i)).collect()
    }

    /// A period in which the tool is at one of the objects, or at none.
    fn step_apart(&mut self, drive: &Drive, touched: Option<usize>) {
        self.cell.lean_on_table();
        let SimCell { arm, object, contact, time_ns, takes_part, .. } = &mut self.cell;
        let mut arm = arm.as_mut().filter(|_| takes_part.arm);
        let first = object.as_mut().zip(Some(contact)).into_iter();
        let all = first.chain(self.others.iter_mut().map(|other| (&mut other.object, &mut other.contact)));
        let mut on_tool = None;
        for (i, (object, contact)) in all.enumerate() {
            match arm.as_deref_mut().filter(|_| touched == Some(i)) {
                Some(arm) => {
                    contact.advance(arm, object, drive, *time_ns);
                    on_tool = Some(contact.record.on_tool);
                }
                None => {
                    contact.let_go();
                    contact.pass(object);
                }
            }
        }
        if let (Some(arm), None) = (arm, touched) {
            arm.period(drive);
        }
        // Whoever asks what the tool feels asks the cell.
        self.cell.contact.record.on_tool = on_tool.unwrap_or_default();
        self.cell.time_ns += TICK_NS;
    }

    /// Whether two objects are near each other. While nothing moves that need not be looked at twice.
    fn are_near(&mut self) -> bool {
        let still = self.objects().all(SimObject::rests);
        if self.known_apart && still {
            return false;
        }
        let fastest = self.objects().map(speed).fold(0.0, f64::max);
        let Some(mut many) = self.many.take() else { return false };
        many.take_up(self.objects());
        let near = many.any_near(JOIN_DISTANCE + 2.0 * fastest * shared_mem::time::TICK);
        self.many = Some(many);
        self.known_apart = still && !near;
        near
    }

    /// From here on all are in one world.
    fn join(&mut self) {
        if let Some(mut many) = self.many.take() {
            many.take_up(self.objects());
            self.many = Some(many);
        }
        (self.is_together, self.known_apart) = (true, false);
    }

    /// Each by itself again, where all are apart.
    fn part(&mut self) {
        let Some(many) = self.many.take() else { return };
        if !many.any_near(PART_DISTANCE) {
            let first = self.cell.object.iter_mut();
            let all = first.chain(self.others.iter_mut().map(|other| &mut other.object));
            for (i, object) in all.enumerate() {
                let motion = many.motion(i);
                object.set(&Pose::from_isometry(motion.pose), motion.velocity, motion.spin);
            }
            self.cell.contact.look_again();
            self.others.iter_mut().for_each(|other| other.contact.look_again());
            // The tool between two of them keeps them together.
            self.is_together = self.at_the_tool().len() > 1;
        }
        self.many = Some(many);
    }

    fn objects(&self) -> impl Iterator<Item = &SimObject> {
        self.cell.object.iter().chain(self.others.iter().map(|other| &other.object))
    }

    /// Geometric centre of a body by its number.
    pub fn object(&self, number: usize) -> Option<Pose<Base, Object>> {
        match &self.many {
            Some(many) if self.is_together => many.pose(number),
            _ => self.objects().nth(number).map(SimObject::pose),
        }
    }

    /// Whether the tool presses on a body, or something else moves it.
    pub fn is_moved(&self, number: usize) -> bool {
        match &self.many {
            Some(many) if self.is_together => many.is_moved(number),
            _ if number == 0 => self.cell.contact_force() > 0.0,
            _ => self.others.get(number - 1).is_some_and(|other| other.contact.record.mean_force > 0.0),
        }
    }

    /// Normal force between the tool and whatever it touches, mean over the last period [N].
    pub fn contact_force(&self) -> f64 {
        let others = self.others.iter().filter(|_| !self.is_together);
        self.cell.contact_force() + others.map(|other| other.contact.record.mean_force).sum::<f64>()
    }

    /// Puts a body somewhere: pose and velocity [m/s] of its geometric centre, angular velocity [rad/s].
    pub fn set_object(&mut self, number: usize, pose: &Pose<Base, Object>, velocity: Vector3<f64>, spin: Vector3<f64>) {
        self.known_apart = false;
        if let Some(many) = self.many.as_mut().filter(|_| self.is_together) {
            many.put(number, pose);
        } else if number == 0 {
            self.cell.set_object(pose, velocity, spin);
        } else if let Some(other) = self.others.get_mut(number - 1) {
            other.object.set(pose, velocity, spin);
            other.contact.look_again();
        }
    }

    /// Puts the arm somewhere: [`SimCell::set_arm`].
    pub fn set_arm(&mut self, state: &JointState, dof: usize) {
        self.cell.set_arm(&state.q[..dof], &state.dq[..dof]);
        self.others.iter_mut().for_each(|other| other.contact.look_again());
    }

    /// The cell as a camera sees it now.
    pub fn snapshot(&self) -> SceneSnapshot {
        let mut named = NamedPoses::default();
        for (number, name) in self.names.iter().enumerate() {
            if let Some(pose) = self.object(number) {
                named.push(*name, pose);
            }
        }
        SceneSnapshot { object: self.object(0), named, ..self.cell.snapshot() }
    }
}

/// Effects on hit and slide act under the law of one object, which a cell with this one has not.
fn refuse_effects(theta: Option<&Theta>, articulated: &shared_mem::cell::Object) -> Result<(), SimError> {
    let blocks = theta.map_or(&[][..], |theta| &theta.effects);
    let of_objects = |name: &str| find(name).is_some_and(|effect| matches!(effect.stage, Stage::Hit | Stage::Slide));
    let Some(block) = blocks.iter().find(|block| of_objects(&block.name)) else { return Ok(()) };
    Err(SimError::Body {
        name: articulated.name.clone().unwrap_or_default(),
        what: format!(
            "it moves in itself (`urdf`), and beside such an object effects on hit and slide, as `{}`, are not simulated; take it \
             out of cell.toml",
            block.name
        ),
    })
}

/// Of the fastest point of an object, at most [m/s].
fn speed(object: &SimObject) -> f64 {
    object.centre_velocity().norm() + object.angular_velocity().norm() * object.bounding_radius()
}
