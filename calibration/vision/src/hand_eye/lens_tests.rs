//! Pictures of a board through lenses of every model, with a JSON file beside each: the mount has to come out of all of them.

use super::fit::fit;
use super::input::{Source, taken};
use crate::viewpoint::board::Board;
use crate::viewpoint::lens::Lens;
use crate::viewpoint::test_board::picture;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use shared_mem::hand_eye::Mount;
use shared_mem::lens::Distortion;
use shared_mem::recording::write_png;
use std::path::Path;

const LENS: Lens = Lens { focal: [505.0, 505.3], centre: [318.4, 243.7] };
const BOARD: &str = "7x5,0.03,0.022,DICT_4X4_50";
const PICTURES: usize = 12;

fn pose(place: [f64; 3], angles: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
    Isometry3::from_parts(Translation3::from(place), turn)
}

fn mount() -> Isometry3<f64> {
    pose([0.052, -0.031, 0.068], [0.02, -0.03, 0.8])
}

/// Writes pictures with what stands beside them.
fn write(folder: &Path, distortion: &Distortion, beside: &Value) {
    let board = Board::parse(BOARD).expect("a board");
    let base_from_board = pose([0.5, 0.1, 0.02], [0.0, 0.0, 0.3]);
    let mut random = Pcg64::seed_from_u64(11);
    for number in 0..PICTURES {
        let (sin, cos) = (number as f64 * 2.4).sin_cos();
        // The board fills the picture, where a lens bends most.
        let camera_from_board = pose(
            [-0.105 + 0.03 * cos, -0.075 + 0.025 * sin, 0.24 + 0.02 * sin],
            [0.35 * cos, 0.35 * sin, 0.5 * (number as f64 * 1.7).sin()],
        );
        // An arm that is off by some tenths of a millimetre.
        let wrong = Translation3::from(Vector3::from_fn(|_, _| random.random_range(-3e-4..3e-4)));
        let base_from_end_effector = wrong * base_from_board * camera_from_board.inverse() * mount().inverse();
        let pixels = picture(&board, 0, &camera_from_board, &LENS, distortion);
        let rgb: Vec<u8> = pixels.channels[0].values.iter().flat_map(|v| [v.round() as u8; 3]).collect();
        write_png(&folder.join(format!("{number:02}.png")), 640, 480, &rgb).expect("a picture");
        let mut file = beside.clone();
        file["O_T_EE"] = json!(base_from_end_effector.to_homogeneous().as_slice());
        file["K"] = json!([LENS.focal[0], 0, LENS.centre[0], 0, LENS.focal[1], LENS.centre[1], 0, 0, 1]);
        std::fs::write(folder.join(format!("{number:02}.json")), file.to_string()).expect("a file");
    }
}

fn source(folder: &Path) -> Source {
    let board = Some(Board::parse(BOARD).expect("a board"));
    Source { target: folder.to_owned(), cell: None, board, intrinsics: None, frames: 40 }
}

#[test]
fn the_mount_comes_out_of_pictures_through_lenses_of_every_model() {
    let rational = [0.45, -2.55, 4e-4, 1e-4, 1.48, 0.33, -2.37, 1.41];
    let fisheye = [-0.04, 0.02, -0.006, 0.001];
    let cases = [
        (Distortion::Polynomial(rational), json!({ "D": rational, "distortion_model": "rational_polynomial" })),
        (Distortion::Fisheye(fisheye), json!({ "D": fisheye, "distortion_model": "equidistant" })),
    ];
    for (distortion, beside) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), &distortion, &beside);
        let read = taken(&source(folder.path())).expect("pictures of a board");
        assert_eq!(read.camera.distortion, distortion);
        let found = fit(Mount::EyeInHand, &read.views).expect("a mount");
        let off = (found.chain.camera.translation.vector - mount().translation.vector) * 1e3;
        assert!(off.amax() < 1.5, "{distortion:?}: off by {off} mm with {} pictures", read.views.len());
        let inside = (0..3).all(|i| off[i].abs() < found.half_width[3 + i] * 1e3);
        assert!(inside, "{distortion:?}: off by {off} mm, which {:?} does not hold", found.half_width);
    }
}

#[test]
fn a_lens_that_is_not_read_and_files_that_two_pictures_could_have_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &Distortion::NONE, &json!({ "D": [0.1, 0.2, 0.3, 0.4], "distortion_model": "omni" }));
    let line = taken(&source(folder.path())).expect_err("no such model").to_string();
    assert!(line.contains("00.json") && line.contains("`omni`"), "{line}");
    std::fs::copy(folder.path().join("00.png"), folder.path().join("00.jpg")).expect("a copy");
    let line = taken(&source(folder.path())).expect_err("whose is it").to_string();
    assert!(line.contains("00.png") && line.contains("00.jpg"), "{line}");
    write(folder.path(), &Distortion::NONE, &json!({ "width": 1280, "height": 960 }));
    std::fs::remove_file(folder.path().join("00.jpg")).expect("it was there");
    let line = taken(&source(folder.path())).expect_err("of another size").to_string();
    assert!(line.contains("1280 x 960"), "{line}");
}
