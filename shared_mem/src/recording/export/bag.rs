//! A ROS 2 bag as it is written: its messages, and its topics that cell.toml does not name.

use super::super::definitions::definition;
use super::metadata::{Contents, TopicCount, latched_profile};
use crate::output::Output;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};
use std::collections::{BTreeMap, HashMap};
use std::io::{self, BufWriter, Write as _};

/// Topics that cell.toml does not name.
pub(super) const EXTERNAL_TORQUES: &str = "/franka_robot_state_broadcaster/external_joint_torques";
pub(super) const FLANGE_POSE: &str = "/franka_robot_state_broadcaster/current_pose";
pub(super) const COLOR: &str = "/camera/color/image_raw";
pub(super) const COLOR_COMPRESSED: &str = "/camera/color/image_raw/compressed";
pub(super) const DEPTH: &str = "/camera/aligned_depth_to_color/image_raw";
pub(super) const INFO: &str = "/camera/color/camera_info";
pub(super) const WRENCH: &str = "/wrench";
pub(super) const GRIPPER: &str = "/gripper/joint_states";
pub(super) const EVENTS: &str = "/events";

/// A bag that is being written.
pub(super) struct Bag {
    mcap: mcap::Writer<BufWriter<Output>>,
    /// Channel and next sequence number of each topic, and its place in what the bag holds.
    channels: HashMap<String, (u16, u32, usize)>,
    contents: Contents,
}

impl Bag {
    pub(super) fn create(output: Output) -> Result<Self, mcap::McapError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("twinalign ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0);
        Ok(Self {
            mcap: options.create(BufWriter::new(output))?,
            channels: HashMap::new(),
            contents: Contents::default(),
        })
    }

    /// A record about the bag as a whole.
    pub(super) fn put_metadata(&mut self, record: &Metadata) -> Result<(), mcap::McapError> {
        self.mcap.write_metadata(record)
    }

    /// Adds index and footer.
    pub(super) fn finish(mut self) -> Result<(Output, Contents), mcap::McapError> {
        self.mcap.finish()?;
        let mut buffer = self.mcap.into_inner();
        buffer.flush()?;
        Ok((buffer.into_inner().map_err(io::IntoInnerError::into_error)?, self.contents))
    }

    /// A message on a topic that late subscribers get the last message of.
    pub(super) fn put_latched(
        &mut self,
        topic: &str,
        kind: &'static str,
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        self.put_with(topic, (kind, true), unix_ns, message)
    }

    pub(super) fn put(
        &mut self,
        topic: &str,
        kind: &'static str,
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        self.put_with(topic, (kind, false), unix_ns, message)
    }

    fn put_with(
        &mut self,
        topic: &str,
        (kind, is_latched): (&'static str, bool),
        unix_ns: u64,
        message: &[u8],
    ) -> Result<(), mcap::McapError> {
        let (channel_id, sequence, at) = match self.channels.get(topic) {
            Some(known) => *known,
            None => {
                let schema = self.mcap.add_schema(kind, "ros2msg", definition(kind).as_bytes())?;
                // rosbag2 asks for the key even where it is empty.
                let profile = if is_latched { latched_profile() } else { String::new() };
                let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), profile)]);
                self.contents.topics.push(TopicCount { name: topic.to_owned(), kind, is_latched, messages: 0 });
                (self.mcap.add_channel(schema, topic, "cdr", &metadata)?, 0, self.contents.topics.len() - 1)
            }
        };
        self.channels.insert(topic.to_owned(), (channel_id, sequence.wrapping_add(1), at));
        self.contents.topics[at].messages += 1;
        let (first, last) = self.contents.span_ns.unwrap_or((unix_ns, unix_ns));
        self.contents.span_ns = Some((first.min(unix_ns), last.max(unix_ns)));
        let header = MessageHeader { channel_id, sequence, log_time: unix_ns, publish_time: unix_ns };
        self.mcap.write_to_known_channel(&header, message)
    }
}
