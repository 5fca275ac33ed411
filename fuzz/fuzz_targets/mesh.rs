//! The object's mesh. The first byte says by which ending the rest is read: obj, stl or ply.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::cell::{Cell, Object};
use twin::scene::ObjectModel;

const ENDINGS: [&str; 3] = ["obj", "stl", "ply"];

const OBJ: &[u8] = b"\0v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/2 4/3\nf 2 3 4\nf -4 -1 -2\n";
const STL: &[u8] = b"\x01solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid a\n";
const PLY: &[u8] = b"\x02ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 3\n";

fn binary_ply() -> Vec<u8> {
    let mut out = b"\x02ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n".to_vec();
    for [x, y, z] in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]] {
        out.extend([x.to_le_bytes(), y.to_le_bytes()].concat());
        out.extend(f64::from(z).to_le_bytes());
    }
    out.push(4);
    out.extend([0, 1, 2, 3_i32].iter().flat_map(|i| i.to_le_bytes()));
    out
}

fuzz_target!(
    init: fuzz::seeds([OBJ.to_vec(), STL.to_vec(), PLY.to_vec(), binary_ply()]),
    |bytes: &[u8]| {
        let Some((&first, bytes)) = bytes.split_first() else { return };
        let name = format!("mesh.{}", ENDINGS[usize::from(first) % ENDINGS.len()]);
        fuzz::file(&name, bytes);
        let object = Object { mesh: Some(name.into()), ..Object::default() };
        let cell = Cell { objects: vec![object], folder: fuzz::folder().to_owned(), ..Cell::default() };
        if let Some(Some(model)) = fuzz::accepted(ObjectModel::new(&cell, None)) {
            let (points, triangles) = model.shape.triangles();
            assert!(triangles.iter().flatten().all(|corner| (*corner as usize) < points.len()));
            assert!(points.iter().all(|point| point.iter().all(|value| value.is_finite())));
        }
    }
);
