//! An episode that a person steers: the arm's joints follow targets that are jogged, within their limits, and the body that it
//! carries goes with the flange. What is recorded of it is what is recorded of a scripted one.

use super::Task;
use super::arm::{Carrier, CarrierCommand};
use super::demonstration::Columns;
use super::episode::{Course, STEPS_A_ROW};
use super::start::{Placed, StartError};
use crate::arm::{Follower, Joints};
use crate::world::{STEP, World};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::recording::{Episode as Recorded, EpisodeInfo, EpisodeMoment, RigidPose};
use std::sync::Arc;

/// Steps from one target to the next: ten milliseconds.
const STEPS_A_TARGET: usize = 10;
/// Fastest jog of the flange [m/s, rad/s] and of a joint [rad/s].
const FASTEST: [f64; 3] = [0.25, 1.0, 0.8];
/// A target does not run further ahead of the joints than this [rad].
const LEASH: f64 = 0.2;
/// A pose that is missed by more is out of reach, and no target [m, rad].
const MISSED: [f64; 2] = [1e-3, 5e-3];
/// What is carried enters what is fast by no more than this [m].
const ENTERS: f64 = 1e-3;

/// What a person asks for, until it is asked for something else. Shares of the fastest jog, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Jog {
    /// Nothing: the arm holds.
    #[default]
    Still,
    /// The flange along and about the base frame's axes.
    Flange {
        /// Along x, y, z.
        along: [f64; 3],
        /// About x, y, z.
        about: [f64; 3],
    },
    Joints(Joints),
}

/// An episode cannot be steered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SteerError {
    /// Nothing is there to be steered.
    #[error("the task has no arm to steer; give it an [arm] block (docs/tasks.md)")]
    NoArm,
    /// The carried body starts where the arm cannot be.
    #[error("the arm does not reach the start of what it carries; move the body, or `base` of [arm]")]
    OutOfReach,
    /// Bodies overlap, or nothing is left to do.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// An episode in progress.
#[derive(Debug)]
pub struct Steered {
    task: Arc<Task>,
    seed: u64,
    world: World,
    follower: Follower,
    jog: Jog,
    command: CarrierCommand,
    /// Where the joints are going, and the flange with them.
    target: Joints,
    flange: Isometry3<f64>,
    /// The last joints at which what is carried was in nothing.
    clear: Joints,
    /// Why the arm does not go where it is jogged.
    held_by: Option<&'static str>,
    carried: Vec<usize>,
    /// How deep that may be in what is fast: no deeper than where it started, and a little [m].
    enters: f64,
    course: Course,
    columns: Columns,
    moments: Vec<EpisodeMoment>,
}

impl Steered {
    /// Places the bodies by a seed.
    ///
    /// # Errors
    /// [`SteerError`] for a task without an arm, and when it cannot start.
    pub fn begin(task: &Arc<Task>, seed: u64) -> Result<Self, SteerError> {
        let carrier = task.carrier.as_ref().ok_or(SteerError::NoArm)?;
        let Placed { world, .. } = task.placed(seed)?;
        let q = carrier.joints_at(&world.pose(carrier.body)).ok_or(SteerError::OutOfReach)?;
        let mut follower = Follower::calm(&q, carrier.limits(), STEP);
        follower.set_speed(1.0);
        let carried = task.carried(carrier.body);
        let enters = world.enters_fixed(&carried) + ENTERS;
        let mut begun = Self {
            task: Arc::clone(task),
            seed,
            world,
            follower,
            jog: Jog::Still,
            command: CarrierCommand::at_rest(q),
            target: q,
            flange: carrier.flange(&q),
            clear: q,
            held_by: None,
            carried,
            enters,
            course: Course::new(),
            columns: Columns::of(task),
            moments: Vec::new(),
        };
        begun.remember();
        Ok(begun)
    }

    /// What the arm is to do from now on. Numbers that are none, and shares beyond 1, count as no more than 1.
    pub fn jog(&mut self, jog: Jog) {
        self.jog = jog;
    }

    /// Opens or closes the gripper, with the force of its drive; nothing happens where the task has none.
    pub fn fingers(&mut self, open: bool) {
        let Some(gripper) = &self.task.gripper else { return };
        if let Some((target, force)) = gripper.order(&self.task.bodies, open) {
            self.world.drive(gripper.drive(), target, force);
        }
    }

    /// Lets a step of [`STEP`] pass.
    pub fn step(&mut self) {
        let task = Arc::clone(&self.task);
        let Some(carrier) = &task.carrier else { return };
        if self.course.done.is_multiple_of(STEPS_A_TARGET) {
            self.aim(carrier);
        }
        match self.follower.step() {
            Some(q) => self.command.go(q, self.follower.velocity()),
            None => self.held_by = Some("no way to where it is jogged"),
        }
        if let Some(q) = self.command.joints() {
            match self.world.arm(carrier.body) {
                Some(_) => self.world.aim(carrier.body, q, &self.follower.velocity()),
                None => self.world.move_to(carrier.body, &carrier.body_at(q)),
            }
        }
        self.world.step();
        self.course.count(&task, &self.world);
        if self.course.done.is_multiple_of(STEPS_A_ROW) {
            self.remember();
        }
    }

    /// Puts the target where the jog leads within the time to the next one.
    fn aim(&mut self, carrier: &Carrier) {
        self.held_by = None;
        let now = self.command.joints().copied().unwrap_or(self.target);
        if self.world.enters_fixed(&self.carried) <= self.enters {
            self.clear = now;
        } else {
            // Back to where it came from, whatever is asked for.
            self.held_by = Some("blocked: collision with a fixed body");
            self.go_for(carrier, self.clear);
            return;
        }
        let time = STEPS_A_TARGET as f64 * STEP;
        let share = |share: f64| if share.is_finite() { share.clamp(-1.0, 1.0) } else { 0.0 };
        let far = |q: &Joints| q.iter().zip(&now).any(|(q, now)| (q - now).abs() > LEASH);
        match self.jog {
            Jog::Still => {}
            Jog::Flange { along, about } => {
                let [fast, turning, _] = FASTEST;
                let shift = Vector3::from(along.map(share)) * (fast * time);
                let turn = UnitQuaternion::from_scaled_axis(Vector3::from(about.map(share)) * (turning * time));
                let mut next = self.flange;
                next.translation = Translation3::from(next.translation.vector + shift);
                next.rotation = turn * next.rotation;
                let found = carrier.nearest(&self.target, &next);
                if found.off > MISSED[0] || found.turned > MISSED[1] {
                    self.held_by = Some("that is out of its reach");
                } else if !far(&found.q) {
                    self.go_for(carrier, found.q);
                    self.flange = next;
                }
            }
            Jog::Joints(shares) => {
                let mut next = self.target;
                for (i, joint) in carrier.limits().counted().enumerate() {
                    let [low, high] = joint.targets();
                    let wanted = next[i] + share(shares[i]) * FASTEST[2] * time;
                    next[i] = wanted.max(low).min(high);
                    if next[i] != wanted && shares[i] != 0.0 {
                        self.held_by = Some("a joint is at its end");
                    }
                }
                if !far(&next) {
                    self.go_for(carrier, next);
                }
            }
        }
    }

    fn go_for(&mut self, carrier: &Carrier, q: Joints) {
        if self.follower.aim(&q).is_ok() {
            (self.target, self.flange) = (q, carrier.flange(&q));
        } else {
            self.held_by = Some("a joint is at its end");
        }
    }

    fn remember(&mut self) {
        let moment =
            self.columns.moment(&self.task, &self.world, self.course.done, &self.command, |body| self.world.pose(body));
        self.moments.push(moment);
    }

    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Simulated time since the start [s].
    pub fn time(&self) -> f64 {
        self.course.done as f64 * STEP
    }

    /// Where the bodies are.
    pub fn poses(&self) -> Vec<RigidPose> {
        (0..self.task.bodies.len()).map(|body| super::demonstration::rigid_pose(&self.world.pose(body))).collect()
    }

    /// Joint positions of the arm [rad].
    pub fn joints(&self) -> Joints {
        let given_way =
            self.task.carrier.as_ref().and_then(|carrier| self.world.arm(carrier.body)).map(|state| state.q);
        given_way.or(self.command.joints().copied()).unwrap_or_default()
    }

    /// Origin of the flange in the arm's base [m].
    pub fn flange(&self) -> [f64; 3] {
        let carrier = self.task.carrier.as_ref();
        carrier.map_or([0.0; 3], |carrier| carrier.flange(&self.joints()).translation.vector.into())
    }

    /// Between the fingers [m], and whether they hold something; `None` without a gripper.
    pub fn gripper(&self) -> Option<(f64, bool)> {
        let state = self.task.gripper.as_ref()?.state(&self.world, self.task.bodies.len())?;
        Some((state.width, state.grasped != 0))
    }

    /// Which of the conditions of success hold now, in the order of [`Task::conditions`].
    pub fn holds(&self) -> Vec<bool> {
        self.task.conditions.iter().map(|condition| condition.holds(&self.world)).collect()
    }

    /// Whether all of them have held for as long as they have to.
    pub fn is_success(&self) -> bool {
        self.course.is_success(self.task.hold)
    }

    /// Why the arm does not go where it is jogged, where it does not.
    pub fn held_by(&self) -> Option<&'static str> {
        self.held_by
    }

    /// What is recorded of it so far; its rows are handed over.
    pub fn recorded(&mut self) -> Recorded {
        let info = EpisodeInfo {
            task: self.task.name.clone(),
            seed: self.seed,
            noise_m: 0.0,
            success: self.is_success(),
            duration_s: self.time(),
        };
        let moments = std::mem::take(&mut self.moments);
        self.columns.recorded(&self.task, info, moments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::MAX_JOINTS;
    use std::path::Path;

    fn task(name: &str) -> Arc<Task> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../twin/tasks").join(name);
        Arc::new(Task::read(&path).expect("a task that ships"))
    }

    /// Lets seconds pass; the largest speed, acceleration and jerk of a joint are inside its limits.
    fn pass(episode: &mut Steered, seconds: f64) {
        let limits = crate::arm::Limits::fr3();
        let (mut q, mut v, mut a) = (episode.joints(), [0.0; MAX_JOINTS], [f64::NAN; MAX_JOINTS]);
        let mut begun = 0;
        for _ in 0..(seconds / STEP) as usize {
            episode.step();
            let next = episode.joints();
            for (i, joint) in limits.counted().enumerate() {
                let speed = (next[i] - q[i]) / STEP;
                let rate = (speed - v[i]) / STEP;
                assert!((joint.q_min..=joint.q_max).contains(&next[i]), "joint {i} at {}", next[i]);
                assert!(speed.abs() <= joint.velocity);
                // The first differences are over the border of two calls.
                if begun > 1 {
                    assert!(rate.abs() <= joint.acceleration + 1e-3, "joint {i}: {rate}");
                }
                if begun > 2 {
                    assert!((rate - a[i]).abs() / STEP <= joint.jerk + 1.0, "joint {i}: {}", (rate - a[i]) / STEP);
                }
                (v[i], a[i]) = (speed, rate);
            }
            (q, begun) = (next, begun + 1);
        }
    }

    #[test]
    fn the_flange_goes_where_it_is_jogged_and_holds_when_it_is_let_go() {
        let mut episode = Steered::begin(&task("pick_carrot.toml"), 0).expect("a start");
        let hand = |episode: &Steered| episode.poses()[3].position;
        let before = hand(&episode);
        episode.jog(Jog::Flange { along: [0.5, 0.0, 0.0], about: [0.0; 3] });
        pass(&mut episode, 0.8);
        episode.jog(Jog::Still);
        pass(&mut episode, 1.0);
        let after = hand(&episode);
        assert!((after[0] - before[0] - 0.1).abs() < 0.005, "{before:?} {after:?}");
        assert!((after[1] - before[1]).abs() < 1e-3 && (after[2] - before[2]).abs() < 1e-3, "{before:?} {after:?}");
        pass(&mut episode, 0.5);
        let moved = hand(&episode).iter().zip(after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-6, "it holds: {moved}");
    }

    #[test]
    fn whatever_is_jogged_no_joint_leaves_its_limits_and_nothing_enters_the_table() {
        let mut episode = Steered::begin(&task("push_milk.toml"), 0).expect("a start");
        let jogs = [
            Jog::Flange { along: [0.0, 0.0, -1.0], about: [0.0; 3] },
            Jog::Flange { along: [1.0, 0.0, 0.0], about: [0.0, 0.0, 1.0] },
            Jog::Joints([1.0, -1.0, 1.0, 1.0, f64::NAN, -1.0, 7.0, 0.0]),
            Jog::Flange { along: [9.0, f64::INFINITY, 1.0], about: [0.0; 3] },
            Jog::Flange { along: [0.0, 0.0, -1.0], about: [1.0, 1.0, 0.0] },
        ];
        for jog in jogs {
            episode.jog(jog);
            pass(&mut episode, 3.0);
            assert!(episode.world.enters_fixed(&episode.carried) < 0.01, "{:?}", episode.held_by());
        }
    }

    #[test]
    fn fingers_close_and_open_and_rows_are_recorded() {
        let mut episode = Steered::begin(&task("pick_carrot.toml"), 3).expect("a start");
        let (open, _) = episode.gripper().expect("a gripper");
        episode.fingers(false);
        pass(&mut episode, 1.0);
        assert!(episode.gripper().expect("a gripper").0 < 0.3 * open);
        episode.fingers(true);
        pass(&mut episode, 1.0);
        assert!((episode.gripper().expect("a gripper").0 - open).abs() < 1e-3);
        let recorded = episode.recorded();
        assert_eq!(recorded.moments.len(), 201);
        assert!(!recorded.info.success && recorded.moments.iter().all(|moment| moment.arm.is_some()));
    }
}
