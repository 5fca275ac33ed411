//! How long a step of training takes: 15,000 splats on a ball, one photograph of 320x240 with mask and depth.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use shared_mem::lens::Distortion;
use splat::{Body, Camera, Lens, Photograph, Settings, Shape, SplatCloud, Surroundings, render, train};
use std::ops::ControlFlow;

const SIZE: [usize; 2] = [320, 240];
const LENS: Lens = Lens { focal: [300.0; 2], centre: [159.5, 119.5], distortion: Distortion::NONE };
const RINGS: u32 = 122;
const AROUND: u32 = 123;
const STEPS: usize = 10;

/// A ball of 0.1 m with waves of colour.
fn ball(degree: usize) -> SplatCloud {
    let (mut points, mut colors, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..RINGS {
        let (wide, z) = ((ring as f32 + 0.5) / RINGS as f32 * std::f32::consts::PI).sin_cos();
        for step in 0..AROUND {
            let (sin, cos) = (step as f32 / AROUND as f32 * std::f32::consts::TAU).sin_cos();
            let way = [wide * cos, wide * sin, z];
            points.push(Point3::from(way.map(|value| 0.1 * value)));
            colors.push(way.map(|value| 0.5 + 0.4 * (12.0 * value).sin()));
            let [a, b] = [ring * AROUND + step, ring * AROUND + (step + 1) % AROUND];
            if ring + 1 < RINGS {
                triangles.extend([[a, a + AROUND, b], [b, a + AROUND, b + AROUND]]);
            }
        }
    }
    SplatCloud::on_mesh(&points, &triangles, &colors, degree)
}

fn step(criterion: &mut Criterion) {
    let pose =
        Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.32), UnitQuaternion::from_euler_angles(0.4, 0.3, 0.0));
    let around = Surroundings { background: [0.0; 3], light: -nalgebra::Vector3::z() };
    let painted = ball(0);
    let body = Body { shape: Shape::Splats(&painted), camera_from_body: pose, instance: 1 };
    let seen = render(&[body], &LENS, SIZE, &around);
    let photograph = Photograph {
        camera: Camera { lens: LENS, camera_from_world: pose },
        size: SIZE,
        rgb: seen.rgb8().collect(),
        mask: Some(seen.cover.iter().map(|cover| (cover * 255.0) as u8).collect()),
        depth: Some(seen.depth),
    };
    let mut grey = ball(1);
    let count = grey.coefficients();
    grey.harmonics.iter_mut().step_by(count).for_each(|color| *color = [0.0; 3]);
    let mut group = criterion.benchmark_group("steps of 15,000 splats at 320x240");
    group.sample_size(10).throughput(Throughput::Elements(STEPS as u64));
    for (name, settings) in [("object", Settings::object(STEPS)), ("scene", Settings::scene(STEPS))] {
        let photographs = [photograph.clone()];
        let run = || train(&grey, &photographs, &settings, |_| ControlFlow::Continue(()));
        group.bench_function(name, |bencher| bencher.iter(run));
    }
}

criterion_group!(benches, step);
criterion_main!(benches);
