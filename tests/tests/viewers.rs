//! The layout that ships for Foxglove and Lichtblick shows what an own clip holds.

use serde_json::Value;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::twin::{TwinGap, TwinState};
use shared_mem::recording::{ClipInfo, ClipWriter, RawMessages};
use shared_mem::topics::CAMERA_COLOR;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tests::texts::root;
use twin::arm::ArmModel;
use twin::description::shown_robot;

/// Topics of the live view alone.
const LIVE: [&str; 1] = ["/scene"];

/// The shipped cell for a moment, with its twin: topics and what they say of their messages.
fn recorded(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let cell = Cell::read(&root().join("config/fr3_cell.toml")).expect("the shipped cell");
    let robot = Arc::new(shown_robot(&cell).expect("an arm").expect("a shape"));
    let q = *ArmModel::from_cell(&cell).expect("an arm").ready();
    let info = ClipInfo { cell_toml: Some(cell.to_toml()), ..ClipInfo::default() };
    let mut writer = ClipWriter::create(path, &info).expect("a new file");
    writer.show(&robot, &robot.joints, &cell);
    let (stamp_ns, dof) = (1_000_000_000, 7);
    writer.arm_state(&ArmState { stamp_ns, dof, q, q_d: q, ..ArmState::default() }).expect("room");
    writer.twin_state(&TwinState { stamp_ns, dof, q, ..TwinState::default() }).expect("room");
    writer.twin_gap(&TwinGap { stamp_ns, dof, ..TwinGap::default() }).expect("room");
    writer.object_pose(&ObjectPose { stamp_ns, ..ObjectPose::default() }).expect("room");
    writer.camera_info(&CameraInfo { stamp_ns, ..CameraInfo::default() }).expect("room");
    writer.event(&Event::new(EventLevel::Info, EventSource::Bridge, "begun")).expect("room");
    let header = ImageHeader {
        stamp_ns,
        width: 1,
        height: 1,
        stride: 3,
        encoding: PixelEncoding::Rgb8,
        ..ImageHeader::default()
    };
    writer.image(CAMERA_COLOR, &header, &[0; 3]).expect("room");
    writer.finish().expect("a whole clip");
    let (mut messages, mut found) = (RawMessages::open(path).expect("a clip"), BTreeMap::new());
    while let Some(message) = messages.read_next().expect("a message") {
        found.insert(message.topic.to_owned(), message.definition.to_vec());
    }
    found
}

/// Every text in a JSON value, keys included, that begins as a topic does.
fn topics(value: &Value, found: &mut Vec<String>) {
    let mut take = |text: &str| found.extend(text.starts_with('/').then(|| text.to_owned()));
    match value {
        Value::String(text) => take(text),
        Value::Array(list) => list.iter().for_each(|value| topics(value, found)),
        Value::Object(map) => {
            map.keys().for_each(|key| take(key));
            map.iter().filter(|(key, _)| *key != "publish").for_each(|(_, value)| topics(value, found));
        }
        _ => {}
    }
}

#[test]
fn every_topic_and_every_curve_of_the_layout_is_in_a_clip() {
    let lab = tempfile::tempdir().expect("a folder");
    let recorded = recorded(&lab.path().join("clip.mcap"));
    let text = std::fs::read_to_string(root().join("config/foxglove_layout.json")).expect("the layout");
    let layout: Value = serde_json::from_str(&text).expect("JSON");
    let mut shown = Vec::new();
    topics(&layout["configById"], &mut shown);
    assert!(shown.len() > 20, "{shown:?}");
    for path in shown.iter().filter(|path| !LIVE.contains(&path.as_str())) {
        let (topic, field) = path.split_once('.').unwrap_or((path, ""));
        let definition = recorded.get(topic).unwrap_or_else(|| panic!("no {topic} in {:?}", recorded.keys()));
        let field = field.split('[').next().unwrap_or(field).as_bytes();
        assert!(definition.windows(field.len().max(1)).any(|part| part == field || field.is_empty()), "{path}");
    }
    // And the panels stand in the arrangement, each once.
    let arranged = layout["layout"].to_string();
    let panels = layout["configById"].as_object().expect("panels");
    assert!(panels.keys().all(|panel| arranged.matches(&format!("\"{panel}\"")).count() == 1), "{arranged}");
    for part in ["/robot_description", "/tf", "/tf_static", "/camera/info"] {
        assert!(recorded.contains_key(part), "{part}");
    }
}
