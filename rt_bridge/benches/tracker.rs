//! How long the tracker needs for a frame of 640 by 480, one thread: while it follows the object, and while it searches the
//! whole picture. A 30 Hz camera leaves 33 ms; the simulated camera's own picture is timed beside it.

use criterion::{Criterion, criterion_group, criterion_main};
use rt_bridge::tracker::{Frame, Tracker, View};
use shared_mem::cell::Cell;
use std::path::Path;
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;
use twin::sim::SimCell;

fn frames(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let cell = Cell::read(&path).expect("the shipped cell");
    let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
    let mut camera = SimCamera::new(&cell).expect("a camera");
    let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
    criterion.bench_function("the simulated camera's picture", |bencher| {
        bencher.iter(|| camera.render(&scene, &mut color, &mut depth));
    });
    let view = View::new(&camera.info()).expect("a camera");
    for (name, scene) in
        [("a frame with the object", scene), ("a frame without it", SceneSnapshot { object: None, ..scene })]
    {
        let [color_header, depth_header] = camera.render(&scene, &mut color, &mut depth);
        let frame = Frame::new(&view, (&depth_header, &depth), Some((&color_header, &color))).expect("a frame");
        let mut tracker = Tracker::new(&cell).expect("a tracker");
        tracker.set_view(view.clone());
        let mut at = 0.0;
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                at += 1.0 / 30.0;
                tracker.look(&frame, at, Some(&scene.q))
            });
        });
    }
    let mut first = Tracker::new(&cell).expect("a tracker");
    first.set_view(view.clone());
    let [color_header, depth_header] = camera.render(&scene, &mut color, &mut depth);
    let frame = Frame::new(&view, (&depth_header, &depth), Some((&color_header, &color))).expect("a frame");
    for name in ["a search's first frame", "a search's second frame", "the frame in which it is found"] {
        let before = first.clone();
        criterion.bench_function(name, |bencher| {
            bencher.iter_batched(
                || before.clone(),
                |mut tracker| tracker.look(&frame, 0.0, Some(&scene.q)),
                criterion::BatchSize::SmallInput,
            );
        });
        first.look(&frame, 0.0, Some(&scene.q));
    }
}

criterion_group!(benches, frames);
criterion_main!(benches);
