//! Every topic: its name, payload and limits. Nothing else in the project names a topic.
//!
//! Memory is set aside for the worst case when a topic opens: `(subscribers x (buffer + borrowed) + history + loans)`
//! payloads. All topics overflow safely: a slow reader loses its oldest messages and never blocks the writer.

use crate::msg::Message;
use crate::msg::arm::{ArmCommand, ArmState};
use crate::msg::event::Event;
use crate::msg::gripper::{GripperCommand, GripperState};
use crate::msg::image::CameraInfo;
use crate::msg::motion::MotionChunk;
use crate::msg::object::{NamedPose, ObjectPose};
use crate::msg::target::{ArmTarget, GripperTarget};
use crate::msg::twin::{TwinGap, TwinObject, TwinState};
use crate::msg::wrench::Wrench;
use std::marker::PhantomData;

/// A topic with messages of fixed size.
#[derive(Debug)]
pub struct Topic<M> {
    /// Name on shared memory and in recordings.
    pub name: &'static str,
    /// How many messages wait for each reader.
    pub limits: Limits,
    message: PhantomData<fn() -> M>,
}

impl<M> Clone for Topic<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M> Copy for Topic<M> {}

/// A topic of pictures.
#[derive(Debug, Clone, Copy)]
pub struct ImageTopic {
    /// Name on shared memory and in recordings.
    pub name: &'static str,
    /// How many pictures wait for each reader.
    pub limits: Limits,
}

/// How much a topic keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Messages that wait for a reader before the oldest is overwritten.
    pub buffer: usize,
    /// Messages a reader that joins late is given.
    pub history: usize,
    /// Messages a reader may hold at once.
    pub borrowed: usize,
    /// Readers at once.
    pub subscribers: usize,
    /// Writers at once.
    pub publishers: usize,
}

/// Streams at the control rate: 2 s wait for a reader that stalls.
const STREAM: Limits = Limits { buffer: 2048, history: 0, borrowed: 2, subscribers: 8, publishers: 1 };
/// Pictures: a quarter of a second at 30 Hz; each megabyte counts.
const PICTURES: Limits = Limits { buffer: 8, history: 0, borrowed: 2, subscribers: 4, publishers: 1 };
/// What a late reader wants to know at once.
const LATCHED: Limits = Limits { buffer: 4, history: 1, borrowed: 2, subscribers: 8, publishers: 1 };

/// What is steered by: the newest counts.
const TARGETS: Limits = Limits { buffer: 16, history: 0, borrowed: 2, subscribers: 4, publishers: 4 };

const fn topic<M: Message>(name: &'static str, limits: Limits) -> Topic<M> {
    Topic { name, limits, message: PhantomData }
}

/// Bridge to all: state of the arm, each cycle.
pub const ARM_STATE: Topic<ArmState> = topic("/arm/state", STREAM);
/// Bridge to all: what the arm was told, each cycle.
pub const ARM_COMMAND: Topic<ArmCommand> = topic("/arm/command", STREAM);
/// Capture to bridge: motions to play. Several writers, so that a second sender is refused by the bridge and not by the transport,
/// and a stop has a place beside both.
pub const ARM_MOTION: Topic<MotionChunk> =
    topic("/arm/motion", Limits { buffer: 64, history: 0, borrowed: 2, subscribers: 4, publishers: 4 });
/// Anyone to bridge: where the arm is to go now. Several writers, so that a second sender is refused by the bridge and not by
/// the transport.
pub const ARM_TARGET: Topic<ArmTarget> = topic("/arm/target", TARGETS);
/// Tracker or simulation to all: pose of the object, at frame rate.
pub const OBJECT_POSE: Topic<ObjectPose> =
    topic("/object/pose", Limits { buffer: 256, history: 1, borrowed: 2, subscribers: 8, publishers: 2 });
/// Tracker or simulation to all: pose of each object that has a name, at frame rate. The first object of a cell is on
/// [`OBJECT_POSE`], too.
pub const OBJECT_POSES: Topic<NamedPose> =
    topic("/object/poses", Limits { buffer: 1024, history: 32, borrowed: 2, subscribers: 8, publishers: 2 });
/// Bridge to all: colour pictures.
pub const CAMERA_COLOR: ImageTopic = ImageTopic { name: "/camera/color", limits: PICTURES };
/// Bridge to all: depth pictures.
pub const CAMERA_DEPTH: ImageTopic = ImageTopic { name: "/camera/depth", limits: PICTURES };
/// Bridge to all: intrinsics and pose of the camera, once a second and to late readers.
pub const CAMERA_INFO: Topic<CameraInfo> = topic("/camera/info", LATCHED);
/// Bridge to all: force/torque samples.
pub const WRENCH: Topic<Wrench> = topic("/wrench", STREAM);
/// Bridge to all: gripper state.
pub const GRIPPER: Topic<GripperState> =
    topic("/gripper", Limits { buffer: 64, history: 1, borrowed: 2, subscribers: 8, publishers: 1 });
/// Anyone to bridge: what the gripper is to do. The newest counts.
pub const GRIPPER_COMMAND: Topic<GripperCommand> =
    topic("/gripper/command", Limits { buffer: 8, history: 0, borrowed: 2, subscribers: 4, publishers: 4 });
/// Anyone to bridge: how far the fingers are to be apart now.
pub const GRIPPER_TARGET: Topic<GripperTarget> = topic("/gripper/target", TARGETS);
/// Twin to all: its own state, each cycle it mirrors.
pub const TWIN_STATE: Topic<TwinState> = topic("/twin/state", STREAM);
/// Twin to all: real against twin, each cycle it mirrors.
pub const TWIN_GAP: Topic<TwinGap> = topic("/twin/gap", STREAM);
/// Twin to all: each object that has a name, real against twin, whenever its pose comes.
pub const TWIN_OBJECTS: Topic<TwinObject> =
    topic("/twin/objects", Limits { buffer: 1024, history: 0, borrowed: 2, subscribers: 8, publishers: 1 });
/// Anyone to all: remarks for people.
pub const EVENTS: Topic<Event> =
    topic("/events", Limits { buffer: 128, history: 16, borrowed: 2, subscribers: 8, publishers: 8 });

/// Recordings of tasks: positions of bodies on joints.
pub const TASK_JOINTS: &str = "/task/joints";
/// Recordings of tasks: where the drives of joints are commanded to go.
pub const TASK_DRIVES: &str = "/task/drives";

/// Recordings of several bodies: where the body of this name is.
///
/// ```
/// use shared_mem::topics::{object_of, object_pose};
///
/// let topic = object_pose("lid");
/// assert_eq!(topic, "/object/lid/pose");
/// assert_eq!(object_of(&topic, "pose"), Some("lid"));
/// assert_eq!(object_of(&topic, "target"), None);
/// ```
pub fn object_pose(name: &str) -> String {
    format!("/object/{name}/pose")
}

/// Recordings: the object of this name in the twin, and how far it is from the real one.
pub fn twin_object(name: &str) -> String {
    format!("/twin/object/{name}")
}

/// Recordings of tasks: where the moved body of this name is commanded to be.
pub fn object_target(name: &str) -> String {
    format!("/object/{name}/target")
}

/// The body that a topic of [`object_pose`] (`"pose"`) or of [`object_target`] (`"target"`) is about.
pub fn object_of<'a>(topic: &'a str, what: &str) -> Option<&'a str> {
    topic.strip_prefix("/object/")?.strip_suffix(what)?.strip_suffix('/')
}

/// Something to do with every topic, whatever its messages.
pub trait Visitor {
    /// A topic of messages.
    fn messages<M: Message>(&mut self, topic: Topic<M>);
    /// A topic of pictures.
    fn pictures(&mut self, topic: ImageTopic);
}

macro_rules! list {
    ($($kind:ident $topic:ident),+ $(,)?) => {
        /// Names of all topics, in the order of a report.
        pub const ALL: [&str; [$($topic.name),+].len()] = [$($topic.name),+];

        /// Calls the visitor once for each topic.
        pub fn visit(visitor: &mut impl Visitor) {
            $(visitor.$kind($topic);)+
        }
    };
}
list!(
    messages ARM_STATE,
    messages ARM_COMMAND,
    messages ARM_MOTION,
    messages ARM_TARGET,
    messages OBJECT_POSE,
    messages OBJECT_POSES,
    pictures CAMERA_COLOR,
    pictures CAMERA_DEPTH,
    messages CAMERA_INFO,
    messages WRENCH,
    messages GRIPPER,
    messages GRIPPER_COMMAND,
    messages GRIPPER_TARGET,
    messages TWIN_STATE,
    messages TWIN_GAP,
    messages TWIN_OBJECTS,
    messages EVENTS,
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_of_this_file_is_in_the_list() {
        let definitions = include_str!("topics.rs").lines().filter(|line| {
            line.starts_with("pub const ") && (line.contains(": Topic<") || line.contains(": ImageTopic"))
        });
        assert_eq!(definitions.count(), ALL.len());
    }
}
