//! All messages of a clip in the order they were recorded: for replaying arms and cameras, and for viewers.
//!
//! Own clips yield every payload; ROS 2 bags yield pictures, camera calibrations, wrenches, a gripper's joint and log
//! texts (their other joints and poses are read as a whole by [`super::read_clip`]). Stamps of own clips are the recording machine's monotonic clock, of bags the
//! headers' Unix time [ns].

use super::container::{Channel, Message, Messages};
use super::error::ReadError;
use super::picture::Picture;
use super::ros2::{self, CameraCalibration, CompressedImage, Image, JointState, Log};
use super::wire::{self, Wire, proto};
use crate::msg::arm::{ArmCommand, ArmState};
use crate::msg::event::{Event, EventLevel, EventSource};
use crate::msg::gripper::GripperState;
use crate::msg::image::CameraInfo;
use crate::msg::object::ObjectPose;
use crate::msg::target::{ArmTarget, GripperTarget};
use crate::msg::twin::{TwinGap, TwinObject, TwinState};
use crate::msg::wrench::Wrench;
use prost::Message as _;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// One message of a clip.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipMessage {
    /// Topic it was recorded on.
    pub topic: String,
    /// When it was recorded: Unix time [ns].
    pub log_time_ns: u64,
    /// What it says.
    pub payload: Payload,
}

/// What a message says.
#[derive(Debug, Clone, PartialEq)]
pub enum Payload {
    /// `/arm/state`
    ArmState(Box<ArmState>),
    /// `/arm/command`
    ArmCommand(Box<ArmCommand>),
    /// `/object/pose`
    ObjectPose(Box<ObjectPose>),
    /// `/camera/info`, or a bag's `sensor_msgs/CameraInfo` (which knows no pose: identity).
    CameraInfo(Box<CameraInfo>),
    /// `/camera/color`, `/camera/depth`, or a bag's `sensor_msgs/Image` or `CompressedImage`.
    Picture(Picture),
    /// `/wrench`, or a bag's `geometry_msgs/WrenchStamped`.
    Wrench(Wrench),
    /// `/gripper`, or a bag's joint `gripper_width`.
    Gripper(GripperState),
    /// `/arm/target`
    ArmTarget(Box<ArmTarget>),
    /// `/gripper/target`
    GripperTarget(GripperTarget),
    /// `/twin/state`
    TwinState(Box<TwinState>),
    /// `/twin/gap`
    TwinGap(Box<TwinGap>),
    /// `/twin/object/NAME`
    TwinObject(Box<TwinObject>),
    /// `/events`, or a bag's `rcl_interfaces/Log`.
    Event(Box<Event>),
}

/// Iterates over the messages of a clip.
///
/// What is cut or changed in the file is skipped; [`ClipMessages::damage`] tells what, once the end is reached.
#[derive(Debug)]
pub struct ClipMessages {
    path: PathBuf,
    topics: Vec<String>,
    is_of_pictures: bool,
    messages: Messages<BufReader<File>>,
}

impl ClipMessages {
    /// Opens a clip file; `topics` limits the messages to these, none means all.
    ///
    /// # Errors
    /// [`ReadError`] when the file is missing or no MCAP file.
    pub fn open(path: &Path, topics: &[&str]) -> Result<Self, ReadError> {
        let topics = topics.iter().map(|&topic| topic.to_owned()).collect();
        Ok(Self { path: path.to_owned(), topics, is_of_pictures: false, messages: Messages::open(path)? })
    }

    /// Opens a clip file for its pictures: a bag's cameras may have lenses that no clip holds.
    pub(super) fn of_pictures(path: &Path) -> Result<Self, ReadError> {
        Ok(Self { is_of_pictures: true, ..Self::open(path, &[])? })
    }

    /// The part of the file that could not be read so far; `None` while all is whole.
    pub fn damage(&self) -> Option<String> {
        self.messages.damage().summary()
    }
}

impl Iterator for ClipMessages {
    type Item = Result<ClipMessage, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let message = match self.messages.next() {
                Ok(Some(message)) => message,
                Ok(None) => return None,
                Err(error) => return Some(Err(error)),
            };
            let topic = &message.channel.topic;
            if !self.topics.is_empty() && !self.topics.contains(topic) {
                continue;
            }
            if self.is_of_pictures && message.channel.type_name() == ros2::CAMERA_INFO {
                continue;
            }
            match payload(&message) {
                Ok(None) => {}
                Ok(Some(payload)) => {
                    return Some(Ok(ClipMessage { topic: topic.clone(), log_time_ns: message.log_time_ns, payload }));
                }
                Err(what) => return Some(Err(ReadError::content(&self.path, topic, what))),
            }
        }
    }
}

/// True for a message of an own clip.
pub(super) fn is_own(channel: &Channel) -> bool {
    channel.encoding == "protobuf" && ["twinalign.", "foxglove."].iter().any(|p| channel.type_name().starts_with(p))
}

/// Decodes one of the protobuf payloads.
pub(super) fn decode<T: Wire>(data: &[u8]) -> Result<T, String> {
    let message = T::Message::decode(data)
        .map_err(|e| format!("a message is no {} ({e}); it was written by another program", T::SCHEMA))?;
    Ok(T::from_wire(message))
}

/// What a message says; `None` for a type that is of no use here.
fn payload(message: &Message<'_>) -> Result<Option<Payload>, String> {
    if is_own(message.channel) { own(message) } else { foreign(message) }
}

fn own(message: &Message<'_>) -> Result<Option<Payload>, String> {
    let data = message.data;
    Ok(Some(match message.channel.type_name() {
        ArmState::SCHEMA => Payload::ArmState(Box::new(decode(data)?)),
        ArmCommand::SCHEMA => Payload::ArmCommand(Box::new(decode(data)?)),
        ObjectPose::SCHEMA if message.channel.topic == ObjectPose::TOPIC => {
            Payload::ObjectPose(Box::new(decode(data)?))
        }
        CameraInfo::SCHEMA => Payload::CameraInfo(Box::new(decode(data)?)),
        Wrench::SCHEMA => Payload::Wrench(decode(data)?),
        GripperState::SCHEMA => Payload::Gripper(decode(data)?),
        ArmTarget::SCHEMA => Payload::ArmTarget(Box::new(decode(data)?)),
        GripperTarget::SCHEMA => Payload::GripperTarget(decode(data)?),
        TwinState::SCHEMA => Payload::TwinState(Box::new(decode(data)?)),
        TwinGap::SCHEMA => Payload::TwinGap(Box::new(decode(data)?)),
        TwinObject::SCHEMA => Payload::TwinObject(Box::new(decode(data)?)),
        Event::SCHEMA => Payload::Event(Box::new(decode(data)?)),
        wire::IMAGE_SCHEMA => {
            let image = proto::foxglove::RawImage::decode(data)
                .map_err(|e| format!("a message is no foxglove.RawImage ({e})"))?;
            let Some((header, pixels)) = wire::image_from_wire(image) else { return Ok(None) };
            Payload::Picture(Picture::from_own(header, pixels)?)
        }
        _ => return Ok(None),
    }))
}

fn foreign(message: &Message<'_>) -> Result<Option<Payload>, String> {
    let stamp = |header_ns: u64| if header_ns == 0 { message.log_time_ns } else { header_ns };
    let bad = |e: super::cdr::CdrError| format!("a message cannot be decoded: {e}; record the bag again");
    Ok(Some(match message.channel.type_name() {
        ros2::IMAGE => {
            let mut image = Image::decode(message.data).map_err(bad)?;
            image.stamp_ns = stamp(image.stamp_ns);
            Payload::Picture(Picture::from_image(&image)?)
        }
        ros2::COMPRESSED_IMAGE => {
            let mut image = CompressedImage::decode(message.data).map_err(bad)?;
            image.stamp_ns = stamp(image.stamp_ns);
            Payload::Picture(Picture::from_compressed(&image)?)
        }
        ros2::CAMERA_INFO => {
            let mut info = CameraCalibration::decode(message.data).map_err(bad)?;
            info.stamp_ns = stamp(info.stamp_ns);
            Payload::CameraInfo(Box::new(info.camera_info()?))
        }
        ros2::WRENCH => {
            let (header_ns, force, torque) = ros2::wrench(message.data).map_err(bad)?;
            let stamp_ns = stamp(header_ns);
            Payload::Wrench(Wrench { stamp_ns, device_ns: stamp_ns, force, torque, ..Wrench::default() })
        }
        ros2::LOG => Payload::Event(Box::new(event(&Log::decode(message.data).map_err(bad)?, stamp))),
        JointState::TYPE => {
            let joints = JointState::decode(message.data).map_err(bad)?;
            let Some(state) = gripper(&joints, stamp) else { return Ok(None) };
            Payload::Gripper(state)
        }
        _ => return Ok(None),
    }))
}

/// A remark that a node logged.
fn event(log: &Log<'_>, stamp: impl Fn(u64) -> u64) -> Event {
    let level = match log.level {
        0..30 => EventLevel::Info,
        30..40 => EventLevel::Warning,
        _ => EventLevel::Error,
    };
    let source = match log.name {
        "recorder" => EventSource::Recorder,
        "twin" => EventSource::Twin,
        "capture" => EventSource::Capture,
        _ => EventSource::Bridge,
    };
    Event { stamp_ns: stamp(log.stamp_ns), ..Event::new(level, source, log.text) }
}

/// A gripper's joint; `None` for other joints.
fn gripper(joints: &JointState<'_>, stamp: impl Fn(u64) -> u64) -> Option<GripperState> {
    let (&[ros2::GRIPPER_JOINT], &[width]) = (&joints.names[..], &joints.position[..]) else { return None };
    let force = joints.effort.first().copied().unwrap_or(0.0);
    Some(GripperState { stamp_ns: stamp(joints.stamp_ns), width, width_d: width, force, ..GripperState::default() })
}
