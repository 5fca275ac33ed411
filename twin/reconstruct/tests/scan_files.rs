//! Scans as other programs write them: what is read has to be the same, however it is written.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use reconstruct::scan::Scan;
use serde_json::{Value, json};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::{pack_picture, pack_with_alpha};
use std::path::Path;

/// Around the origin, looking at it: x right, y down, z forwards.
fn poses(count: usize) -> impl Iterator<Item = Isometry3<f64>> {
    (0..count).map(move |i| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / count as f64).sin_cos();
        Isometry3::face_towards(&Point3::new(cos, sin, 0.5), &Point3::origin(), &-Vector3::z())
    })
}

/// Writes a file with the folders that it lies in.
fn put(path: &Path, bytes: impl AsRef<[u8]>) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, bytes).expect("a file");
}

/// A mask of one white pixel, which tells masks apart.
fn mask([width, height]: [u32; 2], white: usize) -> Vec<u8> {
    let pixels = (0..(width * height) as usize).flat_map(|at| [if at == white { 255 } else { 0 }; 3]);
    pack_picture(PixelEncoding::Rgb8, width, height, &pixels.collect::<Vec<u8>>()).expect("a picture")
}

/// Rows of a pose as nerfstudio has them: y up, looking along -z.
fn rows(pose: &Isometry3<f64>) -> Vec<Vec<f64>> {
    let turn = pose.rotation.to_rotation_matrix().matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    let place = pose.translation.vector;
    (0..3).map(|row| vec![turn[(row, 0)], turn[(row, 1)], turn[(row, 2)], place[row]]).collect()
}

/// Fourteen pictures with alpha of 20 x 16 pixels, and the list of them that `frame` and `head` make.
fn listed(folder: &Path, head: Value, frame: impl Fn(usize, Vec<Vec<f64>>) -> Value) -> Scan {
    for number in 0..14 {
        let rgba: Vec<u8> = (0..320).flat_map(|at| [at as u8, 7, 9, if at == number { 255 } else { 0 }]).collect();
        put(&folder.join(format!("train/r_{number}.png")), pack_with_alpha(20, 16, &rgba).expect("a picture"));
    }
    let frames: Vec<Value> = poses(14).enumerate().map(|(number, pose)| frame(number, rows(&pose))).collect();
    let mut list = head;
    list["frames"] = json!(frames);
    put(&folder.join("transforms.json"), list.to_string());
    Scan::open(folder).expect("a scan")
}

#[test]
fn an_angle_names_without_endings_and_three_rows_are_the_same_scan_as_a_full_file() {
    let full = tempfile::tempdir().expect("a folder");
    let focal = 10.0 / 0.35f64.tan();
    let head = json!({ "w": 20, "h": 16, "fl_x": focal, "fl_y": focal, "cx": 10.0, "cy": 8.0 });
    let full = listed(full.path(), head, |number, mut rows| {
        rows.push(vec![0.0, 0.0, 0.0, 1.0]);
        json!({ "file_path": format!("train/r_{number}.png"), "transform_matrix": rows })
    });
    type Frame = fn(usize, Vec<Vec<f64>>) -> Value;
    let forms: [(Value, Frame); 3] = [
        (
            json!({ "camera_angle_x": 0.7, "aabb_scale": 4 }),
            |number, rows| json!({ "file_path": format!("./train/r_{number}"), "rotation": 0.1, "transform_matrix": rows }),
        ),
        (
            json!({ "camera_angle_x": 0.7 }),
            |number, rows| json!({ "file_path": format!("train\\r_{number}.png"), "transform_matrix": rows }),
        ),
        (
            json!({}),
            |number, rows| json!({ "file_path": format!("train/r_{number}"), "camera_angle_x": 0.7, "transform_matrix": rows }),
        ),
    ];
    for (head, frame) in forms {
        let folder = tempfile::tempdir().expect("a folder");
        let scan = listed(folder.path(), head, frame);
        assert_eq!(scan.views.len(), full.views.len());
        for (number, (view, given)) in scan.views.iter().zip(&full.views).enumerate() {
            assert!((view.camera.focal[0] - given.camera.focal[0]).abs() < 1e-9);
            assert_eq!((view.camera.width, view.camera.centre), (given.camera.width, given.camera.centre));
            assert_eq!(view.scan_from_camera, given.scan_from_camera);
            let (frame, wanted) = (scan.frame(number, 1).expect("pixels"), full.frame(number, 1).expect("pixels"));
            assert_eq!((frame.rgb, frame.mask), (wanted.rgb, wanted.mask), "{}", view.name);
        }
    }
}

/// A COLMAP model of two cameras, each with a folder of pictures of the same names.
fn two_cameras(folder: &Path) {
    let cameras = [("front", [12, 8], 8), ("top", [9, 10], 6)];
    let (mut list, mut images) = (String::new(), String::new());
    for (camera, (name, [width, height], count)) in cameras.into_iter().enumerate() {
        list += &format!("{camera} PINHOLE {width} {height} 10 10 {} {}\n", width / 2, height / 2);
        for (number, pose) in poses(count).enumerate() {
            let view = pose.inverse();
            let (q, t) = (view.rotation.coords, view.translation.vector);
            images += &format!("{number} {} {} {} {} {} {} {} {camera} ", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
            images += &format!("{name}/{number:06}.png\n\n");
            put(&folder.join(format!("images/{name}/{number:06}.png")), mask([width, height], 0));
            put(&folder.join(format!("masks/{name}/{number:06}.png")), mask([width, height], 10 * camera + number));
        }
    }
    put(&folder.join("sparse/0/cameras.txt"), list);
    put(&folder.join("sparse/0/images.txt"), images);
}

#[test]
fn a_set_in_parts_is_read_by_the_part_to_learn_from() {
    let folder = tempfile::tempdir().expect("a folder");
    listed(
        folder.path(),
        json!({"fl_x": 20}),
        |number, rows| json!({"file_path": format!("train/r_{number}"), "transform_matrix": rows}),
    );
    let list = folder.path().join("transforms.json");
    std::fs::rename(list, folder.path().join("transforms_train.json")).expect("it was there");
    put(&folder.path().join("transforms_test.json"), "{}");
    assert_eq!(Scan::open(folder.path()).expect("a scan").views.len(), 14);
}

#[test]
fn cameras_with_a_folder_each_have_masks_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    two_cameras(folder.path());
    let scan = Scan::open(folder.path()).expect("a scan");
    assert_eq!(scan.views.len(), 14);
    for (number, view) in scan.views.iter().enumerate() {
        let frame = scan.frame(number, 1).expect("pixels");
        let (camera, number) = if number < 8 { (0, number) } else { (1, number - 8) };
        assert_eq!(frame.mask.iter().position(|white| *white), Some(10 * camera + number), "{}", view.name);
    }
    // A mask that either camera could have.
    std::fs::remove_file(folder.path().join("masks/top/000003.png")).expect("it was there");
    put(&folder.path().join("masks/000003.png"), mask([9, 10], 5));
    let line = Scan::open(folder.path()).expect_err("whose is it").to_string();
    assert!(line.contains("top/000003.png") && line.contains("front/000003.png") && !line.contains('\n'), "{line}");
}
