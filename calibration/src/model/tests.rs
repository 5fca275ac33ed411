//! What is written is read back, and what was found stands in the file or among what it lacks.

use super::{Format, write};
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::theta::Theta;
use std::path::Path;
use twin::arm::ArmModel;
use twin::effects::{Role, registry};

fn shipped() -> Cell {
    let text = include_str!("../../../config/fr3_cell.toml");
    Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
}

fn theta(text: &str) -> Theta {
    shared_mem::toml_file::parse(text, Path::new("theta.toml")).expect("a theta.toml")
}

const FORMATS: [Format; 3] = [Format::Mjcf, Format::Urdf, Format::Sdf];

#[test]
fn an_urdf_that_is_written_is_the_arm_that_it_was_written_from() {
    let (mut cell, folder) = (shipped(), tempfile::tempdir().expect("a folder"));
    let file = write(&cell, &Theta::default(), Format::Urdf, None).expect("a model");
    std::fs::write(folder.path().join("arm.urdf"), &file.text).expect("room");
    let before = ArmModel::from_cell(&cell).expect("the arm");
    cell.robot = Some(shared_mem::cell::Robot { urdf: Some("arm.urdf".into()), ..Default::default() });
    (cell.folder, cell.tool) = (folder.path().to_owned(), None);
    let after = ArmModel::from_cell(&cell).expect("the arm that was written");
    assert_eq!(before.joint_names(), after.joint_names());
    let q = *before.ready();
    for (one, other) in before.mass_matrix(&q).as_flattened().iter().zip(after.mass_matrix(&q).as_flattened()) {
        assert!((one - other).abs() < 1e-8, "{one} {other}");
    }
    for (one, other) in before.gravity(&q).iter().zip(after.gravity(&q)) {
        assert!((one - other).abs() < 1e-7, "{one} {other}");
    }
}

#[test]
fn every_effect_stands_in_the_file_or_is_named_among_what_it_lacks() {
    for effect in registry() {
        let mut block = format!("[[effect]]\nname = \"{}\"\n", effect.name);
        for parameter in effect.parameters {
            if let Role::Size { .. } = parameter.role {
                let value = parameter.plausible[1] * 0.9;
                block += &match parameter.shape {
                    twin::effects::Shape::Vector(n) => format!("{} = {:?}\n", parameter.name, vec![value; n]),
                    _ => format!("{} = {value:?}\n", parameter.name),
                };
            }
        }
        // A cell of which next to nothing is known drops none either.
        let bounded = Cell { camera: None, objects: Vec::new(), tool: None, ..shipped() };
        for (cell, format) in FORMATS.iter().flat_map(|format| [(shipped(), *format), (bounded.clone(), *format)]) {
            let file = write(&cell, &theta(&block), format, None).expect("a model");
            let bare = write(&cell, &Theta::default(), format, None).expect("a model");
            let named = file.lines.iter().any(|line| line.from.iter().any(|from| from.contains(effect.name)));
            let lacks =
                file.left_out.iter().any(|left| left.what.contains(effect.name)) || file.left_out != bare.left_out;
            assert!(named || lacks, "{} is dropped in {format:?}", effect.name);
            assert!(!file.text.contains("NaN") && !file.text.contains("inf"), "{}", effect.name);
            for left in &file.left_out {
                let what = left.what.replace("--", "- -").replace(['<', '>'], "'");
                assert!(file.text.contains(&what), "{} is not said in the file: {what}", effect.name);
            }
        }
    }
}

#[test]
fn numbers_of_joints_are_sums_of_what_is_stated_and_what_was_found() {
    let found = theta(
        "[arm]\nstiffness = [610.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0]\ndamping = [50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0]\n\
         [[effect]]\nname = \"rotor_inertia\"\nextra = 0.1\n[[effect]]\nname = \"command_delay\"\ndelay = 0.012\n\
         [[effect]]\nname = \"torque_gain\"\ngain = 0.9\n",
    );
    let text = write(&shipped(), &found, Format::Mjcf, None).expect("a model").text;
    assert!(text.contains("armature=\"0.295\"") && text.contains("armature=\"0.174\""), "{text}");
    assert!(
        text.contains("kp=\"549\"") && text.contains("delay=\"0.012\"") && text.contains("gravcomp=\"0.9\""),
        "{text}"
    );
    assert!(text.contains(
        "fr3_joint1 armature [kg m^2]: rotor inertia seen at the joint, from cell.toml and theta.toml (rotor_inertia)"
    ));
}

#[test]
fn a_law_that_is_given_no_desired_velocity_has_no_actuator_for_it() {
    let actuators = |kind: ControllerKind| {
        let mut cell = shipped();
        cell.controller.as_mut().expect("a controller").kind = kind;
        let text = write(&cell, &Theta::default(), Format::Mjcf, None).expect("a model").text;
        [text.contains("fr3_joint1_velocity"), text.contains("gravcomp=\"1\""), text.contains("kp=\"600\" kv=\"50\"")]
    };
    assert_eq!(actuators(ControllerKind::JointImpedance), [true, true, false]);
    assert_eq!(actuators(ControllerKind::CompensatedPd), [false, true, true]);
    assert_eq!(actuators(ControllerKind::JointPd), [false, false, true]);
}

#[test]
fn a_joint_of_any_name_makes_no_other_element() {
    let evil = "a\\\"/><joint name='b' --> ";
    let text = format!(
        "[robot]\njoints = [\"{evil}\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [2.0]\ndamping = [0.1]\n"
    );
    let cell = Cell::parse(&text, Path::new("cell.toml")).expect("a cell");
    for format in FORMATS {
        let file = write(&cell, &Theta::default(), format, None).expect("a model");
        assert!(!file.text.contains("<joint name='b'"), "{}", file.text);
        assert_eq!(file.text.matches("<!--").count(), file.text.matches("-->").count(), "{}", file.text);
    }
}
