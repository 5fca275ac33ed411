//! The live twin: a simulated cell that gets the commands of the real arm and is compared with what the real cell does.
//!
//! [`Shadow`] is the whole logic without processes: feed it arm states and poses of objects, take predictions and gaps out.
//! [`live`] wires it to shared memory. One thread; stamps are the host's monotonic clock unless a name says otherwise.
//!
//! The twin is set back onto the robot ("aligned") when it first sees it, when the bridge was restarted, after a hole
//! of more than [`LONGEST_HOLE`] cycles and when it falls behind. In between it runs freely: that is what makes the gap.

mod gap;
pub mod live;
mod object;
mod report;
#[cfg(test)]
mod tests;

pub use object::ObjectEvent;
pub use report::{Ages, Summary};

use crate::arm::JointState;
use crate::control::Drive;
use crate::scene::{MeshFileError, cell_bodies};
use crate::sim::{SimError, SimScene};
use gap::JointGap;
use object::ObjectMirror;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::object::{NamedPose, ObjectName, ObjectPose};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use std::fmt;

/// Missing cycles that are bridged by simulating them; a longer hole aligns the twin anew.
pub const LONGEST_HOLE: u64 = 20;

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Attached => write!(f, "attached to the bridge; the twin starts where the robot is"),
            Self::BridgeRestarted => write!(f, "the bridge was restarted; the twin starts again where the robot is"),
            Self::Hole(cycles) => write!(f, "{cycles} cycles of the robot are missing; the twin was set back onto it"),
            Self::ClockWentBack => write!(f, "the robot's clock went backwards; the twin was set back onto it"),
            Self::FellBehind => write!(f, "the twin fell behind and skipped ahead; give it a core of its own"),
        }
    }
}

/// The twin and what it last saw of the robot.
pub struct Shadow {
    scene: SimScene,
    dof: usize,
    last: Option<ArmState>,
    joints: JointGap,
    /// One for each body, in the order of the twin's.
    objects: Vec<ObjectMirror>,
    alignments: u32,
    cycles: u64,
    dropped: u64,
    ages: Ages,
}

/// Something a person wants to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The first state of a bridge.
    Attached,
    /// States come from another start of the bridge.
    BridgeRestarted,
    /// So many cycles of the robot's clock were missing, too many to bridge.
    Hole(u64),
    /// The robot's clock went backwards.
    ClockWentBack,
    /// The twin was asked to skip what it had not mirrored yet.
    FellBehind,
}

/// What one arm state gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirrored {
    /// The prediction for the state's moment. `stamp_ns` is left for the sender.
    pub state: TwinState,
    /// Prediction against measurement. `stamp_ns` is left for the sender.
    pub gap: TwinGap,
    /// Why the twin was aligned, when it was.
    pub event: Option<Event>,
}

/// An arm state cannot be mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MirrorError {
    /// Another arm than the cell's.
    #[error(
        "the bridge reports an arm with {reported} joints, cell.toml describes one with {expected}; start both with the same --cell"
    )]
    OtherArm {
        /// Joints in the message.
        reported: usize,
        /// Joints of the twin.
        expected: usize,
    },
}

/// The twin cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ShadowError {
    /// The simulated cell.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The object's mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// Nothing to mirror.
    #[error("cell.toml has no [robot]; the shadow mirrors an arm, so add one, for instance `model = \"fr3\"`")]
    NoArm,
}

impl Shadow {
    /// A twin of the cell, with identified parameters where `theta` has some.
    ///
    /// # Errors
    /// [`ShadowError`] naming what cell.toml lacks.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, ShadowError> {
        let scene = SimScene::new(cell, theta)?;
        let dof = scene.cell().arm_model().ok_or(ShadowError::NoArm)?.dof();
        let mut objects = Vec::new();
        for (number, body) in cell_bodies(cell)?.iter().enumerate() {
            let one = Cell { in_question: body.object, ..cell.clone() };
            objects.push(ObjectMirror::new(&one, number, &body.surface()));
        }
        Ok(Self {
            scene,
            dof,
            last: None,
            joints: JointGap::new(dof),
            objects,
            alignments: 0,
            cycles: 0,
            dropped: 0,
            ages: Ages::default(),
        })
    }

    /// Mirrors one arm state that was `age_ns` old on arrival. `None` for states that say nothing new: repeated ones,
    /// and those with numbers that are not finite, which count as dropped.
    ///
    /// # Errors
    /// [`MirrorError::OtherArm`] when the state is not of this cell's arm.
    pub fn on_state(&mut self, state: &ArmState, age_ns: u64) -> Result<Option<Mirrored>, MirrorError> {
        let reported = state.dof as usize;
        if reported != self.dof {
            return Err(MirrorError::OtherArm { reported, expected: self.dof });
        }
        if ![&state.q, &state.dq, &state.q_d, &state.dq_d].into_iter().flatten().all(|v| v.is_finite()) {
            self.dropped += 1;
            return Ok(None);
        }
        let event = match self.catch_up(state) {
            Step::Nothing => return Ok(None),
            Step::Mirrored => None,
            Step::Align(event) => {
                self.align(state);
                Some(event)
            }
        };
        self.last = Some(*state);
        self.cycles += 1;
        self.ages.record(age_ns);
        for object in &mut self.objects {
            object.remember(state.stamp_ns, &self.scene);
        }
        Ok(Some(Mirrored { state: self.prediction(state), gap: self.compare(state, age_ns), event }))
    }

    /// Takes in what the tracker says about the first object; tells when the twin's was set onto it.
    pub fn on_object(&mut self, pose: &ObjectPose) -> Option<ObjectEvent> {
        self.on_body(0, pose)
    }

    /// The same about one of the others by its name, with its number; `None` for the first, which is on a topic of its own, and
    /// for a name that the cell does not have.
    pub fn on_named(&mut self, pose: &NamedPose) -> Option<(usize, Option<ObjectEvent>)> {
        let number = self.scene.names().iter().position(|name| *name == pose.name).filter(|number| *number > 0)?;
        Some((number, self.on_body(number, &pose.unnamed())))
    }

    fn on_body(&mut self, number: usize, pose: &ObjectPose) -> Option<ObjectEvent> {
        let event = self.objects.get_mut(number)?.on_pose(pose, &mut self.scene);
        if event.is_some() {
            self.alignments += 1;
        }
        event
    }

    /// Name of an object by its number; empty for one without.
    pub fn name(&self, number: usize) -> ObjectName {
        self.scene.names().get(number).copied().unwrap_or_default()
    }

    /// An object in the twin when the tracker saw it last, and how far the two were apart; `None` for one without a name or that was
    /// not seen. `stamp_ns` is left for the sender.
    pub fn twin_object(&self, number: usize) -> Option<TwinObject> {
        let (mirror, name) = (self.objects.get(number)?, self.name(number));
        let (mirrors_ns, pose) = mirror.pictured().filter(|_| !name.is_empty())?;
        let (add_m, add_s_m) = mirror.latest_gap().unwrap_or((f64::NAN, f64::NAN));
        let (position, wxyz) = (pose.position(), pose.wxyz());
        Some(TwinObject { stamp_ns: 0, mirrors_ns, position, wxyz, add_m, add_s_m, name })
    }

    /// The reader threw away `states` unread because it was too slow: the next state aligns the twin.
    pub fn fell_behind(&mut self, states: u64) {
        self.dropped += states;
        self.last = None;
    }

    /// Figures since the twin was made.
    pub fn summary(&self) -> Summary {
        Summary {
            cycles: self.cycles,
            dropped: self.dropped,
            alignments: self.alignments,
            ages: self.ages.clone(),
            joint_rms: self.joints.overall().map(|rms| rms[..self.dof].to_vec()),
            object: self.objects.first().and_then(ObjectMirror::mean_gap),
            objects: self.by_name(),
        }
    }

    /// Mean gap of each object that has a name.
    fn by_name(&self) -> Vec<(String, Option<(f64, f64)>)> {
        let named = self.scene.names().iter().zip(&self.objects).filter(|(name, _)| !name.is_empty());
        named.map(|(name, mirror)| (name.text().to_owned(), mirror.mean_gap())).collect()
    }

    /// Simulates up to the moment of `state` where that is possible.
    fn catch_up(&mut self, state: &ArmState) -> Step {
        let Some(last) = self.last else {
            return Step::Align(if self.cycles > 0 { Event::FellBehind } else { Event::Attached });
        };
        if state.session != last.session {
            return Step::Align(Event::BridgeRestarted);
        }
        if state.device_ns < last.device_ns {
            return Step::Align(Event::ClockWentBack);
        }
        // Rounded: a robot's own clock may jitter against the period.
        let periods = (state.device_ns - last.device_ns + TICK_NS / 2) / TICK_NS;
        if periods > LONGEST_HOLE + 1 {
            return Step::Align(Event::Hole(periods - 1));
        }
        for k in 0..periods {
            let share = k as f64 / periods as f64;
            let q_d = between(&last.q_d, &state.q_d, share);
            let dq_d = between(&last.dq_d, &state.dq_d, share);
            self.scene.step(&Drive::JointImpedance { q_d, dq_d });
        }
        if periods == 0 { Step::Nothing } else { Step::Mirrored }
    }

    fn align(&mut self, state: &ArmState) {
        self.scene.set_arm(&JointState { q: state.q, dq: state.dq }, self.dof);
        self.alignments += 1;
        self.joints.start_anew();
        for object in &mut self.objects {
            // It may have been moved meanwhile, and the arm was just put where the twin's object may stand.
            object.lose();
        }
    }

    fn prediction(&self, state: &ArmState) -> TwinState {
        let (object, cell) = (self.scene.object(0), self.scene.cell());
        TwinState {
            stamp_ns: 0,
            mirrors_ns: state.stamp_ns,
            cycle: state.cycle,
            dof: state.dof,
            has_object: u32::from(object.is_some()),
            q: cell.q(),
            dq: cell.dq(),
            tau_J: cell.tau_J(),
            object_position: object.map_or([0.0; 3], |pose| pose.position()),
            object_wxyz: object.map_or([1.0, 0.0, 0.0, 0.0], |pose| pose.wxyz()),
            contact_force: self.scene.contact_force(),
        }
    }

    fn compare(&mut self, state: &ArmState, age_ns: u64) -> TwinGap {
        let predicted = self.scene.cell().joint_reading().q;
        let mut joint_error = [0.0; MAX_JOINTS];
        for i in 0..self.dof {
            joint_error[i] = predicted[i] - state.q[i];
        }
        self.joints.add(&joint_error);
        let (object_add_m, object_add_s_m) =
            self.objects.first().and_then(ObjectMirror::latest_gap).unwrap_or((f64::NAN, f64::NAN));
        TwinGap {
            stamp_ns: 0,
            cycle: state.cycle,
            dof: state.dof,
            alignments: self.alignments,
            joint_error,
            joint_rms: self.joints.recent(),
            object_add_m,
            object_add_s_m,
            age_ns,
        }
    }
}

/// What became of the way to a state's moment.
enum Step {
    Nothing,
    Mirrored,
    Align(Event),
}

/// The command in force a share of the way from one received state to the next. Without a hole this is the first.
fn between(from: &Joints, to: &Joints, share: f64) -> Joints {
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}
