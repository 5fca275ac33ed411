//! What is read of meshes, and what is refused.

use super::*;

const TETRAHEDRON: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

fn read_as(name: &str, bytes: &[u8]) -> Result<ObjectShape, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    read(&path).map_err(|e| e.to_string())
}

fn written_as_obj() -> String {
    let lines = TETRAHEDRON.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    lines.chain(FACES.iter().map(|f| format!("f {}/1 {}/1 {}/1\n", f[0] + 1, f[1] + 1, f[2] + 1))).collect()
}

fn written_as_ply(format: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for v in TETRAHEDRON {
        match format {
            "ascii" => out.extend(format!("{} {} {}\n", v[0], v[1], v[2]).bytes()),
            _ => out.extend(v.iter().flat_map(|c| (*c as f32).to_le_bytes())),
        }
    }
    for f in FACES {
        match format {
            "ascii" => out.extend(format!("3 {} {} {}\n", f[0], f[1], f[2]).bytes()),
            _ => {
                out.push(3);
                out.extend(f.iter().flat_map(|i| i.to_le_bytes()));
            }
        }
    }
    out
}

fn written_as_binary_stl() -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend(4u32.to_le_bytes());
    for f in FACES {
        out.extend([0; 12]);
        out.extend(f.iter().flat_map(|i| TETRAHEDRON[*i as usize]).flat_map(|c| (c as f32).to_le_bytes()));
        out.extend([0; 2]);
    }
    out
}

#[test]
fn every_format_gives_the_same_centred_body() {
    let files = [
        ("a.obj", written_as_obj().into_bytes()),
        ("a.ply", written_as_ply("ascii")),
        ("b.ply", written_as_ply("binary_little_endian")),
        ("a.stl", written_as_binary_stl()),
    ];
    for (name, bytes) in files {
        let shape = read_as(name, &bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(shape.half_extents(), Vector3::new(0.5, 0.5, 1.0), "{name}");
        let (points, triangles) = shape.triangles();
        assert_eq!((points.len(), triangles.len()), (4, 4), "{name}");
    }
}

#[test]
fn the_geometric_centre_is_the_middle_of_the_bounding_box_wherever_origin_and_centroid_of_the_file_are() {
    // The tetrahedron's corners have their centroid at (0.25, 0.25, 0.5), the volume too.
    let moved: String =
        TETRAHEDRON.iter().map(|[x, y, z]| format!("v {} {} {}\n", x + 7.0, y - 3.0, z + 0.5)).collect();
    let faces: String = FACES.iter().map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1)).collect();
    let (points, _) = read_as("a.obj", (moved + &faces).as_bytes()).expect("a body").triangles();
    let expected = TETRAHEDRON.map(|[x, y, z]| Point3::new(x - 0.5, y - 0.5, z - 1.0));
    assert!(points.iter().zip(&expected).all(|(a, b)| (a - b).norm() < 1e-12), "{points:?}");
}

#[test]
fn the_centroid_is_that_of_the_volume_and_an_open_surface_has_none() {
    let corners: String = TETRAHEDRON.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let faces = FACES.map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
    let read = |faces: &[String]| read_as("a.obj", (corners.clone() + &faces.concat()).as_bytes()).expect("a body");
    assert!((read(&faces).centroid() - Vector3::new(-0.25, -0.25, -0.5)).norm() < 1e-12);
    assert_eq!(read(&faces[1..]).centroid(), Vector3::zeros());
}

#[test]
fn a_ply_whose_header_promises_what_is_not_there_is_refused() {
    let file = |columns: &str, count: &str, values: &str| {
        format!("ply\nformat ascii 1.0\nelement vertex {count}\n{columns}end_header\n{values}")
    };
    let cases = [
        (file("property list uchar float x\n", "4", "0\n0\n0\n0\n"), "4 corners and 0 triangles"),
        (file("", "1000000000000", ""), "rows without columns"),
        (file("property float x\n", "18446744073709551615", "1\n"), "18446744073709551615 rows"),
        (file("property list uchar float x\n", "1", "1e18 0\n"), "a list claims"),
    ];
    for (text, expected) in cases {
        let error = read_as("a.ply", text.as_bytes()).expect_err(expected);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_mesh_inside_out_is_turned_around_and_its_open_edges_are_counted() {
    let inverted: String = FACES.iter().map(|f| format!("f {} {} {}\n", f[1] + 1, f[0] + 1, f[2] + 1)).collect();
    let corners: String = TETRAHEDRON.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let (points, triangles) = read_as("a.obj", (corners + &inverted).as_bytes()).expect("a body").triangles();
    assert!((volume(&points, &triangles) - 1.0 / 3.0).abs() < 1e-12);
    assert_eq!(open_edges(&points, &triangles), 0);
    assert_eq!(open_edges(&points, &triangles[1..]), 3);
}

#[test]
fn a_mesh_in_millimetres_is_refused_with_the_factor() {
    let text = written_as_obj().replace("v 0 0 2", "v 0 0 2000");
    let error = read_as("a.obj", text.as_bytes()).unwrap_err();
    assert!(error.contains("2000 m large") && error.contains("0.001"), "{error}");
}

#[test]
fn a_cut_file_is_refused_with_a_remedy() {
    let mut bytes = written_as_ply("binary_little_endian");
    bytes.truncate(bytes.len() - 3);
    let error = read_as("cut.ply", &bytes).unwrap_err();
    assert!(error.contains("ends in the middle") && error.contains("use a triangulated"), "{error}");
    assert!(read_as("empty.obj", b"").is_err());
}
