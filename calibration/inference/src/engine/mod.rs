//! Another program that simulates a cell in place of the twin: MuJoCo, Isaac, a laboratory's own. It is asked over a
//! small protocol on its standard input and output (docs/engine.md), one process for each thread that has something to ask.
//!
//! | file | owns |
//! |---|---|
//! | `frame` | one message on a pipe |
//! | `message` | what messages say |
//! | `ability` | what an engine can do, and what of a set of parameters that leaves |
//! | `process` | one process: asked, waited for, killed |
//! | `started` | what a process started, killed with it |
//! | `physical` | states that no arm and no object can have |
//! | `recent` | roll-outs that were asked for a moment ago |
//! | `used` | what an answer says about it |
//! | `fault` | what may be wrong, each with a remedy |
//!
//! An engine that ends is started again once for each roll-out; then, as with silence and with what is no answer, it is given up:
//! the work is interrupted as Ctrl-C does it, so that what was found is kept. SI units, joints in the model's order.

mod ability;
mod fault;
mod frame;
mod message;
mod physical;
mod process;
mod recent;
mod started;
mod used;

pub use ability::{Ability, Quantity};
pub use fault::EngineError;
pub use message::ObjectBody;
pub use used::Used;

use crate::interrupt::Interrupt;
use message::{Greeting, ObjectBlock, Reply, RollOut, VERSION};
use process::{Asked, POLL_INTERVAL, Process, Running};
use recent::Recent;
use serde_json::Value;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use shared_mem::{ending, place};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// Numbers of a pose: x, y, z, then a unit quaternion w, x, y, z.
pub const POSE: usize = 7;
/// By so much the length of a quaternion may be off [1]: what single precision makes of seven figures, and room for sums of them.
const QUATERNION_NORM_TOLERANCE: f64 = 1e-4;

/// How an engine is started.
#[derive(Debug, Clone)]
pub struct Call {
    /// A command line for a POSIX shell.
    pub command: String,
    /// Longer than this no answer is waited for.
    pub limit: Duration,
}

/// An engine that answers.
#[derive(Debug)]
pub struct Engine {
    call: Call,
    greeting: Vec<u8>,
    ability: Ability,
    idle: Mutex<Vec<Process>>,
    running: Arc<Running>,
    interrupt: Interrupt,
    failed: OnceLock<EngineError>,
    started_again: AtomicUsize,
    asked: AtomicUsize,
    /// Whether it was asked for an object.
    with_object: AtomicBool,
    recent: Mutex<Recent>,
}

/// What is to be simulated.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// Gains and effects: those that the engine knows ([`Ability::part`]).
    pub theta: &'a Theta,
    pub dof: usize,
    /// What the encoders read at the start: positions, then velocities.
    pub start: &'a [f64],
    /// Rows of commands from before the start.
    pub before: usize,
    /// Commands, a row for each control period: desired positions, then desired velocities.
    pub commands: &'a [f64],
    /// What is asked for, of what the engine reports.
    pub readings: &'a [Quantity],
    /// When states are asked for, from the start on, ascending [s].
    pub times: &'a [f64],
    /// The object that takes part; without one it is the arm alone.
    pub object: Option<ObjectQuestion<'a>>,
}

/// What is to be simulated of an object.
#[derive(Debug, Clone, Copy)]
pub struct ObjectQuestion<'a> {
    pub body: &'a ObjectBody,
    /// Where its geometric centre rests at the start, in the base frame.
    pub start: &'a Pose<Base, Object>,
    /// When its pose is asked for, from the start on, ascending [s].
    pub times: &'a [f64],
}

#[derive(Debug, Clone, thiserror::Error)]
pub enum NoStates {
    /// The engine has none for these parameters.
    #[error("{0}")]
    Impossible(String),
    /// The engine is of no use any more.
    #[error(transparent)]
    Failed(#[from] EngineError),
}

impl Engine {
    /// Starts an engine and hears what it can do. `joints`: their names in the order of all arrays. When the engine is given up,
    /// `interrupt` is asked for the end.
    ///
    /// # Errors
    /// [`EngineError`] when it does not start, or does not speak the protocol.
    pub fn start(
        call: Call,
        cell: &Cell,
        folder: &Path,
        joints: &[String],
        interrupt: &Interrupt,
    ) -> Result<Arc<Self>, EngineError> {
        let wrong = |what: String| EngineError::Wrong { command: call.command.clone(), what };
        let greeting = Greeting {
            message: "hello",
            protocol: VERSION,
            joints,
            period: TICK,
            cell: cell_as_json(&cell.at_home_anywhere()),
            folder: place::from_anywhere(folder).display().to_string(),
        };
        let greeting = frame::bytes(&greeting, &[]).map_err(|error| wrong(format!("cannot be greeted: {error}")))?;
        let running = Arc::new(Running::default());
        kill_at_the_end(&running);
        let (process, ability) = greeted(&call, &greeting, &running)?;
        Ok(Arc::new(Self {
            call,
            greeting,
            ability,
            idle: Mutex::new(vec![process]),
            running,
            interrupt: interrupt.clone(),
            failed: OnceLock::new(),
            started_again: AtomicUsize::new(0),
            asked: AtomicUsize::new(0),
            with_object: AtomicBool::new(false),
            recent: Mutex::default(),
        }))
    }

    /// What it can do.
    pub fn ability(&self) -> &Ability {
        &self.ability
    }

    /// Whether it can be asked for clips with an object.
    ///
    /// # Errors
    /// [`EngineError`] where it knows no object, or nothing moves the object in a clip.
    pub fn admits<'a>(&self, clips: impl Iterator<Item = &'a Clip>) -> Result<(), EngineError> {
        let count = clips.filter(|clip| clip.kind == ClipKind::FreeMotion).count();
        match count {
            _ if !self.ability.object => Err(EngineError::NoObject { command: self.call.command.clone() }),
            0 => Ok(()),
            count => Err(EngineError::NoArm { count }),
        }
    }

    /// Why it was given up.
    pub fn failure(&self) -> Option<&EngineError> {
        self.failed.get()
    }

    /// What it was used for so far.
    pub fn used(&self) -> Used {
        let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
        Used {
            command: self.call.command.clone(),
            rollouts: count(&self.asked),
            started_again: count(&self.started_again),
            ..Used::of(&self.ability, self.with_object.load(Ordering::Relaxed))
        }
    }

    /// States at the times that were asked for, row by row: of each quantity of the question's `readings`, a number for each joint. Behind
    /// them the object's poses, [`POSE`] numbers each, where the question has an object.
    ///
    /// # Errors
    /// [`NoStates`]. From the first failure on there are none at all.
    pub fn roll_out(&self, question: &Question<'_>) -> Result<Arc<Vec<f64>>, NoStates> {
        if let Some(failed) = self.failed.get() {
            return Err(failed.clone().into());
        }
        let message = self.message(question)?;
        let key = Recent::key(&message);
        if let Some(known) = locked(&self.recent).get(key) {
            return Ok(known);
        }
        let states = match self.states(message, question) {
            Err(NoStates::Failed(error)) => {
                // Of two that fail at the same time the first is reported.
                let error = self.failed.get_or_init(|| error).clone();
                self.interrupt.ask();
                return Err(error.into());
            }
            states => Arc::new(states?),
        };
        locked(&self.recent).keep(key, &states);
        Ok(states)
    }

    fn message(&self, question: &Question<'_>) -> Result<Vec<u8>, EngineError> {
        let Question { theta, dof, start, before, commands, readings, times, object } = *question;
        let head = RollOut {
            message: "rollout",
            dof,
            before,
            ticks: commands.len() / (2 * dof).max(1) - before,
            rows: times.len(),
            readings: readings.iter().map(|quantity| quantity.name()).collect(),
            parameters: self.ability.gains(theta),
            effects: self.ability.blocks(&theta.effects),
            object: object.map(|object| {
                let (position, orientation) = (object.start.position(), object.start.wxyz());
                ObjectBlock { body: object.body, position, orientation, poses: object.times.len() }
            }),
        };
        let poses = object.map_or(&[][..], |object| object.times);
        frame::bytes(&head, &[start, commands, times, poses].concat()).map_err(|error| self.wrong(error.to_string()))
    }

    fn states(&self, message: Vec<u8>, question: &Question<'_>) -> Result<Vec<f64>, NoStates> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        self.with_object.fetch_or(question.object.is_some(), Ordering::Relaxed);
        // The one that answered last; as many idle as were ever asked at once.
        let idle = locked(&self.idle).pop();
        let (rows, columns) = (question.times.len(), question.readings.len() * question.dof);
        let poses = question.object.map_or(0, |object| object.times.len());
        let asked = Asked { message, most: rows * columns + poses * POSE };
        let first = match idle {
            Some(process) => self.ask(process, asked.clone()),
            None => self.ask(self.another()?, asked.clone()),
        };
        let (reply, numbers) = match first {
            // Once more, with a new process, since it may have been the system that ended it; not with an idle one, which may be about
            // to end itself.
            Err(EngineError::Ended { .. }) => {
                self.started_again.fetch_add(1, Ordering::Relaxed);
                self.ask(self.another()?, asked.clone())?
            }
            answer => answer?,
        };
        match reply {
            Reply::States => {}
            Reply::Impossible { why } => return Err(NoStates::Impossible(why)),
            Reply::Error { why } => {
                return Err(EngineError::Refused { command: self.call.command.clone(), why }.into());
            }
            Reply::Hello(_) => return Err(self.wrong("answered a roll-out with a greeting".into()).into()),
        }
        if numbers.len() != asked.most {
            let of_object = if poses > 0 { format!(" and {poses} poses of {POSE}") } else { String::new() };
            let what =
                format!("sent {} numbers where {rows} rows of {columns}{of_object} were asked for", numbers.len());
            return Err(self.wrong(what).into());
        }
        let length = |pose: &[f64]| pose[3..].iter().map(|part| part * part).sum::<f64>().sqrt();
        // What is no number is no fault of the engine's (`physical`).
        let off = |length: &f64| length.is_finite() && (length - 1.0).abs() > QUATERNION_NORM_TOLERANCE;
        if let Some(length) = numbers[rows * columns..].chunks_exact(POSE).map(length).find(off) {
            return Err(self
                .wrong(format!("sent an orientation that is no unit quaternion, but {length:.4} long"))
                .into());
        }
        match physical::impossible(question, &numbers) {
            Some(why) => Err(NoStates::Impossible(why)),
            None => Ok(numbers),
        }
    }

    /// A process beside those that run, which can do what the first one said.
    fn another(&self) -> Result<Process, EngineError> {
        let (process, ability) = greeted(&self.call, &self.greeting, &self.running)?;
        if ability != self.ability {
            return Err(self.wrong("says of itself something else than when it was started first".into()));
        }
        Ok(process)
    }

    /// Asks a process, which is idle from then on.
    fn ask(&self, mut process: Process, asked: Asked) -> Result<(Reply, Vec<f64>), EngineError> {
        let answer = process.ask(asked, self.call.limit)?;
        locked(&self.idle).push(process);
        Ok(answer)
    }

    fn wrong(&self, what: String) -> EngineError {
        EngineError::Wrong { command: self.call.command.clone(), what }
    }
}

fn locked<T>(what: &Mutex<T>) -> MutexGuard<'_, T> {
    what.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A process that has said what it can do.
fn greeted(call: &Call, greeting: &[u8], running: &Arc<Running>) -> Result<(Process, Ability), EngineError> {
    let wrong = |what: String| EngineError::Wrong { command: call.command.clone(), what };
    let mut process = Process::start(&call.command, running)?;
    match process.ask(Asked { message: greeting.to_vec(), most: 0 }, call.limit)?.0 {
        Reply::Hello(hello) => {
            let ability = Ability::read(hello).map_err(wrong)?;
            Ok((process, ability))
        }
        Reply::Error { why } | Reply::Impossible { why } => {
            Err(EngineError::Refused { command: call.command.clone(), why })
        }
        Reply::States => Err(wrong("answered the greeting with states".into())),
    }
}

/// Kills every process of an engine once the user asked for the end; those that are waited for and those that nobody asks.
fn kill_at_the_end(running: &Arc<Running>) {
    // Weakly, so that the thread ends with the engine.
    let running = Arc::downgrade(running);
    std::thread::spawn(move || {
        while let Some(running) = running.upgrade() {
            if ending::asked() {
                running.kill();
            }
            drop(running);
            std::thread::sleep(POLL_INTERVAL);
        }
    });
}

fn cell_as_json(cell: &Cell) -> Value {
    let table: Option<toml::Table> = toml::from_str(&cell.to_toml()).ok();
    serde_json::json!(table)
}

#[cfg(test)]
mod tests;
