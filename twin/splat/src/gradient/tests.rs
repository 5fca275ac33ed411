//! The picture against the reference's, and every slope against difference quotients.

use super::*;
use crate::loss::{Loss, Target, Weights};
use crate::reference::{Body, Shape, Surroundings, render};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use shared_mem::lens::Distortion;

const SIZE: [usize; 2] = [53, 37];
const LENS: Lens =
    Lens { focal: [60.0, 57.0], centre: [25.3, 18.8], distortion: Distortion::brown([-0.08, 0.04, 6e-4, -4e-4, 0.01]) };

/// Splats before a camera, some beyond the picture's edges.
fn scene(count: usize, seed: u64) -> (Parameters<f64>, Isometry3<f64>) {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    let mut splats = Parameters::zeros(count, 3);
    for i in 0..count {
        splats.centre[i] = [between(-0.6, 0.6), between(-0.45, 0.45), between(-0.4, 0.4)];
        splats.turn[i] = [0; 4].map(|_| between(-1.0, 1.0));
        splats.log_sigma[i] = [0; 3].map(|_| between(-4.2, -2.2));
        splats.logit[i] = between(-2.0, 2.5);
    }
    splats.harmonics.iter_mut().for_each(|color| *color = [0; 3].map(|_| between(-0.4, 0.4)));
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.5);
    (splats, Isometry3::from_parts(Translation3::new(0.02, -0.03, 1.1), turn))
}

#[test]
fn the_picture_is_the_references_in_both_precisions() {
    let (splats, pose) = scene(300, 1);
    let cloud = splats.cloud();
    let around = Surroundings { background: [0.2, 0.4, 0.6], light: Vector3::z() };
    let body = Body { shape: Shape::Splats(&cloud), camera_from_body: pose, instance: 1 };
    let reference = render(&[body], &LENS, SIZE, &around);
    let wide = Frame::<f64, COLOR_DEPTH>::new(&Parameters::of(&cloud), &pose, &LENS, SIZE).planes();
    let narrow = Frame::<f32, COLOR_PLANE>::new(&Parameters::of(&cloud), &pose, &LENS, SIZE).planes();
    let mut off = [0.0f64; 2];
    for (i, color) in reference.color.iter().enumerate() {
        for (c, color) in color.iter().enumerate() {
            let wide = wide.channels[c][i] + wide.left[i] * around.background[c];
            let narrow = f64::from(narrow.channels[c][i]) + f64::from(narrow.left[i]) * around.background[c];
            off[0] = off[0].max((wide - f64::from(*color)).abs());
            off[1] = off[1].max((narrow - f64::from(*color)).abs());
        }
        let cover = 1.0 - wide.left[i];
        assert!(cover == 0.0 || (wide.channels[3][i] / cover - f64::from(reference.depth[i])).abs() < 1e-6);
    }
    // Single precision may see another side of the threshold below which a splat is not drawn: 1/255 of a colour.
    assert!(off[0] < 1e-6 && off[1] < 8e-3, "{off:?}");
}

/// A photograph that other splats make, with a depth and a mask.
fn target(seed: u64) -> Target<f64> {
    let (splats, pose) = scene(150, seed);
    let seen = Frame::<f64, COLOR_DEPTH>::new(&splats, &pose, &LENS, SIZE).planes();
    let background = [0.3, 0.1, 0.5];
    let color = [0, 1, 2].map(|c| {
        let over = seen.channels[c].iter().zip(&seen.left).map(|(value, left)| value + left * background[c]);
        over.collect()
    });
    let mask: Vec<f64> = seen.left.iter().map(|left| 1.0 - left).collect();
    let depth = seen.channels[3].iter().zip(&mask).map(|(sum, cover)| if *cover > 0.3 { sum / cover } else { 0.0 });
    Target { size: SIZE, color, background, depth: depth.collect(), mask, rays: Target::rays(&LENS, SIZE) }
}

/// Steps of the quotient: of centres in metres, a millionth of a splat's size, as of all others.
const STEP_CENTRE: f64 = 2e-8;
const STEP: f64 = 1e-6;
/// Of slopes that are a smaller share of the largest of their kind, rounding leaves too little.
const MIN_SLOPE_SHARE: f64 = 0.03;

fn compare<const C: usize>(weights: &Weights, entries: usize, seed: u64) {
    let (splats, pose) = scene(150, seed);
    let target = target(seed + 100);
    let frame = Frame::<f64, C>::new(&splats, &pose, &LENS, SIZE);
    let seen = frame.planes();
    let cover: Vec<f64> = seen.left.iter().map(|left| 1.0 - left).collect();
    let slope = frame.backward(&splats, &Loss::new(&seen, &cover, &target, weights).slope);
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (mut worst, mut compared, mut broken) = (0.0f64, 0, 0);
    while compared < entries {
        let kind = rng.random_range(0..5);
        let column = slope.columns()[kind];
        let largest = column.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let at = rng.random_range(0..column.len());
        if column[at].abs() < MIN_SLOPE_SHARE * largest {
            continue;
        }
        let value = |by: f64| {
            let mut moved = splats.clone();
            moved.columns_mut()[kind][at] += by;
            Loss::new(&Frame::<f64, C>::new(&moved, &pose, &LENS, SIZE).planes(), &cover, &target, weights).value
        };
        let step = if kind == 0 { STEP_CENTRE } else { STEP };
        let quotient = |step: f64| (value(step) - value(-step)) / (2.0 * step);
        let (whole, half) = (quotient(step), quotient(step / 2.0));
        // Between the two lies a kink of an absolute value, or the threshold below which a splat is not drawn: no slope.
        if (whole - half).abs() > 5e-5 * whole.abs() {
            broken += 1;
            continue;
        }
        worst = worst.max((whole / column[at] - 1.0).abs());
        compared += 1;
    }
    assert!(worst < 1e-4 && broken < entries / 2, "the worst of {compared} slopes is {worst:e} off, {broken} broken");
}

#[test]
fn slopes_of_colour_mask_and_depth_are_difference_quotients() {
    let weights = Weights { similarity: 0.2, mask: 0.1, depth: 0.5, normals: 0.0 };
    compare::<COLOR_DEPTH>(&weights, 1000, 7);
}

#[test]
fn slopes_of_the_normals_are_difference_quotients() {
    let weights = Weights { similarity: 0.2, mask: 0.1, depth: 0.5, normals: 0.3 };
    compare::<COLOR_PLANE>(&weights, 300, 8);
}

#[test]
fn single_precision_takes_nearly_the_same_slopes() {
    let (splats, pose) = scene(150, 9);
    let weights = Weights { similarity: 0.2, mask: 0.1, depth: 0.5, normals: 0.0 };
    let target = target(109);
    let wide = Frame::<f64, COLOR_DEPTH>::new(&splats, &pose, &LENS, SIZE);
    let seen = wide.planes();
    let cover: Vec<f64> = seen.left.iter().map(|left| 1.0 - left).collect();
    let loss = Loss::new(&seen, &cover, &target, &weights);
    let exact = wide.backward(&splats, &loss.slope).columns().concat();
    let narrow = |plane: &[f64]| plane.iter().map(|value| *value as f32).collect::<Vec<f32>>();
    let mut single = Parameters::<f32>::zeros(splats.len(), splats.degree);
    for (to, from) in single.columns_mut().into_iter().zip(splats.columns()) {
        to.copy_from_slice(&narrow(from));
    }
    let channels = loss.slope.channels.each_ref().map(|plane| narrow(plane));
    let slope = Planes { size: SIZE, channels, left: narrow(&loss.slope.left) };
    let found = Frame::<f32, COLOR_DEPTH>::new(&single, &pose, &LENS, SIZE).backward(&single, &slope);
    let found: Vec<f64> = found.columns().concat().into_iter().map(f64::from).collect();
    let (off, all) =
        exact.iter().zip(&found).fold((0.0, 0.0), |(off, all), (a, b)| (off + (a - b).powi(2), all + a * a));
    let off = (off / all).sqrt();
    assert!(off < 1e-4, "{off:e}");
}
