//! Splats, a picture of them, and the slopes of a loss over both as JSON, for another implementation to compare with:
//! `cargo run --release -p splat --example gradients > gradients.json`, then `tests/peers/splat_gradients.py gradients.json`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use shared_mem::lens::Distortion;
use splat::{COLOR_DEPTH, Frame, Lens, Parameters, Planes};
use std::io::Write as _;

const SIZE: [usize; 2] = [64, 48];
const LENS: Lens = Lens { focal: [70.0, 66.0], centre: [30.2, 24.9], distortion: Distortion::NONE };
const SPLATS: usize = 200;

fn main() -> std::io::Result<()> {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    let mut splats = Parameters::<f64>::zeros(SPLATS, 3);
    for i in 0..SPLATS {
        splats.centre[i] = [between(-0.35, 0.35), between(-0.25, 0.25), between(-0.3, 0.3)];
        splats.turn[i] = [0; 4].map(|_| between(-1.0, 1.0));
        splats.log_sigma[i] = [0; 3].map(|_| between(-4.2, -2.6));
        splats.logit[i] = between(-2.0, 2.5);
    }
    splats.harmonics.iter_mut().for_each(|color| *color = [0; 3].map(|_| between(-0.3, 0.3)));
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.5);
    let camera = Isometry3::from_parts(Translation3::new(0.02, -0.03, 1.1), turn);
    let mut slope = Planes::<f64, COLOR_DEPTH>::zeros(SIZE);
    slope.channels.iter_mut().chain([&mut slope.left]).flatten().for_each(|value| *value = between(-1.0, 1.0));
    let frame = Frame::new(&splats, &camera, &LENS, SIZE);
    let seen = frame.planes();
    let back = frame.backward(&splats, &slope);
    let rotation = camera.rotation.to_rotation_matrix();
    let answer = serde_json::json!({
        "size": SIZE,
        "focal": LENS.focal,
        "centre": LENS.centre,
        "rotation": (0..3).map(|i| (0..3).map(|j| rotation[(i, j)]).collect()).collect::<Vec<Vec<f64>>>(),
        "translation": camera.translation.vector.as_slice(),
        "splats": columns(&splats),
        "picture": { "channels": seen.channels, "left": seen.left },
        "slope": { "channels": slope.channels, "left": slope.left },
        "gradient": columns(&back),
    });
    std::io::stdout().write_all(answer.to_string().as_bytes())
}

fn columns(splats: &Parameters<f64>) -> serde_json::Value {
    let [centre, turn, log_sigma, logit, harmonics] = splats.columns();
    serde_json::json!({ "centre": centre, "turn": turn, "log_sigma": log_sigma, "logit": logit, "harmonics": harmonics })
}
