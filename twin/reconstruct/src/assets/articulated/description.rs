//! The object for other programs: a URDF of two links, and the `[[articulated]]` block of a task.

use super::{ArticulatedSummary, LINKS};
use crate::assets::escaped;
use crate::mesh::Mesh;
use std::fmt::Write as _;

pub(super) fn piece_file(link: &str, number: usize) -> String {
    format!("pieces/{link}_{number:02}.obj")
}

/// Two links: the fine meshes to see, the convex pieces to touch. Pieces lie around their own middle, and stand where they belong by
/// their `<origin>`.
pub(super) fn urdf(summary: &ArticulatedSummary, pieces: &[Vec<Mesh>; 2]) -> String {
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&summary.name));
    for (number, part) in summary.parts.iter().enumerate() {
        let [x, y, z] = part.centre_of_mass_m;
        let [xx, xy, xz, yy, yz, zz] = part.inertia_kg_m2;
        let link = LINKS[number];
        write!(
            text,
            "  <link name=\"{link}\">\n    <inertial>\n      <origin xyz=\"{x:.6} {y:.6} {z:.6}\" rpy=\"0 0 0\"/>\n      \
             <mass value=\"{:.6}\"/>\n      \
             <inertia ixx=\"{xx:e}\" ixy=\"{xy:e}\" ixz=\"{xz:e}\" iyy=\"{yy:e}\" iyz=\"{yz:e}\" izz=\"{zz:e}\"/>\n    </inertial>\n    \
             <visual>\n      <geometry><mesh filename=\"{link}_fine.obj\"/></geometry>\n    </visual>\n",
            part.mass_kg
        )
        .expect("a string takes all text");
        for (piece, mesh) in pieces[number].iter().enumerate() {
            let (low, high) = mesh.bounds();
            let middle = nalgebra::center(&low, &high);
            write!(
                text,
                "    <collision>\n      <origin xyz=\"{:.7} {:.7} {:.7}\" rpy=\"0 0 0\"/>\n      \
                 <geometry><mesh filename=\"{}\"/></geometry>\n    </collision>\n",
                middle.x,
                middle.y,
                middle.z,
                piece_file(link, piece)
            )
            .expect("a string takes all text");
        }
        text.push_str("  </link>\n");
    }
    let joint = &summary.joint;
    let ([x, y, z], [u, v, w], [lower, upper]) = (joint.origin_m, joint.axis, joint.limits);
    write!(
        text,
        "  <joint name=\"joint\" type=\"{}\">\n    <parent link=\"base\"/>\n    <child link=\"part\"/>\n    \
         <origin xyz=\"{x:.6} {y:.6} {z:.6}\" rpy=\"0 0 0\"/>\n    <axis xyz=\"{u:.7} {v:.7} {w:.7}\"/>\n    \
         <limit lower=\"{lower:.6}\" upper=\"{upper:.6}\" effort=\"100\" velocity=\"10\"/>\n    \
         <dynamics friction=\"0\" damping=\"0\"/>\n  </joint>\n</robot>\n",
        joint.kind
    )
    .expect("a string takes all text");
    text
}

/// The `[[articulated]]` block of a task.
pub(super) fn block(summary: &ArticulatedSummary) -> String {
    let unit = if summary.joint.kind == "revolute" { "rad" } else { "m" };
    let [lower, upper] = summary.joint.limits;
    // What TOML's basic strings take as it is.
    let name: String = summary.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    format!(
        "# Of scans: its part goes from {lower:.4} to {upper:.4} {unit}. Friction and damping of the joint stand in articulated.urdf.\n\
         [[articulated]]\nname = \"{name}\"\nurdf = \"articulated.urdf\"\nhold = \"fixed\"\nposition = [0.5, 0.0, {:.4}]\n\
         friction = 0.5\njoints = {{ joint = {:.4} }}\n",
        -summary.low_m.min(0.0),
        0.0f64.clamp(lower, upper)
    )
}
