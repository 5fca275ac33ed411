//! Meshes as files: OBJ for shapes, binary PLY with colours.

use super::Mesh;
use std::fmt::Write as _;

/// A Wavefront OBJ [m].
pub fn obj(mesh: &Mesh) -> String {
    let mut text = String::with_capacity(40 * (mesh.points.len() + mesh.triangles.len()));
    for point in &mesh.points {
        writeln!(text, "v {:.7} {:.7} {:.7}", point.x, point.y, point.z).expect("a string takes all text");
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| corner + 1);
        writeln!(text, "f {a} {b} {c}").expect("a string takes all text");
    }
    text
}

/// A binary PLY [m] with colours, and, where it is known, with how many pictures show each corner (at most 255).
pub fn ply(mesh: &Mesh, colours: &[[u8; 3]], pictures: Option<&[u8]>) -> Vec<u8> {
    let shown = if pictures.is_some() { "property uchar pictures\n" } else { "" };
    let head = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n{shown}\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.points.len(),
        mesh.triangles.len()
    );
    let mut out = head.into_bytes();
    for (number, (point, colour)) in mesh.points.iter().zip(colours).enumerate() {
        out.extend(point.coords.iter().flat_map(|v| (*v as f32).to_le_bytes()));
        out.extend(colour);
        out.extend(pictures.map(|pictures| pictures[number]));
    }
    for triangle in &mesh.triangles {
        out.push(3);
        out.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn files_hold_what_the_mesh_holds() {
        let points = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 0.25, 0.0)];
        let mesh = Mesh { points, triangles: vec![[0, 1, 2]] };
        let text = obj(&mesh);
        assert!(text.contains("v 0.0000000 0.2500000 0.0000000\nf 1 2 3"), "{text}");
        let bytes = ply(&mesh, &[[1, 2, 3]; 3], Some(&[7; 3]));
        let data = bytes.windows(11).position(|w| w == b"end_header\n").expect("a head") + 11;
        assert_eq!(bytes.len() - data, 3 * 16 + 13);
        assert_eq!(&bytes[data + 12..data + 16], &[1, 2, 3, 7]);
    }
}
