//! Task files: those that ship succeed from any start, and what is wrong with one is said in a line with its place.

use shared_mem::cell::{Cell, ClipKind};
use shared_mem::output::Destination;
use shared_mem::recording::{ClipInfo, ClipMessages, Episode, Payload, read_clip, read_episode, write_episode};
use std::path::{Path, PathBuf};
use twin::arm::ArmModel;
use twin::task::{Run, Task};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../twin/tasks").join(name)
}

/// The rows without the gripper's force, which nobody knows: what is no number equals nothing.
fn known(mut rows: Episode) -> Episode {
    rows.moments.iter_mut().flat_map(|row| &mut row.gripper).for_each(|gripper| gripper.force = 0.0);
    rows
}

fn run(task: &Task, seed: u64) -> Run {
    Run { seed, duration: task.horizon(), noise: 0.0 }
}

#[test]
fn the_scripted_motion_of_each_task_succeeds_from_ten_starts() {
    for name in ["push_milk.toml", "stack_boxes.toml", "pick_carrot.toml", "close_laptop.toml"] {
        let task = Task::read(&shipped(name)).unwrap_or_else(|error| panic!("{error}"));
        for seed in 0..10 {
            let episode = task.episode(&run(&task, seed)).expect("room for all");
            assert!(episode.success && episode.at_rest, "{name}, seed {seed}: {episode:?}");
        }
    }
}

#[test]
fn a_cell_in_the_place_of_a_task_is_said_to_be_one() {
    let cell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let error = Task::read(&cell).expect_err("a cell").to_string();
    assert!(error.contains("describes a cell, and a task is asked for"), "{error}");
}

#[test]
fn a_start_is_that_of_its_seed_and_another_seed_has_another() {
    let task = Task::read(&shipped("stack_boxes.toml")).expect("a task");
    let [one, again, other] =
        [1, 1, 2].map(|seed| task.episode(&Run { duration: 0.001, ..run(&task, seed) }).expect("room for all"));
    assert_eq!(one, again);
    assert_ne!(one.bodies[1].start, other.bodies[1].start);
}

#[test]
fn noise_changes_the_motion_and_not_the_start() {
    let task = Task::read(&shipped("pick_carrot.toml")).expect("a task");
    let rows = |noise| known(task.demonstration(&Run { noise, ..run(&task, 3) }).expect("room for all").1);
    let (plain, noisy, again) = (rows(0.0), rows(0.002), rows(0.002));
    assert!(noisy == again);
    assert_eq!(plain.moments[0].poses, noisy.moments[0].poses);
    let hand = |rows: &Episode, row: usize| rows.moments[row].targets[0].position;
    let off = (0..3).map(|k| (hand(&plain, 100)[k] - hand(&noisy, 100)[k]).abs()).fold(0.0, f64::max);
    assert!(off > 1e-5 && off < 0.01, "{off}");
    // It waits for its fingers, and has gone somewhere else after that.
    assert_eq!(hand(&noisy, 185), hand(&noisy, 250));
    assert_ne!(hand(&noisy, 250), hand(&noisy, 330));
}

#[test]
fn a_recorded_episode_is_read_back_as_it_was() {
    let task = Task::read(&shipped("pick_carrot.toml")).expect("a task");
    let (episode, rows) = task.demonstration(&run(&task, 5)).expect("room for all");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("episode.mcap");
    let place = Destination::new(&path, false).expect("a place");
    write_episode(place.begin().expect("room"), &ClipInfo::default(), &rows).expect("room");
    let mut read = read_episode(&path).expect("an episode");
    assert_eq!(read.info.success, episode.success);
    assert_eq!(read.object.as_deref(), Some("plate"));
    // The gripper's stamp is that of its row.
    for (read, row) in read.moments.iter_mut().zip(&rows.moments) {
        let (Some(read), Some(row)) = (&mut read.gripper, &row.gripper) else { panic!("no gripper") };
        assert!(read.force.is_nan() && (0.0..0.091).contains(&read.width), "{read:?}");
        read.stamp_ns = row.stamp_ns;
    }
    for (read, row) in read.moments.iter_mut().zip(&rows.moments) {
        let (Some(arm), Some(row)) = (&mut read.arm, &row.arm) else { panic!("no arm") };
        assert_eq!((arm.stamp_ns, arm.device_ns), (read.time_ns, read.time_ns));
        (arm.stamp_ns, arm.device_ns) = (row.stamp_ns, row.device_ns);
    }
    assert!(known(read) == known(rows.clone()));
    let held = rows.moments.iter().filter(|row| row.gripper.is_some_and(|gripper| gripper.grasped == 1)).count();
    assert!((200..600).contains(&held), "{held} rows of {}", rows.moments.len());
    // Readers that know one object see the first.
    let poses = ClipMessages::open(&path, &[]).expect("a clip").filter_map(Result::ok);
    let poses: Vec<_> = poses.filter(|message| matches!(message.payload, Payload::ObjectPose(_))).collect();
    assert_eq!(poses.len(), rows.moments.len());
    assert!(poses.iter().all(|message| message.topic == "/object/pose"));
    // And the arm, by itself.
    let clip = read_clip(&path, ClipKind::Excitation, &Cell::parse(ARM, &path).expect("a cell")).expect("a clip");
    assert_eq!((clip.measured.len(), clip.measured.dof, clip.measured.tau.len()), (rows.moments.len(), 7, 0));
    assert!(clip.warnings.is_empty(), "{:?}", clip.warnings);
    // A file that lacks its end is no whole episode.
    let bytes = std::fs::read(&path).expect("the file");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("room");
    assert!(read_episode(&path).is_err());
}

const ARM: &str = "[robot]\nmodel = \"fr3\"\n";

#[test]
fn the_arm_goes_where_its_body_goes_and_says_what_it_cannot_do() {
    let task = Task::read(&shipped("stack_boxes.toml")).expect("a task");
    let (_, rows) = task.demonstration(&run(&task, 2)).expect("room for all");
    let model = ArmModel::fr3();
    let mut before: Option<[f64; 8]> = None;
    for (k, row) in rows.moments.iter().enumerate() {
        let (arm, target) = (row.arm.as_ref().expect("an arm"), &row.targets[0]);
        let flange = model.flange(&arm.q).isometry();
        let palm = flange * nalgebra::Point3::new(0.0, 0.0, 0.1034);
        let off = (palm.coords - nalgebra::Vector3::from(target.position)).norm();
        assert!(off < 1e-8, "row {k}: {off}");
        assert!((flange.rotation * nalgebra::Vector3::z()).z < -0.999_999, "row {k}");
        let turned =
            before.map_or(0.0, |q| (0..7).map(|i| (arm.q[i] - q[i] - 0.01 * arm.dq[i]).abs()).fold(0.0, f64::max));
        assert!(turned < 2e-3, "row {k}: {turned}");
        before = Some(arm.q);
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("task.toml");
    let text = std::fs::read_to_string(shipped("stack_boxes.toml")).expect("the file");
    for (base, said) in [("[-0.6, 0.0, 0.0]", "it does not reach"), ("[0.15, 0.0, 0.0]", "beyond")] {
        std::fs::write(&path, text.replace("[arm]\n", &format!("[arm]\nbase = {base}\n"))).expect("room");
        let task = Task::read(&path).expect("a task");
        let episode = task.episode(&run(&task, 2)).expect("room for all");
        let fault = episode.arm_fault.expect("a fault");
        assert!(fault.contains(said) && !episode.success, "{base}: {fault}");
    }
}

/// A table, a box on it, and a box that has to get to x = 1.
const GOOD: &str = r#"horizon = 1.0
[[body]]
name = "table"
hold = "fixed"
friction = 0.5
piece = [{ shape = "box", size = [1.0, 1.0, 0.1], position = [0.0, 0.0, -0.05] }]
[[body]]
name = "box"
mass = 0.2
friction = 0.5
position = [0.0, 0.0, 0.03]
piece = [{ shape = "box", size = [0.06, 0.06, 0.06] }]
[[body]]
name = "lid"
mass = 0.2
friction = 0.5
position = [0.3, 0.0, 0.2]
piece = [{ shape = "box", size = [0.06, 0.06, 0.06] }]
joint = { kind = "revolute", axis = [0.0, 1.0, 0.0], limits = [0.0, 1.0] }
[[success]]
body = "box"
low = [0.9, -1.0, 0.0]
high = [1.1, 1.0, 0.1]
"#;

#[test]
fn what_is_wrong_with_a_task_is_said_in_one_line_with_line_and_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let open = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
    // A tetrahedron whose middle of one side is pushed in.
    let dented = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.02 0.02 0.02\n\
        f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 5\nf 3 4 5\nf 4 2 5\n";
    std::fs::write(folder.path().join("open.obj"), open).expect("room");
    std::fs::write(folder.path().join("dented.obj"), dented).expect("room");
    let piece = "piece = [{ shape = \"box\", size = [0.06, 0.06, 0.06] }]\n[[body]]\nname = \"lid\"";
    let mesh = |file: &str| format!("piece = [{{ mesh = \"{file}\" }}]\n[[body]]\nname = \"lid\"");
    let cases: [(&str, &str, &str, &str); 18] = [
        ("", "", "", ""),
        (
            "position = [0.0, 0.0, 0.03]",
            "position = [0.0, 0.0, 0.02]",
            "11",
            "`table` and `box` overlap where they start",
        ),
        (", limits = [0.0, 1.0]", "", "19", "`joint`: it has no limits"),
        ("limits = [0.0, 1.0]", "limits = [1.0, 0.0]", "19", "`limits`: [1, 0] is no range"),
        (piece, &mesh("open.obj"), "12", "`mesh`: FOLDER/open.obj is open at 3 edges"),
        (piece, &mesh("dented.obj"), "12", "FOLDER/dented.obj is not convex"),
        (piece, &mesh("none.obj"), "12", "No such file"),
        ("low = [0.9,", "low = [-1.0,", "20", "`success`: all of it holds at the start already"),
        (
            "friction = 0.5\nposition = [0.0",
            "fricton = 0.5\nposition = [0.0",
            "10",
            "unknown key `fricton`; did you mean `friction`?",
        ),
        (
            "mass = 0.2\nfriction = 0.5\nposition = [0.0",
            "friction = 0.5\nposition = [0.0",
            "7",
            "`mass`: `box` moves by itself",
        ),
        (
            "mass = 0.2\nfriction = 0.5\nposition = [0.0",
            "mass = -1.0\nfriction = 0.5\nposition = [0.0",
            "9",
            "`mass`: it is -1",
        ),
        ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 0.0, 0.0]", "19", "`axis`: it has no length"),
        ("body = \"box\"", "body = \"bok\"", "21", "no body is called `bok`"),
        ("name = \"lid\"", "name = \"box\"", "14", "two bodies are called `box`"),
        ("size = [0.06, 0.06, 0.06] }]\n[[body]]", "size = [0.06, 0.0, 0.06] }]\n[[body]]", "12", "`size` holds 0"),
        (
            "limits = [0.0, 1.0]",
            "limits = [0.0, 1.0], drive = { target = 0.5, speed = -1.0, force = 1.0 }",
            "19",
            "`drive`: it is -1",
        ),
        ("0.06] }]\n[[body]]", "0.06], position = [nan, 0.0, 0.0] }]\n[[body]]", "11", "`position`: it holds NaN"),
        ("horizon = 1.0", "horizon = nan", "1", "`horizon`: it is NaN"),
    ];
    for (before, after, line, said) in cases {
        assert!(GOOD.contains(before), "{before}");
        let path = folder.path().join("task.toml");
        std::fs::write(&path, GOOD.replacen(before, after, 1)).expect("room");
        let outcome = Task::read(&path);
        if said.is_empty() {
            outcome.expect("a good task");
            continue;
        }
        let error = outcome.expect_err(said).to_string();
        let said = said.replace("FOLDER", &folder.path().display().to_string());
        assert!(error.starts_with(&format!("{}:{line}: ", path.display())), "{said}: {error}");
        assert!(error.contains(&said) && !error.contains('\n'), "{said}: {error}");
    }
}

#[test]
fn bodies_that_find_no_room_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("task.toml");
    let text =
        GOOD.replacen("position = [0.0, 0.0, 0.03]", "position = [0.0, 0.0, 0.02]\nstart = { x = [-0.1, 0.1] }", 1);
    std::fs::write(&path, text).expect("room");
    let error = Task::read(&path).expect_err("no room").to_string();
    assert!(error.contains("`table` and `box` overlap where they start in 1000 drawings out of 1000"), "{error}");
}
