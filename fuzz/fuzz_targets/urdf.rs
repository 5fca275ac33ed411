//! A URDF: the XML reader, and the chain of joints that the twin makes of what it read.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::cell::{Cell, Robot};
use twin::arm::ArmModel;

const ARM: &[u8] = include_bytes!("../../rt_bridge/src/serve/fr3.urdf");
const TWO_JOINTS: &[u8] = br#"<robot name="x" version="1.2"><link name="a"/><link name="b"><inertial><mass value="1"/><origin rpy="0 1 0"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><link name="c"/><joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint><joint name="k" type="fixed"><parent link="b"/><child link="c"/><origin xyz="1 2 3" quat_xyzw="0 0 0 1"/></joint></robot>"#;

fuzz_target!(
    init: fuzz::seeds([ARM.to_vec(), TWO_JOINTS.to_vec()]),
    |text: &str| {
        if let Err(error) = urdf_rs::read_from_string(text) {
            assert!(!error.to_string().contains(char::is_control), "{error:?}");
            return;
        }
        fuzz::file("arm.urdf", text.as_bytes());
        let robot = Robot { urdf: Some("arm.urdf".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), folder: fuzz::folder().to_owned(), ..Cell::default() };
        if let Some(arm) = fuzz::accepted(ArmModel::from_cell(&cell)) {
            let flange = arm.flange(arm.ready()).position();
            assert!(flange.iter().all(|value| value.is_finite()), "{flange:?}");
        }
    }
);
