//! The user's URDF with what is known of the arm: friction of its joints, its largest torques, loads on its flange. All else stays byte for byte.

use super::super::cell_model::{Arm, CellModel};
use super::super::known::{Known, number};
use super::names::names_for;
use super::places::PlacedJoint;
use super::{Base, LeftOut, alike, arms};
use anyhow::anyhow;
use nalgebra::Isometry3;
use shared_mem::input;
use std::path::Path;
use twin::arm::{ArmModel, Part, with_elements, with_files_found_from, with_joint_numbers};
use twin::xml::Element;

/// Of a load, which is a point: `<inertia>` wants some.
const POINT: &str = "ixx=\"1e-9\" iyy=\"1e-9\" izz=\"1e-9\" ixy=\"0\" ixz=\"0\" iyz=\"0\"";

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
    let root = Element::read(&text).map_err(|what| anyhow!("{}: {what}", base.file.display()))?;
    let cell: Vec<String> = arm.joints.iter().map(|joint| joint.part.joint.clone()).collect();
    let own = arms::chosen(&cell, &joints_of(&root), base.joints)?;
    let theirs = ArmModel::from_urdf(&text, base.file, &own)?;
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
    if model.camera.is_some() {
        left_out.push(LeftOut {
            what: "the camera".into(),
            why: "a URDF of your own has its own frames: its pose stands in theta.toml and cell.toml".into(),
        });
    }
    let parts = theirs.parts();
    let at = flange(arm, &theirs, &parts, &own)?;
    let parent = parts.last().map_or("", |part| part.link.as_str());
    let (mut more, mut before) = (String::new(), Vec::new());
    for load in &arm.loads {
        let name = name_of_load(&root, &load.name, parent);
        if name != load.name {
            left_out.push(LeftOut {
                what: format!("the name `{}` of the load", load.name),
                why: format!("the model has another link or joint of this name; the load is `{name}`"),
            });
        }
        more += &body(&name, parent, &at, &load.mass, load.centre);
        before.push(name);
    }
    // What an earlier merge wrote there goes.
    let is_earlier = |kind: &str, name: &str| {
        let link = if kind == "joint" { name.strip_suffix("_joint") } else { Some(name) };
        link.is_some_and(|link| before.iter().any(|name| name == link) && is_load_of(&root, link, parent))
    };
    let text = with_elements(&text, base.file, &more, &is_earlier)?;
    let out = base.out.unwrap_or(Path::new("model.urdf"));
    Ok((with_files_found_from(&text, base.file, out)?, left_out))
}

/// Joints that an arm may have, in the document's order.
fn joints_of(root: &Element) -> Vec<String> {
    let moves = |joint: &&Element| {
        joint.name == "joint"
            && joint.get("type").is_some_and(|kind| ["revolute", "continuous", "prismatic"].contains(&kind))
            && joint.elements().all(|inner| inner.name != "mimic")
    };
    root.elements().filter(moves).filter_map(|joint| joint.get("name")).map(str::to_owned).collect()
}

/// The cell's flange in the user's last link: where it is by the axes of the joints, whatever hangs behind it in the user's model.
fn flange(arm: &Arm, theirs: &ArmModel, parts: &[Part], own: &[String]) -> anyhow::Result<Isometry3<f64>> {
    let of_cell: Vec<Part> = arm.joints.iter().map(|joint| joint.part.clone()).collect();
    let (in_cell, in_own) = (placed(&of_cell), placed(parts));
    let (Some(last), Some(there), true) = (in_own.last(), in_cell.last(), arm.has_geometry) else {
        return Ok(theirs.flange_on_last_part());
    };
    let frame = alike::base(&in_cell.iter().collect::<Vec<_>>(), &in_own.iter().collect::<Vec<_>>(), own)?;
    Ok(last.body.inverse() * frame * there.body * arm.flange)
}

/// Joints in the base frame with all at 0.
fn placed(parts: &[Part]) -> Vec<PlacedJoint> {
    let mut at = Isometry3::identity();
    let mut place = |part: &Part| {
        at *= part.origin;
        let kind = if part.slides { "slide" } else { "hinge" };
        PlacedJoint::new(at, at.translation.vector, at.rotation * part.axis.into_inner(), kind)
    };
    parts.iter().map(&mut place).collect()
}

/// A name for a load that nothing else in the model has, neither its link nor its joint.
fn name_of_load(root: &Element, wanted: &str, parent: &str) -> String {
    let is_there = |kind: &str, name: &str| root.elements().any(|e| e.name == kind && e.get("name") == Some(name));
    let is_usable = |name: &String| {
        is_load_of(root, name, parent) || !is_there("link", name) && !is_there("joint", &format!("{name}_joint"))
    };
    names_for(wanted).find(is_usable).unwrap_or_default()
}

/// Whether a link is one that an earlier merge hung there: a point on a fixed joint.
fn is_load_of(root: &Element, link: &str, parent: &str) -> bool {
    let called = |kind: &str, name: &str| root.elements().find(|e| e.name == kind && e.get("name") == Some(name));
    let inner = |element: &'_ Element, kind: &str, key: &str| {
        let inner = element.elements().find(|inner| inner.name == kind);
        inner.and_then(|inner| inner.get(key)).map(str::to_owned)
    };
    let is_point = called("link", link).is_some_and(|link| {
        let inertial = link.elements().find(|inner| inner.name == "inertial");
        let moment = |key: &str| inertial.and_then(|inertial| inner(inertial, "inertia", key));
        link.elements().count() == 1 && ["ixx", "iyy", "izz"].iter().all(|key| moment(key).as_deref() == Some("1e-9"))
    });
    let hangs = called("joint", &format!("{link}_joint"))
        .is_some_and(|joint| inner(joint, "parent", "link").as_deref() == Some(parent));
    is_point && hangs
}

/// A load with the joint by which it hangs.
fn body(name: &str, parent: &str, at: &Isometry3<f64>, mass: &Known, centre: [f64; 3]) -> String {
    let (p, (roll, pitch, yaw)) = (at.translation.vector, at.rotation.euler_angles());
    let [x, y, z] = centre.map(number);
    format!(
        "  <link name=\"{name}\">\n    <inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{}\"/><inertia {POINT}/></inertial>\n  </link>\n  <joint \
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
