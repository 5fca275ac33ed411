//! A session as ROS 2 bags that are folders: what `ros2 bag info` is told, and the topics by which ROS programs show a robot.

use shared_mem::msg::arm::ArmState;
use shared_mem::recording::{
    ClipInfo, ClipWriter, Exported, Format, Order, RawMessages, RobotModel, Session, Transform, export_session,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

const CELL: &str =
    "[robot]\njoints = [\"a\", \"b\"]\nbase_frame = \"base\"\n[[clip]]\nfile = \"run.mcap\"\nkind = \"excitation\"\n";
const ROWS: u64 = 100;
const MS: u64 = 1_000_000;

fn record(folder: &Path) -> Session {
    std::fs::write(folder.join("cell.toml"), CELL).expect("room");
    let mut writer = ClipWriter::create(&folder.join("run.mcap"), &ClipInfo::default()).expect("a new file");
    for i in 0..ROWS {
        let q = std::array::from_fn(|joint| if joint < 2 { 1e-3 * i as f64 } else { 0.0 });
        let stamp_ns = 5_000_000_000 + i * MS;
        writer
            .arm_state(&ArmState { stamp_ns, device_ns: stamp_ns, cycle: i, dof: 2, q, q_d: q, ..ArmState::default() })
            .expect("room");
    }
    writer.finish().expect("room");
    Session::open(folder).expect("a session")
}

fn export(session: &Session, to: Format, out: &Path, force: bool) -> Vec<Exported> {
    let frame = |parent: &str, child: &str, x: f64| Transform {
        parent: parent.into(),
        child: child.into(),
        position: [x, 0.0, 0.0],
        wxyz: [1.0, 0.0, 0.0, 0.0],
    };
    let robot = RobotModel {
        description: "<robot name='r'/>".into(),
        root: "base".into(),
        joints: vec!["a".into(), "b".into()],
        fixed: vec![frame("b", "tip", 0.1)],
        frames_at: Box::new(move |names, q| {
            assert_eq!(names, ["a", "b"]);
            Some(vec![frame("base", "a", q[0]), frame("a", "b", q[1])])
        }),
    };
    let robot = Arc::new(robot);
    let order = Order { to, out, force, flange_at: &|_| None, robot: Some(&robot) };
    export_session(session, order, |_| {}).expect("an export")
}

/// Messages by topic, and their encodings by type.
fn topics(file: &Path) -> BTreeMap<String, (String, u64)> {
    let (mut messages, mut found) = (RawMessages::open(file).expect("a bag"), BTreeMap::new());
    while let Some(message) = messages.read_next().expect("a message") {
        assert!(!message.definition.is_empty(), "{} has no definition", message.type_name);
        found.entry(message.topic.to_owned()).or_insert((message.type_name.to_owned(), 0)).1 += 1;
    }
    found
}

#[test]
fn a_bag_is_a_folder_with_its_contents_told_and_the_robot_in_it() {
    let lab = tempfile::tempdir().expect("a folder");
    let session = record(lab.path());
    let out = lab.path().join("bags");
    let done = export(&session, Format::Rosbag2, &out, false);
    assert_eq!(done[0].file, Path::new("run/run_0.mcap"));
    let found = topics(&out.join("run/run_0.mcap"));
    let count = |topic: &str| found.get(topic).map(|(kind, count)| (kind.as_str(), *count));
    assert_eq!(count("/joint_states"), Some(("sensor_msgs/msg/JointState", ROWS)));
    // A hundred a second.
    assert_eq!(count("/tf"), Some(("tf2_msgs/msg/TFMessage", ROWS / 10)));
    assert_eq!(count("/tf_static"), Some(("tf2_msgs/msg/TFMessage", 1)));
    assert_eq!(count("/robot_description"), Some(("std_msgs/msg/String", 1)));

    let text = std::fs::read_to_string(out.join("run/metadata.yaml")).expect("a file");
    let all: u64 = found.values().map(|(_, count)| count).sum();
    for line in [
        "  version: 9\n".to_owned(),
        format!("  duration:\n    nanoseconds: {}\n", (ROWS - 1) * MS),
        format!("  message_count: {all}\n  topics_with_message_count:\n"),
        "  relative_file_paths:\n    - \"run_0.mcap\"\n".to_owned(),
    ] {
        assert!(text.contains(&line), "{line} is not in\n{text}");
    }
    assert_eq!(text.matches("durability: transient_local").count(), 2, "{text}");
    for (topic, (kind, count)) in &found {
        let block = text.split("- topic_metadata:").find(|block| block.contains(&format!("name: \"{topic}\"\n")));
        let block = block.unwrap_or_else(|| panic!("{topic} is not in\n{text}"));
        assert!(
            block.contains(&format!("type: {kind}\n")) && block.contains(&format!("message_count: {count}\n")),
            "{block}"
        );
        assert!(block.contains("type_description_hash: RIHS01_"), "{block}");
    }
}

#[test]
fn it_is_read_like_any_bag_and_written_over_where_that_is_asked_for() {
    let lab = tempfile::tempdir().expect("a folder");
    let session = record(lab.path());
    let out = lab.path().join("bags");
    export(&session, Format::Rosbag2, &out, false);
    let bags = Session::open(&out).expect("a session");
    let (clip, own) = (bags.read(&bags.clips[0]).expect("a clip"), session.read(&session.clips[0]).expect("a clip"));
    assert_eq!((&clip.measured.q, &clip.joint_names), (&own.measured.q, &own.joint_names));
    export(&session, Format::Rosbag2, &out, true);
    // A bag of a bag keeps its name.
    let done = export(&bags, Format::Rosbag2, &lab.path().join("again"), false);
    assert_eq!(done[0].file, Path::new("run/run_0.mcap"));
    // The file alone holds the same.
    let single = export(&session, Format::Ros2, &lab.path().join("files"), false);
    assert_eq!(single[0].file, Path::new("run.mcap"));
    assert_eq!(topics(&lab.path().join("files/run.mcap")), topics(&out.join("run/run_0.mcap")));
}
