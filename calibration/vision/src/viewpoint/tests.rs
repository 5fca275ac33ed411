//! The whole way, on the simulated camera.

use super::command::{Options, StartFrom, kinds, run};
use super::fit::{Method, NoFit, fit};
use super::frame::{Evidence, Frame};
use super::grid::Grid;
use super::lens::Lens;
use super::outline::Outliner;
use super::search::Reach;
use super::shape::Shape;
use super::{depth, step};
use inference::interrupt::Interrupt;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::{Camera, Cell};
use shared_mem::frames::Pose;
use shared_mem::output::Destination;
use shared_mem::recording::{PictureKind, write_png};
use std::path::{Path, PathBuf};
use twin::render::{Hand, RobotSurface};
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;

const REACH: Reach = Reach { angle: 0.2, distance: 0.15 };

fn shipped() -> Cell {
    let mut cell =
        Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/fr3_cell.toml")).expect("a cell");
    // Half the pixels: a quarter of the time.
    let camera = cell.camera.take().expect("a camera");
    cell.camera = Some(Camera { width: 320, height: 240, ..camera });
    cell
}

fn truth(cell: &Cell) -> Isometry3<f64> {
    cell.camera.as_ref().and_then(Camera::base_from_camera).expect("a pose").isometry().inverse()
}

fn lens(cell: &Cell) -> Lens {
    Lens::new(&cell.camera.as_ref().expect("a camera").pinhole())
}

fn shape(cell: &Cell) -> Shape {
    Shape::new(RobotSurface::new(cell, Hand::None).expect("a robot"))
}

/// A frame with the exact silhouette.
fn masked(cell: &Cell, shape: &Shape) -> Frame {
    let q = *shape.surface().model().ready();
    let mut outliner = Outliner::new(320, 240, lens(cell));
    let placed: Vec<_> = shape.place(&q).iter().map(|part| truth(cell) * part).collect();
    outliner.draw(&shape.fine, &placed);
    let values = outliner.covered().map(|covered| f32::from(u8::from(covered))).collect();
    let mask = Grid { width: 320, height: 240, values };
    Frame::new("ready".into(), q, lens(cell), &Evidence::Mask(mask), shape)
}

/// The camera moved by 0.11 m and turned by 9 degrees.
fn off(cell: &Cell) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.08, 0.1));
    (Translation3::new(0.06, -0.08, 0.05) * truth(cell).inverse() * turn).inverse()
}

/// A colour picture of the robot, and its options.
fn photo(cell: &Cell, folder: &Path) -> Options {
    let mut camera = SimCamera::new(cell).expect("a camera");
    let q = *shape(cell).surface().model().ready();
    let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
    camera.render(&SceneSnapshot { q, dof: 7, ..SceneSnapshot::default() }, &mut color, &mut depth);
    let path = folder.join("photo.png");
    write_png(&path, 320, 240, &color).expect("a file");
    let at = folder.join("cell.toml");
    std::fs::write(&at, cell.to_toml()).expect("a file");
    let base_from_camera = off(cell).inverse();
    let turn = base_from_camera.rotation;
    Options {
        targets: vec![path],
        cell: Some(at),
        joints: vec![q[..7].iter().map(f64::to_string).collect::<Vec<_>>().join(",")],
        masks: Vec::new(),
        background: None,
        kind: Some(PictureKind::Color),
        intrinsics: None,
        start: StartFrom::Pose(base_from_camera.translation.vector.into(), [turn.w, turn.i, turn.j, turn.k]),
        reach: Some(REACH),
        method: Method::Outline,
        frames: 1,
        hand: Hand::None,
        seed: 1,
        out: Destination::of(Some(&folder.join("found.toml")), true).expect("a place"),
        report: Destination::of(Some(&folder.join("outline.png")), true).expect("a place"),
    }
}

#[test]
fn a_silhouette_brings_a_camera_back_to_its_place_finer_than_its_pixels() {
    let cell = shipped();
    let shape = shape(&cell);
    let found = fit(&[masked(&cell, &shape)], &shape, &off(&cell), &REACH, Method::Outline, 1).expect("a pose");
    let (distance, angle) = step::apart(&found.camera_from_base, &truth(&cell));
    // A pixel is 6 mm at the robot.
    assert!(distance < 6e-3 && angle < 4e-3, "{distance} m, {angle} rad");
    assert!(found.loss < 1e-3, "{}", found.loss);
}

#[test]
fn a_noisy_depth_picture_of_robot_table_and_box_is_enough() {
    let cell = shipped();
    let shape = shape(&cell);
    let mut camera = SimCamera::new(&cell).expect("a camera");
    let q = *shape.surface().model().ready();
    let (mut color, mut bytes) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
    let object = Some(Pose::from_isometry(Isometry3::translation(0.6, 0.25, 0.05)));
    camera.render(&SceneSnapshot { q, dof: 7, object, ..SceneSnapshot::default() }, &mut color, &mut bytes);
    let values = bytes.chunks_exact(2).map(|b| f32::from(u16::from_le_bytes([b[0], b[1]]))).collect();
    let share = depth::silhouette(&Grid { width: 320, height: 240, values }, &lens(&cell));
    let frame = Frame::new("depth".into(), q, lens(&cell), &Evidence::Mask(share), &shape);
    let found = fit(&[frame], &shape, &off(&cell), &REACH, Method::Outline, 1).expect("a pose");
    let (distance, angle) = step::apart(&found.camera_from_base, &truth(&cell));
    assert!(distance < 0.012 && angle < 8e-3, "{distance} m, {angle} rad");
}

#[test]
fn the_swarm_goes_downhill_on_the_same_loss() {
    let cell = shipped();
    let shape = shape(&cell);
    let frames = [masked(&cell, &shape)];
    let found = fit(&frames, &shape, &off(&cell), &REACH, Method::Swarm(400), 1).expect("a pose");
    let start = frames[0].wrong(Frame::FINEST, &shape, &off(&cell));
    assert!(found.loss < 0.3 * start, "{} after {start}", found.loss);
}

#[test]
fn a_robot_outside_of_the_view_is_said_to_be_there() {
    let cell = shipped();
    let shape = shape(&cell);
    let away = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 2.5) * truth(&cell);
    let found = fit(&[masked(&cell, &shape)], &shape, &away, &REACH, Method::Outline, 1);
    assert_eq!(found.err(), Some(NoFit::OutOfView));
}

#[test]
fn a_plain_photo_is_enough_and_the_answer_goes_into_the_cell() {
    let (cell, folder) = (shipped(), tempfile::tempdir().expect("a folder"));
    let options = photo(&cell, folder.path());
    let found = run(&options, &Interrupt::default()).expect("a pose");
    let truth = truth(&cell).inverse();
    let distance = (truth.translation.vector - Vector3::from(found.camera.position)).norm();
    assert!(distance < 0.02, "{distance} m off");
    let start = found.start.expect("a start");
    assert!(start.excluded && start.confirmed < found.confirmed, "{start:?}");
    let written = Cell::read(&folder.path().join("found.toml")).expect("a cell");
    assert_eq!(written.camera.expect("a camera").pose.position, found.camera.position);
    assert!(folder.path().join("outline.png").exists());
}

#[test]
fn depth_is_tried_before_colour_unless_something_else_was_asked_for() {
    let (cell, folder) = (shipped(), tempfile::tempdir().expect("a folder"));
    let options = Options { kind: None, ..photo(&cell, folder.path()) };
    assert_eq!(kinds(&options), [PictureKind::Depth, PictureKind::Color]);
    assert_eq!(kinds(&Options { kind: Some(PictureKind::Color), ..options.clone() }), [PictureKind::Color]);
    assert_eq!(kinds(&Options { background: Some("empty.png".into()), ..options.clone() }), [PictureKind::Color]);
    assert_eq!(
        run(&options, &Interrupt::default()).expect("a pose").pictures,
        "color",
        "files are of the kind they are"
    );
}

#[test]
fn what_cannot_be_fitted_is_refused_in_one_line() {
    let (cell, folder) = (shipped(), tempfile::tempdir().expect("a folder"));
    let options = photo(&cell, folder.path());
    let file = |name: &str, value: u8, width: u32| -> PathBuf {
        let path = folder.path().join(name);
        write_png(&path, width, 240, &vec![value; width as usize * 240 * 3]).expect("a file");
        path
    };
    let (black, wide) = (file("black.png", 0, 320), file("wide.png", 9, 640));
    let refused: [(Options, &str); 8] = [
        (Options { kind: Some(PictureKind::Depth), ..options.clone() }, "leave --depth out"),
        (Options { targets: vec![black.clone()], ..options.clone() }, "shows nothing"),
        (Options { targets: vec![wide], ..options.clone() }, "intrinsics are for 320 x 240"),
        (Options { masks: vec![black], ..options.clone() }, "nothing to fit"),
        (Options { joints: vec!["0,0".into()], ..options.clone() }, "7 joints"),
        (Options { joints: Vec::new(), ..options.clone() }, "one for each"),
        (Options { intrinsics: Some([600.0, 600.0, 320.0, 240.0]), ..options.clone() }, "of this resolution"),
        (Options { method: Method::Swarm(100), ..options }, "silhouettes"),
    ];
    for (options, expected) in refused {
        let error = run(&options, &Interrupt::default()).expect_err(expected);
        let line = shared_mem::error_line(error.as_ref());
        assert!(line.contains(expected) && !line.contains('\n'), "{line}");
    }
}
