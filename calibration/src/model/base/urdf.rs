//! The user's URDF with what is known of the arm: friction of its joints, its largest torques, loads on its flange. All else stays byte for byte.

use super::super::cell_model::CellModel;
use super::super::known::{Known, number};
use super::{Base, LeftOut, arms};
use anyhow::{anyhow, ensure};
use nalgebra::Isometry3;
use shared_mem::input;
use std::path::Path;
use twin::arm::{ArmModel, with_files_found_from, with_joint_numbers};

/// The text, and what is not in it.
///
/// # Errors
/// What of the user's model cannot be used.
pub(super) fn merge(model: &CellModel, base: &Base<'_>) -> anyhow::Result<(String, Vec<LeftOut>)> {
    let arm = model
        .arm
        .as_ref()
        .ok_or_else(|| anyhow!("the cell has no arm; --base brings the arm of a model up to date"))?;
    let mut text = input::text(base.file, input::Kind::Robot)?;
    let theirs = ArmModel::from_urdf(&text, base.file, base.joints)?;
    let cell: Vec<String> = arm.joints.iter().map(|joint| joint.part.joint.clone()).collect();
    let own = arms::chosen(&cell, theirs.joint_names(), base.joints)?;
    ensure!(
        own == theirs.joint_names(),
        "{} has an arm of the joints {}, and the cell's are {}; say with --base-joints which are meant",
        base.file.display(),
        theirs.joint_names().join(", "),
        own.join(", ")
    );
    for (joint, name) in arm.joints.iter().zip(&own) {
        for (tag, key, known) in [
            ("dynamics", "friction", &joint.dry),
            ("dynamics", "damping", &joint.damping),
            ("limit", "effort", &joint.torque_limit),
        ] {
            if known.is_known() && known.value.is_finite() {
                text = with_joint_numbers(&text, base.file, (name, tag), &[(key, known.value)])?;
            }
        }
    }
    let mut left_out = Vec::new();
    let parts = theirs.parts();
    let more = arm.loads.iter().map(|load| {
        let link = parts.last().map_or("", |part| part.link.as_str());
        body(&load.name, link, &theirs.flange_on_last_part(), &load.mass, load.centre)
    });
    let more: String = more.collect();
    if model.camera.is_some() {
        left_out.push(LeftOut {
            what: "the camera".into(),
            why: "a URDF of your own has its own frames: its pose stands in theta.toml and cell.toml".into(),
        });
    }
    let end = text.rfind("</robot>").ok_or_else(|| anyhow!("{} does not end with </robot>", base.file.display()))?;
    text.insert_str(end, &more);
    let out = base.out.unwrap_or(Path::new("model.urdf"));
    Ok((with_files_found_from(&text, base.file, out)?, left_out))
}

/// A load with the joint by which it hangs.
fn body(name: &str, parent: &str, at: &Isometry3<f64>, mass: &Known, centre: [f64; 3]) -> String {
    let (p, (roll, pitch, yaw)) = (at.translation.vector, at.rotation.euler_angles());
    let [x, y, z] = centre.map(number);
    let small = "ixx=\"1e-9\" iyy=\"1e-9\" izz=\"1e-9\" ixy=\"0\" ixz=\"0\" iyz=\"0\"";
    format!(
        "  <link name=\"{name}\">\n    <inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{}\"/><inertia {small}/></inertial>\n  </link>\n  <joint \
         name=\"{name}_joint\" type=\"fixed\">\n    <parent link=\"{parent}\"/><child link=\"{name}\"/><origin xyz=\"{} {} {}\" rpy=\"{} {} {}\"/>\n  \
         </joint>\n",
        number(mass.value),
        number(p.x),
        number(p.y),
        number(p.z),
        number(roll),
        number(pitch),
        number(yaw)
    )
}
