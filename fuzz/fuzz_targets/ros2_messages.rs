//! ROS 2 messages (CDR) in a bag. The first byte says of which type the rest is.
#![no_main]

use libfuzzer_sys::fuzz_target;
use mcap::records::MessageHeader;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{ClipMessages, PictureKind, ReadError, for_pictures, read_clip};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

const MEASURED: &str = "/franka_robot_state_broadcaster/measured_joint_states";
const DESIRED: &str = "/franka_robot_state_broadcaster/desired_joint_states";

/// Types and the topics that carry them.
const KINDS: [(&str, &[&str]); 8] = [
    ("sensor_msgs/msg/JointState", &[MEASURED, DESIRED]),
    ("geometry_msgs/msg/PoseStamped", &["/object/pose"]),
    ("geometry_msgs/msg/TransformStamped", &["/object/pose"]),
    ("sensor_msgs/msg/Image", &["/camera/color"]),
    ("sensor_msgs/msg/CompressedImage", &["/camera/depth/compressed"]),
    ("sensor_msgs/msg/CameraInfo", &["/camera/color/camera_info"]),
    ("geometry_msgs/msg/WrenchStamped", &["/wrench"]),
    ("rcl_interfaces/msg/Log", &["/rosout"]),
];

/// A message of a joint state that is well-formed.
fn joint_state() -> Vec<u8> {
    let mut out = vec![12, 0, 0, 0, 5, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0];
    for name in [b'a', b'b'] {
        out.extend([2, 0, 0, 0, name, 0, 0, 0]);
    }
    for values in 0..3 {
        out.extend([2, 0, 0, 0]);
        out.resize(out.len().next_multiple_of(8), 0);
        out.extend([0.1 * f64::from(values), 0.2].iter().flat_map(|v: &f64| v.to_le_bytes()));
    }
    [vec![0, 0, 1, 0, 0], out].concat()
}

/// A message that is a header, a frame's name and zeros.
fn anything(kind: u8) -> Vec<u8> {
    [&[kind, 0, 1, 0, 0, 12, 0, 0, 0, 5, 0, 0, 0, 5, 0, 0, 0, b'b', b'a', b's', b'e', 0, 0, 0, 0][..], &[0; 120]]
        .concat()
}

fn bag(name: &str, topics: &[&str], message: &[u8]) -> Vec<u8> {
    let mut mcap =
        mcap::WriteOptions::new().profile("ros2").compression(None).create(Cursor::new(Vec::new())).expect("memory");
    let schema = mcap.add_schema(name, "ros2msg", b"").expect("memory");
    for topic in topics {
        let channel_id = mcap.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("memory");
        for i in 0..2 {
            let time = 1_000_000_000 + i * 1_000_000;
            let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
            mcap.write_to_known_channel(&header, message).expect("memory");
        }
    }
    mcap.finish().expect("memory");
    mcap.into_inner().into_inner()
}

fuzz_target!(
    init: fuzz::seeds([joint_state()].into_iter().chain((1..8).map(anything))),
    |bytes: &[u8]| {
        let Some((&first, message)) = bytes.split_first() else { return };
        let (name, topics) = KINDS[usize::from(first) % KINDS.len()];
        let path = fuzz::file("bag.mcap", &bag(name, topics, message));
        let cell = Cell::parse("[robot]\njoints = [\"a\", \"b\"]\n", Path::new("cell.toml")).expect("a valid cell");
        for kind in [ClipKind::Excitation, ClipKind::FreeMotion] {
            fuzz::accepted(read_clip(&path, kind, &cell));
        }
        for message in ClipMessages::open(&path, &[]).expect("a recording") {
            fuzz::accepted(message);
        }
        for kind in [PictureKind::Color, PictureKind::Depth] {
            fuzz::accepted(for_pictures::<ReadError>(&path, kind, |_, _| Ok(())));
        }
    }
);
