//! Depth of surfaces that are drawn from their equations.

use depth::{Camera, Depth, View, estimate};
use nalgebra::{Isometry3, Point3, Vector3};

const SIZE: [usize; 2] = [160, 120];
const FOCAL: f64 = 250.0;
const CENTRE: [f64; 2] = [80.0, 60.0];

/// Where a ray from a place in a direction first meets a surface, as a multiple of the direction.
type Surface = fn(&Point3<f64>, &Vector3<f64>) -> Option<f64>;

/// A plane through (0, 0, 0.5) m that is turned by 35 degrees from the cameras.
fn slanted(from: &Point3<f64>, along: &Vector3<f64>) -> Option<f64> {
    let normal = Vector3::new(-0.5, 0.27, -0.82).normalize();
    Some(normal.dot(&(Point3::new(0.0, 0.0, 0.5) - from)) / normal.dot(along)).filter(|t| *t > 0.0)
}

/// A ball of 120 mm at (0, 0, 0.5) m.
fn ball(from: &Point3<f64>, along: &Vector3<f64>) -> Option<f64> {
    let to = from - Point3::new(0.0, 0.0, 0.5);
    let (a, b, c) = (along.norm_squared(), along.dot(&to), to.norm_squared() - 0.0144);
    let root = b * b - a * c;
    (root > 0.0).then(|| (-b - root.sqrt()) / a)
}

/// Print at a place in space: waves of 5 to 30 mm in eight directions.
fn print(at: &Point3<f64>) -> f64 {
    let wave = |number: usize| {
        let turn = 2.4 * number as f64;
        let way = Vector3::new(turn.cos(), turn.sin(), (1.7 * turn).cos());
        (way.dot(&at.coords) * std::f64::consts::TAU / (0.005 + 0.0035 * number as f64) + turn).sin()
    };
    127.0 + 14.0 * (0..8).map(wave).sum::<f64>()
}

/// Views from 0.5 m, up to 14 degrees from the middle, and the true depth of the first.
fn scan(surface: Surface, texture: bool) -> (Vec<View>, Vec<f64>) {
    let target = Point3::new(0.0, 0.0, 0.5);
    let mut truth = Vec::new();
    let view = |number: usize, truth: &mut Vec<f64>| {
        let away = if number == 0 { 0.0 } else { 0.12 };
        let turn = std::f64::consts::TAU / 3.0 * number as f64;
        let eye = Point3::new(away * turn.cos(), away * turn.sin(), 0.0);
        let pose = Isometry3::face_towards(&eye, &target, &Vector3::y());
        let camera = Camera { size: SIZE, focal: [FOCAL; 2], centre: CENTRE };
        let mut grey = Vec::new();
        for at in 0..SIZE[0] * SIZE[1] {
            let pixel = [(at % SIZE[0]) as f64 + 0.5, (at / SIZE[0]) as f64 + 0.5];
            let [x, y] = [0, 1].map(|i| (pixel[i] - CENTRE[i]) / FOCAL);
            let along = pose * Vector3::new(x, y, 1.0);
            let hit = surface(&eye, &along);
            if number == 0 {
                truth.push(hit.unwrap_or(f64::NAN));
            }
            // Rounded as a camera does it.
            let shown = hit.map_or(60.0, |t| if texture { print(&(eye + along * t)) } else { 60.0 });
            grey.push(shown.round().clamp(0.0, 255.0) as f32);
        }
        View { camera, camera_from_world: pose.inverse(), grey, fine: Vec::new(), range: [0.25, 1.0] }
    };
    let views = (0..4).map(|number| view(number, &mut truth)).collect();
    (views, truth)
}

/// Depth of the first view.
fn first(views: &[View]) -> Depth {
    estimate(views, 1, &|_| ()).expect("nobody asked for the end").swap_remove(0)
}

/// Middle error [m] of what has depth, and its share of what there is at least so many pixels from the picture's edge.
fn judged(depth: &Depth, truth: &[f64]) -> (f64, f64) {
    let inner = |at: &usize| {
        let (column, row) = (at % SIZE[0], at / SIZE[0]);
        (10..SIZE[0] - 10).contains(&column) && (10..SIZE[1] - 10).contains(&row) && truth[*at].is_finite()
    };
    let all: Vec<usize> = (0..truth.len()).filter(inner).collect();
    let errors = all.iter().map(|at| (f64::from(depth.depth[*at]) - truth[*at]).abs()).filter(|e| e.is_finite());
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_by(f64::total_cmp);
    (errors[errors.len() / 2], errors.len() as f64 / all.len() as f64)
}

#[test]
fn a_printed_plane_that_slants_is_found() {
    let (views, truth) = scan(slanted, true);
    let depth = first(&views);
    let (middle, share) = judged(&depth, &truth);
    eprintln!("plane: {:.3} mm off on {:.1} %", 1e3 * middle, 1e2 * share);
    assert!(middle < 5e-4 && share > 0.9, "{middle} m off on {share}");
    let towards = Vector3::new(-0.5, 0.27, -0.82).normalize();
    let towards = views[0].camera_from_world * towards;
    let off = depth.normal.iter().filter(|n| n[0].is_finite()).map(|n| Vector3::from(*n).cast::<f64>().angle(&towards));
    let mut off: Vec<f64> = off.collect();
    off.sort_by(f64::total_cmp);
    assert!(off[off.len() / 2].to_degrees() < 4.0, "{}", off[off.len() / 2].to_degrees());
}

#[test]
fn a_printed_ball_is_found() {
    let (views, truth) = scan(ball, true);
    let (middle, share) = judged(&first(&views), &truth);
    eprintln!("ball: {:.3} mm off on {:.1} %", 1e3 * middle, 1e2 * share);
    assert!(middle < 8e-4 && share > 0.8, "{middle} m off on {share}");
}

#[test]
fn what_has_no_print_has_no_depth() {
    let (views, truth) = scan(slanted, false);
    let depth = first(&views);
    let known = depth.depth.iter().filter(|z| z.is_finite()).count() as f64 / truth.len() as f64;
    assert!(known < 0.02, "{known}");
    assert!(depth.confidence.iter().zip(&depth.depth).all(|(c, z)| (*c > 0.0) == z.is_finite()));
}
