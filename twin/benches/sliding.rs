//! Time of one 1 ms step of the sliding law: sliding with spin and at rest, on four corners and on a fine patch.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};
use shared_mem::cell::Support;
use std::hint::black_box;
use twin::sliding::{Coulomb, Patch, PlanarState, Slider, Wrench};

fn step(c: &mut Criterion) {
    for (name, support) in [("corners", Support::Corners), ("ring", Support::Ring), ("uniform", Support::Uniform)] {
        let slider = Slider {
            mass: 0.3,
            yaw_inertia: 2.5e-4,
            height: 0.05,
            patch: Patch::rectangle([0.08, 0.06], Vector2::zeros(), support).expect("a rectangle"),
        };
        let weight = Wrench::weight(0.3, -Vector3::z() * 9.81);
        let rest = PlanarState::at_rest(Vector2::zeros(), 0.1);
        let sliding = PlanarState { velocity: Vector2::x() * 0.6, yaw_rate: 6.0, ..rest };
        for (what, start) in [("sliding", sliding), ("resting", rest)] {
            c.bench_function(&format!("{name}/{what}/1 ms"), |b| {
                b.iter(|| {
                    let mut state = black_box(start);
                    black_box(slider.step(&mut state, &weight, &Coulomb(0.3), 1e-3));
                    state
                });
            });
        }
        c.bench_function(&format!("{name}/slide to rest at 1 ms"), |b| {
            b.iter(|| {
                let mut state = black_box(sliding);
                while !matches!(slider.step(&mut state, &weight, &Coulomb(0.3), 1e-3), twin::sliding::Ending::Rests) {}
                state
            });
        });
    }
}

criterion_group!(benches, step);
criterion_main!(benches);
