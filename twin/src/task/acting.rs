//! An episode in which a policy acts: its targets are gone for within the limits of the arm, as a bridge goes for them, until
//! success, the horizon, or something that would stop a robot.

use super::Task;
use super::arm::CarrierCommand;
use super::cell::Servo;
use super::demonstration::Columns;
use super::episode::{Course, STEPS_A_ROW};
use super::progress::Progress;
use super::start::Placed;
use super::steered::SteerError;
use crate::arm::{Follower, JointState, Joints};
use crate::world::{STEP, World};
use nalgebra::Isometry3;
use shared_mem::recording::{Episode as Recorded, EpisodeInfo, EpisodeMoment};
use std::sync::Arc;

/// What is carried may go no deeper than this into what is fast [m]: a robot would be stopped by its reflex.
const ENTERS: f64 = 5e-3;

/// What a policy asks for: where everything that is commanded is to be at the end of its time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Action {
    /// Moved bodies by their place in the task, in the world. Of a body that the arm carries, `joints` count where they are given.
    pub bodies: Vec<(usize, Isometry3<f64>)>,
    /// Joints of the arm [rad].
    pub joints: Option<Joints>,
    /// Opening of the gripper [m].
    pub width: Option<f64>,
    /// Other joints with a drive, by the place of their bodies [rad or m].
    pub drives: Vec<(usize, f64)>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ActingEnd {
    /// Whether all conditions held for as long as they have to, without a fault before.
    pub success: bool,
    /// How far it came: 0 as at the start, 1 success.
    pub progress: f64,
    /// Simulated time [s].
    pub duration_s: f64,
    /// What would have stopped a robot.
    pub fault: Option<String>,
    /// Conditions that did not hold at the end, in words.
    pub missed: Vec<String>,
}

/// An episode in progress.
#[derive(Debug)]
pub struct Acting {
    task: Arc<Task>,
    seed: u64,
    world: World,
    arm: Option<Steering>,
    carried: Vec<usize>,
    /// How deep that may be in what is fast [m].
    enters: f64,
    /// Where each body was at the start or was last commanded to be.
    commanded: Vec<Isometry3<f64>>,
    course: Course,
    progress: Progress,
    columns: Columns,
    moments: Vec<EpisodeMoment>,
    fault: Option<String>,
}

/// The arm on its way to targets.
#[derive(Debug)]
struct Steering {
    follower: Follower,
    command: CarrierCommand,
    target: Joints,
    servo: Option<Servo>,
}

impl Acting {
    /// Places the bodies by a seed.
    ///
    /// # Errors
    /// [`SteerError`] when the task cannot start, or the arm does not reach its start.
    pub fn begin(task: &Arc<Task>, seed: u64) -> Result<Self, SteerError> {
        let Placed { world, .. } = task.placed(seed)?;
        let arm = task.carrier.as_ref().map(|carrier| {
            let q = carrier.joints_at(&world.pose(carrier.body)).ok_or(SteerError::OutOfReach)?;
            let mut follower = Follower::calm(&q, carrier.limits(), STEP);
            follower.set_speed(1.0);
            Ok::<_, SteerError>(Steering {
                follower,
                command: CarrierCommand::at_rest(q),
                target: q,
                servo: Servo::begin(task, &q),
            })
        });
        let arm = arm.transpose()?;
        let carried = task.carrier.as_ref().map_or_else(Vec::new, |carrier| task.carried(carrier.body));
        let mut begun = Self {
            task: Arc::clone(task),
            seed,
            enters: world.enters_fixed(&carried) + ENTERS,
            commanded: (0..task.bodies.len()).map(|body| world.pose(body)).collect(),
            progress: Progress::begin(task, &world),
            world,
            arm,
            carried,
            course: Course::new(),
            columns: Columns::of(task),
            moments: Vec::new(),
            fault: None,
        };
        begun.remember();
        Ok(begun)
    }

    /// Goes for an action over so many rows of ten milliseconds; ends earlier where the episode does.
    pub fn act(&mut self, action: &Action, rows: usize) {
        let task = Arc::clone(&self.task);
        if let (Some(width), Some(gripper)) = (action.width, &task.gripper)
            && let Some((target, force)) = gripper.order_width(&task.bodies, width)
        {
            self.world.drive(gripper.drive(), target, force);
        }
        for (body, target) in &action.drives {
            if let Some(force) = task.bodies.get(*body).and_then(|plan| plan.drive_force()) {
                self.world.drive(*body, *target, force);
            }
        }
        let from = self.commanded.clone();
        let began_at = self.arm.as_ref().map(|arm| arm.target);
        let goal = match began_at.map(|from| task.joints_of(action, &from)) {
            Some(Ok(goal)) => goal,
            Some(Err(fault)) => {
                self.fault = Some(fault);
                return;
            }
            None => None,
        };
        for row in 1..=rows {
            if self.is_over() {
                return;
            }
            let share = row as f64 / rows as f64;
            if let (Some(goal), Some(began_at), Some(arm)) = (goal, began_at, &mut self.arm) {
                let target: Joints = std::array::from_fn(|i| began_at[i] + share * (goal[i] - began_at[i]));
                match arm.follower.aim(&target) {
                    Ok(()) => arm.target = target,
                    Err(joint) => {
                        let name = task.arm_joints().get(joint).map_or("a joint", String::as_str);
                        self.fault = Some(format!("{name} is sent to {:.3} rad, beyond its end", target[joint]));
                        return;
                    }
                }
            }
            let before = (row - 1) as f64 / rows as f64;
            self.pass(&task, action, (&from, [before, share]));
        }
    }

    /// Lets one row pass; bodies without an arm go from where they were towards the action by a share of the way.
    fn pass(&mut self, task: &Task, action: &Action, (from, [before, after]): (&[Isometry3<f64>], [f64; 2])) {
        let carried_by_arm = task.carrier.as_ref().map(|carrier| carrier.body);
        for step in 1..=STEPS_A_ROW {
            let share = before + (after - before) * step as f64 / STEPS_A_ROW as f64;
            for (body, goal) in action.bodies.iter().filter(|(body, _)| Some(*body) != carried_by_arm) {
                let pose = from[*body].lerp_slerp(goal, share);
                self.world.move_to(*body, &pose);
                self.commanded[*body] = pose;
            }
            if let (Some(carrier), Some(arm)) = (&task.carrier, &mut self.arm) {
                let Some(q_d) = arm.follower.step() else {
                    self.fault = Some("no way leads to where it is sent".to_owned());
                    return;
                };
                let dq_d = arm.follower.velocity();
                arm.command.go(q_d, dq_d);
                let q = arm.servo.as_mut().map_or(q_d, |servo| servo.step(&q_d, &dq_d));
                self.world.move_to(carrier.body, &carrier.body_at(&q));
                self.commanded[carrier.body] = carrier.body_at(&q_d);
            }
            self.world.step();
            self.course.count(task, &self.world);
        }
        self.progress.look(task, &self.world);
        if self.world.enters_fixed(&self.carried) > self.enters {
            self.fault = Some("it pushes into what is fast".to_owned());
        }
        if let Some(arm) = &mut self.arm
            && let Some(servo) = &arm.servo
        {
            let reading: JointState = servo.reading();
            arm.command.read(reading);
        }
        self.remember();
    }

    fn remember(&mut self) {
        let resting = CarrierCommand::default();
        let command = self.arm.as_ref().map_or(&resting, |arm| &arm.command);
        let commanded = |body: usize| self.commanded[body];
        let moment = self.columns.moment(&self.task, &self.world, self.course.done, command, commanded);
        self.moments.push(moment);
    }

    /// What is now.
    pub fn now(&self) -> Option<&EpisodeMoment> {
        self.moments.last()
    }

    /// What the cameras show: as late as those of the task's cell.
    pub fn seen(&self) -> Option<&EpisodeMoment> {
        let latency = self.task.cell.as_ref().map_or(0.0, |cell| cell.latency);
        let rows = (latency / (STEPS_A_ROW as f64 * STEP)).round() as usize;
        let at = self.moments.len().saturating_sub(1 + rows);
        self.moments.get(at)
    }

    /// Whether it has come to its end: success, a fault, or the horizon.
    pub fn is_over(&self) -> bool {
        self.fault.is_some() || self.is_success() || self.time() + 0.5 * STEP >= self.task.horizon
    }

    fn is_success(&self) -> bool {
        self.course.is_success(self.task.hold)
    }

    /// Simulated time since the start [s].
    pub fn time(&self) -> f64 {
        self.course.done as f64 * STEP
    }

    /// What came of it so far.
    pub fn end(&self) -> ActingEnd {
        let success = self.is_success() && self.fault.is_none();
        ActingEnd {
            success,
            progress: self.progress.best(success),
            duration_s: self.time(),
            fault: self.fault.clone(),
            missed: if success { Vec::new() } else { self.task.missed(&self.world) },
        }
    }

    /// All of it, for a clip.
    pub fn recorded(self) -> Recorded {
        let end = self.end();
        let info = EpisodeInfo {
            task: self.task.name.clone(),
            seed: self.seed,
            noise_m: 0.0,
            success: end.success,
            duration_s: end.duration_s,
        };
        self.columns.recorded(&self.task, info, self.moments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Numbers, Run, Signs};
    use shared_mem::cell::Cell;
    use shared_mem::theta::Theta;
    use std::path::Path;

    fn task(name: &str) -> Task {
        Task::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../twin/tasks").join(name)).expect("a task that ships")
    }

    /// What a scripted run commands, twenty times a second, as a policy that knows it by heart.
    fn replayed(task: &Task, seed: u64) -> ActingEnd {
        let run = Run { seed, duration: task.horizon(), noise: 0.0 };
        let (_, shown) = task.demonstration(&run).expect("room for all");
        let (numbers, task) = (Numbers::of(task), Arc::new(task.clone()));
        let mut acting = Acting::begin(&task, seed).expect("a start");
        let mut signs = Signs::default();
        for next in shown.moments.iter().skip(5).step_by(5) {
            let state = numbers.state(acting.now().expect("a row"), &mut signs);
            assert_eq!(state.len(), numbers.state_names().len());
            acting.act(&numbers.read(&numbers.action(next, &signs)).expect("an action"), 5);
        }
        while !acting.is_over() {
            acting.act(&Action::default(), 5);
        }
        acting.end()
    }

    #[test]
    fn a_policy_that_does_what_was_shown_succeeds_as_the_script_does() {
        for name in ["push_milk.toml", "pick_carrot.toml", "close_laptop.toml", "stack_boxes.toml"] {
            let end = replayed(&task(name), 1);
            assert!(end.success && end.progress == 1.0 && end.missed.is_empty(), "{name}: {end:?}");
        }
    }

    #[test]
    fn an_arm_under_its_controller_comes_later_than_one_that_is_where_it_is_told() {
        let exact = task("pick_carrot.toml");
        let cell = Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml")).expect("a cell");
        let theta: Theta = toml::from_str(
            "[object]\nmass = 0.1\nfriction = 0.2\n[[effect]]\nname = \"command_delay\"\ndelay = 0.05\n[[effect]]\nname = \"camera_latency\"\nlatency = 0.1\n\
             [[effect]]\nname = \"table_tilt\"\ntilt = [0.01, 0.0]\n",
        )
        .expect("parameters");
        let (nominal, none) = exact.in_cell(&cell, None).expect("its cell");
        let (late, left_out) = exact.in_cell(&cell, Some(&theta)).expect("its cell");
        assert_eq!((none, left_out), (vec![], vec!["table_tilt"]));
        let at = |task: &Task| {
            let run = Run { seed: 1, duration: 0.5, noise: 0.0 };
            let (_, rows) = task.demonstration(&run).expect("room for all");
            let hand = rows.bodies.iter().position(|name| name == "hand").expect("a hand");
            let last = rows.moments.last().expect("rows");
            let from = rows.moments[0].poses[hand].position;
            let way = |pose: &shared_mem::recording::RigidPose| {
                (0..3).map(|k| (pose.position[k] - from[k]).powi(2)).sum::<f64>().sqrt()
            };
            [way(&last.poses[hand]), way(&last.targets[0])]
        };
        let ([reached, wanted], [moved, same], [delayed, _]) = (at(&exact), at(&nominal), at(&late));
        assert!((reached - wanted).abs() < 1e-9 && (same - wanted).abs() < 1e-9);
        assert!(delayed < moved && moved < reached, "{delayed} {moved} {reached}");
        let mut seen = Acting::begin(&Arc::new(late), 1).expect("a start");
        let hand = [0.35, 0.0, 0.30];
        let turn = nalgebra::one();
        seen.act(&Action { bodies: vec![(3, Isometry3::from_parts(hand.into(), turn))], ..Action::default() }, 30);
        let (now, shown) =
            (seen.now().expect("a row").poses[3].position[0], seen.seen().expect("rows").poses[3].position[0]);
        assert!(now > shown + 1e-3, "{now} {shown}");
    }

    #[test]
    fn what_would_stop_a_robot_ends_the_episode_with_its_reason() {
        let task = Arc::new(task("pick_carrot.toml"));
        let mut far = Acting::begin(&task, 0).expect("a start");
        far.act(&Action { joints: Some([9.0; 8]), ..Action::default() }, 100);
        assert!(far.is_over() && far.end().fault.is_some_and(|fault| fault.contains("beyond its end")));
        let mut low = Acting::begin(&task, 0).expect("a start");
        let down = Isometry3::translation(0.3, 0.0, -0.1);
        low.act(&Action { bodies: vec![(3, down)], ..Action::default() }, 300);
        let end = low.end();
        assert!(!end.success && end.fault.as_ref().is_some_and(|fault| fault.contains("pushes into")), "{end:?}");
    }
}
