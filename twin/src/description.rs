//! The robot's description for programs that draw it and know its frames: the URDF that cell.toml names, else one of the built-in
//! arm with cylinders from joint to joint. Numbers stand in full, so that frames calculated from it are the twin's.

use crate::arm::{ArmModel, LinkFrame, ModelError, Part, UrdfFrames};
use crate::xml::Document;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;
use shared_mem::input;
use shared_mem::recording::{RobotModel, Transform};
use std::path::Path;

/// Radius of a link at the base and at the flange [m]: an FR3's.
const LINK_RADIUS: [f64; 2] = [0.065, 0.042];
/// Joints closer than this have no link to be drawn between them [m].
const SHORTEST: f64 = 1e-3;

/// The robot as recordings show it: description, frames that stay and frames that move. `None` where no arm moves, or only its
/// joints' names are known.
///
/// # Errors
/// [`ModelError`] when cell.toml describes no arm, or its URDF cannot be read.
pub fn shown_robot(cell: &Cell) -> Result<Option<RobotModel>, ModelError> {
    let Some(description) = description(cell)? else { return Ok(None) };
    let arm = ArmModel::from_cell(cell)?;
    let file = cell.robot.as_ref().and_then(|robot| robot.urdf.as_deref()).unwrap_or(Path::new("the built-in model"));
    shown(description, &arm, (Some(cell.base_frame()), file)).map(Some)
}

/// The same of a URDF's text, whose arm was read already.
///
/// # Errors
/// [`ModelError`] when a joint of it moves in more than one way.
pub fn shown_urdf(text: &str, arm: &ArmModel) -> Result<RobotModel, ModelError> {
    shown(text.to_owned(), arm, (None, Path::new("robot_description")))
}

fn shown(text: String, arm: &ArmModel, (base, file): (Option<&str>, &Path)) -> Result<RobotModel, ModelError> {
    let frames = UrdfFrames::of(&text, file)?.renamed(arm.described_joint_names(), arm.joint_names());
    let (root, joints) = (frames.root().to_owned(), arm.joint_names().to_vec());
    let mut fixed: Vec<Transform> = frames.fixed(&joints).map(transform).collect();
    if let Some(base) = base.filter(|base| *base != root) {
        // Recordings give poses in the frame that cell.toml names.
        let parent_from_child = Isometry3::identity();
        fixed.push(transform(LinkFrame { parent: base, child: &root, parent_from_child }));
    }
    let frames_at = move |names: &[String], q: &[f64]| {
        let moving: Vec<Transform> = frames.moving(names, q).map(transform).collect();
        (!moving.is_empty()).then_some(moving)
    };
    Ok(RobotModel { description: text, root, joints, fixed, frames_at: Box::new(frames_at) })
}

fn transform(frame: LinkFrame<'_>) -> Transform {
    let LinkFrame { parent, child, parent_from_child } = frame;
    let (p, q) = (parent_from_child.translation.vector, parent_from_child.rotation.quaternion());
    Transform { parent: parent.to_owned(), child: child.to_owned(), position: p.into(), wxyz: [q.w, q.i, q.j, q.k] }
}

/// The URDF's text; `None` where only the names of the joints are known.
fn description(cell: &Cell) -> Result<Option<String>, ModelError> {
    let Some(robot) = &cell.robot else { return Ok(None) };
    if let Some(file) = &robot.urdf {
        return Ok(Some(input::text(&cell.folder.join(file), input::Kind::Robot)?));
    }
    let arm = ArmModel::from_cell(cell)?;
    Ok(arm.has_geometry().then(|| written(cell, &arm)))
}

fn written(cell: &Cell, arm: &ArmModel) -> String {
    let mut xml = Document::new();
    xml.open("robot", &[("name", "fr3".into())]);
    let (parts, flange) = (arm.parts(), arm.flange_on_last_part());
    let last = parts.len();
    // Where the next joint, or the flange, lies in each link's frame.
    let next = |link: usize| parts.get(link).map_or(flange.translation.vector, |part| part.origin.translation.vector);
    let radius = |link: usize| {
        let share = link as f64 / last.max(1) as f64;
        LINK_RADIUS[0] * (1.0 - share) + LINK_RADIUS[1] * share
    };
    let mut before = cell.base_frame().to_owned();
    link(&mut xml, &before, Some((Vector3::zeros(), next(0), radius(0))));
    for (number, part) in parts.iter().enumerate() {
        joint(&mut xml, part, &before);
        before.clone_from(&part.link);
        link(&mut xml, &before, Some((Vector3::zeros(), next(number + 1), radius(number + 1))));
    }
    fixed(&mut xml, ("flange_joint", &before, "flange"), &flange);
    let tool = cell.tool.as_ref().map(|tool| (Vector3::zeros(), Vector3::z() * tool.length, tool.radius));
    link(&mut xml, "flange", tool);
    xml.finish()
}

/// A link, drawn as a cylinder from one point to another.
fn link(xml: &mut Document, name: &str, shape: Option<(Vector3<f64>, Vector3<f64>, f64)>) {
    xml.open("link", &[("name", name.into())]);
    if let Some((from, to, radius)) = shape.filter(|(from, to, _)| (to - from).norm() > SHORTEST) {
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(to - from))
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let middle = Isometry3::from_parts(Translation3::from((from + to) / 2.0), turn);
        xml.open("visual", &[]);
        xml.leaf("origin", &origin(&middle));
        xml.open("geometry", &[]);
        xml.leaf("cylinder", &[("radius", radius.to_string()), ("length", (to - from).norm().to_string())]);
        xml.close();
        xml.close();
    }
    xml.close();
}

fn joint(xml: &mut Document, part: &Part, parent: &str) {
    let kind = if part.slides { "prismatic" } else { "revolute" };
    xml.open("joint", &[("name", part.joint.clone()), ("type", kind.into())]);
    ends(xml, (parent, &part.link), &part.origin);
    xml.leaf("axis", &[("xyz", numbers(part.axis.as_slice()))]);
    let [lower, upper] = part.range.map(|end| end.to_string());
    xml.leaf(
        "limit",
        &[
            ("lower", lower),
            ("upper", upper),
            ("effort", part.torque.to_string()),
            ("velocity", part.velocity.to_string()),
        ],
    );
    xml.close();
}

fn fixed(xml: &mut Document, (name, parent, child): (&str, &str, &str), at: &Isometry3<f64>) {
    xml.open("joint", &[("name", name.into()), ("type", "fixed".into())]);
    ends(xml, (parent, child), at);
    xml.close();
}

fn ends(xml: &mut Document, (parent, child): (&str, &str), at: &Isometry3<f64>) {
    xml.leaf("parent", &[("link", parent.into())]);
    xml.leaf("child", &[("link", child.into())]);
    xml.leaf("origin", &origin(at));
}

fn origin(at: &Isometry3<f64>) -> [(&'static str, String); 2] {
    let (roll, pitch, yaw) = at.rotation.euler_angles();
    [("xyz", numbers(at.translation.vector.as_slice())), ("rpy", numbers(&[roll, pitch, yaw]))]
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::msg::joints_from;

    #[test]
    fn frames_calculated_from_it_are_the_twin_s() {
        let cell = Cell::parse(include_str!("../../config/fr3_cell.toml"), Path::new("cell.toml")).expect("a cell");
        let arm = ArmModel::from_cell(&cell).expect("an arm");
        let text = description(&cell).expect("an arm").expect("a shape");
        let frames = UrdfFrames::of(&text, Path::new("fr3.urdf")).expect("own text");
        assert_eq!(frames.root(), "fr3_link0");
        // Axes of joints 1 and 2, and of 5 and 6, meet in a point each.
        assert_eq!(text.matches("<cylinder").count(), 7, "{text}");
        let q = [0.3, -0.7, 0.2, -2.1, -0.4, 1.9, 1.2];
        let moving: Vec<_> = frames.moving(arm.joint_names(), &q).collect();
        let (mut at, mut farthest) = (Isometry3::identity(), 0.0_f64);
        for (frame, (name, expected)) in moving.iter().zip(arm.named_links(&joints_from(&q))) {
            at *= frame.parent_from_child;
            assert_eq!(frame.child, name);
            farthest = farthest.max((at.to_homogeneous() - expected.to_homogeneous()).abs().max());
        }
        let last: Vec<_> = frames.fixed(arm.joint_names()).collect();
        assert_eq!(last.iter().map(|frame| frame.child).collect::<Vec<_>>(), ["flange"]);
        at *= last[0].parent_from_child;
        let flange = arm.flange(&joints_from(&q)).isometry().to_homogeneous();
        farthest = farthest.max((at.to_homogeneous() - flange).abs().max());
        assert!(moving.len() == 7 && farthest < 1e-9, "{farthest}");
    }
}
