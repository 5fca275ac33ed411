//! Gaussian splats in PLY files, plain and compressed.
#![no_main]

use libfuzzer_sys::fuzz_target;
use nalgebra::Similarity3;
use splat::SplatCloud;

/// One splat with the usual columns.
fn plain() -> Vec<u8> {
    const COLUMNS: [&str; 14] = [
        "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
        "rot_2", "rot_3",
    ];
    let columns: String = COLUMNS.iter().map(|name| format!("property float {name}\n")).collect();
    let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{columns}end_header\n");
    [header.as_bytes(), &[0; 4 * COLUMNS.len()]].concat()
}

/// One chunk of one splat, packed into words.
fn packed() -> Vec<u8> {
    let floats = ["min_x", "min_y", "min_z", "max_x", "max_y", "max_z"].into_iter();
    let floats =
        floats.chain(["min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"]);
    let floats: String = floats.map(|name| format!("property float {name}\n")).collect();
    let words = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];
    let words: String = words.iter().map(|name| format!("property uint {name}\n")).collect();
    let header =
        format!("ply\nformat binary_little_endian 1.0\nelement chunk 1\n{floats}element vertex 1\n{words}end_header\n");
    [header.as_bytes(), &[0; 4 * 16]].concat()
}

fuzz_target!(
    init: fuzz::seeds([plain(), packed()]),
    |bytes: &[u8]| {
        if let Some(cloud) = fuzz::accepted(SplatCloud::parse(bytes)) {
            assert_eq!(cloud.harmonics.len(), cloud.splats.len() * cloud.coefficients());
            let moved = cloud.moved(&Similarity3::from_scaling(2.0));
            assert_eq!(moved.only(|i| i % 2 == 0).splats.len(), cloud.splats.len().div_ceil(2));
        }
    }
);
