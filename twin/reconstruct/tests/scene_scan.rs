//! A whole scan of a table with boxes and a wall, from files to surface, table and splats; and scans that cannot be used.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use reconstruct::assets::scene_files;
use reconstruct::scan::Scan;
use reconstruct::scene::{Options, Scene, SceneError, reconstruct};
use serde_json::json;
use shared_mem::ending;
use shared_mem::lens::Distortion;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use splat::{Body, Lens, Mesh, Shape, SplatCloud, Surroundings, render};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const SIZE: [usize; 2] = [128, 96];
const FOCAL: f64 = 120.0;
const VIEWS: usize = 32;
/// Height of the table in the base frame [m].
const TABLE: f64 = 0.05;
const OPTIONS: Options = Options { scale: None, voxel: 0.01, planar: true, steps: 200 };

/// A box with its middle and edges [m], its triangles counter-clockwise from outside.
fn solid(middle: [f64; 3], edges: [f64; 3], turn: f64, color: [u8; 3]) -> Mesh {
    let pose =
        Isometry3::from_parts(Translation3::from(middle), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn));
    let corner = |i: usize| {
        let side = |axis: usize| (if i >> axis & 1 == 0 { -0.5 } else { 0.5 }) * edges[axis];
        pose * Point3::new(side(0), side(1), side(2))
    };
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh::new(((0..8).map(corner).collect(), triangles), color)
}

fn solids() -> [Mesh; 4] {
    [
        solid([0.0, 0.0, TABLE - 0.02], [1.2, 1.0, 0.04], 0.0, [200, 170, 130]),
        solid([0.12, -0.05, TABLE + 0.06], [0.10, 0.16, 0.12], 0.5, [220, 40, 40]),
        solid([-0.15, 0.1, TABLE + 0.05], [0.1, 0.1, 0.1], 0.0, [40, 60, 220]),
        solid([0.0, 0.45, TABLE + 0.15], [1.2, 0.04, 0.30], 0.0, [120, 180, 120]),
    ]
}

/// Cameras above the table on three sides of it, looking at its middle.
fn poses(spread: f64) -> impl Iterator<Item = Isometry3<f64>> {
    (0..VIEWS).map(move |i| {
        let share = (i as f64 + 0.5) / VIEWS as f64;
        let around = -std::f64::consts::FRAC_PI_2 + spread * 2.2 * ((7 * i % VIEWS) as f64 / VIEWS as f64 - 0.5) * 2.0;
        let up: f64 = 0.35 + spread * 0.5 * share;
        let eye = Point3::new(up.cos() * around.cos(), up.cos() * around.sin(), up.sin()) * 0.8;
        Isometry3::face_towards(&eye, &Point3::new(0.0, 0.0, TABLE), &-Vector3::z())
    })
}

/// How the poses are written.
#[derive(Clone, Copy, PartialEq)]
enum Poses {
    /// Of a robot, from around, or from nearly one place.
    Robot { spread: f64 },
    /// As nerfstudio has them, in units of so many metres.
    Transforms { metres: f64 },
    /// As nerfstudio has them, with the axes of COLMAP.
    Flipped,
}

/// Writes the scan; pictures with an even number may be blurred.
fn write(folder: &Path, poses_are: Poses, is_blurred: bool) {
    let solids = solids();
    let lens = Lens {
        focal: [FOCAL; 2],
        centre: [SIZE[0] as f64 / 2.0 - 0.5, SIZE[1] as f64 / 2.0 - 0.5],
        distortion: Distortion::NONE,
    };
    let mut random = Pcg64::seed_from_u64(3);
    for part in ["images", "depth"] {
        std::fs::create_dir_all(folder.join(part)).expect("a folder");
    }
    let spread = if let Poses::Robot { spread } = poses_are { spread } else { 1.0 };
    let mut frames = Vec::new();
    for (number, pose) in poses(spread).enumerate() {
        let body = |mesh| Body { shape: Shape::Mesh(mesh), camera_from_body: pose.inverse(), instance: 1 };
        let light = pose.rotation.inverse() * Vector3::new(0.3, -0.5, 0.8);
        let around = Surroundings { background: [0.1, 0.1, 0.12], light };
        let seen = render(&solids.each_ref().map(body), &lens, SIZE, &around);
        let mut rgb: Vec<[u8; 3]> = seen.rgb8().collect();
        if is_blurred && number % 2 == 0 {
            let sharp = rgb.clone();
            rgb.iter_mut().enumerate().for_each(|(at, rgb)| {
                let near = (0..81).map(|i| sharp[(at + i % 9 + i / 9 * SIZE[0]).min(sharp.len() - 1)]);
                let mut sum = [0u32; 3];
                near.for_each(|near| (0..3).for_each(|c| sum[c] += u32::from(near[c])));
                *rgb = sum.map(|sum| (sum / 81) as u8);
            });
        }
        let mut noisy = |z: f32| if z > 0.0 { z + 0.005 * z * z * random.random_range(-1.7f32..1.7) } else { 0.0 };
        let depth: Vec<u8> = seen.depth.iter().flat_map(|z| ((noisy(*z) * 1e4).round() as u16).to_le_bytes()).collect();
        let (width, height) = (SIZE[0] as u32, SIZE[1] as u32);
        let name = format!("{number:02}.png");
        for (part, encoding, pixels) in
            [("images", PixelEncoding::Rgb8, rgb.as_flattened()), ("depth", PixelEncoding::Depth16, &depth)]
        {
            let packed = pack_picture(encoding, width, height, pixels).expect("a picture");
            std::fs::write(folder.join(part).join(&name), packed).expect("a file");
        }
        let mut frame = json!({ "file_path": format!("images/{name}") });
        let (place, turn) = (pose.translation.vector, pose.rotation);
        if let Poses::Robot { .. } = poses_are {
            frame["base_from_camera"] = json!([place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]);
        } else {
            let metres = if let Poses::Transforms { metres } = poses_are { metres } else { 1.0 };
            let flip = if poses_are == Poses::Flipped { 1.0 } else { -1.0 };
            let turn = Rotation3::from(turn).matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, flip, flip));
            let row = |i: usize| vec![turn[(i, 0)], turn[(i, 1)], turn[(i, 2)], place[i] / metres];
            frame["transform_matrix"] = json!([row(0), row(1), row(2), vec![0.0, 0.0, 0.0, 1.0]]);
        }
        frames.push(frame);
    }
    let scan = json!({
        "fl_x": FOCAL, "w": SIZE[0], "h": SIZE[1], "depth_unit_scale_factor": 1e-4, "frames": frames
    });
    let names = ["poses.json", "transforms.json"];
    let own = usize::from(!matches!(poses_are, Poses::Robot { .. }));
    let _ = std::fs::remove_file(folder.join(names[1 - own]));
    std::fs::write(folder.join(names[own]), scan.to_string()).expect("a file");
}

/// One of the files that become of a scene.
fn written(scene: &Scene, name: &str) -> Option<Vec<u8>> {
    let mut files = scene_files(scene, "").into_iter();
    files.find(|(path, _)| path == &PathBuf::from(name)).map(|(_, bytes)| bytes)
}

#[test]
fn a_table_comes_out_of_its_pictures_at_its_height_with_splats_and_a_mesh_to_collide_with() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Robot { spread: 1.0 }, false);
    let scan = Scan::open(folder.path()).expect("a scan");
    let scene = reconstruct(scan, &OPTIONS, &folder.path().join("scene.state")).expect("a scene");
    let table = scene.table().expect("a table");
    let tilt = table.plane.normal.angle(&Vector3::z()).to_degrees();
    assert!(tilt < 0.2 && (table.middle.z - TABLE).abs() < 2e-3, "{tilt} degrees, {} m", table.middle.z);
    assert!(table.plane.points > 5000, "{}", table.plane.points);
    let block = written(&scene, "cell_scene.toml").expect("a block");
    assert!(String::from_utf8(block).expect("text").contains("[table]\nheight = 0.0"));
    let off = scene.depth_off().expect("depth of held-out views");
    assert!(scene.psnr() > 26.0 && off < 3e-3, "{} dB, {off} m", scene.psnr());
    let read = SplatCloud::parse(&written(&scene, "splats.ply").expect("a file")).expect("splats");
    assert_eq!(read.splats.len(), scene.splats.splats.len());
    assert!(
        scene.collision.triangles.len() <= scene.surface.triangles.len() / 3,
        "{}",
        scene.collision.triangles.len()
    );
    let (low, high) = scene.collision.bounds();
    assert!(low.x < -0.55 && high.x > 0.55 && high.z > TABLE + 0.25 && low.z > TABLE - 0.06, "{low} {high}");
    assert!(scene.remarks.is_empty(), "{:?}", scene.remarks);
}

/// Where the run that is ended early finds its scan, and after how many milliseconds.
const SCAN: &str = "TWINALIGN_TEST_SCENE";
const ENDS: &str = "TWINALIGN_TEST_SCENE_ENDS";
/// What it said in the end.
const SAID: &str = "said";

#[test]
fn a_run_that_is_ended_again_and_again_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), Poses::Robot { spread: 1.0 }, false);
    let elsewhere = folder.path().join("whole.state");
    let whole = reconstruct(Scan::open(folder.path()).expect("a scan"), &OPTIONS, &elsewhere).expect("a scene");
    // Ending is asked of a process, once and for all: each part of the work is a process of its own.
    let program = std::env::current_exe().expect("this test");
    let mut ended = 0;
    for round in 1..60 {
        let child = Command::new(&program)
            .args(["--exact", "a_part_of_the_work"])
            .env(SCAN, folder.path())
            .env(ENDS, (500 + 500 * round).to_string())
            .output();
        assert!(child.expect("it runs").status.success());
        let said = std::fs::read_to_string(folder.path().join(SAID)).expect("what it said");
        if said == "it is done" {
            break;
        }
        assert!(said.contains("interrupted"), "{said}");
        ended += 1;
    }
    assert!(ended > 0, "it was never ended");
    let resumed = std::fs::read(folder.path().join("splats.ply")).expect("the resumed run's file");
    assert!(Some(resumed) == written(&whole, "splats.ply"), "it differs after {ended} parts");
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
    let said = match reconstruct(Scan::open(&scan).expect("a scan"), &OPTIONS, &scan.join("part.state")) {
        Ok(scene) => {
            std::fs::write(scan.join("splats.ply"), written(&scene, "splats.ply").expect("a file")).expect("a file");
            "it is done".into()
        }
        Err(SceneError::Scan(_)) => "interrupted while it read".into(),
        Err(error) => error.to_string(),
    };
    std::fs::write(scan.join(SAID), said).expect("a file");
}

#[test]
fn scans_that_cannot_be_used_are_refused_in_a_line_that_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = || {
        let found = Scan::open(folder.path()).map_err(|error| error.to_string());
        let options = Options { steps: 1, ..OPTIONS };
        let made = found.and_then(|scan| {
            reconstruct(scan, &options, &folder.path().join("x.state")).map_err(|error| error.to_string())
        });
        let Err(line) = made else { panic!("it cannot be used") };
        assert!(!line.contains('\n'), "{line}");
        line
    };
    assert!(refused().contains("no poses"));
    let cases = [
        (Poses::Robot { spread: 0.02 }, "from one side"),
        (Poses::Transforms { metres: 0.3 }, "give --scale "),
        (Poses::Flipped, "look the other way"),
    ];
    for (poses, what) in cases {
        write(folder.path(), poses, false);
        let line = refused();
        assert!(line.contains(what), "{line}");
        if let Some((_, metres)) = line.split_once("give --scale ") {
            assert!((metres.parse::<f64>().expect("a number") - 0.3).abs() < 4e-3, "{line}");
        }
    }
    write(folder.path(), Poses::Robot { spread: 1.0 }, true);
    let made = reconstruct(
        Scan::open(folder.path()).expect("a scan"),
        &Options { steps: 1, ..OPTIONS },
        &folder.path().join("y.state"),
    );
    let remarks = made.expect("half of it").remarks;
    assert!(remarks.iter().any(|remark| remark.0.starts_with("16 views are blurred")), "{remarks:?}");
}
