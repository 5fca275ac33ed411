//! All objects, the table and the tool in one world of many bodies. The arm stays the cell's own, with its controller and effects:
//! the world meets its inertia at the tool, and what touches the tool acts as a torque on the joints for that period.

use super::super::arm::SimArm;
use super::super::contact::Held;
use super::super::{SimCell, SimObject};
use crate::arm::{JointState, Joints, MAX_JOINTS};
use crate::control::Drive;
use crate::physics::Hull;
use crate::scene::ObjectModel;
use crate::sim::SimError;
use crate::world::{ArmPlan, BodyMotion, BodyPlan, Hold, Piece, STEP, World, box_hull};
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::ObjectName;
use shared_mem::time::TICK_NS;
use std::ops::Range;
use std::sync::Arc;

/// Half edges and thickness of the table [m].
const TABLE: [f64; 2] = [5.0, 0.2];
/// Sides of the prism that stands for the round tool.
const SIDES: usize = 16;
/// What moves faster than this is being moved [m/s].
const MOVES: f64 = 1e-3;
/// Place of the table among the bodies.
const ON_TABLE: usize = 0;

/// A body as it joins.
pub(super) struct Member {
    pub(super) plan: BodyPlan,
    /// Coulomb friction against the tool.
    pub(super) tip_friction: f64,
}

#[derive(Clone)]
pub(super) struct ManyBodies {
    world: World,
    tool: Option<usize>,
    /// Places of the objects among the bodies.
    objects: Range<usize>,
}

impl ManyBodies {
    /// Objects where they are now on a table at `height` [m], with the tool that an arm holds.
    ///
    /// # Errors
    /// [`SimError::Body`] for an object that cannot be one of many bodies.
    pub(super) fn new(height: f64, tool: Option<(Held, &SimArm)>, members: Vec<Member>) -> Result<Self, SimError> {
        let at = |z: f64| Isometry3::translation(0.0, 0.0, z);
        let [half, thick] = TABLE;
        let slab = box_hull([2.0 * half, 2.0 * half, thick]).map(|hull| Piece::new(hull, Isometry3::identity()));
        let table = Hold::Fixed(at(height - 0.5 * thick));
        let mut bodies = vec![BodyPlan::homogeneous("table", slab.into_iter().collect(), 1.0, table)];
        let held = tool.filter(|(_, arm)| arm.model().has_geometry());
        bodies.extend(held.and_then(|(held, arm)| tool_body(&held, arm)));
        let tool = bodies.len().checked_sub(1).filter(|last| *last != ON_TABLE);
        let first = bodies.len();
        let against_tool: Vec<f64> = members.iter().map(|member| member.tip_friction).collect();
        bodies.extend(members.into_iter().map(|member| member.plan.hanging(first)));
        let mut world = World::new(&bodies)?;
        for (i, friction) in against_tool.into_iter().enumerate() {
            if let Some(tool) = tool {
                world.set_friction([tool, first + i], friction);
            }
        }
        if let Some(tool) = tool {
            // As everywhere in the simulated cell: a recorded arm never touches the table.
            world.let_pass([ON_TABLE, tool]);
        }
        Ok(Self { world, tool, objects: first..bodies.len() })
    }

    /// Two objects that overlap now, by their numbers.
    pub(super) fn overlap(&self) -> Option<[usize; 2]> {
        let [a, b] = self.world.overlap()?;
        let both = self.objects.contains(&a) && self.objects.contains(&b);
        both.then(|| [a - self.objects.start, b - self.objects.start])
    }

    /// Puts all objects where they are by themselves.
    pub(super) fn take_up<'a>(&mut self, objects: impl Iterator<Item = &'a SimObject>) {
        for (body, object) in self.objects.clone().zip(objects) {
            let (velocity, spin) = (object.centre_velocity(), object.angular_velocity());
            self.world.set_motion(body, &BodyMotion { pose: object.pose().isometry(), velocity, spin });
        }
        self.world.refresh();
    }

    pub(super) fn any_near(&self, within: f64) -> bool {
        self.world.any_near(&self.objects, within)
    }

    pub(super) fn motion(&self, number: usize) -> BodyMotion {
        self.world.motion(self.objects.start + number)
    }

    pub(super) fn pose(&self, number: usize) -> Option<Pose<Base, Object>> {
        let body = self.objects.start + number;
        self.objects.contains(&body).then(|| Pose::from_isometry(self.world.pose(body)))
    }

    /// Puts an object somewhere, at rest; one on a joint as near to that as its joint lets it.
    pub(super) fn put(&mut self, number: usize, pose: &Pose<Base, Object>) {
        let body = self.objects.start + number;
        if self.objects.contains(&body) {
            self.world.put_link(body, &pose.isometry());
        }
    }

    /// Whether an object's body hangs on another one by a joint.
    pub(super) fn is_on_joint(&self, number: usize) -> bool {
        self.world.joint(self.objects.start + number).is_some()
    }

    /// Whether the tool presses on an object, or something else moves it.
    pub(super) fn is_moved(&self, number: usize) -> bool {
        let body = self.objects.start + number;
        self.world.speed(body) > MOVES || self.tool.is_some_and(|tool| self.world.touch(tool, body))
    }

    /// One period. The arm is moved as if nothing touched it; where something does, it goes back and takes the period again with
    /// the torque of that.
    pub(super) fn step(&mut self, cell: &mut SimCell, drive: &Drive) {
        let now_ns = cell.time_ns;
        cell.time_ns += TICK_NS;
        let (table, takes_part) = (cell.lean_on_table(), cell.takes_part.arm);
        let record = &mut cell.contact.record;
        (record.mean_force, record.on_tool) = (0.0, Default::default());
        let Some(arm) = &mut cell.arm else { return self.world.step() };
        let Some(tool) = self.tool else {
            if takes_part {
                arm.period(drive);
            }
            return self.world.step();
        };
        if !takes_part {
            self.world.set_arm(tool, arm.state());
            self.world.refresh();
            return self.world.step();
        }
        let before = arm.motion.clone();
        arm.period(drive);
        let (q, free) = (before.state.q, arm.state().dq);
        self.world.set_arm(tool, &JointState { q, dq: free });
        self.world.refresh();
        self.world.step();
        let load = self.world.load_on(tool);
        if load.pressing == 0.0 {
            return;
        }
        let after = self.world.arm(tool).map_or(free, |state| state.dq);
        let masses = arm.model().mass_matrix(&q);
        let torque: Joints =
            std::array::from_fn(|i| (0..MAX_JOINTS).map(|j| masses[i][j] * (after[j] - free[j])).sum::<f64>() / STEP);
        arm.motion.clone_from(&before);
        arm.push(std::array::from_fn(|i| torque[i] + table[i]));
        arm.period(drive);
        arm.push([0.0; MAX_JOINTS]);
        (record.mean_force, record.on_tool) = (load.pressing, [load.force, load.moment]);
        let first = record.span.map_or(now_ns, |(first, _)| first);
        record.span = Some((first, now_ns + TICK_NS));
    }
}

impl Member {
    /// A rigid object that stands at `start`.
    ///
    /// # Errors
    /// [`SimError::Body`] where its mesh has no volume.
    pub(super) fn rigid(
        name: ObjectName,
        object: &SimObject,
        model: &ObjectModel,
        start: Isometry3<f64>,
    ) -> Result<Self, SimError> {
        let fault = || SimError::Body { name: name.text().to_owned(), what: "its mesh has no volume".into() };
        let piece = Piece::new(object.hull().ok_or_else(fault)?, Isometry3::identity());
        let body = BodyPlan::homogeneous(name.text(), vec![piece], model.mass, Hold::Free(start));
        // As for one object: about a centre of mass elsewhere the inertia stays that of evenly spread mass.
        let plan = BodyPlan { centre_of_mass: model.centre_of_mass, friction: model.friction, ..body };
        Ok(Self { plan, tip_friction: model.tip_friction })
    }
}

/// The tool at the flange of an arm whose controller is the cell's.
fn tool_body(held: &Held, arm: &SimArm) -> Option<BodyPlan> {
    let no_gains = [0.0; MAX_JOINTS];
    let plan = ArmPlan {
        model: Arc::new(arm.model().clone()),
        base: Isometry3::identity(),
        flange_from_body: held.flange_from_tool,
        start: arm.state().q,
        stiffness: no_gains,
        damping: no_gains,
    };
    let piece = Piece::new(capsule(held.segment, held.radius)?, Isometry3::identity());
    // Its mass is the arm's.
    Some(BodyPlan::homogeneous("tool", vec![piece], 0.0, Hold::Arm(Box::new(plan))))
}

/// A capsule along z from the origin on: as much outside of the round one between its edges as inside of it at them.
fn capsule(segment: f64, radius: f64) -> Option<Hull> {
    let radius = radius / (std::f64::consts::PI / SIDES as f64).cos().sqrt();
    let ring = |height: f64, across: f64| {
        (0..SIDES).map(move |i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / SIDES as f64).sin_cos();
            Point3::from(Vector3::new(across * cos, across * sin, height))
        })
    };
    let eighth = radius * std::f64::consts::FRAC_1_SQRT_2;
    let corners: Vec<Point3<f64>> = ring(0.0, radius)
        .chain(ring(segment, radius))
        .chain(ring(-eighth, eighth))
        .chain(ring(segment + eighth, eighth))
        .chain([Point3::new(0.0, 0.0, -radius), Point3::new(0.0, 0.0, segment + radius)])
        .collect();
    Hull::of(&corners)
}
