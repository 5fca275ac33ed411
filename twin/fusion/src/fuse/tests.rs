//! Views of boxes on a table become their surface.

use super::*;
use crate::plane::{levels, table};
use crate::test_boxes::{SIZE, cameras, seen, table as solids};
use nalgebra::{Point3, Vector3};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};
use rand_pcg::Pcg64Mcg;

/// Depth pictures with a stereo camera's noise, 0.5 % of the square, and colours by box.
fn views(count: usize) -> Vec<(Camera, Vec<f32>, Vec<[u8; 3]>)> {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let bell = Normal::new(0.0, 1.0).expect("a deviation");
    let solids = solids();
    let one = |camera: Camera| {
        let (mut depth, mut rgb) = (Vec::new(), Vec::new());
        for seen in seen(&solids, &camera) {
            let (at, _, _, number) = seen.unwrap_or((0.0, Point3::origin(), Vector3::z(), 0));
            depth.push((at + 0.005 * at * at * bell.sample(&mut rng)) as f32);
            rgb.push([[200, 180, 150], [220, 40, 40], [40, 60, 220]][number]);
        }
        (camera, depth, rgb)
    };
    cameras(count, 0.7).into_iter().map(one).collect()
}

/// How far a point lies off the table and the boxes [m].
fn off(point: &Point3<f32>) -> f64 {
    let distance = |solid: &crate::test_boxes::Solid| {
        let own = solid.pose.inverse() * point.cast::<f64>();
        let beyond = Vector3::from_fn(|i, _| own[i].abs() - solid.half[i]);
        beyond.sup(&Vector3::zeros()).norm() + beyond.max().min(0.0)
    };
    solids().iter().map(distance).fold(f64::INFINITY, f64::min).abs()
}

#[test]
fn noisy_views_become_a_coloured_surface_that_faces_outward_and_has_its_table() {
    let pictures = views(24);
    let settings = Settings { voxel: 8e-3, ..Settings::default() };
    let surface = fuse(
        pictures.iter().map(|(camera, depth, rgb)| View { camera: *camera, size: SIZE, depth, rgb: Some(rgb) }),
        settings,
    );
    let mut offs: Vec<f64> = surface.points.iter().map(off).collect();
    offs.sort_by(f64::total_cmp);
    let (middle, most) = (offs[offs.len() / 2], offs[offs.len() * 95 / 100]);
    assert!(offs.len() > 10_000 && middle < 1e-3 && most < 5e-3, "{} points, {middle} and {most} m", offs.len());
    // On the red box's top: facing up, and red.
    let normals = surface.normals();
    let top = |p: &Point3<f32>| (p.z - 0.12).abs() < 4e-3 && (p.x - 0.12).abs() < 0.03 && (p.y + 0.05).abs() < 0.03;
    let on_top: Vec<usize> = (0..normals.len()).filter(|i| top(&surface.points[*i])).collect();
    assert!(on_top.len() > 20);
    for i in on_top {
        assert!(
            normals[i].z > 0.7 && surface.colors[i][0] > 0.7 && surface.colors[i][1] < 0.4,
            "{:?}",
            surface.colors[i]
        );
    }
    let levels = levels(&surface, &Vector3::z(), 0.26);
    let table = levels[table(&levels).expect("a table")].plane;
    let tilt = table.normal.angle(&Vector3::z()).to_degrees();
    assert!(tilt < 0.2 && table.offset.abs() < 2e-3, "{tilt} degrees, {} m", table.offset);
    let text = surface.obj();
    assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count(), surface.triangles.len());
}

#[test]
fn views_of_nothing_become_nothing() {
    let empty = vec![0.0; SIZE[0] * SIZE[1]];
    let unknown = vec![f32::NAN; SIZE[0] * SIZE[1]];
    for depth in [&empty, &unknown] {
        let view = View { camera: cameras(1, 0.5)[0], size: SIZE, depth, rgb: None };
        assert_eq!(fuse([view, view], Settings::default()), Surface::default());
    }
}
