//! What the user's model has already stays what it is: names, orders, sections, units of controls, and what hangs on its flange.

use super::super::{Format, write, write_into};
use super::Base;
use super::classes::numbers;
use super::tests::{actuators, lab, merged, named, shipped};
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use shared_mem::theta::Theta;
use std::path::Path;
use twin::xml::Element;

const PAYLOAD: &str = "[[effect]]\nname = \"payload\"\nmass = 0.4\ncentre = [0.0, 0.0, 0.05]\n";
const CUBE: &str = "<worldbody><body name='cube' pos='1 1 1'><freejoint/><geom size='.1' mass='1'/></body></worldbody>";

fn list(root: &Element, key: &str) -> Vec<f64> {
    named(root, "key", "home").get(key).map(numbers).expect("a list")
}

#[test]
fn the_object_comes_last_where_a_document_has_several_worlds() {
    let key = "<keyframe><key name='home' qpos='0 -0.785 0 -2.356 0 1.571 0.785 0 0 1 2 3 1 0 0 0'/></keyframe>";
    let base = lab("", "", &format!("{CUBE}{key}"))
        .replace("<worldbody><geom", "<worldbody><light/></worldbody><worldbody><geom");
    let (_, root) = merged(&base, "", &[]).expect("a model");
    let last = root.elements().rfind(|section| section.name == "worldbody").expect("a world");
    assert_eq!(last.elements().filter_map(|body| body.get("name")).collect::<Vec<_>>()[..2], ["cube", "object"]);
    let q = list(&root, "qpos");
    assert_eq!((q.len(), q[9..12].to_vec()), (23, vec![1.0, 2.0, 3.0]));
    assert_eq!(q[16..19].to_vec(), named(&root, "body", "object").get("pos").map(numbers).expect("a place"));
}

#[test]
fn controls_in_other_units_or_with_an_offset_are_converted_with_their_range() {
    let key =
        "<keyframe><key name='home' qpos='0 -0.5 0 -2 0 1.5 0.7 0 0' ctrl='10 -40 10 -190 10 160 80 0.04'/></keyframe>";
    let scaled = "<general gear='2' gainprm='40' biastype='affine' biasprm='-400 -2000 -200' ctrlrange='-290 290'/>";
    let base = lab("", "", key);
    let (before, rest) = base.split_once("<general gainprm='2000'").expect("a class");
    let (_, rest) = rest.split_once("/>").expect("its end");
    let (_, root) = merged(&format!("{before}{scaled}{rest}"), "", &[]).expect("a model");
    // 40 (c - 10) - 2000 * 2 q = 0
    let wanted = [0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.7, 0.04];
    let found = list(&root, "ctrl");
    assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-9), "{found:?}");
    let range = named(&root, "general", "motor1").get("ctrlrange").map(numbers).expect("a range");
    assert!((range[0] + 3.0).abs() < 1e-9 && (range[1] - 2.8).abs() < 1e-9, "{range:?}");
}

#[test]
fn a_drive_by_a_tendon_of_one_joint_is_that_joints_and_others_are_named() {
    let tendons = "<tendon><fixed name='t1'><joint joint='fr3_joint1' coef='2'/></fixed><fixed name='both'><joint joint='fr3_joint1' coef='1'/><joint \
                   joint='fr3_joint2' coef='1'/></fixed></tendon><actuator><motor name='differential' tendon='both'/></actuator><keyframe><key name='home' \
                   qpos='0.1 0 0 -2 0 1 0 0 0' ctrl='0.2 0 0 -2 0 1 0 0 7'/></keyframe>";
    let base = lab("", "", tendons).replace("name='motor1' joint='fr3_joint1'", "name='motor1' tendon='t1'");
    let (model, root) = merged(&base, "", &[]).expect("a model");
    assert_eq!(actuators(&root)[..9].join(" "), "motor1 motor2 motor3 motor4 motor5 motor6 motor7 grip differential");
    assert_eq!(named(&root, "general", "motor1").get("joint"), Some("fr3_joint1"));
    assert_eq!((list(&root, "ctrl")[0], list(&root, "ctrl")[8]), (0.1, 7.0));
    assert!(model.left_out.iter().any(|left| left.what == "actuator differential"), "{:?}", model.left_out);
}

#[test]
fn names_that_mean_something_else_are_kept_and_the_cells_are_others() {
    let others =
        "<worldbody><geom name='object' size='.1'/><body name='payload'><geom size='.1' mass='1'/></body></worldbody>";
    let base = lab("", "", others);
    let (model, root) = merged(&base, PAYLOAD, &[]).expect("a model");
    let count = |root: &Element, kind: &str, name: &str| {
        root.all().iter().filter(|e| e.name == kind && e.get("name") == Some(name)).count()
    };
    for (kind, name) in [("body", "payload"), ("body", "cell_payload"), ("geom", "object"), ("geom", "cell_object")] {
        assert_eq!(count(&root, kind, name), 1, "{kind} {name}");
    }
    for said in ["`payload`", "`object`"] {
        assert!(model.left_out.iter().any(|left| left.what.contains(said)), "{:?}", model.left_out);
    }
    // Once more it is the same.
    let (_, again) = merged(&model.text, PAYLOAD, &[]).expect("a model");
    assert_eq!(
        again.all().iter().filter(|e| e.name == "body" || e.name == "geom").count(),
        root.all().iter().filter(|e| e.name == "body" || e.name == "geom").count()
    );

    let rich = "<worldbody><body name='object' pos='1 2 3'><freejoint name='free'/><geom name='og' size='.1'/><site name='grasp'/></body></worldbody>\
                <contact><pair geom1='og' geom2='table'/></contact>";
    let (_, root) = merged(&lab("", "", rich), "", &[]).expect("a model");
    let object = named(&root, "body", "object");
    assert_eq!(
        (object.get("pos"), count(object, "freejoint", "free"), count(object, "freejoint", "object")),
        (Some("1 2 3"), 1, 0)
    );
    assert_eq!(
        [("geom", "og"), ("site", "grasp"), ("geom", "object")].map(|(kind, name)| count(object, kind, name)),
        [1; 3]
    );
    assert_eq!(object.elements().filter(|inner| inner.name == "inertial").count(), 1);
}

#[test]
fn a_joint_that_turns_the_other_way_or_has_another_zero_is_named() {
    let base = lab("", "", "");
    let joint = base.find("name='fr3_joint4' axis='").expect("a joint") + "name='fr3_joint4' axis='".len();
    let axis = base[joint..].split('\'').next().expect("an axis");
    let against: Vec<String> = numbers(axis).iter().map(|part| (-part).to_string()).collect();
    let turned = format!("{}{}{}", &base[..joint], against.join(" "), &base[joint + axis.len()..]);
    let refused = merged(&turned, "", &[]).expect_err("turned round");
    assert!(refused.contains("fr3_joint4 of the model turns the other way"), "{refused}");
    // The body of joint 4 turned about its axis.
    let link = base.find("<body name='link3' pos='").expect("a body");
    let quat = link + base[link..].find("quat='").expect("a turn") + "quat='".len();
    let written = base[quat..].split('\'').next().expect("its end");
    let [w, x, y, z] = numbers(written)[..] else { panic!("{written}") };
    let axis = Unit::new_normalize(Vector3::from_column_slice(&numbers(axis)));
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) * UnitQuaternion::from_axis_angle(&axis, 0.5);
    let turn = format!("{} {} {} {}", turn.w, turn.i, turn.j, turn.k);
    let elsewhere = format!("{}{turn}{}", &base[..quat], &base[quat + written.len()..]);
    let refused = merged(&elsewhere, "", &[]).expect_err("another zero");
    assert!(refused.contains("zero of `fr3_joint4`"), "{refused}");
    let longer = base.replace("<body name='link3' pos='", "<body name='link3' pos='0.5 0 0' user='");
    let refused = merged(&longer, "", &[]).expect_err("another arm");
    assert!(refused.contains("not built as the cell's"), "{refused}");
}

#[test]
fn a_range_of_a_class_moves_with_an_encoder_that_is_off() {
    let offset = "[[effect]]\nname = \"joint_encoder_offset\"\noffset = [0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0]\n";
    let (_, root) = merged(&lab("", "", ""), offset, &[]).expect("a model");
    let joint = named(&root, "joint", "fr3_joint2");
    let (reads, range) =
        (joint.get("ref").map(numbers).expect("a zero"), joint.get("range").map(numbers).expect("a range"));
    assert!((range[0] - (-170.0 + reads[0])).abs() < 1e-9 && (range[1] - (170.0 + reads[0])).abs() < 1e-9, "{range:?}");
}

fn urdf_merged(own: &str, joints: &[String]) -> Result<super::super::ModelFile, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("own.urdf");
    std::fs::write(&file, own).expect("room");
    let theta: Theta = shared_mem::toml_file::parse(PAYLOAD, Path::new("theta.toml")).expect("a theta.toml");
    let base = Base { file: &file, joints, out: Some(&file) };
    write_into(&shipped(), &theta, Format::Urdf, &base).map_err(|error| error.to_string())
}

#[test]
fn loads_hang_at_the_cells_flange_before_the_end_of_the_root_and_once() {
    let bare = write(&shipped(), &Theta::default(), Format::Urdf, None).expect("a model").text;
    let hand = "<link name='hand'/><joint name='hand' type='fixed'><parent link='fr3_link7'/><child link='hand'/><origin xyz='0 0 0.3'/></joint>";
    let (before, rest) = bare.split_once("<joint ").expect("joints");
    let own = format!("{before}{hand}<joint {rest}<!-- </robot> -->\n").replace("UTF-8", "ISO-8859-1");
    let found = urdf_merged(&own, &[]).expect("a model").text;
    assert!(
        found.trim_end().ends_with("</robot>\n<!-- </robot> -->") && found.contains("encoding=\"UTF-8\""),
        "{found}"
    );
    let root = Element::read(&found).expect("XML");
    let origin = |root: &Element, joint: &str| {
        let joint = named(root, "joint", joint).clone();
        let at =
            joint.elements().find(|inner| inner.name == "origin").and_then(|origin| origin.get("xyz")).map(numbers);
        Isometry3::from(Translation3::from(Vector3::from_column_slice(&at.expect("a place"))))
    };
    let off = origin(&root, "payload_joint").translation.vector - origin(&root, "flange_joint").translation.vector;
    assert!(off.norm() < 1e-6, "{off:?}");
    let again = urdf_merged(&found, &[]).expect("a model").text;
    assert_eq!(again, found);
    let other =
        found.replace("<mass value=\"0.4\"/><inertia ixx=\"1e-9\"", "<mass value=\"0.4\"/><inertia ixx=\"1e-4\"");
    let model = urdf_merged(&other, &[]).expect("a model");
    assert!(
        model.text.contains("link name=\"cell_payload\"")
            && model.left_out.iter().any(|left| left.what.contains("`payload`"))
    );
    let at = bare.find("0.316").expect("a length");
    let longer = format!("{}0.516{}", &bare[..at], &bare[at + 5..]);
    let refused = urdf_merged(&longer, &[]).expect_err("another arm");
    assert!(refused.contains("not built as the cell's"), "{refused}");
}
