//! Scans as people take them: from above a table, the object filling half of the picture, nothing from below.

use nalgebra::{Isometry3, Point3, Vector3};
use reconstruct::field::{Field, Grid};
use reconstruct::object::{Certainty, Object, Options, TableSource, draw, reconstruct};
use reconstruct::scan::{Camera, Scan, Table};
use serde_json::json;
use shared_mem::lens::Distortion;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use std::path::Path;

const WIDTH: u32 = 120;
const HEIGHT: u32 = 90;
const FOCAL: f64 = 130.0;
const VIEWS: usize = 30;
/// Height of the table [m].
const TABLE: f64 = 0.012;
const CAMERA: Camera = Camera {
    width: WIDTH,
    height: HEIGHT,
    focal: [FOCAL; 2],
    centre: [WIDTH as f64 / 2.0, HEIGHT as f64 / 2.0],
    lens: Distortion::NONE,
};
/// What stands on it: a block of these edges [m].
const EDGES: [f64; 3] = [0.08, 0.06, 0.05];

/// A block on the table, in colours that change slowly.
fn block() -> Field<f32> {
    let grid = Grid { dims: [54, 44, 40], origin: Point3::new(-0.053, -0.043, TABLE - 0.0142), voxel: 0.002 };
    let middle = Point3::new(0.0, 0.0, TABLE + 0.5 * EDGES[2]);
    let points: Vec<Point3<f64>> = (0..grid.len()).map(|i| grid.position(grid.node(i))).collect();
    let distance = |p: &Point3<f64>| {
        let outside = |axis: usize| (p - middle)[axis].abs() - 0.5 * EDGES[axis];
        ((0..3).map(outside).fold(f64::MIN, f64::max) / grid.voxel) as f32
    };
    let colour = |p: &Point3<f64>| [0, 1, 2].map(|i| (0.5 + 0.3 * (70.0 * p[i]).sin()) as f32);
    Field { grid, distance: points.iter().map(distance).collect(), colour: points.iter().map(colour).collect() }
}

/// Three rounds, 14, 36 and 62 degrees above the table.
fn poses() -> impl Iterator<Item = Isometry3<f64>> {
    (0..VIEWS).map(|number| {
        let (high, turn) = ([14.0f64, 36.0, 62.0][number % 3].to_radians(), number as f64 * 0.63);
        let way = Vector3::new(high.cos() * turn.cos(), high.cos() * turn.sin(), high.sin());
        let middle = Point3::new(0.0, 0.0, TABLE + 0.5 * EDGES[2]);
        Isometry3::face_towards(&(middle + way * 0.2), &middle, &-Vector3::z())
    })
}

/// Depth of the table in a pixel [m], 0 above the horizon.
fn depth_of_table(pose: &Isometry3<f64>, pixel: usize) -> f32 {
    let at = [pixel % WIDTH as usize, pixel / WIDTH as usize].map(|i| i as f64 + 0.5);
    let [x, y] = CAMERA.direction(at);
    let down = -(pose.rotation * Vector3::new(x, y, 1.0)).z;
    if down > 0.01 { ((pose.translation.z - TABLE) / down) as f32 } else { 0.0 }
}

/// Writes the scan, with depth of the object and of the table where it is wanted.
fn write(folder: &Path, with_depth: bool, keys: &serde_json::Value) {
    let field = block();
    let parts = if with_depth { &["images", "masks", "depth"][..] } else { &["images", "masks"] };
    parts.iter().for_each(|part| std::fs::create_dir_all(folder.join(part)).expect("a folder"));
    let mut frames = Vec::new();
    for (number, pose) in poses().enumerate() {
        let drawn = draw(&field, &CAMERA, &pose);
        let inside = |at: usize| drawn.opacity[at] > 0.5;
        let pixels = 0..drawn.rgb.len();
        let mask: Vec<u8> = pixels.clone().flat_map(|at| [if inside(at) { 255 } else { 0 }; 3]).collect();
        let depth = pixels.map(|at| if inside(at) { drawn.depth[at] } else { depth_of_table(&pose, at) });
        let depth: Vec<u8> = depth.flat_map(|z| ((z * 1e4).round() as u16).to_le_bytes()).collect();
        let name = format!("{number:02}.png");
        for part in parts {
            let (encoding, pixels) = match *part {
                "images" => (PixelEncoding::Rgb8, drawn.rgb.as_flattened()),
                "masks" => (PixelEncoding::Rgb8, &mask[..]),
                _ => (PixelEncoding::Depth16, &depth[..]),
            };
            let packed = pack_picture(encoding, WIDTH, HEIGHT, pixels).expect("a picture");
            std::fs::write(folder.join(part).join(&name), packed).expect("a file");
        }
        let opengl = pose.to_homogeneous() * nalgebra::Matrix4::from_diagonal(&[1.0, -1.0, -1.0, 1.0].into());
        let rows: Vec<Vec<f64>> = opengl.row_iter().map(|row| row.iter().copied().collect()).collect();
        frames.push(json!({ "file_path": format!("images/{name}"), "transform_matrix": rows }));
    }
    let mut scan = json!({ "fl_x": FOCAL, "w": WIDTH, "h": HEIGHT, "depth_unit_scale_factor": 1e-4, "frames": frames });
    scan.as_object_mut().expect("keys").extend(keys.as_object().expect("keys").clone());
    std::fs::write(folder.join("transforms.json"), scan.to_string()).expect("a file");
}

fn made(with_depth: bool, keys: &serde_json::Value, table: Option<Table>) -> Result<Object, String> {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), with_depth, keys);
    let options = Options { scale: Some(1.0), edge: 32, table };
    let scan = Scan::open(folder.path()).map_err(|error| error.to_string())?;
    reconstruct(scan, &options, &folder.path().join("block.state")).map_err(|error| error.to_string())
}

fn said(object: &Object, what: &str) -> bool {
    object.remarks.iter().any(|remark| remark.0.contains(what))
}

#[test]
fn depth_around_a_block_says_where_its_base_is() {
    let object = made(true, &json!({}), None).expect("an object");
    let support = object.support.expect("a table");
    assert_eq!(support.source, TableSource::Depth);
    let off = support.table.height(&Point3::new(0.0, 0.0, TABLE));
    assert!(off.abs() < 2e-4 && support.table.normal.z > 0.9999, "{support:?}");
    let (low, high) = object.fine.bounds();
    let size = high - low;
    // To half a voxel of the grid, whose box is as tight as the pictures let it.
    assert!(object.field.grid.voxel < 4e-3, "{}", object.field.grid.voxel);
    (0..3).for_each(|axis| assert!((size[axis] - EDGES[axis]).abs() < 2.5e-3, "{size}"));
    assert!((object.solid.volume / EDGES.iter().product::<f64>() - 1.0).abs() < 0.05, "{}", object.solid.volume);
    assert!(said(&object, "closed in the plane") && !said(&object, "beside the object"), "{:?}", object.remarks);
    assert!(object.share(Certainty::Unseen) > 0.1);
}

#[test]
#[ignore = "takes a minute: cargo test --release --workspace --test object_above -- --ignored"]
fn without_depth_a_table_is_stated_or_the_tip_is_named() {
    let object = made(false, &json!({ "table": [0, 0, 3, 3.0 * TABLE] }), None).expect("an object");
    assert_eq!(object.support.map(|support| support.source), Some(TableSource::Scan));
    let low = object.fine.bounds().0.z;
    assert!((low - TABLE).abs() < 2e-4, "{low}");
    let object = made(false, &json!({}), None).expect("an object");
    assert!(object.support.is_none() && object.fine.bounds().0.z < TABLE - 4e-3, "{:?}", object.fine.bounds());
    assert!(said(&object, "the lowest") && said(&object, "--table"), "{:?}", object.remarks);
}

#[test]
fn a_table_that_cannot_be_is_refused_in_one_line() {
    for (table, what) in [
        (Table { normal: -Vector3::z(), offset: -TABLE }, "below the table"),
        (Table::at_height(TABLE + 0.02), "of what the masks show lies below it"),
        (Table::at_height(TABLE - 0.1), "mm and more above it"),
    ] {
        let line = made(false, &json!({}), Some(table)).expect_err("it is refused");
        assert!(line.contains("--table") && line.contains(what) && !line.contains('\n'), "{line}");
    }
}
