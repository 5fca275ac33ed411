//! Names, orders and places of the user's model stay, and the cell's come into its frames.

use super::super::{Format, ModelFile, write_into};
use super::Base;
use super::classes::numbers;
use super::places::Places;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::fmt::Write as _;
use std::path::Path;
use twin::arm::ArmModel;
use twin::xml::Element;

pub(super) fn shipped() -> Cell {
    let text = include_str!("../../../../config/fr3_cell.toml");
    Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
}

/// A laboratory's own model of the shipped arm: each link turned about its joint's axis, so that its frames are others; two fingers
/// with a motor of their own; the base at `base`; `prefix` before the joints' names and `more` at the end.
pub(super) fn lab(base: &str, prefix: &str, more: &str) -> String {
    let arm = ArmModel::from_cell(&shipped()).expect("the arm");
    let mut bodies = String::new();
    for (k, part) in arm.parts().iter().enumerate() {
        let turn = |axis: &Unit<Vector3<f64>>| {
            Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(axis, 0.3))
        };
        let before = k.checked_sub(1).map_or_else(Isometry3::identity, |last| turn(&arm.parts()[last].axis).inverse());
        let at = before * part.origin * turn(&part.axis);
        let (p, q, a) = (at.translation.vector, at.rotation, part.axis);
        let _written = write!(
            bodies,
            "<body name='{prefix}link{k}' pos='{} {} {}' quat='{} {} {} {}'><inertial mass='2' pos='0 0 0' diaginertia='.02 .02 .01'/>\
             <joint name='{prefix}{}' axis='{} {} {}' class='arm'/>",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k, part.joint, a.x, a.y, a.z
        );
    }
    let fingers: String = ["a", "b"].map(|f| format!("<body name='{prefix}{f}'><inertial mass='.01' pos='0 0 0' diaginertia='1e-5 1e-5 1e-5'/><joint name='{prefix}finger_{f}' type='slide' axis='0 1 0'/></body>")).concat();
    let motors: String = arm
        .joint_names()
        .iter()
        .enumerate()
        .map(|(k, joint)| format!("<general name='{prefix}motor{}' joint='{prefix}{joint}' class='drive'/>", k + 1))
        .collect();
    format!(
        "<mujoco model='lab'><compiler angle='degree'/><option timestep='0.002'/><default><geom friction='0.6'/><default class='arm'><joint \
         damping='0.5' range='-170 170'/></default><default class='drive'><general gainprm='2000' biastype='affine' biasprm='0 -2000 -200' \
         ctrlrange='-2.9 2.9'/></default></default><worldbody><geom name='table' type='box' size='1 1 .02' pos='0 0 -.02'/><body name='stand' \
         {base}>{bodies}{fingers}{}</body></worldbody><actuator>{motors}<position name='{prefix}grip' joint='{prefix}finger_a' \
         kp='100'/></actuator>{more}</mujoco>",
        "</body>".repeat(7)
    )
}

pub(super) fn merged(lab: &str, theta: &str, joints: &[&str]) -> Result<(ModelFile, Element), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, out) = (folder.path().join("lab.xml"), folder.path().join("found.xml"));
    std::fs::write(&file, lab).expect("room");
    let theta: Theta = shared_mem::toml_file::parse(theta, Path::new("theta.toml")).expect("a theta.toml");
    let joints: Vec<String> = joints.iter().map(|&name| name.to_owned()).collect();
    let base = Base { file: &file, joints: &joints, out: Some(&out) };
    let model = write_into(&shipped(), &theta, Format::Mjcf, &base).map_err(|error| error.to_string())?;
    let root = Element::read(&model.text).expect("XML");
    Ok((model, root))
}

pub(super) fn named<'a>(root: &'a Element, kind: &str, name: &str) -> &'a Element {
    let all = root.all();
    all.into_iter()
        .find(|e| e.name == kind && e.get("name") == Some(name))
        .unwrap_or_else(|| panic!("no {kind} {name}"))
}

pub(super) fn actuators(root: &Element) -> Vec<&str> {
    let section = root.elements().find(|element| element.name == "actuator").expect("actuators");
    section.elements().filter_map(|actuator| actuator.get("name")).collect()
}

#[test]
fn controls_keep_their_order_and_keyframes_follow_them() {
    let key = "<keyframe><key name='home' qpos='0 -0.785 0 -2.356 0 1.571 0.785 0.04 0.03' qvel='0 0 0 0 0 0 0 0 0' ctrl='0.1 -0.785 0.2 \
               -2.356 0.3 1.571 0.785 0.04'/></keyframe>";
    let (_, root) = merged(&lab("", "", key), "", &[]).expect("a model");
    let names = actuators(&root);
    assert_eq!(names[..8], ["motor1", "motor2", "motor3", "motor4", "motor5", "motor6", "motor7", "grip"]);
    assert_eq!((names.len(), names[8]), (15, "fr3_joint1_velocity"), "{names:?}");
    let motor = named(&root, "general", "motor2");
    assert_eq!(
        (motor.get("joint"), motor.get("gainprm"), motor.get("biasprm")),
        (Some("fr3_joint2"), Some("600 0 0"), Some("0 -600 -0"))
    );
    assert_eq!(motor.get("class"), Some("drive"), "its range of controls stays");
    let home = named(&root, "key", "home");
    let list = |key: &str| home.get(key).map(numbers).expect(key);
    assert_eq!(list("ctrl"), [0.1, -0.785, 0.2, -2.356, 0.3, 1.571, 0.785, 0.04, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let (q, object) = (list("qpos"), named(&root, "body", "object"));
    assert_eq!((q.len(), list("qvel").len(), q[7..9].to_vec()), (16, 15, vec![0.04, 0.03]));
    assert_eq!(q[9..12].to_vec(), object.get("pos").map(numbers).expect("a place"));
}

#[test]
fn controls_of_another_kind_become_the_positions_of_their_joints() {
    let motors = lab("", "", "<keyframe><key name='up' qpos='0 -0.5 0 -2 0 1.5 0.7 0 0' ctrl='9 9 9 9 9 9 9 0.04'/><key name='bare' ctrl='9 9 9 9 9 9 9 0.04'/></keyframe>")
        .replace("biastype='affine' biasprm='0 -2000 -200'", "");
    let (model, root) = merged(&motors, "", &[]).expect("a model");
    let up = named(&root, "key", "up").get("ctrl").map(numbers).expect("controls");
    assert_eq!(up[..8], [0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.7, 0.04]);
    assert_eq!(named(&root, "key", "bare").get("ctrl"), None);
    assert!(model.left_out.iter().any(|left| left.what == "ctrl of keyframe bare"), "{:?}", model.left_out);
}

#[test]
fn places_come_into_the_frame_of_the_base_wherever_it_stands() {
    let payload = "[[effect]]\nname = \"payload\"\nmass = 0.4\ncentre = [0.0, 0.0, 0.05]\n";
    let bases = [
        ("", Isometry3::identity()),
        (
            "pos='0.2 0.1 0.75' euler='0 0 90'",
            Isometry3::new(Vector3::new(0.2, 0.1, 0.75), Vector3::z() * 90_f64.to_radians()),
        ),
        ("pos='0 0 1' euler='0 90 0'", Isometry3::new(Vector3::new(0.0, 0.0, 1.0), Vector3::y() * 90_f64.to_radians())),
    ];
    let cell = super::super::write(&shipped(), &Theta::default(), Format::Mjcf, None).expect("a model");
    let cell = Element::read(&cell.text).expect("XML");
    for (text, base) in bases {
        let (model, root) = merged(&lab(text, "", ""), payload, &[]).expect("a model");
        for (kind, name) in [("body", "object"), ("camera", "camera")] {
            let at = |root: &Element| super::places::Angles::of(&Element::default()).frame(named(root, kind, name));
            let off = (base * at(&cell)).inverse() * at(&root);
            assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-6, "{name}: {off:?}");
        }
        // A load hangs at the flange, whatever the frame of the last link.
        let (places, flange) = (Places::of(&root), Places::of(&cell).bodies["flange"]);
        let off = (base * flange).inverse() * places.bodies["payload"];
        assert!(off.translation.vector.norm() < 1e-9, "{off:?}");
        let leans = model.left_out.iter().any(|left| left.what == "gravity");
        assert_eq!(leans, text.contains("90 0'") && !text.contains("0 0 90"), "{:?}", model.left_out);
        let sensor = named(&root, "framepos", "object_position");
        assert_eq!(sensor.get("refname"), Some("cell_base"));
        let site = super::places::Angles::of(&Element::default()).frame(named(&root, "site", "cell_base"));
        assert!((site * Point3::origin()).coords.norm() < 1e-9, "the stand is the cell's base: {site:?}");
    }
}

#[test]
fn sensors_and_names_of_the_model_stay_and_an_encoder_that_is_off_moves_its_keyframes() {
    let more = "<sensor><actuatorfrc name='torque2' actuator='motor2'/><jointpos name='q2' joint='fr3_joint2'/></sensor><keyframe><key \
                name='home' qpos='0 -0.785 0 -2.356 0 1.571 0.785 0 0' ctrl='0 -0.785 0 -2.356 0 1.571 0.785 0'/></keyframe>";
    let offset = "[[effect]]\nname = \"joint_encoder_offset\"\noffset = [0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0]\n";
    let (_, root) = merged(&lab("", "", more), offset, &[]).expect("a model");
    assert_eq!(named(&root, "actuatorfrc", "torque2").get("actuator"), Some("motor2"));
    assert_eq!(named(&root, "jointpos", "q2").get("joint"), Some("fr3_joint2"));
    let reads = numbers(named(&root, "joint", "fr3_joint2").get("ref").expect("an offset"))[0].to_radians();
    let list = |key: &str| named(&root, "key", "home").get(key).map(numbers).expect(key)[1];
    assert!((reads.abs() - 0.02).abs() < 1e-9, "{reads}");
    assert!((list("qpos") - (-0.785 + reads)).abs() < 1e-9 && (list("ctrl") - (-0.785 + reads)).abs() < 1e-9);
}

#[test]
fn one_of_several_arms_is_asked_for_and_an_arm_of_another_build_is_refused() {
    let one = lab("", "left_", "");
    let two = one.replace(
        "</worldbody>",
        &format!("{}</worldbody>", {
            let right = lab("pos='0 1 0'", "right_", "");
            let (_, bodies) = right.split_once("<body name='stand'").expect("a stand");
            let (bodies, _) = bodies.split_once("</worldbody>").expect("its end");
            format!("<body name='other'{bodies}")
        }),
    );
    let asked = merged(&two, "", &[]).expect_err("two arms");
    assert!(asked.contains("2 arms") && asked.contains("--base-joints right_fr3_joint1,"), "{asked}");
    let names: Vec<String> = (1..=7).map(|k| format!("right_fr3_joint{k}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (_, root) = merged(&two, "", &names).expect("the right arm");
    assert!(numbers(named(&root, "body", "object").get("pos").expect("a place"))[1] > 0.99);
    assert!(named(&root, "joint", "right_fr3_joint1").get("armature").is_some());
    assert!(named(&root, "joint", "left_fr3_joint1").get("armature").is_none());
    let longer = lab("", "", "").replace("<body name='link3' pos='", "<body name='link3' pos='0.5 0 0' user='");
    let refused = merged(&longer, "", &[]).expect_err("another arm");
    assert!(refused.contains("not built as the cell's"), "{refused}");
}

#[test]
fn included_files_come_in_and_meshes_are_found_from_the_new_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().canonicalize().expect("a folder");
    std::fs::create_dir(at.join("out")).expect("room");
    let arm = lab("", "", "");
    let (before, bodies) = arm.split_once("<worldbody>").expect("a world");
    std::fs::write(
        at.join("arm.xml"),
        format!("<mujocoinclude><worldbody>{}</mujocoinclude>", bodies.trim_end_matches("</mujoco>")),
    )
    .expect("room");
    let main = before.replace("<compiler ", "<compiler meshdir='meshes' ")
        + "<include file='arm.xml'/><asset><mesh file='cup.obj'/></asset></mujoco>";
    std::fs::write(at.join("lab.xml"), main).expect("room");
    let (file, out) = (at.join("lab.xml"), at.join("out/found.xml"));
    let base = Base { file: &file, joints: &[], out: Some(&out) };
    let model = write_into(&shipped(), &Theta::default(), Format::Mjcf, &base).expect("a model");
    let root = Element::read(&model.text).expect("XML");
    assert!(root.all().iter().all(|element| element.name != "include"));
    let places: Vec<&str> = root.all().iter().filter_map(|element| element.get("meshdir")).collect();
    assert_eq!(places, [at.join("meshes").to_str().expect("UTF-8")]);
    std::fs::write(at.join("lab.xml"), "<mujoco><include file='lab.xml'/></mujoco>").expect("room");
    let error = write_into(&shipped(), &Theta::default(), Format::Mjcf, &base).expect_err("no end").to_string();
    assert!(error.contains("include each other"), "{error}");
}

#[test]
fn a_urdf_keeps_everything_but_what_is_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let bare = super::super::write(&shipped(), &Theta::default(), Format::Urdf, None).expect("a model").text;
    let own = bare.replace("fr3_joint", "joint").replace("effort=\"87\"", "effort=\"20\"");
    let file = folder.path().join("own.urdf");
    std::fs::write(&file, &own).expect("room");
    let theta = "[[effect]]\nname = \"joint_viscous_friction\"\nviscous = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]\n[[effect]]\nname = \
                 \"payload\"\nmass = 0.4\ncentre = [0.0, 0.0, 0.05]\n";
    let theta: Theta = shared_mem::toml_file::parse(theta, Path::new("theta.toml")).expect("a theta.toml");
    let base = Base { file: &file, joints: &[], out: None };
    let model = write_into(&shipped(), &theta, Format::Urdf, &base).expect("a model");
    let before = ArmModel::from_urdf(&own, &file, &[]).expect("an arm");
    let after = ArmModel::from_urdf(&model.text, &file, &[]).expect("an arm");
    assert_eq!(after.joint_names()[0], "joint1");
    assert_eq!(after.torque_limit()[0], 87.0);
    assert!((after.moving_mass() - before.moving_mass() - 0.4).abs() < 1e-9);
    assert!(model.text.contains("damping=\"3\""), "{}", model.text);
    assert!(super::super::write_into(&shipped(), &theta, Format::Sdf, &base).is_err());
}
