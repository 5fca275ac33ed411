//! One run of a task: did it come to rest, where, and was it a success.

use super::Task;
use super::arm::CarrierCommand;
use super::cell::Servo;
use super::motion::Motions;
use super::progress::Progress;
use super::start::{Placed, StartError};
use crate::world::{STEP, World};
use nalgebra::Isometry3;
use rand_pcg::Pcg64;
use serde::Serialize;

/// A body whose fastest point is slower than this is at rest [m/s], once it has been for so long [s].
const REST_SPEED: f64 = 1e-4;
const STILL_FOR: f64 = 0.1;

/// Steps from one row of a recording to the next.
pub(super) const STEPS_A_ROW: usize = 10;
/// Stream of the deviates of way points: starts are drawn from another one, so that noise leaves them as they are.
const NOISE_STREAM: u128 = 0x006e_6f69_7365;

/// How an episode is to be run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Draws where bodies start, and the noise.
    pub seed: u64,
    /// Simulated time at most [s].
    pub duration: f64,
    /// One sigma of what is added to the script's way points, along each axis [m].
    pub noise: f64,
}

/// An episode between two steps.
pub(super) struct Scene<'a> {
    pub(super) world: &'a World,
    pub(super) motions: &'a Motions,
    /// Poses of all bodies at the beginning.
    pub(super) starts: &'a [Isometry3<f64>],
    /// The arm, where the task has one.
    pub(super) command: &'a CarrierCommand,
}

impl Scene<'_> {
    /// Where a moved body is commanded to be after so many steps.
    pub(super) fn commanded(&self, body: usize, done: usize) -> Isometry3<f64> {
        commanded(self.motions, self.starts, body, done)
    }
}

fn commanded(motions: &Motions, starts: &[Isometry3<f64>], body: usize, done: usize) -> Isometry3<f64> {
    let goal = done.checked_sub(1).and_then(|step| motions.goal(body, &starts[body], step));
    goal.map_or(starts[body], |(goal, _)| goal)
}

/// What came of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Episode {
    /// By which the start was drawn.
    pub seed: u64,
    /// Simulated time [s]: until success, or all that was asked for.
    pub duration_s: f64,
    /// Whether every body that moves by itself was at rest at the end.
    pub at_rest: bool,
    /// Since when it was [s].
    pub at_rest_since_s: Option<f64>,
    /// Whether all conditions held for as long as they have to, and the arm, where there is one, can do it.
    pub success: bool,
    /// How far it came towards success: 0 as at the start, 1 success.
    pub progress: f64,
    /// Conditions of success that did not hold at the end, in words.
    pub missed: Vec<String>,
    /// What of the motion the arm cannot do, at first.
    pub arm_fault: Option<String>,
    /// Joints of an arm that gives way, at the start and at the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmEnd>,
    pub bodies: Vec<BodyEnd>,
    /// Bodies that press on each other at the end, by name.
    pub contacts: Vec<[String; 2]>,
}

/// The joints of an arm that gives way, the first seven [rad].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmEnd {
    /// At the start.
    pub start_q: Vec<f64>,
    /// At the end.
    pub end_q: Vec<f64>,
}

/// A body at the start and at the end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyEnd {
    pub name: String,
    /// Where it started.
    pub start: Place,
    /// Where it is.
    pub end: Place,
    /// Its fastest point at the end [m/s].
    pub speed_m_s: f64,
}

/// A pose of a body's origin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// World [m].
    pub position: [f64; 3],
    pub orientation_wxyz: [f64; 4],
    /// Of its joint, where it has one [rad or m].
    pub joint: Option<f64>,
}

impl Task {
    /// Simulates an episode.
    ///
    /// # Errors
    /// [`StartError`] when bodies overlap wherever they start, or nothing is left to do.
    pub fn episode(&self, how: &Run) -> Result<Episode, StartError> {
        self.watched(how, |_, _| {})
    }

    /// Simulates an episode; `watch` is called at the start and after every [`STEPS_A_ROW`] steps, with how many there
    /// have been.
    pub(super) fn watched(&self, how: &Run, mut watch: impl FnMut(usize, &Scene<'_>)) -> Result<Episode, StartError> {
        let Placed { mut world, yaws } = self.placed(how.seed)?;
        let poses: Vec<Isometry3<f64>> = (0..self.bodies.len()).map(|body| world.pose(body)).collect();
        let mut generator = Pcg64::new(u128::from(how.seed), NOISE_STREAM);
        let motions = self.motions.placed(&world, &yaws).off_by(how.noise, &mut generator);
        let starts: Vec<Place> = (0..self.bodies.len()).map(|body| Place::of(&world, body)).collect();
        let joints = |world: &World| -> Option<Vec<f64>> {
            let carrier = self.carrier.as_ref()?;
            Some(world.arm(carrier.body)?.q[..carrier.joint_names().len()].to_vec())
        };
        let start_q = joints(&world);
        let steps = (how.duration / STEP).round().max(1.0) as usize;
        let mut run = Course::new();
        let mut command = CarrierCommand::default();
        self.carry(&mut command, (&motions, &poses), 0);
        let mut progress = Progress::begin(self, &world);
        let mut servo = command.joints().and_then(|q| Servo::begin(self, q));
        watch(0, &Scene { world: &world, motions: &motions, starts: &poses, command: &command });
        while run.done < steps && !run.is_success(self.hold) {
            motions.act(&mut world, &poses, run.done);
            if let Some(servo) = &mut servo {
                self.obey(servo, &command, &mut world, run.done);
            }
            world.step();
            run.count(self, &world);
            if run.done.is_multiple_of(STEPS_A_ROW) {
                progress.look(self, &world);
                self.carry(&mut command, (&motions, &poses), run.done);
                if let Some(servo) = &servo {
                    command.read(servo.reading());
                }
                watch(run.done, &Scene { world: &world, motions: &motions, starts: &poses, command: &command });
            }
        }
        let at_rest = (run.done - run.moved) as f64 * STEP > STILL_FOR;
        let bodies = starts.into_iter().enumerate().map(|(body, start)| BodyEnd {
            name: self.bodies[body].name.clone(),
            start,
            end: Place::of(&world, body),
            speed_m_s: world.speed(body),
        });
        let success = run.is_success(self.hold) && command.fault.is_none();
        Ok(Episode {
            seed: how.seed,
            duration_s: run.done as f64 * STEP,
            at_rest,
            at_rest_since_s: at_rest.then_some(run.moved as f64 * STEP),
            success,
            progress: progress.best(success),
            missed: if success { Vec::new() } else { self.missed(&world) },
            arm_fault: command.fault,
            arm: start_q.zip(joints(&world)).map(|(start_q, end_q)| ArmEnd { start_q, end_q }),
            bodies: bodies.collect(),
            contacts: self.contacts(&world),
        })
    }

    /// Lets the arm go on to where its body is commanded to be after so many steps.
    fn carry(&self, command: &mut CarrierCommand, (motions, starts): (&Motions, &[Isometry3<f64>]), done: usize) {
        if let Some(carrier) = &self.carrier {
            let [now, next] = [done, done + 1].map(|done| commanded(motions, starts, carrier.body, done));
            carrier.follow(command, [&now, &next], (done as f64 * STEP, STEP));
        }
    }

    /// Has the arm follow its way for a step, from the last row of it on, and what it carries with it.
    fn obey(&self, servo: &mut Servo, command: &CarrierCommand, world: &mut World, done: usize) {
        let (Some(carrier), Some(q)) = (&self.carrier, command.joints()) else { return };
        let since = ((done % STEPS_A_ROW) + 1) as f64 * STEP;
        let q_d = std::array::from_fn(|i| q[i] + since * command.speeds()[i]);
        world.move_to(carrier.body, &carrier.body_at(&servo.step(&q_d, command.speeds())));
    }

    fn contacts(&self, world: &World) -> Vec<[String; 2]> {
        let count = self.bodies.len();
        let pairs = (0..count).flat_map(|first| (first + 1..count).map(move |second| [first, second]));
        let touching = pairs.filter(|[first, second]| world.touch(*first, *second));
        touching.map(|pair| pair.map(|body| self.bodies[body].name.clone())).collect()
    }
}

/// Steps done, and the last ones in which something moved and in which a condition did not hold.
#[derive(Debug)]
pub(super) struct Course {
    pub(super) done: usize,
    moved: usize,
    failed: usize,
}

impl Course {
    pub(super) fn new() -> Self {
        Self { done: 0, moved: 0, failed: 0 }
    }

    /// A step was done.
    pub(super) fn count(&mut self, task: &Task, world: &World) {
        self.done += 1;
        if (0..task.bodies.len()).any(|body| world.speed(body) > REST_SPEED) {
            self.moved = self.done;
        }
        if !task.conditions.iter().all(|condition| condition.holds(world)) {
            self.failed = self.done;
        }
    }

    pub(super) fn is_success(&self, hold: f64) -> bool {
        self.done > 0 && (self.done - self.failed) as f64 * STEP >= hold
    }
}

impl Place {
    fn of(world: &World, body: usize) -> Self {
        let pose = world.pose(body);
        let q = pose.rotation.quaternion();
        let position = pose.translation.vector.into();
        Self { position, orientation_wxyz: [q.w, q.i, q.j, q.k], joint: world.joint(body) }
    }
}
