//! Logs that the tools of their own formats wrote (`make_fixtures.py`), imported: the session holds what was written.

use crate::lab;
use crate::lab::{ROWS, fixture, holds_the_motion, imported, motion};
use import::Outcome;
use shared_mem::cell::ClipKind;
use shared_mem::origin::Origin;
use shared_mem::recording::{Format, Order, Session, export_session};

const EXACT: f64 = 1e-12;

fn fr3() -> Vec<String> {
    (1..=7).map(|i| format!("fr3_joint{i}")).collect()
}

#[test]
fn ros2_bags_of_both_storages_hold_what_was_written() {
    for (name, format) in [
        ("rosbag2_mcap", "ROS 2 bag (mcap)"),
        ("rosbag2_sqlite3", "ROS 2 bag (sqlite3)"),
        ("rosbag2_mcap/rosbag2_mcap.mcap", "ROS 2 bag (mcap)"),
        ("rosbag2_sqlite3/rosbag2_sqlite3.db3", "ROS 2 bag (sqlite3)"),
    ] {
        let lab = imported(name);
        let clip = lab.clip(0);
        holds_the_motion(&clip, (0, ROWS), 7, EXACT);
        assert_eq!(clip.measured.stamps_ns[0], 1_700_000_000_000_000_000);
        assert_eq!(clip.joint_names, fr3());
        let tau = clip.measured.tau_row(9).expect("tau_J");
        assert!((tau[3] - (5.0 + motion(9, 3, lab::LAG).0)).abs() < EXACT);
        assert!(!clip.torques_end_at_rows, "as the bag itself is read");
        assert_eq!(lab.session.cell.robot.as_ref().and_then(|robot| robot.model.as_deref()), Some("fr3"));
        let Outcome::Done { clips, .. } = &lab.outcome else { panic!("open") };
        assert_eq!(clips[0].format, format);
        let pictures: Vec<_> = clips[0].left_out.iter().map(|out| (out.what.as_str(), out.count)).collect();
        assert_eq!(pictures, [("/camera/color/image_raw", 1)], "counted");
    }
}

#[test]
fn a_bag_reads_the_same_imported_and_as_it_is() {
    let lab = imported("rosbag2_mcap");
    let cell = lab.session.cell.clone();
    let bag = fixture("rosbag2_mcap/rosbag2_mcap.mcap");
    let own = shared_mem::recording::read_clip(&bag, ClipKind::Excitation, &cell).expect("a bag");
    let clip = lab.clip(0);
    assert!(clip.measured == own.measured, "measured");
    assert!(clip.desired == own.desired, "desired");
    assert!(own.desired.tau_row(0).is_some(), "torques and all");
    assert_eq!(own.origins, Origin::elsewhere("ROS 2 bag").into());
    assert_eq!(Some(clip.origins), Origin::import("rosbag2_mcap", "ROS 2 bag (mcap)").map(Into::into));
}

#[test]
fn what_a_bag_says_about_where_it_comes_from_is_brought_back() {
    let lab = imported("rosbag2_mcap");
    let out = lab.folder.path().join("bags");
    let order = Order { to: Format::Ros2, out: &out, force: false, flange_at: &|_| None, robot: None };
    let bags = export_session(&lab.session, order, |_| {}).expect("an export");
    let back = lab.folder.path().join("back");
    let outcome = lab::run(&out.join(&bags[0].file), &back).expect("a bag");
    assert!(matches!(outcome, Outcome::Done { .. }), "{outcome:?}");
    let session = Session::open(&back).expect("a session");
    let clip = session.read(&session.clips[0]).expect("a clip");
    assert_eq!(clip.origins, lab.clip(0).origins, "the import of before, and not of the bag between");
}

#[test]
fn ros1_bags_hold_franka_states_joint_states_and_poses_in_every_compression() {
    for name in ["franka_state.bag", "joint_states_bz2.bag", "joint_states_lz4.bag"] {
        let lab = imported(name);
        let clip = lab.clip(0);
        holds_the_motion(&clip, (0, ROWS), 7, EXACT);
        assert_eq!(clip.object.len(), ROWS, "{name}");
        let [x, y, z] = clip.object.poses[10].position();
        assert!((x - 0.51).abs() < EXACT && (y - 0.1).abs() < EXACT && (z - 0.05).abs() < EXACT);
        assert_eq!(clip.kind, ClipKind::Excitation, "until cell.toml describes the object");
        // A model would be needed to tell, where the robot's own driver does not.
        assert_eq!(clip.measured.tau_row(0).is_some(), name.starts_with("franka"), "{}", lab.why("measured.torque"));
    }
}

#[test]
fn lerobot_data_sets_of_both_versions_are_an_episode_a_clip() {
    for name in ["lerobot_v21", "lerobot_v3"] {
        let lab = imported(name);
        assert_eq!(lab.session.clips.len(), 2);
        // Single precision, in degrees.
        holds_the_motion(&lab.clip(0), (0, ROWS), 5, 1e-6);
        holds_the_motion(&lab.clip(1), (0, 40), 5, 1e-6);
        assert_eq!(
            lab.clip(0).joint_names,
            ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
        );
        assert!(lab.why("joints").contains("gripper"), "{}", lab.why("joints"));
        assert!(lab.why("measured.q_unit").contains("no joint turns that far"), "{}", lab.why("measured.q_unit"));
        let Outcome::Done { clips, .. } = &lab.outcome else { panic!("open") };
        assert_eq!(clips[0].left_out[0].what, "observation.images.front");
    }
}

#[test]
fn tables_and_archives_hold_what_was_written() {
    for name in ["plain.csv", "log.npz", "small.npz"] {
        let lab = imported(name);
        holds_the_motion(&lab.clip(0), (0, ROWS), 7, EXACT);
        assert!(lab.why("measured.torque").contains("no model"), "{name}: {}", lab.why("measured.torque"));
    }
}

#[test]
fn degrees_milliseconds_another_order_and_a_turned_joint_are_put_right_with_reasons() {
    let lab = imported("degrees.tsv");
    let clip = lab.clip(0);
    assert_eq!(clip.joint_names, ["base", "shoulder", "elbow"]);
    for row in 0..ROWS {
        assert_eq!(clip.measured.stamps_ns[row], row as u64 * lab::STEP_NS);
        for i in 0..3 {
            let (q, dq) = motion(row, i, lab::LAG);
            assert!((clip.measured.q_row(row)[i] - 3.0 * q).abs() < EXACT);
            assert!((clip.measured.dq_row(row).expect("dq")[i] - 3.0 * dq).abs() < 1e-11);
            assert!((clip.desired.q_row(row)[i] - 3.0 * motion(row, i, 0.0).0).abs() < EXACT, "row {row}, joint {i}");
        }
    }
    for (line, told) in [
        ("measured.stamp_unit", "50 rows a second in milliseconds"),
        ("measured.q_unit", "no joint turns that far"),
        ("measured.dq_unit", "deg/s"),
        ("desired.q", "order of the measured joints"),
        ("desired.sign", "joint 3 moves against"),
        ("desired.shift", "follows its commands by 30 ms"),
    ] {
        assert!(lab.why(line).contains(told), "{line}: {}", lab.why(line));
    }
}

#[test]
fn both_logs_of_libfranka_hold_what_was_written() {
    for name in ["libfranka.csv", "libfranka_old.csv"] {
        let lab = imported(name);
        let clip = lab.clip(0);
        holds_the_motion(&clip, (0, ROWS), 7, 1e-5);
        assert_eq!(clip.joint_names, fr3());
        assert!(clip.torques_end_at_rows && clip.measured.tau_row(0).is_some());
        assert!(lab.why("measured.stamp_unit").contains("milliseconds"));
    }
}

#[test]
fn a_motion_of_sage_is_cut_to_its_events() {
    let lab = imported("sage_motion");
    let clip = lab.clip(0);
    holds_the_motion(&clip, (5, 46), 5, EXACT);
    assert_eq!(clip.joint_names[2], "elbow_flex");
}

#[test]
fn a_folder_of_logs_is_one_session_and_the_second_import_is_one_command() {
    let lab = tempfile::tempdir().expect("a folder");
    let week = lab.path().join("week");
    std::fs::create_dir(&week).expect("room");
    for name in ["monday.bag", "tuesday.bag", ".hidden.bag"] {
        std::fs::copy(fixture("joint_states_lz4.bag"), week.join(name)).expect("room");
    }
    let (first, again) = (lab.path().join("first"), lab.path().join("again"));
    let outcome = lab::run(&week, &first).expect("an import");
    let Outcome::Done { clips, .. } = outcome else { panic!("open") };
    let names: Vec<_> = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    assert_eq!(names, ["monday.mcap", "tuesday.mcap"]);
    let (files, mapping) = ([week], first.join("import.toml"));
    let order = import::Order { mapping: Some(&mapping), ..lab::order(&files, &again, &mapping) };
    let outcome = import::import(order, |_, _| {}).expect("the second import");
    assert!(matches!(&outcome, Outcome::Done { notes, .. } if notes.is_empty()), "{outcome:?}");
    for file in names {
        let same = |folder: &std::path::Path| {
            let session = shared_mem::recording::Session::open(folder).expect("a session");
            let clip = session.read(&session.clips[0]).expect("a clip");
            (clip.measured, clip.desired, clip.object)
        };
        assert_eq!(same(&first), same(&again), "{file}");
    }
    // What was there is kept.
    let error = import::import(order, |_, _| {}).expect_err("it is there").to_string();
    assert!(error.contains("--force") && error.lines().count() == 1, "{error}");
    import::import(import::Order { force: true, ..order }, |_, _| {}).expect("a replacement");
}

#[test]
fn what_cannot_be_known_is_asked_once() {
    let lab = tempfile::tempdir().expect("a folder");
    let (out, questions) = (lab.path().join("session"), lab.path().join("import.toml"));
    let files = [fixture("unnamed.csv")];
    let order = lab::order(&files, &out, &questions);
    let outcome = import::import(order, |_, _| {}).expect("questions");
    let Outcome::Open { file, notes } = outcome else { panic!("nothing was asked") };
    assert!(file == questions && !out.exists());
    let open: Vec<&str> = notes.iter().filter(|note| note.open).map(|note| note.line.as_str()).collect();
    assert_eq!(open, ["measured.q", "measured.rate", "desired.q"]);
    // As it stands it is refused, by the first line that is open.
    let given = import::Order { mapping: Some(&questions), ..order };
    let error = import::import(given, |_, _| {}).expect_err("open lines").to_string();
    assert!(error.contains("[measured] q") && error.lines().count() == 1, "{error}");
    // Its questions kept where somebody may have begun to answer.
    let kept = import::import(order, |_, _| {}).expect_err("it is there").to_string();
    assert!(kept.contains("fill in its open lines, then: ") && kept.contains("--force"), "{kept}");
    let text = std::fs::read_to_string(&questions).expect("the file");
    let (measured, desired) = text.split_once("[desired]").expect("two blocks");
    let answer = |block: &str, columns: [u32; 2]| {
        let [a, b] = columns;
        block
            .replace("\nq = []", &format!("\nq = [\"column[{a}]\", \"column[{b}]\"]"))
            .replace("rate = 0.0", "rate = 50.0")
    };
    let text = format!("{}[desired]{}", answer(measured, [1, 2]), answer(desired, [3, 4]));
    std::fs::write(&questions, text).expect("room");
    import::import(given, |_, _| {}).expect("all is answered");
    let session = shared_mem::recording::Session::open(&out).expect("a session");
    holds_the_motion(&session.read(&session.clips[0]).expect("a clip"), (0, ROWS), 2, EXACT);
}

#[test]
fn an_object_alone_is_a_free_motion_once_cell_toml_describes_it() {
    let lab = tempfile::tempdir().expect("a folder");
    let (file, out, cell) = (lab.path().join("toss.csv"), lab.path().join("session"), lab.path().join("cell.toml"));
    let row = |k: u32| format!("{},{},100,50,1,0,0,0\n", f64::from(k) * 0.01, 500.0 + f64::from(k));
    let rows: String = (0..80).map(row).collect();
    let names = "t,cube_x,cube_y,cube_z,cube_qw,cube_qx,cube_qy,cube_qz\n";
    std::fs::write(&file, format!("{names}{rows}")).expect("room");
    let files = [file];
    let questions = lab.path().join("import.toml");
    let order = lab::order(&files, &out, &questions);
    let error = import::import(order, |_, _| {}).expect_err("no cell").to_string();
    assert!(error.contains("--cell") && error.lines().count() == 1 && !out.exists(), "{error}");
    std::fs::write(&cell, "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n").expect("room");
    import::import(import::Order { cell: Some(&cell), ..order }, |_, _| {}).expect("an object");
    let session = shared_mem::recording::Session::open(&out).expect("a session");
    let clip = session.read(&session.clips[0]).expect("a clip");
    assert_eq!((clip.kind, clip.object.len()), (ClipKind::FreeMotion, 80));
    // Millimetres.
    assert!((clip.object.poses[10].position()[0] - 0.51).abs() < EXACT);
}
