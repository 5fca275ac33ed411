//! A whole scan of a known object, from files to the mesh, on a coarse grid; and scans that cannot be used.

use nalgebra::{Isometry3, Point3, Vector3};
use reconstruct::assets::{Labels, dataset_files, files};
use reconstruct::field::{Field, Grid};
use reconstruct::mesh::{Solid, surface};
use reconstruct::object::{Object, ObjectError, Options, draw, forget, reconstruct};
use reconstruct::scan::{Camera, ScaleSource, Scan};
use serde_json::json;
use shared_mem::ending;
use shared_mem::lens::Distortion;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use splat::SplatCloud;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use tempfile::TempDir;

const WIDTH: u32 = 120;
const HEIGHT: u32 = 90;
const FOCAL: f64 = 130.0;
const VIEWS: usize = 24;

/// A ring of 60 and 18 mm with a knob, whose genus is one and which is no mirror image of itself in any of its views, in colours that
/// change slowly.
fn ring() -> Field<f32> {
    let grid = Grid { dims: [56, 56, 36], origin: Point3::new(-0.088, -0.088, -0.0368), voxel: 0.0032 };
    let knob = Point3::new(0.05, 0.032, 0.03);
    let distance = |p: Point3<f64>| {
        let ring = ((p.x.hypot(p.y) - 0.06).powi(2) + p.z * p.z).sqrt() - 0.018;
        ring.min((p - knob).norm() - 0.026)
    };
    let colour = |p: Point3<f64>| [0.5 + 4.0 * p.x, 0.5 + 4.0 * p.y, 0.5 + 10.0 * p.z].map(|c| c as f32);
    let points: Vec<Point3<f64>> = (0..grid.len()).map(|i| grid.position(grid.node(i))).collect();
    let distance = points.iter().map(|p| (distance(*p) / grid.voxel) as f32).collect();
    Field { grid, distance, colour: points.iter().map(|p| colour(*p)).collect() }
}

fn camera(lens: Distortion) -> Camera {
    let centre = [f64::from(WIDTH) / 2.0, f64::from(HEIGHT) / 2.0];
    Camera { width: WIDTH, height: HEIGHT, focal: [FOCAL; 2], centre, lens }
}

/// From all sides along a spiral, looking at the origin.
fn poses() -> impl Iterator<Item = Isometry3<f64>> {
    (0..VIEWS).map(|i| {
        let height = 0.9 - 1.8 * (i as f64 + 0.5) / VIEWS as f64;
        let (sin, cos) = (i as f64 * 2.4).sin_cos();
        let across = (1.0f64 - height * height).sqrt();
        let eye = Point3::new(across * cos, across * sin, height) * 0.3;
        Isometry3::face_towards(&eye, &Point3::origin(), &-Vector3::z())
    })
}

/// How the poses are written.
#[derive(Clone, Copy, PartialEq)]
enum Poses {
    Right,
    /// In a left-handed frame.
    Mirrored,
    /// Of cameras that look along -z, with y up.
    OpenGl,
}

/// Writes the scan of a pinhole.
fn write(folder: &Path, poses_are: Poses) {
    write_through(Distortion::NONE, &json!({}), folder, poses_are);
}

/// Writes the scan of a lens, with the keys that say which.
fn write_through(lens: Distortion, keys: &serde_json::Value, folder: &Path, poses_are: Poses) {
    let field = ring();
    let mut frames = Vec::new();
    for part in ["images", "masks", "depth"] {
        std::fs::create_dir_all(folder.join(part)).expect("a folder");
    }
    for (number, pose) in poses().enumerate() {
        let drawn = draw(&field, &camera(lens), &pose);
        let mask: Vec<u8> = drawn.opacity.iter().flat_map(|o| [if *o > 0.5 { 255 } else { 0 }; 3]).collect();
        let depth: Vec<u8> = drawn
            .depth
            .iter()
            .zip(&drawn.opacity)
            .flat_map(|(z, o)| (if *o > 0.5 { (z * 1e4).round() as u16 } else { 0 }).to_le_bytes())
            .collect();
        let name = format!("{number:02}.png");
        for (part, encoding, pixels) in [
            ("images", PixelEncoding::Rgb8, drawn.rgb.as_flattened()),
            ("masks", PixelEncoding::Rgb8, &mask),
            ("depth", PixelEncoding::Depth16, &depth),
        ] {
            let packed = pack_picture(encoding, WIDTH, HEIGHT, pixels).expect("a picture");
            std::fs::write(folder.join(part).join(&name), packed).expect("a file");
        }
        let (mut place, turn) = (pose.translation.vector, pose.rotation);
        let [w, i, j, k] = [turn.w, turn.i, turn.j, turn.k];
        let [w, i, j, k] = match poses_are {
            Poses::Right => [w, i, j, k],
            Poses::Mirrored => [w, i, -j, -k],
            // Half a turn about the camera's own x.
            Poses::OpenGl => [-i, w, k, -j],
        };
        if poses_are == Poses::Mirrored {
            place.x = -place.x;
        }
        let pose = [place.x, place.y, place.z, w, i, j, k];
        frames.push(json!({ "file_path": format!("images/{name}"), "base_from_camera": pose }));
    }
    let mut scan = json!({
        "fl_x": FOCAL, "w": WIDTH, "h": HEIGHT, "depth_unit_scale_factor": 1e-4, "frames": frames
    });
    let keys = keys.as_object().expect("keys").clone();
    scan.as_object_mut().expect("keys").extend(keys);
    std::fs::write(folder.join("poses.json"), scan.to_string()).expect("a file");
}

#[test]
fn a_ring_comes_out_of_pictures_through_a_fisheye() {
    let keys = json!({ "camera_model": "OPENCV_FISHEYE", "k1": -0.2, "k2": 0.3, "k3": -0.1, "k4": 0.02 });
    a_ring_comes_out_of_pictures_through(Distortion::Fisheye([-0.2, 0.3, -0.1, 0.02]), &keys);
}

#[test]
#[ignore = "takes half a minute: cargo test --release --workspace --test object_scan -- --ignored"]
fn a_ring_comes_out_of_pictures_through_a_rational_lens() {
    let keys = json!({ "k1": 0.1, "k2": -0.3, "p1": 1e-3, "p2": -2e-3, "k3": 0.1, "k4": 0.5, "k5": 0.2, "k6": 0.1 });
    a_ring_comes_out_of_pictures_through(Distortion::Polynomial([0.1, -0.3, 1e-3, -2e-3, 0.1, 0.5, 0.2, 0.1]), &keys);
}

fn a_ring_comes_out_of_pictures_through(lens: Distortion, keys: &serde_json::Value) {
    let (truth, _) = surface(&ring()).expect("a ring");
    let folder = tempfile::tempdir().expect("a folder");
    write_through(lens, keys, folder.path(), Poses::Right);
    let scan = Scan::open(folder.path()).expect("a scan");
    assert!(scan.views.iter().all(|view| view.camera == camera(lens)));
    let object = reconstruct(scan, &COARSE, &folder.path().join("ring.state")).expect("an object");
    let volume = Solid::of(&object.fine).volume / Solid::of(&truth).volume;
    assert!(object.topology.genus == 1 && (volume - 1.0).abs() < 0.1, "{lens:?}: {volume}");
    assert!(object.psnr() > 26.0 && object.psnr_splats() > 28.0, "{} {}", object.psnr(), object.psnr_splats());
}

#[test]
fn a_ring_comes_out_of_its_pictures_closed_with_its_hole_its_volume_and_its_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Right);
    let scan = Scan::open(folder.path()).expect("a scan");
    let kept = folder.path().join("ring.state");
    let object = reconstruct(scan, &Options { scale: None, edge: 32, table: None }, &kept).expect("an object");
    assert_eq!((object.topology.genus, object.topology.parts, object.held_out.len()), (1, 1, 3));
    let (truth, _) = surface(&ring()).expect("a ring");
    let volume = Solid::of(&object.fine).volume / Solid::of(&truth).volume;
    // Of a grid so coarse a twentieth: a node is a quarter of the ring's thickness.
    assert!((volume - 1.0).abs() < 0.06, "{volume}");
    assert!(object.psnr() > 28.0, "{}", object.psnr());
    assert!(object.remarks.is_empty(), "{:?}", object.remarks);
    assert!(object.psnr_splats() > 30.0, "{}", object.psnr_splats());
    // In the frame of the meshes, whose origin is not the scan's.
    let read = SplatCloud::parse(&written(&object, "splats.ply")).expect("splats");
    assert_eq!(read.splats.len(), object.fine.points.len());
    let count = read.splats.len() as f64;
    let ours = read.splats.iter().map(|splat| splat.centre.coords.cast::<f64>()).sum::<Vector3<f64>>() / count;
    let mesh = object.fine.points.iter().map(|p| p - object.middle()).sum::<Vector3<f64>>() / count;
    assert!((ours - mesh).norm() < 5e-3 && object.middle().z > 0.015, "{ours} {mesh}");
    its_dataset_is_a_scan_of_the_same_views(&object);
}

/// In the object's own frame.
fn its_dataset_is_a_scan_of_the_same_views(object: &Object) {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, bytes) in dataset_files(&object.train, &object.splats, &object.middle()) {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
    let dataset = folder.path().join("dataset");
    let scan = Scan::open(&dataset).expect("a scan");
    assert_eq!((scan.views.len(), object.train.len()), (VIEWS - 3, VIEWS - 3));
    for (number, (view, given)) in scan.views.iter().zip(&object.train).enumerate() {
        let place = view.scan_from_camera.translation.vector + object.middle().coords;
        assert!((place - given.scan_from_camera.translation.vector).norm() < 1e-9);
        assert!(view.scan_from_camera.rotation.angle_to(&given.scan_from_camera.rotation) < 1e-7);
        assert_eq!(view.camera, given.camera);
        let frame = scan.frame(number, 1).expect("pixels");
        assert_eq!((&frame.rgb, &frame.mask), (&given.rgb, &given.mask));
    }
    assert_eq!(std::fs::read(dataset.join("init.ply")).expect("splats"), written(object, "splats.ply"));
    let points = std::fs::read_to_string(dataset.join("sparse/0/points3D.txt")).expect("points");
    assert_eq!(points.lines().count(), 1 + object.splats.splats.len());
}

/// One of the files that become of an object.
fn written(object: &Object, name: &str) -> Vec<u8> {
    let labels = Labels { name: "ring".into(), mass: None, command: String::new() };
    let mut files = files(object, &[], &labels).into_iter();
    files.find(|(path, _)| path == &PathBuf::from(name)).expect("a file of this name").1
}

/// Where the run that is ended early finds its scan, and after how many milliseconds.
const SCAN: &str = "TWINALIGN_TEST_SCAN";
const ENDS: &str = "TWINALIGN_TEST_ENDS";
/// What it said in the end.
const SAID: &str = "said";
const COARSE: Options = Options { scale: None, edge: 24, table: None };

#[test]
fn a_run_that_is_ended_again_and_again_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Right);
    ended_again_and_again(&folder);
}

#[test]
#[ignore = "takes a minute: cargo test --release --workspace --test object_scan -- --ignored"]
fn a_run_without_depth_that_is_ended_again_and_again_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Right);
    std::fs::remove_dir_all(folder.path().join("depth")).expect("a folder");
    ended_again_and_again(&folder);
}

fn ended_again_and_again(folder: &TempDir) {
    let kept = folder.path().join("ring.state");
    let whole = reconstruct(Scan::open(folder.path()).expect("a scan"), &COARSE, &kept).expect("an object");
    forget(&kept).expect("nothing is left of it");
    // Ending is asked of a process, once and for all: each part of the work is a process of its own.
    let program = std::env::current_exe().expect("this test");
    let mut ended = 0;
    for round in 1..60 {
        let child = Command::new(&program)
            .args(["--exact", "a_part_of_the_work"])
            .env(SCAN, folder.path())
            .env(ENDS, (2000 + 1500 * round).to_string())
            .output();
        assert!(child.expect("it runs").status.success());
        let said = std::fs::read_to_string(folder.path().join(SAID)).expect("what it said");
        if said.contains("it is done") {
            break;
        }
        assert!(said.contains("the same command goes on from"), "{said}");
        ended += 1;
    }
    assert!(ended > 0, "it was never ended");
    for name in ["splats.ply", "object_fine.obj"] {
        let resumed = std::fs::read(folder.path().join(name)).expect("the resumed run's file");
        assert!(resumed == written(&whole, name), "{name} differs after {ended} parts");
    }
    let left = std::fs::read_dir(folder.path())
        .expect("the folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    assert_eq!(left.filter(|name| name.contains("state")).count(), 0);
}

/// Does nothing by itself.
#[test]
fn a_part_of_the_work() {
    let (Some(scan), Some(ends)) = (std::env::var_os(SCAN), std::env::var(ENDS).ok()) else { return };
    let (scan, ends) = (PathBuf::from(scan), ends.parse().expect("milliseconds"));
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(ends));
        ending::ask();
    });
    let kept = scan.join("ring.state");
    let said = match reconstruct(Scan::open(&scan).expect("a scan"), &COARSE, &kept) {
        Ok(object) => {
            for name in ["splats.ply", "object_fine.obj"] {
                std::fs::write(scan.join(name), written(&object, name)).expect("a file");
            }
            forget(&kept).expect("nothing is left of it");
            "it is done".into()
        }
        Err(ObjectError::Scan(_)) => "the same command goes on from the beginning".into(),
        Err(error) => error.to_string(),
    };
    std::fs::write(scan.join(SAID), said).expect("a file");
}

#[test]
fn scans_that_cannot_be_used_are_refused_in_a_line_that_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Right);
    let refused = |path: &Path, scale: Option<f64>| {
        let found = Scan::open(path).map_err(|error| error.to_string());
        let options = Options { scale, edge: 24, table: None };
        let made = found
            .and_then(|scan| reconstruct(scan, &options, &path.join("x.state")).map_err(|error| error.to_string()));
        let Err(line) = made else { panic!("it cannot be used") };
        assert!(!line.contains('\n'), "{line}");
        line
    };
    let empty = tempfile::tempdir().expect("a folder");
    assert!(refused(empty.path(), None).contains("transforms.json"));
    std::fs::rename(folder.path().join("masks"), folder.path().join("elsewhere")).expect("a folder");
    assert!(refused(folder.path(), None).contains("has no mask"));
    std::fs::rename(folder.path().join("elsewhere"), folder.path().join("masks")).expect("a folder");
    let text = std::fs::read_to_string(folder.path().join("poses.json")).expect("a file");
    std::fs::write(folder.path().join("poses.json"), text.replace("images/00", "images/no")).expect("a file");
    assert!(refused(folder.path(), None).contains("no.png"));
    for (poses, what) in [(Poses::Mirrored, "mirrored"), (Poses::OpenGl, "look the other way")] {
        write(folder.path(), poses);
        assert!(refused(folder.path(), None).contains(what), "{what}");
    }
}

#[test]
fn the_arms_poses_and_a_hand_eye_calibration_are_worth_those_of_the_camera() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Right);
    let given = Scan::open(folder.path()).expect("a scan");
    let (shift, turn) = ([0.06, -0.01, 0.04], Vector3::new(0.02, -0.01, 1.57));
    let mount = Isometry3::new(Vector3::from(shift), turn);
    let q = mount.rotation.quaternion();
    let file = format!(
        "mount = \"eye_in_hand\"\n[EE_T_camera]\nposition = {shift:?}\norientation = {:?}\n",
        [q.w, q.i, q.j, q.k]
    );
    std::fs::write(folder.path().join("hand_eye.toml"), file).expect("a file");
    let path = folder.path().join("poses.json");
    let mut list: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).expect("a file")).expect("JSON");
    for (frame, view) in list["frames"].as_array_mut().expect("frames").iter_mut().zip(&given.views) {
        let end_effector = (view.scan_from_camera * mount.inverse()).to_homogeneous();
        frame.as_object_mut().expect("a frame").remove("base_from_camera");
        frame["O_T_EE"] = json!(end_effector.as_slice());
    }
    std::fs::write(&path, list.to_string()).expect("a file");
    let held = Scan::open(folder.path()).expect("a scan");
    for (a, b) in given.views.iter().zip(&held.views) {
        let off = a.scan_from_camera.inverse() * b.scan_from_camera;
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-7, "{}", a.name);
    }
    let scale = held.scale(None).expect("metres");
    assert!(held.is_of_robot() && scale.metres == 1.0 && scale.source == ScaleSource::Robot);
}
