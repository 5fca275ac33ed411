//! The recorder's ears: one subscriber a topic, drained into the writer, with a count of what was overwritten unseen.

use shared_mem::msg::arm::{ArmCommand, ArmState};
use shared_mem::msg::event::Event;
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::msg::object::{NamedPose, ObjectPose};
use shared_mem::msg::target::{ArmTarget, GripperTarget};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::msg::wrench::Wrench;
use shared_mem::recording::{ClipWriter, WriteError};
use shared_mem::topics;
use shared_mem::transport::{ImageSubscriber, Node, Subscriber, TransportError, Wake};
use std::time::Duration;

/// Longest sleep between two looks at topics that wake nobody.
const LONGEST_SLEEP: Duration = Duration::from_millis(20);

pub(super) struct Sources {
    state: Subscriber<ArmState>,
    command: Subscriber<ArmCommand>,
    object: Subscriber<ObjectPose>,
    objects: Subscriber<NamedPose>,
    /// `None`: pictures are left out.
    pictures: Option<Pictures>,
    info: Subscriber<CameraInfo>,
    wrench: Subscriber<Wrench>,
    gripper: Subscriber<GripperState>,
    arm_target: Subscriber<ArmTarget>,
    gripper_target: Subscriber<GripperTarget>,
    twin_state: Subscriber<TwinState>,
    twin_gap: Subscriber<TwinGap>,
    twin_objects: Subscriber<TwinObject>,
    events: Subscriber<Event>,
    wake: Wake,
    counted: Counted,
}

/// The pictures of the camera.
struct Pictures {
    color: ImageSubscriber,
    depth: ImageSubscriber,
}

/// Numbered streams: a jump of the number is a loss.
#[derive(Debug, Default)]
struct Counted {
    taken: u64,
    /// Of those taken, remarks for people: this recorder sends some itself.
    remarks: u64,
    lost: u64,
    /// Of those lost, the ones that a remark has named.
    named: u64,
    state: Option<(u64, u64)>,
    color: Option<u64>,
    depth: Option<u64>,
}

impl Counted {
    /// Takes note of state `cycle` of bridge `session`; the count starts anew with a new bridge.
    fn state(&mut self, session: u64, cycle: u64) {
        if let Some((before, last)) = self.state
            && before == session
        {
            self.lost += cycle.saturating_sub(last + 1);
        }
        self.state = Some((session, cycle));
    }

    fn picture(last: &mut Option<u64>, sequence: u64) -> u64 {
        let lost = last.map_or(0, |last| sequence.saturating_sub(last + 1));
        *last = Some(sequence);
        lost
    }
}

impl Sources {
    /// Every topic; those of pictures only `with_pictures`.
    pub(super) fn open(node: &Node, with_pictures: bool) -> Result<Self, TransportError> {
        let pictures = || {
            let (color, depth) = (topics::CAMERA_COLOR, topics::CAMERA_DEPTH);
            Ok::<_, TransportError>(Pictures {
                color: node.image_subscriber(color)?,
                depth: node.image_subscriber(depth)?,
            })
        };
        Ok(Self {
            state: node.subscriber(topics::ARM_STATE)?,
            command: node.subscriber(topics::ARM_COMMAND)?,
            object: node.subscriber(topics::OBJECT_POSE)?,
            objects: node.subscriber(topics::OBJECT_POSES)?,
            pictures: with_pictures.then(pictures).transpose()?,
            info: node.subscriber(topics::CAMERA_INFO)?,
            wrench: node.subscriber(topics::WRENCH)?,
            gripper: node.subscriber(topics::GRIPPER)?,
            arm_target: node.subscriber(topics::ARM_TARGET)?,
            gripper_target: node.subscriber(topics::GRIPPER_TARGET)?,
            twin_state: node.subscriber(topics::TWIN_STATE)?,
            twin_gap: node.subscriber(topics::TWIN_GAP)?,
            twin_objects: node.subscriber(topics::TWIN_OBJECTS)?,
            events: node.subscriber(topics::EVENTS)?,
            wake: node.wake_on(topics::ARM_STATE.name)?,
            counted: Counted::default(),
        })
    }

    /// Messages taken so far.
    pub(super) fn taken(&self) -> u64 {
        self.counted.taken
    }

    /// Whether anything came from the cell, remarks for people apart.
    pub(super) fn heard(&self) -> bool {
        self.counted.taken > self.counted.remarks
    }

    /// Messages lost so far.
    pub(super) fn lost(&self) -> u64 {
        self.counted.lost
    }

    /// Messages lost since this was last asked; `None` where there are none.
    pub(super) fn newly_lost(&mut self) -> Option<u64> {
        let lost = self.counted.lost - std::mem::replace(&mut self.counted.named, self.counted.lost);
        (lost > 0).then_some(lost)
    }

    /// Sleeps a while, so that messages are written in batches: each wake-up costs more than writing a message.
    pub(super) fn sleep(&self) -> Result<(), TransportError> {
        std::thread::sleep(Duration::from_millis(4));
        self.wake.wait(LONGEST_SLEEP).map(|_| ())
    }

    /// Writes everything that waits. The outer error is shared memory's, the inner one the disk's.
    pub(super) fn drain_into(&mut self, writer: &mut ClipWriter) -> Result<Result<(), WriteError>, TransportError> {
        // Pictures first: they wait in the shortest queues.
        if let Err(e) = self.drain_pictures(writer)? {
            return Ok(Err(e));
        }
        let counted = &mut self.counted;
        macro_rules! drain {
            ($source:ident, $write:ident) => {
                while let Some(message) = self.$source.receive()? {
                    counted.taken += 1;
                    if let Err(e) = writer.$write(&message) {
                        return Ok(Err(e));
                    }
                }
            };
        }
        while let Some(state) = self.state.receive()? {
            counted.taken += 1;
            counted.state(state.session, state.cycle);
            if let Err(e) = writer.arm_state(&state) {
                return Ok(Err(e));
            }
        }
        drain!(command, arm_command);
        drain!(object, object_pose);
        drain!(objects, named_pose);
        drain!(info, camera_info);
        drain!(wrench, wrench);
        drain!(gripper, gripper);
        drain!(arm_target, arm_target);
        drain!(gripper_target, gripper_target);
        drain!(twin_state, twin_state);
        drain!(twin_gap, twin_gap);
        drain!(twin_objects, twin_object);
        let before = counted.taken;
        drain!(events, event);
        counted.remarks += counted.taken - before;
        Ok(Ok(()))
    }

    fn drain_pictures(&mut self, writer: &mut ClipWriter) -> Result<Result<(), WriteError>, TransportError> {
        let Some(pictures) = &mut self.pictures else { return Ok(Ok(())) };
        let Counted { taken, lost, color, depth, .. } = &mut self.counted;
        let mut take = |header: &ImageHeader, last: &mut Option<u64>| {
            *taken += 1;
            *lost += Counted::picture(last, header.sequence);
        };
        while let Some(picture) = pictures.color.receive()? {
            take(picture.header(), color);
            if let Err(e) = writer.image(topics::CAMERA_COLOR, picture.header(), picture.bytes()) {
                return Ok(Err(e));
            }
        }
        while let Some(picture) = pictures.depth.receive()? {
            take(picture.header(), depth);
            if let Err(e) = writer.image(topics::CAMERA_DEPTH, picture.header(), picture.bytes()) {
                return Ok(Err(e));
            }
        }
        Ok(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_in_the_count_is_a_loss_and_a_new_bridge_is_none() {
        let mut counted = Counted::default();
        for (session, cycle) in [(1, 10), (1, 11), (1, 15), (2, 3), (2, 4)] {
            counted.state(session, cycle);
        }
        assert_eq!(counted.lost, 3);
        let mut last = Some(4);
        assert_eq!(Counted::picture(&mut last, 5), 0);
        assert_eq!(Counted::picture(&mut last, 8), 2);
    }
}
