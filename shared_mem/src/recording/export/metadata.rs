//! `metadata.yaml` of a ROS 2 bag's folder, version 9 of its layout as ROS 2 Jazzy writes it: how long the bag is, which topics
//! are in it, and with which quality of service they are to be offered again.

use std::fmt::Write as _;

/// A duration without end, as `rmw` has it.
const ENDLESS: &str = "{sec: 9223372036, nsec: 854775807}";

/// What a bag holds of a topic.
#[derive(Debug, Clone)]
pub(super) struct TopicCount {
    pub(super) name: String,
    pub(super) kind: &'static str,
    pub(super) is_latched: bool,
    pub(super) messages: u64,
}

/// What a bag holds.
#[derive(Debug, Clone, Default)]
pub(super) struct Contents {
    /// Stamps of its first and its last message [ns].
    pub(super) span_ns: Option<(u64, u64)>,
    /// In the order in which their first messages came.
    pub(super) topics: Vec<TopicCount>,
}

/// The quality of service of topics that late subscribers get the last message of, as rosbag2 notes it beside a topic.
pub(super) fn latched_profile() -> String {
    format!(
        "- {{history: keep_last, depth: 1, reliability: reliable, durability: transient_local, deadline: {ENDLESS}, \
         lifespan: {ENDLESS}, liveliness: automatic, liveliness_lease_duration: {ENDLESS}, \
         avoid_ros_namespace_conventions: false}}"
    )
}

/// The file's text for a bag of the one file `file`.
pub(super) fn text(file: &str, contents: &Contents) -> String {
    let (first, last) = contents.span_ns.unwrap_or((0, 0));
    let (length, messages) = (last - first, contents.topics.iter().map(|topic| topic.messages).sum::<u64>());
    let file = quoted(file);
    let mut text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {length}\n  \
         starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {messages}\n  topics_with_message_count:{}\n",
        if contents.topics.is_empty() { " []" } else { "" }
    );
    for TopicCount { name, kind, is_latched, messages } in &contents.topics {
        let profiles = if *is_latched { format!("\n          {}", latched_profile()) } else { " []".to_owned() };
        let _written = write!(
            text,
            "    - topic_metadata:\n        name: {}\n        type: {kind}\n        serialization_format: cdr\n        \
             offered_qos_profiles:{profiles}\n        type_description_hash: {}\n      message_count: {messages}\n",
            quoted(name),
            type_hash(kind)
        );
    }
    let _written = write!(
        text,
        "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {file}\n  files:\n    - path: {file}\n      \
         starting_time:\n        nanoseconds_since_epoch: {first}\n      duration:\n        nanoseconds: {length}\n      \
         message_count: {messages}\n  custom_data: ~\n  ros_distro: jazzy\n"
    );
    text
}

/// A text of YAML, which takes the escapes of JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The hash of a type's description (REP 2011), as ROS 2 Jazzy calculates it from the type's definition.
fn type_hash(kind: &str) -> &'static str {
    match kind {
        "sensor_msgs/msg/JointState" => "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
        "geometry_msgs/msg/PoseStamped" => "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
        "geometry_msgs/msg/WrenchStamped" => "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
        "sensor_msgs/msg/Image" => "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
        "sensor_msgs/msg/CompressedImage" => "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
        "sensor_msgs/msg/CameraInfo" => "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
        "rcl_interfaces/msg/Log" => "RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
        "tf2_msgs/msg/TFMessage" => "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
        "std_msgs/msg/String" => "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        // Nothing is claimed of a type that is not known.
        _ => "\"\"",
    }
}
