//! Objects that are no boxes: one whose turn nothing shows, and one that looks the same from no two sides.

use crate::scenes::{Bench, cell, error, standing};
use rt_bridge::tracker::Sight;
use shared_mem::cell::{Cell, Object};
use std::fmt::Write as _;
use std::path::Path;

/// The shipped cell with a mesh of this text as its object.
fn with_mesh(folder: &Path, name: &str, obj: &str) -> Cell {
    std::fs::write(folder.join(name), obj).expect("a mesh file");
    let mut cell = cell([0.1; 3]);
    cell.folder = folder.to_owned();
    let object = cell.objects.pop().expect("an object");
    cell.objects = vec![Object { shape: None, size: None, mesh: Some(name.into()), ..object }];
    cell
}

/// A prism over a polygon given counter-clockwise [m], as an OBJ file. The polygon's first corner sees all others.
fn prism(polygon: &[[f64; 2]], height: f64) -> String {
    let mut obj = String::new();
    for z in [0.0, height] {
        for [x, y] in polygon {
            let _infallible = writeln!(obj, "v {x} {y} {z}");
        }
    }
    let n = polygon.len();
    for i in 0..n {
        let (a, b) = (i + 1, (i + 1) % n + 1);
        let _infallible = writeln!(obj, "f {a} {b} {}\nf {a} {} {}", b + n, b + n, a + n);
    }
    for i in 1..n - 1 {
        let _infallible = writeln!(obj, "f {} {} {}\nf {} {} {}", 1, i + 2, i + 1, n + 1, n + i + 1, n + i + 2);
    }
    obj
}

#[test]
fn the_turn_of_a_cylinder_is_said_to_be_unknown_and_its_place_is_right() {
    let round: Vec<[f64; 2]> = (0..60)
        .map(|i| {
            let (sin, cos) = (f64::from(i) / 60.0 * std::f64::consts::TAU).sin_cos();
            [0.035 * cos, 0.035 * sin]
        })
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let cell = with_mesh(folder.path(), "can.obj", &prism(&round, 0.11));
    let mut bench = Bench::new(&cell);
    for frame in 0..20 {
        let mut scene = standing(&cell, 0.45 + 0.008 * frame as f64, 0.1, 0.1 * frame as f64, frame);
        scene.object = scene.object.map(|pose| raised(&pose, 0.055));
        if frame == 0 {
            bench.search(&scene);
        }
        let Sight::Tracked(estimate) = bench.see(&scene) else { panic!("frame {frame}: lost") };
        let (off, _) = error(&bench.tracker, &estimate, &scene);
        assert!(off < 0.003, "frame {frame}: {off} m");
        let [leaning, turned] = [21, 35].map(|i| estimate.covariance[i].sqrt());
        assert!(turned > 0.2 && leaning < 0.05, "frame {frame}: leaning {leaning} rad, turned {turned} rad");
    }
}

#[test]
fn a_crooked_block_is_found_the_right_way_round() {
    let crooked = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.04], [0.05, 0.04], [0.03, 0.09], [0.0, 0.09]];
    let folder = tempfile::tempdir().expect("a folder");
    let cell = with_mesh(folder.path(), "block.obj", &prism(&crooked, 0.06));
    for place in 0..6 {
        let mut bench = Bench::new(&cell);
        for frame in 0..3 {
            let yaw = -2.8 + f64::from(place) + 0.05 * frame as f64;
            let mut scene = standing(&cell, 0.5, 0.12 - 0.04 * f64::from(place), yaw, frame);
            scene.object = scene.object.map(|pose| raised(&pose, 0.03));
            if frame == 0 {
                bench.search(&scene);
            }
            let Sight::Tracked(estimate) = bench.see(&scene) else { panic!("place {place}, frame {frame}: lost") };
            let (off, turned) = error(&bench.tracker, &estimate, &scene);
            assert!(off < 0.003 && turned < 0.05, "place {place}, frame {frame}: {off} m, {turned} rad");
        }
    }
}

/// The same pose with the geometric centre this high.
fn raised<To, From>(pose: &shared_mem::frames::Pose<To, From>, height: f64) -> shared_mem::frames::Pose<To, From> {
    let mut isometry = pose.isometry();
    isometry.translation.vector.z = height;
    shared_mem::frames::Pose::from_isometry(isometry)
}
