//! The live twin: a simulated cell that is told what the real arm is told and compared with what the real cell does.
//!
//! [`Shadow`] is the whole logic without processes: feed it arm states and object poses, take predictions and gaps out.
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

use crate::control::Drive;
use crate::scene::{MeshFileError, ObjectModel};
use crate::sim::{SimCell, SimError};
use gap::JointGap;
use object::ObjectMirror;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::twin::{TwinGap, TwinState};
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
    cell: SimCell,
    dof: usize,
    last: Option<ArmState>,
    joints: JointGap,
    object: Option<ObjectMirror>,
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
    /// The twin was told to skip what it had not mirrored yet.
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
        let sim = SimCell::new(cell, theta)?;
        let dof = sim.arm_model().ok_or(ShadowError::NoArm)?.dof();
        let object = ObjectModel::new(cell, theta)?.map(|model| ObjectMirror::new(cell, &model.shape));
        Ok(Self {
            cell: sim,
            dof,
            last: None,
            joints: JointGap::new(dof),
            object,
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
        if let Some(object) = &mut self.object {
            object.remember(state.stamp_ns, &self.cell);
        }
        Ok(Some(Mirrored { state: self.prediction(state), gap: self.compare(state, age_ns), event }))
    }

    /// Takes in what the tracker says about the object; tells when the twin's object was set onto it.
    pub fn on_object(&mut self, pose: &ObjectPose) -> Option<ObjectEvent> {
        let event = self.object.as_mut()?.on_pose(pose, &mut self.cell);
        if event.is_some() {
            self.alignments += 1;
        }
        event
    }

    /// The reader threw away `states` unread because it was too slow: the next state aligns the twin.
    pub fn fell_behind(&mut self, states: u64) {
        self.dropped += states;
        self.last = None;
    }

    /// Figures since the twin was made.
    #[must_use]
    pub fn summary(&self) -> Summary {
        Summary {
            cycles: self.cycles,
            dropped: self.dropped,
            alignments: self.alignments,
            ages: self.ages.clone(),
            joint_rms: self.joints.overall().map(|rms| rms[..self.dof].to_vec()),
            object: self.object.as_ref().and_then(ObjectMirror::mean_gap),
        }
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
            self.cell.step(&Drive::JointImpedance { q_d, dq_d });
        }
        if periods == 0 { Step::Nothing } else { Step::Mirrored }
    }

    fn align(&mut self, state: &ArmState) {
        self.cell.set_arm(&state.q[..self.dof], &state.dq[..self.dof]);
        self.alignments += 1;
        self.joints.start_anew();
        if let Some(object) = &mut self.object {
            // It may have been moved meanwhile, and the arm was just put where the twin's object may stand.
            object.lose();
        }
    }

    fn prediction(&self, state: &ArmState) -> TwinState {
        let object = self.cell.object();
        TwinState {
            stamp_ns: 0,
            mirrors_ns: state.stamp_ns,
            cycle: state.cycle,
            dof: state.dof,
            has_object: u32::from(object.is_some()),
            q: self.cell.q(),
            dq: self.cell.dq(),
            tau_J: self.cell.tau_J(),
            object_position: object.map_or([0.0; 3], |pose| pose.position()),
            object_wxyz: object.map_or([1.0, 0.0, 0.0, 0.0], |pose| pose.wxyz()),
            contact_force: self.cell.contact_force(),
        }
    }

    fn compare(&mut self, state: &ArmState, age_ns: u64) -> TwinGap {
        let predicted = self.cell.joint_reading().q;
        let mut joint_error = [0.0; MAX_JOINTS];
        for i in 0..self.dof {
            joint_error[i] = predicted[i] - state.q[i];
        }
        self.joints.add(&joint_error);
        let (object_add_m, object_add_s_m) =
            self.object.as_ref().and_then(ObjectMirror::latest_gap).unwrap_or((f64::NAN, f64::NAN));
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
