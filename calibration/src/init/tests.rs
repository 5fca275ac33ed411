//! What is written is a cell to the reader, and every comment in it becomes one where it is taken in.

use super::text::{self, BLOCKS};
use super::{Facts, Named, Order, known::Known};
use shared_mem::cell::{Cell, ClipEntry, ClipKind, Controller, ControllerKind, Topics};
use shared_mem::toml_file;
use std::collections::BTreeSet;
use std::path::Path;

fn known(facts: &Facts) -> Known {
    let order = Order { facts, bag: None, clips: None, out: Path::new("cell.toml"), force: false };
    Known::gather(order).expect("enough is said")
}

fn fr3() -> Facts {
    Facts { robot: Some(Named::Model("fr3".into())), ..Facts::default() }
}

fn parsed(text: &str) -> Cell {
    Cell::parse(text, Path::new("cell.toml")).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn what_is_known_is_read_back_whatever_it_is() {
    let joints = Named::Joints(vec!["a \"b\"".into(), "c".into()]);
    let servo = Facts {
        robot: Some(joints),
        controller: Some(ControllerKind::JointPd),
        stiffness: vec![12.5, 3.0],
        tool: Some([0.1, 0.2, 0.01]),
        table: Some(-0.02),
        object: Some([0.1, 0.2, 0.3]),
        ..Facts::default()
    };
    for facts in [fr3(), servo] {
        let mut known = known(&facts);
        known.cell.topics = Topics { measured: "/joint_states".into(), ..Topics::default() };
        known.cell.camera = Some(shared_mem::cell::Camera::default());
        for file in ["a b.mcap", "run_2/run_2_0.mcap"] {
            known.cell.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
            known.recorded.push("1000 states/s".into());
        }
        assert_eq!(parsed(&text::of(&known)), known.cell);
        assert!(known.cell.controller.is_some_and(|law| !law.stiffness.is_empty()));
    }
}

#[test]
fn a_law_that_is_named_leaves_no_gains_of_another() {
    let known = known(&Facts { controller: Some(ControllerKind::JointPd), ..fr3() });
    assert_eq!(known.cell.controller, Some(Controller { kind: ControllerKind::JointPd, ..Controller::default() }));
    assert!(known.remarks.is_empty(), "{:?}", known.remarks);
    let usual = self::known(&fr3());
    assert!(usual.remarks.iter().any(|(block, text)| *block == "controller" && text.contains("usual gains")));
}

#[test]
fn every_commented_key_is_one_that_the_reader_knows() {
    let text = text::of(&known(&fr3()));
    let mut taken_in = 0;
    for (block, keys) in BLOCKS {
        let header = if block == "clip" { "[[clip]]".to_owned() } else { format!("[{block}]") };
        for (key, example) in keys {
            let line = format!("\n#{key} = {example}\n");
            let is_known = text.contains(&format!("\n{header}\n")) && !text.contains(&line);
            assert!(is_known || text.contains(&line), "{block}.{key} stands nowhere");
            // With whatever its block needs, and without the other names of an arm or a shape.
            let others: &[(&str, &str)] = match (block, *key) {
                ("controller", "kind") | ("clip" | "tool" | "robot" | "gripper", _) => &[],
                ("controller", _) => &[("kind", "\"joint_pd\"")],
                ("object", "mesh") => &[],
                ("object", "urdf") => &[("name", "\"laptop\"")],
                ("object", "hold" | "joints") => &[("name", "\"laptop\""), ("urdf", "\"laptop.urdf\"")],
                ("object", "shape") => &[("size", "[0.1, 0.1, 0.1]")],
                ("object", "size") => &[("shape", "\"box\"")],
                ("object", _) => &[("shape", "\"box\""), ("size", "[0.1, 0.1, 0.1]")],
                _ => &[],
            };
            let needs: Vec<(&str, &str)> = match (block, *key) {
                ("tool" | "clip", _) => keys.iter().filter(|(other, _)| other != key).copied().collect(),
                ("gripper", "stroke" | "counts") => vec![keys[0]],
                ("robot", "base_frame") => vec![keys[0]],
                _ => others.to_vec(),
            };
            let lines: String = needs.iter().map(|(key, value)| format!("{key} = {value}\n")).collect();
            parsed(&format!("{header}\n{key} = {example}\n{lines}"));
            taken_in += 1;
        }
    }
    assert!(taken_in > 50, "{taken_in} keys");
}

#[test]
fn the_keys_are_those_of_the_schema() {
    let schema = Cell::schema();
    let blocks: BTreeSet<&str> = BLOCKS.iter().map(|(block, _)| *block).collect();
    let known: BTreeSet<&str> = schema["properties"].as_object().expect("blocks").keys().map(String::as_str).collect();
    assert_eq!(blocks, known);
    for (block, keys) in BLOCKS {
        let definition = text::definition(&schema, &schema["properties"][block]);
        let known: BTreeSet<&str> =
            definition["properties"].as_object().expect("keys").keys().map(String::as_str).collect();
        assert_eq!(keys.iter().map(|(key, _)| *key).collect::<BTreeSet<_>>(), known, "{block}");
    }
}

#[test]
fn comments_stay_where_a_verb_brings_a_block_up_to_date() {
    let before =
        text::of(&known(&fr3())).replace("kind = \"joint_impedance\"", "kind = \"joint_impedance\"  # ours, May 3");
    let camera = Cell { camera: Some(shared_mem::cell::Camera::default()), ..Cell::default() };
    let mut text = before.clone();
    // The first time a block appears, the second time it changes.
    for latency in [0.0, 0.01] {
        let mut camera = camera.clone();
        camera.camera.iter_mut().for_each(|camera| camera.latency = latency);
        text = toml_file::updated(&text, &camera.to_toml(), &[]).expect("TOML");
        assert_eq!(parsed(&text).camera, camera.camera);
        let kept: Vec<&str> = before.lines().filter(|line| line.contains('#')).collect();
        let left: Vec<&str> = text.lines().filter(|line| line.contains('#')).collect();
        assert_eq!(kept, left);
    }
}

#[test]
fn too_few_gains_are_counted() {
    let facts = Facts { stiffness: vec![600.0; 6], ..fr3() };
    let order = Order { facts: &facts, bag: None, clips: None, out: Path::new("cell.toml"), force: false };
    let error = Known::gather(order).expect_err("six gains for seven joints").to_string();
    assert!(error.contains("--stiffness holds 6 numbers") && error.contains("7 joints"), "{error}");
}

#[test]
fn a_recorded_controller_keeps_its_motors_under_another_law_and_that_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let cell = Cell {
        robot: Some(shared_mem::cell::Robot { model: Some("fr3".into()), ..Default::default() }),
        controller: Some(Controller {
            kind: ControllerKind::JointImpedance,
            stiffness: vec![600.0; 7],
            rotor_inertia: vec![0.2; 7],
            ..Controller::default()
        }),
        ..Cell::default()
    };
    let info = shared_mem::recording::ClipInfo { cell_toml: Some(cell.to_toml()), ..Default::default() };
    let mut writer = shared_mem::recording::ClipWriter::create(&folder.path().join("a.mcap"), &info).expect("a file");
    for k in 0..50 {
        let stamp_ns = 1_000_000 * (1 + k);
        let state = shared_mem::msg::arm::ArmState { stamp_ns, cycle: k, dof: 7, ..Default::default() };
        writer.arm_state(&state).expect("room");
    }
    writer.finish().expect("a clip");
    let facts = Facts { controller: Some(ControllerKind::JointPd), ..Facts::default() };
    let out = folder.path().join("cell.toml");
    let order = Order { facts: &facts, bag: None, clips: Some(folder.path()), out: &out, force: false };
    let known = Known::gather(order).expect("a clip tells its robot");
    let controller = known.cell.controller.expect("a controller");
    assert_eq!((controller.kind, controller.rotor_inertia), (ControllerKind::JointPd, vec![0.2; 7]));
    assert!(controller.stiffness.is_empty());
    assert!(
        known.warnings.iter().any(|line| line.contains("`joint_impedance`") && line.contains("`joint_pd`")),
        "{:?}",
        known.warnings
    );
}
