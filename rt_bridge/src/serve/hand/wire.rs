//! Between the bytes of the hand's protocol, version 3, and its actions. Pure, and total over bytes.

use crate::gripper::fingers::{Action, Fingers, Outcome};
use franka::wire::HeaderLayout;
use franka::wire::gripper::{
    GRIPPER_COMMAND_PORT, GRIPPER_VERSION, GraspRequest, GripperCommand, GripperConnectRequest, GripperConnectStatus,
    GripperMoveRequest, GripperState,
};
use zerocopy::{FromBytes as _, IntoBytes as _};

pub(in crate::serve) use franka::wire::gripper::GripperStatus as Status;

/// Where hands listen.
pub(in crate::serve) const PORT: u16 = GRIPPER_COMMAND_PORT;

/// What a client asks the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::serve) enum Request {
    Connect { version: u16, udp_port: u16 },
    Act(Action),
    Stop,
}

/// Reads a request; `None` for what is none.
pub(in crate::serve) fn request(number: u32, payload: &[u8]) -> Option<Request> {
    let empty = |request| payload.is_empty().then_some(request);
    match GripperCommand::from_u16(u16::try_from(number).ok()?)? {
        GripperCommand::Connect => {
            let wire = GripperConnectRequest::read_from_bytes(payload).ok()?;
            Some(Request::Connect { version: wire.version.get(), udp_port: wire.udp_port.get() })
        }
        GripperCommand::Homing => empty(Request::Act(Action::Homing)),
        GripperCommand::Stop => empty(Request::Stop),
        GripperCommand::Move => {
            let wire = GripperMoveRequest::read_from_bytes(payload).ok()?;
            Some(Request::Act(Action::Move { width: wire.width.get(), speed: wire.speed.get() }))
        }
        GripperCommand::Grasp => {
            let wire = GraspRequest::read_from_bytes(payload).ok()?;
            let epsilon = [wire.epsilon_inner.get(), wire.epsilon_outer.get()];
            Some(Request::Act(Action::Grasp { width: wire.width.get(), epsilon, speed: wire.speed.get() }))
        }
    }
}

/// Whether a client of this version is understood.
pub(super) fn speaks(version: u16) -> bool {
    version == GRIPPER_VERSION
}

/// The reply to a handshake that is accepted.
pub(super) fn welcome(id: u32) -> Vec<u8> {
    handshake_reply(id, GripperConnectStatus::Success.to_u16())
}

/// The reply to a handshake of another version.
pub(super) fn version_reply(id: u32) -> Vec<u8> {
    handshake_reply(id, GripperConnectStatus::IncompatibleLibraryVersion.to_u16())
}

/// The reply to a client for whom there is no place, for which the protocol has no status.
pub(super) fn busy_reply(id: u32) -> Vec<u8> {
    const TAKEN: u16 = 2;
    handshake_reply(id, TAKEN)
}

fn handshake_reply(id: u32, status: u16) -> Vec<u8> {
    let payload = [status.to_le_bytes(), GRIPPER_VERSION.to_le_bytes()].concat();
    message(GripperCommand::Connect.to_u16().into(), id, &payload)
}

/// How the protocol calls the end of an action.
pub(super) fn status(outcome: Outcome) -> Status {
    match outcome {
        Outcome::Success => Status::Success,
        Outcome::Unsuccessful => Status::Unsuccessful,
        Outcome::Impossible => Status::Fail,
    }
}

/// The reply to any other request.
pub(super) fn reply(number: u32, id: u32, status: Status) -> Vec<u8> {
    message(number, id, &status.to_u16().to_le_bytes())
}

fn message(number: u32, id: u32, payload: &[u8]) -> Vec<u8> {
    let mut message = HeaderLayout::Gripper.encode_header(number, id, payload.len());
    message.extend_from_slice(payload);
    message
}

/// The state's datagram; `stamp_ms` counts the hand's milliseconds.
pub(super) fn state(fingers: &Fingers, stamp_ms: u32) -> Vec<u8> {
    /// Of a hand that has been on for a while [degrees Celsius].
    const WARM: u16 = 30;
    let wire = GripperState {
        message_id: stamp_ms.into(),
        width: fingers.width().into(),
        max_width: fingers.widest().into(),
        is_grasped: u8::from(fingers.has_grasped()),
        temperature: WARM.into(),
    };
    wire.as_bytes().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn messages_have_the_lengths_of_the_protocol() {
        assert_eq!(state(&Fingers::new(crate::gripper::FRANKA_HAND), 7).len(), 23);
        assert_eq!(welcome(0).len(), 14);
        assert_eq!(reply(1, 0, Status::Success).len(), 12);
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_request_or_none(number in 0_u32..70_000, payload in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Some(Request::Act(action)) = request(number, &payload) {
                let mut fingers = Fingers::new(crate::gripper::FRANKA_HAND);
                let _impossible = fingers.begin(action);
                let _still_moving = fingers.step(0.01);
                prop_assert!((0.0..=0.08).contains(&fingers.width()));
            }
        }
    }
}
