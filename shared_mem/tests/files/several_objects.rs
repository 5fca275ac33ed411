//! Clips of several objects: each comes back by its name from own clips and bags, and a command is about the one that moves.

use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::output::Output;
use shared_mem::recording::{
    Clip, Format, ObjectSeries, Order, Session, Subject, TrackedObject, Why, export_session, read_clip, write_clip,
};
use std::path::Path;

const CELL: &str = "[[object]]\nname = \"cup\"\nmesh = \"cup.obj\"\n\
    [[object]]\nname = \"milk\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.2]\ntopic = \"/vicon/milk\"\n\
    [[clip]]\nfile = \"a.mcap\"\nkind = \"free_motion\"\n[[clip]]\nfile = \"b.mcap\"\nkind = \"free_motion\"\n";

/// A second of poses from `from` on, `speed` along x.
fn series(from: f64, speed: f64) -> ObjectSeries {
    let at = |i: u64| {
        Pose::from_isometry(Isometry3::new(Vector3::new(from + speed * i as f64 / 30.0, 0.1, 0.05), Vector3::zeros()))
    };
    ObjectSeries {
        stamps_ns: (0..30).map(|i| 1_000_000_000 + i * 33_000_000).collect(),
        poses: (0..30).map(at).collect(),
    }
}

/// A session of two clips, in the second of which the cup moves at `cup` and the milk at `milk` [m/s].
fn session(folder: &Path, [cup, milk]: [f64; 2]) -> Session {
    std::fs::write(folder.join("cell.toml"), CELL).expect("room");
    let cell = Cell::read(&folder.join("cell.toml")).expect("a cell");
    for (name, moves) in [("a.mcap", 0.0), ("b.mcap", 1.0)] {
        let others = vec![TrackedObject { name: "milk".into(), series: series(0.6, milk * moves) }];
        let clip = Clip { object: series(0.3, cup * moves), others, ..clip_of_nothing(&folder.join(name)) };
        let output = Output::create(&folder.join(name)).expect("room");
        write_clip(&clip, (&cell, None), "test", output).expect("room");
    }
    Session::open(folder).expect("a session")
}

fn clip_of_nothing(path: &Path) -> Clip {
    Clip {
        file: path.to_owned(),
        kind: ClipKind::FreeMotion,
        joint_names: Vec::new(),
        desired: Default::default(),
        measured: Default::default(),
        torques_end_at_rows: false,
        origins: shared_mem::origin::Origins::default(),
        object: ObjectSeries::default(),
        others: Vec::new(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// Where the object in question and the other one are at last.
fn ends(session: &Session, number: usize) -> [f64; 2] {
    let clip = session.read(&session.clips[number]).expect("a clip");
    let end = |series: &ObjectSeries| series.poses.last().expect("a pose").position()[0];
    [end(&clip.object), end(&clip.others[0].series)]
}

#[test]
fn the_one_that_moves_is_meant_or_the_one_that_was_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = session(folder.path(), [0.0, 0.3]);
    assert_eq!(ends(&session, 1), [0.3, 0.6 + 0.29]);
    let milk = || Some("milk".to_owned());
    let subject = session.about(None).expect("one moves").expect("of two");
    assert_eq!(subject, Subject { name: "milk".into(), why: Why::Moves(1, 2), also_moving: Vec::new() });
    assert!(subject.to_string().contains("`milk`, which alone moves (in 1 of 2 clips); --object NAME"), "{subject}");
    assert_eq!((session.cell.object_name().map(str::to_owned), ends(&session, 1)), (milk(), [0.6 + 0.29, 0.3]));
    let subject = session.about(Some("cup")).expect("a cup").expect("of two");
    assert_eq!((subject.why, subject.also_moving.as_slice()), (Why::Asked, &["milk".to_owned()][..]));
    assert_eq!(ends(&session, 1), [0.3, 0.6 + 0.29]);
    let error = session.about(Some("plate")).expect_err("no plate").to_string();
    assert!(error.contains("no object `plate`; it has cup, milk") && !error.contains('\n'), "{error}");
}

#[test]
fn where_several_move_one_has_to_be_asked_for_and_where_none_does_the_first_is_meant() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = session(folder.path(), [0.3, 0.3]).about(None).expect_err("two move").to_string();
    assert!(error.contains("cup and milk move; say with --object cup|milk"), "{error}");
    let folder = tempfile::tempdir().expect("a folder");
    let subject = session(folder.path(), [0.0, 0.0]).about(None).expect("a session").expect("of two");
    assert_eq!((subject.name.as_str(), subject.why), ("cup", Why::First));
}

#[test]
fn objects_go_to_a_bag_and_back_by_their_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = session(folder.path(), [0.0, 0.3]);
    let out = tempfile::tempdir().expect("a folder");
    let to = |session: &Session, to, name: &str| {
        let out = out.path().join(name);
        let order = Order { to, out: &out, force: false, flange_at: &|_| None, robot: None };
        let told = export_session(session, order, |_| {}).expect("exported");
        assert!(told.iter().all(|clip| clip.poses == 60 && clip.left_out.is_empty()), "{told:?}");
        Session::open(&out).expect("a session")
    };
    let bag = to(&own, Format::Ros2, "bag");
    let back = to(&bag, Format::Own, "back");
    for session in [&bag, &back] {
        for number in [0, 1] {
            assert_eq!(ends(session, number), ends(&own, number));
        }
    }
    // The first is where everybody looks who knows of one object alone.
    let alone = Cell::parse("[object]\nmesh = \"cup.obj\"\n", Path::new("cell.toml")).expect("a cell");
    let seen = read_clip(&bag.folder.join("b.mcap"), ClipKind::FreeMotion, &alone).expect("a clip");
    assert_eq!(seen.object.poses, own.read(&own.clips[1]).expect("a clip").object.poses);
    // A clip from before the object had a name is about the first.
    let file = back.folder.join("old.mcap");
    let old = Clip { object: series(0.2, 0.1), ..clip_of_nothing(&file) };
    write_clip(&old, (&alone, None), "test", Output::create(&file).expect("room")).expect("room");
    let read = read_clip(&file, ClipKind::FreeMotion, &back.cell).expect("a clip");
    assert_eq!((read.object.poses, read.others[0].series.len()), (old.object.poses, 0));
}
