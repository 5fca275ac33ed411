//! ROS 2 bags with the faults that foreign logs have: each is mended and told, or refused with a remedy.

use mcap::records::MessageHeader;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::lens::Distortion;
use shared_mem::recording::{
    Cameras, Clip, ClipMessages, Payload, Picture, PictureKind, ReadError, Session, for_pictures, read_clip,
};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

const MEASURED: &str = "/franka_robot_state_broadcaster/measured_joint_states";
const DESIRED: &str = "/franka_robot_state_broadcaster/desired_joint_states";
const JOINT_STATE: &str = "sensor_msgs/msg/JointState";
/// Names of the two joints of the cell below.
const NAMES: [&str; 2] = ["shoulder", "elbow"];

#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn put<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
        self
    }
    fn u32(self, value: usize) -> Self {
        self.put(u32::try_from(value).expect("a small number").to_le_bytes())
    }
    fn text(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() + 1);
        cdr.0.extend(text.as_bytes());
        cdr.0.push(0);
        cdr
    }
    fn numbers(self, values: &[f64]) -> Self {
        values.iter().fold(self, |cdr, v| cdr.put(v.to_le_bytes()))
    }
    fn bytes(self, bytes: &[u8]) -> Self {
        let mut cdr = self.u32(bytes.len());
        cdr.0.extend(bytes);
        cdr
    }
    fn header(self, stamp_ns: u64, frame: &str) -> Self {
        self.u32((stamp_ns / 1_000_000_000) as usize).u32((stamp_ns % 1_000_000_000) as usize).text(frame)
    }
    fn message(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

fn joint_state(stamp_ns: u64, names: &[&str], q: &[f64], dq: &[f64]) -> Vec<u8> {
    let cdr = Cdr::default().header(stamp_ns, "").u32(names.len());
    let cdr = names.iter().fold(cdr, |cdr, name| cdr.text(name));
    cdr.u32(q.len()).numbers(q).u32(dq.len()).numbers(dq).u32(0).message()
}

fn pose(stamp_ns: u64, frame: &str, xyzw: [f64; 4]) -> Vec<u8> {
    Cdr::default().header(stamp_ns, frame).numbers(&[0.5, 0.1, 0.05]).numbers(&xyzw).message()
}

/// A bag that is being written.
struct Bag {
    path: PathBuf,
    mcap: mcap::Writer<BufWriter<File>>,
    _folder: tempfile::TempDir,
}

impl Bag {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("bag.mcap");
        let file = BufWriter::new(File::create_new(&path).expect("a new file"));
        Self { path, mcap: mcap::WriteOptions::new().profile("ros2").create(file).expect("room"), _folder: folder }
    }

    fn put(&mut self, topic: &str, name: &str, log_time_ns: u64, data: &[u8]) {
        let schema = self.mcap.add_schema(name, "ros2msg", b"").expect("room");
        let channel_id = self.mcap.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("room");
        let header = MessageHeader { channel_id, sequence: 0, log_time: log_time_ns, publish_time: log_time_ns };
        self.mcap.write_to_known_channel(&header, data).expect("room");
    }

    fn joints(&mut self, topic: &str, stamp_ns: u64, names: &[&str], q: &[f64]) {
        let dq: Vec<f64> = q.iter().map(|q| 0.1 * q).collect();
        self.put(topic, JOINT_STATE, stamp_ns, &joint_state(stamp_ns, names, q, &dq));
    }

    fn camera(&mut self, model: &str, d: &[f64]) {
        let k = [600.0, 0.0, 320.0, 0.0, 610.0, 240.0, 0.0, 0.0, 1.0];
        let info = Cdr::default().header(7, "camera").u32(480).u32(640).text(model).u32(d.len()).numbers(d);
        self.put("/camera_info", "sensor_msgs/msg/CameraInfo", 3, &info.numbers(&k).numbers(&[0.0; 21]).message());
    }

    fn read(mut self, kind: ClipKind, cell: &Cell) -> Result<Clip, String> {
        self.mcap.finish().expect("room");
        read_clip(&self.path, kind, cell).map_err(|e| e.to_string())
    }
}

fn cell() -> Cell {
    let text = "[robot]\njoints = [\"shoulder\", \"elbow\"]\nbase_frame = \"base\"\n";
    Cell::parse(text, Path::new("cell.toml")).expect("a valid cell")
}

/// Position of joint `j` in row `i`: a slow motion.
fn q(i: u64, j: usize) -> f64 {
    (i as f64 * 0.01).sin() * 0.5 + j as f64
}

/// 200 rows at 1 kHz on both topics, changed by `change(row, stamp, q)` on the measured one.
fn excitation(mut change: impl FnMut(u64, &mut u64, &mut [f64; 2])) -> Bag {
    let mut bag = Bag::new();
    for i in 0..200 {
        let stamp = 3_000_000_000 + i * 1_000_000;
        bag.joints(DESIRED, stamp, &NAMES, &[q(i, 0), q(i, 1)]);
        let (mut changed, mut row) = (stamp, [q(i, 0), q(i, 1)]);
        change(i, &mut changed, &mut row);
        bag.joints(MEASURED, changed, &NAMES, &row);
    }
    bag
}

fn read(bag: Bag) -> Clip {
    bag.read(ClipKind::Excitation, &cell()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_clean_bag_loads_without_a_word() {
    let clip = read(excitation(|_, _, _| {}));
    assert_eq!((clip.measured.len(), clip.desired.len(), clip.measured.dof), (200, 200, 2));
    assert_eq!(clip.measured.q_row(7), [q(7, 0), q(7, 1)]);
    assert_eq!(clip.measured.dq_row(7), Some(&[0.1 * q(7, 0), 0.1 * q(7, 1)][..]));
    assert_eq!(clip.measured.tau_row(7), None);
    assert_eq!((clip.warnings, clip.damage), (vec![], None));
}

#[test]
fn a_missing_topic_is_an_error_that_lists_what_is_there_and_where_to_say_so() {
    let mut bag = Bag::new();
    bag.joints("/joint_states", 1, &NAMES, &[0.0, 0.0]);
    let error = bag.read(ClipKind::Excitation, &cell()).unwrap_err();
    for part in [MEASURED, "`/joint_states` (sensor_msgs/msg/JointState)", "`[topics] measured"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_topic_on_which_nothing_came_and_a_file_that_was_cut_are_told_from_a_wrong_name() {
    let mut bag = Bag::new();
    bag.joints(MEASURED, 1, &NAMES, &[0.0, 0.0]);
    let schema = bag.mcap.add_schema(JOINT_STATE, "ros2msg", b"").expect("room");
    bag.mcap.add_channel(schema, DESIRED, "cdr", &BTreeMap::new()).expect("room");
    let error = bag.read(ClipKind::Excitation, &cell()).unwrap_err();
    assert!(error.contains("nobody published desired joints") && !error.contains("[topics]"), "{error}");
    let mut bag = Bag::new();
    for i in 0..2000 {
        bag.joints(MEASURED, i * 1_000_000 + 1, &NAMES, &[q(i, 0), q(i, 1)]);
    }
    bag.mcap.finish().expect("room");
    let whole = std::fs::read(&bag.path).expect("a bag");
    std::fs::write(&bag.path, &whole[..whole.len() / 4]).expect("a shorter one");
    let error = read_clip(&bag.path, ClipKind::Excitation, &cell()).unwrap_err().to_string();
    assert!(error.contains("is damaged") && error.contains("record it again"), "{error}");
}

#[test]
fn a_topic_of_another_type_is_an_error_that_names_both() {
    let mut bag = Bag::new();
    bag.put(MEASURED, "sensor_msgs/msg/Imu", 1, &[0, 1, 0, 0]);
    let error = bag.read(ClipKind::Excitation, &cell()).unwrap_err();
    assert!(error.contains("sensor_msgs/msg/Imu") && error.contains(JOINT_STATE), "{error}");
}

#[test]
fn joints_are_put_into_the_order_of_the_model_on_each_topic() {
    let mut bag = Bag::new();
    for i in 0..20 {
        bag.joints(MEASURED, i * 1_000_000 + 1, &["elbow", "shoulder"], &[q(i, 1), q(i, 0)]);
        bag.joints(DESIRED, i * 1_000_000 + 1, &["gripper", "shoulder", "elbow"], &[9.0, q(i, 0), q(i, 1)]);
    }
    let clip = read(bag);
    assert_eq!(clip.joint_names, NAMES);
    assert_eq!(clip.measured.q_row(5), [q(5, 0), q(5, 1)]);
    assert_eq!(clip.desired.q_row(5), [q(5, 0), q(5, 1)]);
    let turned = clip.reorder(&["elbow".into(), "shoulder".into()]).expect("both are there");
    assert_eq!(turned.measured.q_row(5), [q(5, 1), q(5, 0)]);
    let error = turned.reorder(&["wrist".into()]).unwrap_err().to_string();
    assert!(error.contains("[wrist]") && error.contains("[elbow, shoulder]"), "{error}");
}

#[test]
fn a_missing_joint_is_an_error_that_lists_both_sides() {
    let mut bag = Bag::new();
    bag.joints(MEASURED, 1, &["shoulder", "wrist"], &[0.0, 0.0]);
    bag.joints(DESIRED, 1, &NAMES, &[0.0, 0.0]);
    let error = bag.read(ClipKind::Excitation, &cell()).unwrap_err();
    assert!(error.contains("[shoulder, elbow]") && error.contains("[shoulder, wrist]"), "{error}");
}

#[test]
fn one_row_of_nan_is_left_out_and_told_many_are_an_error() {
    let clip = read(excitation(|i, _, row| {
        if i == 60 {
            row[1] = f64::NAN
        }
    }));
    assert_eq!(clip.measured.len(), 199);
    let told = clip.warnings.iter().find(|w| w.contains("not finite")).expect("a warning");
    assert!(told.contains(MEASURED) && told.contains("row 60") && told.contains("`elbow`"), "{told}");
    let bag = excitation(|i, _, row| {
        if i % 50 == 0 {
            row[0] = f64::INFINITY
        }
    });
    let error = bag.read(ClipKind::Excitation, &cell()).unwrap_err();
    for part in ["bag.mcap", MEASURED, "row 0", "`shoulder`", "4 of 200", "record again"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn stamps_that_go_back_or_repeat_are_sorted_and_told() {
    let clip = read(excitation(|i, stamp, _| match i {
        50 => *stamp += 2_500_000,
        80 => *stamp -= 1_000_000,
        _ => {}
    }));
    assert!(clip.measured.stamps_ns.windows(2).all(|w| w[0] < w[1]));
    assert_eq!(clip.measured.len(), 199);
    assert!(clip.warnings.iter().any(|w| w.contains("go back") && w.contains("repeat")), "{:?}", clip.warnings);
}

#[test]
fn a_glitch_in_the_first_row_is_left_out_and_told() {
    let clip = read(excitation(|i, _, row| {
        if i == 0 {
            *row = [0.0, 0.0]
        }
    }));
    assert_eq!(clip.measured.stamps_ns[0], 3_001_000_000);
    assert!(clip.warnings.iter().any(|w| w.contains("first row")), "{:?}", clip.warnings);
}

#[test]
fn lost_packets_are_counted() {
    let mut bag = Bag::new();
    for i in (0..200).filter(|i| !(90..93).contains(i)) {
        let stamp = 3_000_000_000 + i * 1_000_000;
        bag.joints(DESIRED, stamp, &NAMES, &[q(i, 0), q(i, 1)]);
        bag.joints(MEASURED, stamp, &NAMES, &[q(i, 0), q(i, 1)]);
    }
    let warnings = read(bag).warnings;
    assert!(warnings.iter().any(|w| w.contains("1 gaps, about 3 of 200") && w.contains("row 89")), "{warnings:?}");
}

#[test]
fn a_topic_in_degrees_is_told() {
    let clip = read(excitation(|_, _, row| *row = row.map(f64::to_degrees)));
    assert!(clip.warnings.iter().any(|w| w.contains("57 times") && w.contains("measured")), "{:?}", clip.warnings);
}

#[test]
fn two_publishers_on_one_topic_are_told() {
    let clip = read(excitation(|i, _, row| {
        if i % 2 == 0 {
            row[0] += 0.7
        }
    }));
    assert!(clip.warnings.iter().any(|w| w.contains("two nodes")), "{:?}", clip.warnings);
}

#[test]
fn columns_that_a_driver_never_filled_in_count_as_not_logged() {
    let mut bag = Bag::new();
    for i in 0..50 {
        let stamp = i * 1_000_000 + 1;
        let row = [q(i, 0), q(i, 1)];
        bag.put(MEASURED, JOINT_STATE, stamp, &joint_state(stamp, &NAMES, &row, &[f64::NAN, f64::NAN]));
        bag.put(DESIRED, JOINT_STATE, stamp, &joint_state(stamp, &NAMES, &row, &[0.0, 0.7]));
    }
    let clip = read(bag);
    assert!(clip.measured.dq.is_empty() && clip.desired.dq.is_empty());
    assert_eq!(clip.warnings.iter().filter(|w| w.contains("not logged")).count(), 2, "{:?}", clip.warnings);
}

#[test]
fn topics_that_do_not_overlap_in_time_are_told() {
    let clip = read(excitation(|_, stamp, _| *stamp += 60_000_000_000));
    assert!(clip.warnings.iter().any(|w| w.contains("different clocks")), "{:?}", clip.warnings);
}

#[test]
fn poses_and_transforms_are_read_and_a_lost_track_is_told() {
    let free = Cell::parse("[table]\nheight = 0.0\n", Path::new("cell.toml")).expect("a valid cell");
    for (name, has_child) in [("geometry_msgs/msg/PoseStamped", false), ("geometry_msgs/msg/TransformStamped", true)] {
        let mut bag = Bag::new();
        for i in 0..150u64 {
            let quaternion = if i == 100 { [0.0; 4] } else { [0.0, 0.0, 0.6, 0.8] };
            let data = if has_child {
                let cdr = Cdr::default().header(i * 7_000_000, "base").text("object");
                cdr.numbers(&[0.5, 0.1, 0.05]).numbers(&quaternion).message()
            } else {
                pose(i * 7_000_000, "base", quaternion)
            };
            bag.put("/object/pose", name, i, &data);
        }
        let clip = bag.read(ClipKind::FreeMotion, &free).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(clip.object.len(), 149);
        let pose = &clip.object.poses[3];
        assert_eq!((pose.position(), pose.wxyz()), ([0.5, 0.1, 0.05], [0.8, 0.0, 0.0, 0.6]));
        assert!(clip.warnings.iter().any(|w| w.contains("row 100")), "{:?}", clip.warnings);
    }
}

#[test]
fn poses_in_another_frame_than_the_base_are_told() {
    let mut bag = excitation(|_, _, _| {});
    bag.put("/object/pose", "geometry_msgs/msg/PoseStamped", 5, &pose(5, "camera_link", [0.0, 0.0, 0.0, 1.0]));
    let clip = bag.read(ClipKind::ControlHitSlide, &cell()).unwrap_or_else(|e| panic!("{e}"));
    assert!(clip.warnings.iter().any(|w| w.contains("camera_link") && w.contains("base_frame")), "{:?}", clip.warnings);
}

#[test]
fn poses_in_millimetres_and_quaternions_with_w_first_or_of_another_length_are_told() {
    let free = Cell::parse("[table]\nheight = 0.0\n", Path::new("cell.toml")).expect("a valid cell");
    let mut bag = Bag::new();
    for i in 0..20u64 {
        let cdr = Cdr::default().header(i * 7_000_000, "base").numbers(&[512.0, 100.0, 50.0]);
        bag.put("/object/pose", "geometry_msgs/msg/PoseStamped", i, &cdr.numbers(&[2.0, 0.0, 0.0, 0.0]).message());
    }
    let warnings = bag.read(ClipKind::FreeMotion, &free).unwrap_or_else(|e| panic!("{e}")).warnings;
    assert!(warnings.iter().any(|w| w.contains("millimetres")), "{warnings:?}");
    assert!(warnings.iter().any(|w| w.contains("w first")), "{warnings:?}");
    assert!(warnings.iter().any(|w| w.contains("length 2.000 instead of 1")), "{warnings:?}");
}

#[test]
fn pictures_and_calibrations_of_a_bag_are_iterated_in_order() {
    let mut bag = Bag::new();
    let image = Cdr::default().header(5, "camera").u32(1).u32(2).text("bgr8").put([0u8]).u32(6);
    bag.put("/image", "sensor_msgs/msg/Image", 1, &image.bytes(&[3, 2, 1, 6, 5, 4]).message());
    let jpeg = Cdr::default().header(6, "camera").text("jpeg").bytes(&[0xff, 0xd8, 0xff]);
    bag.put("/image/compressed", "sensor_msgs/msg/CompressedImage", 2, &jpeg.message());
    bag.camera("plumb_bob", &[0.1; 5]);
    bag.mcap.finish().expect("room");
    let messages: Vec<_> = ClipMessages::open(&bag.path, &[]).expect("a bag").map(|m| m.expect("decodes")).collect();
    let topics: Vec<_> = messages.iter().map(|m| m.topic.as_str()).collect();
    assert_eq!(topics, ["/image", "/image/compressed", "/camera_info"]);
    match &messages[0].payload {
        Payload::Picture(Picture::Pixels { header, pixels }) => {
            assert_eq!((header.stamp_ns, header.width, pixels.as_slice()), (5, 2, &[1, 2, 3, 4, 5, 6][..]));
        }
        other => panic!("{other:?}"),
    }
    let jpeg = Picture::Compressed { stamp_ns: 6, format: "jpeg".into(), bytes: vec![0xff, 0xd8, 0xff] };
    assert_eq!(messages[1].payload, Payload::Picture(jpeg));
    let Payload::CameraInfo(info) = &messages[2].payload else { panic!("{:?}", messages[2]) };
    assert_eq!((info.intrinsics, info.width), ([600.0, 610.0, 320.0, 240.0], 640));
}

#[test]
fn pictures_of_a_fisheye_and_joints_without_commands_are_read() {
    let mut bag = Bag::new();
    (1..50).for_each(|i| bag.joints(MEASURED, i * 1_000_000, &NAMES, &[q(i, 0), q(i, 1)]));
    bag.camera("equidistant", &[0.1; 4]);
    bag.mcap.finish().expect("room");
    let said = Cameras::of(&bag.path).expect("a bag").said;
    assert!(matches!(&said[..], [(_, Ok(camera))] if camera.distortion == Distortion::Fisheye([0.1; 4])));
    for_pictures::<ReadError>(&bag.path, PictureKind::Color, |_, _| Ok(())).expect("no lens is asked for");
    std::fs::write(bag.path.with_file_name("cell.toml"), cell().to_toml()).expect("room");
    let session = Session::open(&bag.path).expect("a session");
    let clip = session.read_measured(&session.clips[0]).expect("joints");
    assert_eq!((clip.measured.len(), clip.desired.len()), (49, 0));
}

#[test]
fn a_session_without_clips_or_without_cell_toml_says_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = Session::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("cell.toml"), "{error}");
    std::fs::write(folder.path().join("cell.toml"), "[table]\nheight = 0.0\n").expect("room");
    let error = Session::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("[[clip]]"), "{error}");
    let text = folder.path().join("notes.mcap");
    std::fs::write(&text, "these are notes").expect("room");
    let session = Session::open(&text).expect("cell.toml lies beside it");
    let error = session.read(&session.clips[0]).unwrap_err().to_string();
    assert!(error.contains("no MCAP file"), "{error}");
}

const DAY: u64 = 86_400_000_000_000;
/// Unix time, as bags have it.
const BEGIN: u64 = 1_700_000_000_000_000_000;

/// Joints at 1 kHz on both topics and poses at 100 Hz for 0.4 s; `stamp(topic, row, usual)` is what a message's header says,
/// `None` for one that was not recorded.
fn stroke(stamp: impl Fn(&str, u64, u64) -> Option<u64>) -> Bag {
    let mut bag = Bag::new();
    for i in 0..400 {
        let usual = BEGIN + i * 1_000_000;
        for topic in [DESIRED, MEASURED] {
            if let Some(stamp) = stamp(topic, i, usual) {
                let q = [q(i, 0), q(i, 1)];
                let dq: Vec<f64> = q.iter().map(|q| 0.1 * q).collect();
                bag.put(topic, JOINT_STATE, usual, &joint_state(stamp, &NAMES, &q, &dq));
            }
        }
        if i % 4 == 0
            && let Some(stamp) = stamp("/object/pose", i / 4, usual)
        {
            bag.put("/object/pose", "geometry_msgs/msg/PoseStamped", usual, &pose(stamp, "base", [0.0, 0.0, 0.0, 1.0]));
        }
    }
    bag
}

#[test]
fn a_row_with_a_stamp_of_zero_or_a_day_off_is_left_out_and_the_rest_is_as_if_it_had_not_been_recorded() {
    let read = |bag: Bag| bag.read(ClipKind::ControlHitSlide, &cell()).unwrap_or_else(|e| panic!("{e}"));
    for topic in [DESIRED, MEASURED, "/object/pose"] {
        for row in [0, 41, 99] {
            let without = read(stroke(|t, i, usual| (t != topic || i != row).then_some(usual)));
            for wrong in [0, BEGIN + DAY, BEGIN - DAY] {
                let clip = read(stroke(|t, i, usual| Some(if t == topic && i == row { wrong } else { usual })));
                let told = clip.warnings.iter().filter(|w| w.contains(topic) && w.contains("left out")).count();
                let named = format!("row {row}: ");
                assert!(told == 1 && clip.warnings.iter().any(|w| w.contains(&named)), "{:?}", clip.warnings);
                let rest = |clip: &Clip| (clip.measured.clone(), clip.desired.clone(), clip.object.clone());
                assert_eq!(rest(&clip), rest(&without), "{topic}, row {row}, {wrong}");
            }
        }
    }
}

#[test]
fn rows_of_many_days_and_poses_of_another_day_are_refused_in_one_line() {
    let read = |bag: Bag| bag.read(ClipKind::ControlHitSlide, &cell());
    let scattered = read(stroke(|topic, i, usual| Some(if topic == MEASURED { usual + i * DAY } else { usual })));
    let error = scattered.expect_err("no clip");
    assert!(error.contains(MEASURED) && error.contains("400 places") && !error.contains('\n'), "{error}");
    let apart = read(stroke(|topic, _, usual| Some(if topic == "/object/pose" { usual + DAY } else { usual })));
    let error = apart.expect_err("poses of another day");
    assert!(error.contains("/object/pose") && error.contains("different clocks") && !error.contains('\n'), "{error}");
}
