//! Messages as the bytes that a clip holds, for whoever sends them on instead of writing them: the same protobuf forms.

use super::messages::decode;
use super::picture::check_size;
use super::wire::{IMAGE_SCHEMA, UnixClock, Wire, descriptor, image_from_wire, image_to_wire, proto};
use crate::msg::Message;
use crate::msg::arm::{ArmCommand, ArmState};
use crate::msg::event::Event;
use crate::msg::gripper::GripperState;
use crate::msg::image::{CameraInfo, ImageHeader};
use crate::msg::object::{NamedPose, ObjectPose};
use crate::msg::target::{ArmTarget, GripperTarget};
use crate::msg::twin::{TwinGap, TwinObject, TwinState};
use crate::msg::wrench::Wrench;
use crate::time::unix_offset_ns;
use crate::topics::{self, ImageTopic, Topic};
use prost::Message as _;

/// A message that clips hold. Chunks of motions and orders to a gripper are none: they are not recorded.
pub trait Encoded: Message {
    /// When it was stamped: monotonic clock of the host that made it [ns].
    fn stamp_ns(&self) -> u64;

    /// The same message with another stamp [ns].
    fn with_stamp_ns(self, stamp_ns: u64) -> Self;

    /// Appends the bytes to `out`. Where Foxglove's schema has a Unix time, it is this host's.
    fn append_to(&self, out: &mut Vec<u8>);

    /// From bytes that anybody may have written.
    ///
    /// # Errors
    /// A sentence that says what is wrong with them.
    fn from_bytes(bytes: &[u8]) -> Result<Self, String>;

    /// Full name of the schema.
    fn schema() -> &'static str;
}

macro_rules! encoded {
    ($($message:ident),+ $(,)?) => {$(
        impl Encoded for $message {
            fn stamp_ns(&self) -> u64 {
                self.stamp_ns
            }

            fn with_stamp_ns(self, stamp_ns: u64) -> Self {
                Self { stamp_ns, ..self }
            }

            fn append_to(&self, out: &mut Vec<u8>) {
                out.extend(Wire::to_wire(self, UnixClock(unix_offset_ns())).encode_to_vec());
            }

            fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
                let message: Self = decode(bytes)?;
                Message::from_wire(&Message::to_wire(&message)).map_err(|wrong| wrong.to_string())
            }

            fn schema() -> &'static str {
                <Self as Wire>::SCHEMA
            }
        }
    )+};
}
encoded!(
    ArmState,
    ArmCommand,
    ObjectPose,
    NamedPose,
    CameraInfo,
    Wrench,
    GripperState,
    ArmTarget,
    GripperTarget,
    TwinState,
    TwinGap,
    TwinObject,
    Event,
);

/// Something to do with every topic that clips hold, whatever its messages.
pub trait EncodedVisitor {
    /// A topic of messages.
    fn messages<M: Encoded>(&mut self, topic: Topic<M>);
    /// A topic of pictures.
    fn pictures(&mut self, topic: ImageTopic);
}

/// Calls the visitor once for each topic that clips hold.
pub fn visit_encoded(visitor: &mut impl EncodedVisitor) {
    visitor.messages(topics::ARM_STATE);
    visitor.messages(topics::ARM_COMMAND);
    visitor.messages(topics::OBJECT_POSE);
    visitor.messages(topics::OBJECT_POSES);
    visitor.pictures(topics::CAMERA_COLOR);
    visitor.pictures(topics::CAMERA_DEPTH);
    visitor.messages(topics::CAMERA_INFO);
    visitor.messages(topics::WRENCH);
    visitor.messages(topics::GRIPPER);
    visitor.messages(topics::ARM_TARGET);
    visitor.messages(topics::GRIPPER_TARGET);
    visitor.messages(topics::TWIN_STATE);
    visitor.messages(topics::TWIN_GAP);
    visitor.messages(topics::TWIN_OBJECTS);
    visitor.messages(topics::EVENTS);
}

/// Appends a picture to `out`: header and pixels, rows of `header.stride` bytes.
pub fn append_picture(header: &ImageHeader, pixels: &[u8], out: &mut Vec<u8>) {
    image_to_wire(header, pixels, UnixClock(unix_offset_ns()), out);
}

/// Header and pixels of a picture from bytes that anybody may have written.
///
/// # Errors
/// A sentence that says what is wrong with them.
pub fn picture_from_bytes(bytes: &[u8]) -> Result<(ImageHeader, Vec<u8>), String> {
    let image =
        proto::foxglove::RawImage::decode(bytes).map_err(|e| format!("a message is no {IMAGE_SCHEMA} ({e})"))?;
    check_size(image.width, image.height)?;
    let encoding = image.encoding.clone();
    let (header, pixels) = image_from_wire(image).ok_or_else(|| format!("no picture is encoded as `{encoding}`"))?;
    let header = ImageHeader::from_wire(&header.to_wire()).map_err(|wrong| wrong.to_string())?;
    header.check_size(pixels.len()).map_err(|wrong| wrong.to_string())?;
    Ok((header, pixels))
}

/// Full name of the pictures' schema.
pub fn picture_schema() -> &'static str {
    IMAGE_SCHEMA
}

/// A number that two builds agree on when their definitions of `schema` and of all that it uses agree.
pub fn schema_checksum(schema: &str) -> u32 {
    crc32fast::hash(&descriptor(schema))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::msg::event::{EventLevel, EventSource};
    use crate::msg::image::PixelEncoding;
    use crate::msg::joints_from;

    #[derive(Default)]
    struct Names(Vec<&'static str>);

    impl EncodedVisitor for Names {
        fn messages<M: Encoded>(&mut self, topic: Topic<M>) {
            assert_ne!(schema_checksum(M::schema()), schema_checksum("none.such"), "{} has no definition", topic.name);
            self.0.push(topic.name);
        }

        fn pictures(&mut self, topic: ImageTopic) {
            self.0.push(topic.name);
        }
    }

    #[test]
    fn every_topic_that_clips_hold_is_visited() {
        let mut names = Names::default();
        visit_encoded(&mut names);
        let left_out: Vec<&str> = topics::ALL.into_iter().filter(|name| !names.0.contains(name)).collect();
        assert_eq!(left_out, [topics::ARM_MOTION.name, topics::GRIPPER_COMMAND.name]);
    }

    #[test]
    fn a_message_comes_out_of_its_bytes_as_it_went_in() {
        let state = ArmState { stamp_ns: 7, dof: 7, q: joints_from(&[0.1; 7]), cycle: 3, ..ArmState::default() };
        let event = Event { stamp_ns: 9, ..Event::new(EventLevel::Warning, EventSource::Twin, "slow") };
        let (mut bytes, mut text) = (Vec::new(), Vec::new());
        state.append_to(&mut bytes);
        event.append_to(&mut text);
        assert_eq!(ArmState::from_bytes(&bytes), Ok(state));
        assert_eq!(Event::from_bytes(&text), Ok(event));
        assert_eq!(state.with_stamp_ns(8).stamp_ns, 8);
    }

    #[test]
    fn bytes_of_another_message_and_numbers_that_none_holds_are_refused() {
        assert!(ArmState::from_bytes(b"\xff\xff\xff").is_err_and(|what| what.contains("twinalign.ArmState")));
        let mut bytes = Vec::new();
        ArmState { q: joints_from(&[f64::NAN]), dof: 1, ..ArmState::default() }.append_to(&mut bytes);
        assert!(ArmState::from_bytes(&bytes).is_err_and(|what| what.contains('q')));
    }

    #[test]
    fn a_picture_has_as_many_pixels_as_its_header_says() {
        let header = ImageHeader {
            width: 2,
            height: 2,
            stride: 4,
            encoding: PixelEncoding::Depth16,
            depth_scale: 1e-3,
            ..ImageHeader::default()
        };
        let (mut whole, mut short) = (Vec::new(), Vec::new());
        append_picture(&header, &[1; 8], &mut whole);
        append_picture(&header, &[1; 7], &mut short);
        assert_eq!(picture_from_bytes(&whole), Ok((header, vec![1; 8])));
        assert!(picture_from_bytes(&short).is_err_and(|what| what.contains("7 bytes")));
    }
}
