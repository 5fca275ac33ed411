//! The whole state of a simulated cell, to go on from later. Called by [`crate::rollout`].

use super::contact::ContactRecord;
use super::{SimCell, SimObjectMotion, TakesPart};
use crate::control::ArmMotion;

/// The whole state of a cell at one moment, without the noise of its sensors.
#[derive(Debug)]
pub struct SimState {
    arm: Option<ArmMotion>,
    object: Option<SimObjectMotion>,
    contact: ContactRecord,
    takes_part: TakesPart,
    time_ns: u64,
}

impl Clone for SimState {
    fn clone(&self) -> Self {
        Self { arm: self.arm.clone(), ..*self }
    }

    /// Keeps the memory it has.
    fn clone_from(&mut self, source: &Self) {
        let mut arm = self.arm.take();
        arm.clone_from(&source.arm);
        *self = Self { arm, ..*source };
    }
}

impl SimCell {
    /// What the cell does now, to go on from later.
    pub fn state(&self) -> SimState {
        SimState {
            arm: self.arm.as_ref().map(|arm| arm.motion.clone()),
            object: self.object.as_ref().map(|object| *object.motion()),
            contact: self.contact.record,
            takes_part: self.takes_part,
            time_ns: self.time_ns,
        }
    }

    /// [`SimCell::state`] into a state of this cell, without allocating.
    pub fn state_into(&self, out: &mut SimState) {
        match (&mut out.arm, &self.arm) {
            (Some(out), Some(arm)) => out.clone_from(&arm.motion),
            (out, arm) => *out = arm.as_ref().map(|arm| arm.motion.clone()),
        }
        out.object = self.object.as_ref().map(|object| *object.motion());
        (out.contact, out.takes_part, out.time_ns) = (self.contact.record, self.takes_part, self.time_ns);
    }

    /// Goes on from a state of this cell: bit by bit under the parameters of then. Under other parameters of object,
    /// contact, table and camera from the same poses and velocities; under other ones of the arm what it remembers of
    /// its commands is that of then.
    pub fn resume(&mut self, state: &SimState) {
        if let (Some(arm), Some(motion)) = (&mut self.arm, &state.arm) {
            arm.motion.clone_from(motion);
        }
        if let (Some(object), Some(motion)) = (&mut self.object, &state.object) {
            object.resume(motion);
        }
        (self.contact.record, self.takes_part, self.time_ns) = (state.contact, state.takes_part, state.time_ns);
    }
}
