//! Where clips say that they come from: in own ones, in those of other programs, there and back, and where a file lies about it.

use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::origin::ArmOrigin;
use shared_mem::origin::{Origin, Origins};
use shared_mem::recording::{
    ClipInfo, ClipWriter, Format, Order, Provenance, RawMessages, Session, export_session, read_clip, read_clip_info,
    read_origins,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const CELL: &str = "[robot]\njoints = [\"a\", \"b\"]\n[[clip]]\nfile = \"run.mcap\"\nkind = \"excitation\"\n";
const ROBOT: &str = "fci://172.16.0.2";

fn origin(arm: &str) -> Origin {
    arm.parse().expect("an arm")
}

/// Half a second of each of these arms, one after the other.
fn write(path: &Path, arms: &[&str], info: &ClipInfo) -> ClipWriter {
    let mut writer = ClipWriter::create(path, info).expect("a new file");
    for row in 0..500 * arms.len() as u64 {
        let origin = ArmOrigin::new(arms[row as usize / 500]);
        let (stamp_ns, q) =
            (5_000_000_000 + row * 1_000_000, std::array::from_fn(|j| if j < 2 { 1e-3 * row as f64 } else { 0.0 }));
        let state =
            ArmState { stamp_ns, device_ns: stamp_ns, cycle: row, dof: 2, q, q_d: q, origin, ..ArmState::default() };
        writer.arm_state(&state).expect("room");
    }
    writer
}

/// What reading a clip and looking at its head say about where it comes from: the same.
fn read(path: &Path) -> Origins {
    let cell = Cell::parse(CELL, path).expect("a cell");
    let origins = read_clip(path, ClipKind::Excitation, &cell).expect("a clip").origins;
    assert_eq!(read_origins(path).expect("a clip"), origins);
    origins
}

#[test]
fn a_clip_says_once_which_arm_its_states_are_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    for (name, arm) in [("robot", ROBOT), ("sim", "sim"), ("replay", "replay:///data/clip_04.mcap")] {
        write(&file(name), &[arm], &ClipInfo::default()).finish().expect("room");
        assert_eq!(read(&file(name)), origin(arm).into());
        assert!(read_clip_info(&file(name)).expect("a clip").is_some_and(|info| info.origins == origin(arm).into()));
    }
    // Each state says it on shared memory, and none in the file.
    let bytes = std::fs::read(file("robot")).expect("a file");
    assert!(bytes.windows(10).filter(|window| *window == b"172.16.0.2").count() <= 2);
    let mut messages = RawMessages::open(&file("robot")).expect("a clip");
    while let Some(message) = messages.read_next().expect("a message") {
        assert!(!message.data.windows(6).any(|window| window == b"fci://"));
    }
    assert_eq!(messages.origins(), origin(ROBOT).into());

    // A clip of before says nothing.
    write(&file("old"), &[""], &ClipInfo::default()).finish().expect("room");
    assert!(read(&file("old")).is_unknown());
    // A recorder that is killed has said it.
    let mut killed = write(&file("killed"), &[ROBOT], &ClipInfo::default());
    killed.flush().expect("room");
    std::mem::forget(killed);
    assert_eq!(read(&file("killed")), origin(ROBOT).into());
}

#[test]
fn an_arm_that_is_exchanged_under_way_makes_two_origins_of_one_clip() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("run.mcap");
    write(&file, &["sim", ROBOT, "sim"], &ClipInfo::default()).finish().expect("room");
    let origins = read(&file);
    assert_eq!(origins.iter().collect::<Vec<_>>(), [&Origin::Simulation, &origin(ROBOT)]);
    std::fs::write(folder.path().join("cell.toml"), CELL).expect("room");
    let provenance = Provenance::of(&Session::open(folder.path()).expect("a session"));
    let mixture = provenance.mixture().expect("two sources");
    assert_eq!(mixture, format!("run.mcap: the simulation, run.mcap: the robot at {ROBOT}"));
}

/// The session's one clip in another format, in a folder of its own.
fn exported(session: &Path, to: Format, out: &Path) -> (PathBuf, Vec<String>) {
    let session = Session::open(session).expect("a session");
    let order = Order { to, out, force: false, flange_at: &|_| None, robot: None };
    let done = export_session(&session, order, |_| {}).expect("an export");
    (out.join(&done[0].file), done[0].warnings.clone())
}

#[test]
fn what_a_clip_says_goes_into_bags_and_own_clips_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("cell.toml"), CELL).expect("room");
    write(&folder.path().join("run.mcap"), &[ROBOT], &ClipInfo::default()).finish().expect("room");
    for (to, name) in [(Format::Ros2, "ros2"), (Format::Rosbag2, "rosbag2"), (Format::Own, "own")] {
        let out = folder.path().join(name);
        let (there, warnings) = exported(folder.path(), to, &out);
        assert_eq!(read(&there), origin(ROBOT).into(), "{name}");
        assert!(!warnings.iter().any(|warning| warning.contains("comes from")), "{warnings:?}");
        let back = exported(&out, Format::Own, &folder.path().join(format!("{name}_back"))).0;
        assert_eq!(read(&back), origin(ROBOT).into(), "{name} and back");
    }
    let (there, warnings) = exported(folder.path(), Format::TwinAligner, &folder.path().join("folders"));
    assert_eq!(read(&there), Origin::elsewhere("TwinAligner folder").into());
    assert!(warnings.iter().any(|w| w.contains("no room") && w.contains(ROBOT)), "{warnings:?}");
}

#[test]
fn a_bag_that_says_nothing_was_recorded_elsewhere_and_an_old_clip_as_a_bag_stays_unknown() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("cell.toml"), CELL).expect("room");
    write(&folder.path().join("run.mcap"), &[""], &ClipInfo::default()).finish().expect("room");
    let (bag, _) = exported(folder.path(), Format::Ros2, &folder.path().join("ros2"));
    assert!(read(&bag).is_unknown());
    let foreign = folder.path().join("foreign.mcap");
    with_metadata(&foreign, &[]);
    assert_eq!(read_origins(&foreign).expect("a bag"), Origin::elsewhere("ROS 2 bag").into());
}

/// An MCAP file of another program with these pairs in records about where it comes from.
fn with_metadata(path: &Path, records: &[&[(&str, &str)]]) {
    let mut mcap = mcap::Writer::new(std::fs::File::create(path).expect("a file")).expect("a writer");
    for pairs in records {
        let metadata: BTreeMap<String, String> =
            pairs.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let record = mcap::records::Metadata { name: "twinalign.origin".into(), metadata };
        mcap.write_metadata(&record).expect("room");
    }
    mcap.finish().expect("room");
}

#[test]
fn what_a_file_claims_is_bounded_written_out_and_not_believed_where_it_makes_no_sense() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("run.mcap");
    let of = |records: &[&[(&str, &str)]]| {
        with_metadata(&file, records);
        read_origins(&file).expect("a file")
    };
    let long = "x".repeat(1 << 20);
    let import = of(&[&[("kind", "import"), ("name", &long), ("format", &long)]]);
    assert!(import.iter().count() == 1 && import.to_string().len() < 1000, "{}", import.to_string().len());
    let steering = of(&[&[("kind", "replay"), ("name", "\x1b[2Jclip\n.mcap")]]).to_string();
    assert_eq!(steering, "a replay of \\u{1b}[2Jclip\\n.mcap");
    for nothing in [
        &[][..],
        &[("kind", "")],
        &[("kind", "robot")],
        &[("kind", "robot"), ("name", "a; rm -rf /")],
        &[("kind", "robot"), ("name", &long)],
        &[("kind", "replay"), ("name", "///")],
        &[("kind", "a dream")],
    ] {
        assert!(of(&[nothing]).is_unknown(), "{nothing:?}");
    }
    let hosts: Vec<String> = (0..2000).map(|n| format!("host{n}")).collect();
    let records: Vec<[(&str, &str); 2]> =
        hosts.iter().map(|host| [("kind", "robot"), ("name", host.as_str())]).collect();
    let records: Vec<&[(&str, &str)]> = records.iter().map(|pairs| &pairs[..]).collect();
    assert!(of(&records).iter().count() < 20);
}
