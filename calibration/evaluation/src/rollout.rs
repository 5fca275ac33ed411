//! One episode of one policy on one task.

use crate::policy::{ActionKind, Keys, Policy, PolicyError, Seen};
use serde::{Deserialize, Serialize};
use shared_mem::msg::Joints;
use shared_mem::recording::{Episode, RigidPose};
use std::sync::Arc;
use twin::task::{Acting, Numbers, ROWS_A_SECOND, Run, Signs, StartError, SteerError, Task, TaskView};

/// Moments that are kept of a failure.
const STILLS: usize = 6;

/// What came of an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Whether it was a success.
    pub success: bool,
    /// How far it came, 0 to 1.
    pub progress: f64,
    /// Simulated time [s].
    pub duration_s: f64,
    /// What would have stopped a robot.
    pub fault: Option<String>,
    /// Conditions that did not hold at the end, in words.
    pub missed: Vec<String>,
    /// Moments on the way of a failure.
    pub stills: Vec<Still>,
}

/// Where the bodies were at a moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Still {
    /// Since the start [s].
    pub time_s: f64,
    /// Each body: x, y, z [m], quaternion w, x, y, z.
    pub poses: Vec<[f32; 7]>,
    /// Joints of the arm [rad]; none where the task has none.
    pub arm: Option<Joints>,
}

/// How a policy is asked and its answers are used.
#[derive(Debug, Clone, PartialEq)]
pub struct Asking {
    /// Names of what it sees.
    pub keys: Keys,
    /// What the numbers of its actions mean.
    pub actions: ActionKind,
    /// Actions a second, of which a hundred are a multiple.
    pub rate: u32,
    /// How many actions of each answer are carried out before it is asked again; `None`: all of them.
    pub chunk: Option<usize>,
}

/// An episode could not be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The policy.
    #[error(transparent)]
    Policy(PolicyError),
    /// The start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The arm at the start.
    #[error(transparent)]
    Steer(#[from] SteerError),
    /// The end was asked for.
    #[error("interrupted")]
    Interrupted,
}

impl From<PolicyError> for RunError {
    fn from(error: PolicyError) -> Self {
        if error.is_interruption() { Self::Interrupted } else { Self::Policy(error) }
    }
}

/// The task's scripted motion with noise [m]; `stills`: keeps moments of a failure.
///
/// # Errors
/// [`RunError::Start`].
pub fn script(task: &Task, seed: u64, noise: f64, stills: bool) -> Result<Outcome, RunError> {
    let run = Run { seed, duration: task.horizon(), noise };
    let (episode, moments) = if stills {
        let (episode, recorded) = task.demonstration(&run)?;
        let kept = self::stills(&recorded);
        (episode, kept)
    } else {
        (task.episode(&run)?, Vec::new())
    };
    Ok(Outcome {
        success: episode.success,
        progress: episode.progress,
        duration_s: episode.duration_s,
        fault: episode.arm_fault,
        missed: episode.missed,
        stills: if episode.success { Vec::new() } else { moments },
    })
}

/// A policy on a task in its world, and all that was recorded of it.
///
/// # Errors
/// [`RunError`].
pub fn run(
    task: &Arc<Task>,
    seed: u64,
    policy: &mut Policy,
    asking: &Asking,
    give_up: impl Fn() -> bool,
) -> Result<(Outcome, Episode), RunError> {
    let numbers = Numbers::of(task);
    let mut views: Vec<TaskView> = task.cameras().iter().map(|camera| task.view(camera)).collect();
    let (mut acting, mut signs) = (Acting::begin(task, seed)?, Signs::default());
    let rows = (ROWS_A_SECOND / asking.rate) as usize;
    policy.begin();
    while !acting.is_over() {
        let (Some(now), Some(shown)) = (acting.now(), acting.seen()) else { break };
        let joints = shown.arm.as_ref().map(|arm| &arm.q);
        let pictures = views.iter_mut().map(|view| Some(view.draw(&shown.poses, joints))).collect();
        let seen = Seen { task, numbers: &numbers, now, surroundings: true, pictures };
        let answer = policy.actions(&seen.message(&asking.keys, &mut signs))?;
        for values in answer.iter().take(asking.chunk.unwrap_or(usize::MAX)) {
            if give_up() {
                return Err(RunError::Interrupted);
            }
            let action = asking.actions.read(task, &numbers, values).map_err(|what| policy.answer(&what))?;
            acting.act(&action, rows);
            if acting.is_over() {
                break;
            }
        }
    }
    let end = acting.end();
    let recorded = acting.recorded();
    let outcome = Outcome {
        success: end.success,
        progress: end.progress,
        duration_s: end.duration_s,
        fault: end.fault,
        missed: end.missed,
        stills: if end.success { Vec::new() } else { stills(&recorded) },
    };
    Ok((outcome, recorded))
}

/// A few moments, evenly over the episode, the first and the last among them.
fn stills(episode: &Episode) -> Vec<Still> {
    let last = episode.moments.len().saturating_sub(1);
    let pose = |pose: &RigidPose| {
        let ([x, y, z], [w, i, j, k]) = (pose.position, pose.wxyz);
        [x, y, z, w, i, j, k].map(|value| value as f32)
    };
    let places = (0..STILLS).map(|i| i * last / (STILLS - 1));
    let moments = places.filter_map(|place| episode.moments.get(place));
    moments
        .map(|moment| Still {
            time_s: moment.time_ns as f64 * 1e-9,
            poses: moment.poses.iter().map(pose).collect(),
            arm: moment.arm.as_ref().map(|arm| arm.q),
        })
        .collect()
}
