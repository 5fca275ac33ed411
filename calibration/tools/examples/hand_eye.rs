//! How often the 90 % intervals of `calibration hand-eye` hold the truth, how far the mount is off, and how often a wrong picture is
//! found: simulated pictures, corners and arm's poses with noise, drawn anew for every seed.
//!
//! `cargo run --release -p tools --example hand_eye -- [SEEDS]`

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use shared_mem::hand_eye::Mount;
use vision::hand_eye::fit::fit;
use vision::hand_eye::simulated::{World, off};

/// What came of one seed.
struct Outcome {
    inside: [bool; 6],
    shift: f64,
    turn: f64,
    left_out: usize,
    open: bool,
}

fn outcome(world: &World, seed: u64) -> Option<Outcome> {
    let (truth, views) = world.draw(&mut Pcg64::seed_from_u64(seed));
    let found = fit(world.mount, &views).ok()?;
    let off = off(&found.chain.camera, &truth.camera);
    Some(Outcome {
        inside: std::array::from_fn(|k| off[k].abs() <= found.half_width[k]),
        shift: Vector3::new(off[3], off[4], off[5]).norm_squared(),
        turn: Vector3::new(off[0], off[1], off[2]).norm_squared(),
        left_out: found.views.iter().filter(|view| !view.used).count(),
        open: !found.open.is_empty(),
    })
}

/// Whether the picture that was made wrong is the only one left out.
fn finds(world: &World, seed: u64) -> bool {
    let (_, mut views) = world.draw(&mut Pcg64::seed_from_u64(seed));
    let wrong = seed as usize % views.len();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.012, -0.012, 0.0));
    views[wrong].base_from_end_effector *= Translation3::new(0.006, -0.006, 0.005) * turn;
    fit(world.mount, &views).is_ok_and(|found| (0..views.len()).all(|k| found.views[k].used != (k == wrong)))
}

fn main() -> anyhow::Result<()> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(400), |text| text.parse())?;
    println!(
        "mount, pictures, arm's error: turn and place inside [%] x 6, rms off, good pictures left out, not identifiable, a wrong picture found [%]"
    );
    for mount in [Mount::EyeInHand, Mount::FixedCamera] {
        for (views, arm) in [(6, [1e-3, 0.5e-3]), (12, [0.3e-3, 0.2e-3]), (12, [1e-3, 0.5e-3]), (20, [3e-3, 2e-3])] {
            let world = World { mount, views, pixel: 0.1, arm, turns: [0.5, 0.5, 1.0] };
            let all: Vec<Outcome> = (0..seeds).into_par_iter().filter_map(|seed| outcome(&world, seed)).collect();
            let found = (0..seeds).into_par_iter().filter(|seed| finds(&world, *seed)).count();
            let share = |count: usize| 100.0 * count as f64 / all.len().max(1) as f64;
            let inside: [String; 6] =
                std::array::from_fn(|k| format!("{:.0}", share(all.iter().filter(|one| one.inside[k]).count())));
            let rms = |of: fn(&Outcome) -> f64| (all.iter().map(of).sum::<f64>() / all.len().max(1) as f64).sqrt();
            println!(
                "{mount:?}, {views}, {:.1} mrad {:.1} mm: {}; {:.2} mm {:.3} degrees; {} of {}; {}; {:.0}",
                arm[0] * 1e3,
                arm[1] * 1e3,
                inside.join(" "),
                rms(|one| one.shift) * 1e3,
                rms(|one| one.turn).to_degrees(),
                all.iter().map(|one| one.left_out).sum::<usize>(),
                views * all.len(),
                all.iter().filter(|one| one.open).count(),
                100.0 * found as f64 / seeds as f64,
            );
        }
    }
    Ok(())
}
