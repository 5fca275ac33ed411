//! How long the simulated camera needs for a picture: colour and depth together, one thread. A 30 Hz camera has 33 ms.

use criterion::{Criterion, criterion_group, criterion_main};
use shared_mem::cell::{Camera, Cell};
use std::path::Path;
use twin::sensors::camera::SimCamera;
use twin::sim::SimCell;

fn pictures(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let cell = Cell::read(&path).expect("the shipped cell");
    let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
    for (width, height) in [(640, 480), (1280, 720)] {
        let cell = Cell { camera: Some(Camera { width, height, ..Camera::default() }), ..cell.clone() };
        let mut camera = SimCamera::new(&cell).expect("a camera");
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        criterion.bench_function(&format!("colour and depth {width}x{height}"), |bencher| {
            bencher.iter(|| camera.render(&scene, &mut color, &mut depth));
        });
    }
}

criterion_group!(benches, pictures);
criterion_main!(benches);
