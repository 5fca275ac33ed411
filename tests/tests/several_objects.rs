//! Several objects by name, across processes: the simulated cell moves each, the recorder keeps each on a topic of its own, the
//! live twin says how far each is off.

use nalgebra::Translation3;
use shared_mem::cell::{Cell as Described, ClipKind};
use shared_mem::recording::{ClipMessages, ObjectSeries, Payload, read_clip};
use std::path::Path;
use std::time::Duration;
use tests::{Cell, lab_cell};
use twin::arm::ArmModel;

/// Where the two boxes start; the tool stands 70 mm beside the first, 50 mm above the table.
const CUP: [f64; 2] = [0.5, 0.0];
const MILK: [f64; 2] = [0.4, -0.45];
const TIP: [f64; 3] = [0.5, -0.07, 0.05];

/// The shipped cell with two boxes with names, the arm beside the first.
fn two_objects() -> String {
    let (before, after) = lab_cell().split_once("[object]").expect("an object");
    let (_, after) = after.split_once("[camera]").expect("a camera");
    let object = |name: &str, [x, y]: [f64; 2]| {
        format!(
            "[[object]]\nname = \"{name}\"\nshape = \"box\"\nsize = [0.08, 0.06, 0.10]\nmass = 0.3\n\
             friction_range = [0.3, 0.3]\nstart = [{x}, {y}]\n"
        )
    };
    let cell = Described::parse(lab_cell(), Path::new("cell.toml")).expect("the shipped cell");
    let model = ArmModel::from_cell(&cell).expect("an FR3");
    let [flange, tip] = [model.flange(model.ready()).isometry(), model.tip(model.ready()).isometry()];
    let way = nalgebra::Vector3::from(TIP) - tip.translation.vector;
    let q =
        model.reach(model.ready(), &nalgebra::one(), &(Translation3::from(way) * flange), None).expect("within reach");
    let text = format!("{before}{}{}[camera]{after}", object("cup", CUP), object("milk_box", MILK));
    text.replace("[simulation]", &format!("[simulation]\nq = {:?}", &q[..7]))
}

/// From the first pose to the last [m].
fn way(series: &ObjectSeries) -> f64 {
    let place = |row: usize| series.poses[row].isometry().translation.vector;
    (place(series.len() - 1) - place(0)).norm()
}

#[test]
fn one_of_two_objects_is_pushed_the_other_stays_and_both_are_in_the_clip_and_in_the_twin() {
    let cell = Cell::with(&two_objects());
    let clip = cell.path("clip.mcap");
    let record = cell.text("clip.mcap");
    let bridge = cell.start_bridge(&["--camera", "off", "--record", &record]);
    let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--json"]);
    std::thread::sleep(Duration::from_secs(2));
    let push = cell.start("rt_bridge", &["target", "shift", "0,0.15,0", "--cell", "{cell}", "--json"]);
    let _pushed = push.wait(Duration::from_secs(60)).succeeded();
    std::thread::sleep(Duration::from_secs(2));
    let twin = twin.interrupt().succeeded();
    let answer = bridge.interrupt().succeeded().json();
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");

    let described = Described::read(&cell.path("cell.toml")).expect("the cell");
    let read = read_clip(&clip, ClipKind::ControlHitSlide, &described).expect("a clip");
    let [milk] = &read.others[..] else { panic!("{} other objects", read.others.len()) };
    assert_eq!(milk.name, "milk_box");
    assert!(read.object.len() > 60 && milk.series.len() > 60, "{} and {} poses", read.object.len(), milk.series.len());
    let (pushed, still) = (way(&read.object), way(&milk.series));
    assert!(pushed > 0.04 && still < 1e-6, "the cup went {pushed} m, the milk box {still} m");
    let start = milk.series.poses[0].isometry().translation.vector;
    assert!((start.x - MILK[0]).hypot(start.y - MILK[1]) < 1e-6, "{start}");

    // The first is where readers of one object look, too, and the twin has said of each how far it is off.
    let count = |topic: &str| ClipMessages::open(&clip, &[topic]).expect("a clip").filter(Result::is_ok).count();
    assert!(count("/object/pose") > 60);
    for name in ["cup", "milk_box"] {
        let messages = ClipMessages::open(&clip, &[&format!("/twin/object/{name}")]).expect("a clip");
        let gaps: Vec<f64> = messages
            .filter_map(|message| match message.expect("a message").payload {
                Payload::TwinObject(object) => Some(object.add_m).filter(|gap| !gap.is_nan()),
                _ => None,
            })
            .collect();
        assert!(gaps.len() > 20, "{name}: {} gaps\n{}", gaps.len(), twin.stderr);
        let gap = &twin.json()["gap"]["objects"][name]["add_m"];
        assert!(gap.as_f64() < Some(0.01), "{name}: {gap}\n{}", twin.stderr);
    }
    assert!(twin.json()["gap"]["objects"].as_object().is_some_and(|objects| objects.len() == 2), "{}", twin.stdout);
}

const BOX: &str = "shape = \"box\"\nsize = [0.08, 0.06, 0.10]\n";

/// The shipped cell with these blocks in place of its object.
fn with_objects(blocks: &str) -> String {
    let (before, after) = lab_cell().split_once("[object]").expect("an object");
    let (_, after) = after.split_once("[camera]").expect("a camera");
    format!("{before}{blocks}\n[camera]{after}")
}

fn named(name: &str, rest: &str) -> String {
    format!("[[object]]\nname = \"{name}\"\n{rest}")
}

#[test]
fn one_of_two_objects_is_struck_by_name_the_other_is_kept_clear_of_and_the_session_is_about_the_one() {
    let at = |name: &str, [x, y]: [f64; 2]| named(name, &format!("{BOX}mass = 0.3\nstart = [{x}, {y}]\n"));
    let cell = Cell::with(&with_objects(&(at("box1", [0.48, 0.24]) + &at("box2", [0.48, 0.0]))));
    let session = cell.text("session");
    let capture =
        ["capture", "control-hit-slide", "--cell", "{cell}", "--clips", "2", "--out", &session, "--realtime", "ignore"];
    let unnamed = cell.start("calibration", &capture).wait(Duration::from_secs(20));
    let complaint = unnamed.complaint();
    assert!(complaint.contains("box1, box2") && complaint.contains("--object box1"), "{}", unnamed.stderr);
    let capture = [&capture[..], &["--object", "box2", "--json"]].concat();
    let captured = cell.start("calibration", &capture).wait(Duration::from_secs(120)).succeeded();
    let answer = captured.json();
    let kept = answer["clips"].as_array().expect("clips").iter().filter(|clip| clip["kept"] == true).count();
    assert_eq!(kept, 2, "{answer}\n{}", captured.stderr);
    let described = Described::read(&cell.path("session/cell.toml")).expect("the session's cell");
    for entry in &described.clips {
        let clip =
            read_clip(&cell.path("session").join(&entry.file), ClipKind::ControlHitSlide, &described).expect("a clip");
        let [struck] = &clip.others[..] else { panic!("{} other objects", clip.others.len()) };
        assert_eq!(struck.name, "box2");
        assert!(way(&struck.series) > 0.02 && way(&clip.object) < 1e-6 && clip.object.len() > 60);
    }
    for verb in [&["identify", "object"][..], &["diagnose"]] {
        let words = [verb, &[&session, "--object", "box2", "--json"]].concat();
        let done = cell.start("calibration", &words).wait(Duration::from_secs(120)).succeeded();
        assert_eq!(done.json()["object"], "box2", "{}", done.stderr);
    }
}

#[test]
fn objects_that_cannot_be_are_refused_in_one_line() {
    let hinge = "<robot name='lap'><link name='base'/><link name='lid'/><joint name='hinge' type='continuous'>\
                 <parent link='base'/><child link='lid'/><axis xyz='0 1 0'/></joint></robot>";
    for (blocks, complaint) in [
        (named("cup", BOX) + &named("cup", BOX), "two [[object]] blocks are named `cup`"),
        (named("cup", BOX) + "[object]\n" + BOX, "both [object] and [[object]]"),
        (named("a cup", BOX), "letters, digits and _"),
        (named("a/cup", BOX), "letters, digits and _"),
        (named("cup", BOX) + "[[object]]\n" + BOX, "number 2 has no `name`"),
        (named("cup", BOX) + &named("bowl", "mesh = \"bowl.obj\"\n"), "bowl.obj"),
        (named("cup", BOX) + &named("bowl", ""), "object `bowl`: `[object]` needs exactly one of"),
        (
            named("cup", &format!("{BOX}start = [0.5, 0.1]\n"))
                + &named("bowl", &format!("{BOX}start = [0.5, 0.12]\n")),
            "`cup` and `bowl` overlap where they start",
        ),
        ((0..33).map(|i| named(&format!("box_{i}"), BOX)).collect(), "at most 32"),
        (named("cup", BOX) + &named("lap", "urdf = \"hinge.urdf\"\n"), "joint `hinge` has no limits"),
        (named("cup", BOX) + &named("lap", "urdf = \"nowhere.urdf\"\n"), "nowhere.urdf"),
    ] {
        let cell = Cell::with(&with_objects(&blocks));
        std::fs::write(cell.path("hinge.urdf"), hinge).expect("room");
        let words = ["run", "--cell", "{cell}", "--arm", "sim", "--camera", "off", "--realtime", "ignore"];
        let refused = cell.start("rt_bridge", &words).wait(Duration::from_secs(20));
        assert!(refused.complaint().contains(complaint), "{complaint}: {}", refused.stderr);
        assert_eq!(refused.stderr.trim_end().lines().count(), 1, "{}", refused.stderr);
    }
}

#[test]
fn thirty_objects_stand_where_they_are_put_and_each_is_recorded() {
    let blocks: String = (0..30)
        .map(|i| {
            named(
                &format!("box_{i}"),
                &format!("{BOX}start = [{}, {}]\n", 0.3 + 0.15 * f64::from(i / 10), 0.12 * f64::from(i % 10) - 0.6),
            )
        })
        .collect();
    let cell = Cell::with(&with_objects(&blocks));
    let record = cell.text("clip.mcap");
    let bridge = cell.start_bridge(&["--camera", "off", "--duration", "3", "--record", &record]);
    let answer = bridge.wait(Duration::from_secs(40)).succeeded().json();
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");
    let described = Described::read(&cell.path("cell.toml")).expect("the cell");
    let read = read_clip(&cell.path("clip.mcap"), ClipKind::ControlHitSlide, &described).expect("a clip");
    assert_eq!(read.others.len(), 29);
    for series in [&read.object].into_iter().chain(read.others.iter().map(|other| &other.series)) {
        assert!(series.len() > 10 && way(series) < 1e-6, "{} poses, {} m", series.len(), way(series));
    }
}
