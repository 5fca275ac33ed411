//! One method for each kind of message that an own clip holds, pictures apart.

use super::shown::Whose;
use super::{ClipWriter, WriteError};
use crate::msg::arm::{ArmCommand, ArmState};
use crate::msg::event::Event;
use crate::msg::gripper::GripperState;
use crate::msg::image::CameraInfo;
use crate::msg::object::{NamedPose, ObjectPose};
use crate::msg::origin::ArmOrigin;
use crate::msg::target::{ArmTarget, GripperTarget};
use crate::msg::twin::{TwinGap, TwinObject, TwinState};
use crate::msg::wrench::Wrench;
use crate::recording::wire::Wire;
use crate::topics;
use std::io::Write;

impl<W: Write> ClipWriter<W> {
    /// Records a state of the arm.
    ///
    /// # Errors
    /// [`WriteError`] when the disk is full or fails; what was flushed before stays readable.
    pub fn arm_state(&mut self, message: &ArmState) -> Result<(), WriteError> {
        self.say_origin(&message.origin)?;
        self.message(&ArmState { origin: ArmOrigin::default(), ..*message })?;
        self.show_joints(Whose::Real, message.stamp_ns, message.q.get(..message.dof as usize).unwrap_or(&[]))
    }

    /// Records a command to the arm.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn arm_command(&mut self, message: &ArmCommand) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records a pose of the object.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn object_pose(&mut self, message: &ObjectPose) -> Result<(), WriteError> {
        self.object_pose_on(ObjectPose::TOPIC, message)
    }

    /// Records a pose of one of several objects on its topic, [`crate::topics::object_pose`].
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn object_pose_on(&mut self, topic: &str, message: &ObjectPose) -> Result<(), WriteError> {
        let mut wire = message.to_wire(self.clock);
        wire.frame_id.clone_from(&self.base_frame);
        self.named(topic, ObjectPose::SCHEMA, message.stamp_ns, &wire)
    }

    /// Records a pose of one of several objects by its name.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn named_pose(&mut self, message: &NamedPose) -> Result<(), WriteError> {
        self.object_pose_on(&topics::object_pose(message.name.text()), &message.unnamed())
    }

    /// Records intrinsics and pose of the camera.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn camera_info(&mut self, message: &CameraInfo) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records a force/torque sample.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn wrench(&mut self, message: &Wrench) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records a state of the gripper.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn gripper(&mut self, message: &GripperState) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records where the arm was to go.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn arm_target(&mut self, message: &ArmTarget) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records how far the fingers were to be apart.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn gripper_target(&mut self, message: &GripperTarget) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records a state of the twin.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn twin_state(&mut self, message: &TwinState) -> Result<(), WriteError> {
        self.message(message)?;
        self.show_joints(Whose::Twin, message.stamp_ns, message.q.get(..message.dof as usize).unwrap_or(&[]))
    }

    /// Records real against twin.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn twin_gap(&mut self, message: &TwinGap) -> Result<(), WriteError> {
        self.message(message)
    }

    /// Records one of several objects in the twin by its name.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn twin_object(&mut self, message: &TwinObject) -> Result<(), WriteError> {
        let (topic, wire) = (topics::twin_object(message.name.text()), message.to_wire(self.clock));
        self.named(&topic, TwinObject::SCHEMA, message.stamp_ns, &wire)
    }

    /// Records a remark.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn event(&mut self, message: &Event) -> Result<(), WriteError> {
        self.message(message)
    }
}
