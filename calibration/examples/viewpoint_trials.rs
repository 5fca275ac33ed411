//! How exactly `calibration viewpoint` finds the simulated cell's camera from random starts, and what the particle swarm
//! needs for it.
//!
//! `cargo run --release -p calibration --example viewpoint_trials -- [TRIALS] [PICTURES] [SWARM TRIALS]`

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use calibration::viewpoint::fit::{Method, fit};
use calibration::viewpoint::frame::{Evidence, Frame};
use calibration::viewpoint::grid::Grid;
use calibration::viewpoint::lens::Lens;
use calibration::viewpoint::search::Reach;
use calibration::viewpoint::shape::Shape;
use calibration::viewpoint::step;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use shared_mem::cell::Cell;
use std::path::Path;
use std::time::Instant;
use twin::render::{Hand, RobotSurface};
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;

/// Starts lie within this of the truth [rad, m].
const REACH: Reach = Reach { angle: 0.349, distance: 0.3 };

fn main() -> anyhow::Result<()> {
    let count = |n: usize, default: usize| std::env::args().nth(n).map_or(Ok(default), |text| text.parse());
    let (trials, pictures, swarms) = (count(1, 100)?, count(2, 1)?, count(3, 2)?);
    let mut cell = Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml"))?;
    cell.object.as_mut().expect("an object").pose_noise = None;
    let camera = cell.camera.clone().unwrap_or_default();
    let truth = camera.base_from_camera().expect("a pose").isometry().inverse();
    let shape = Shape::new(RobotSurface::new(&cell, Hand::None)?);
    let mut random = Pcg64::seed_from_u64(5);
    let mut frames = Vec::new();
    for number in 0..pictures {
        let mut q = *shape.surface().model().ready();
        for angle in q.iter_mut().take(7).filter(|_| number > 0) {
            *angle += random.random::<f64>() - 0.5;
        }
        let mask = silhouette(&cell, &SceneSnapshot { q, dof: 7, ..SceneSnapshot::default() })?;
        frames.push(Frame::new(number.to_string(), q, Lens::new(&camera.pinhole()), &Evidence::Mask(mask), &shape));
    }
    for (name, method, trials) in
        [("outline", Method::Outline, trials), ("swarm of 10000", Method::Swarm(10_000), swarms)]
    {
        let mut random = Pcg64::seed_from_u64(11);
        let (mut off, mut failed, mut missed) = (Vec::new(), 0, 0);
        for number in 0..trials {
            let start = start(&truth, &mut random);
            let began = Instant::now();
            match fit(&frames, &shape, &start, &REACH, method, number as u64) {
                Ok(found) => {
                    let (distance, angle) = step::apart(&found.camera_from_base, &truth);
                    missed += usize::from(distance > 0.01);
                    off.push((distance * 1e3, angle.to_degrees(), found.drawings, began.elapsed().as_secs_f64()));
                    let inside = found.interval.is_some_and(|interval| {
                        let apart =
                            truth.inverse().translation.vector - found.camera_from_base.inverse().translation.vector;
                        (0..3).all(|i| apart[i].abs() <= interval.position[i])
                    });
                    println!(
                        "{name} {number}: {:.3} mm, {:.4} degrees, wrong {:.6}, in its interval: {inside}",
                        distance * 1e3,
                        angle.to_degrees(),
                        found.loss
                    );
                }
                Err(why) => {
                    failed += 1;
                    println!("{name} {number}: {why}");
                }
            }
        }
        let median = |value: fn(&(f64, f64, usize, f64)) -> f64| {
            let mut values: Vec<f64> = off.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        println!(
            "{name}: {trials} starts, {failed} said to have failed, {missed} more than 10 mm off without saying so; medians: {:.3} mm, {:.4} degrees, {} drawings, {:.2} s",
            median(|t| t.0),
            median(|t| t.1),
            median(|t| t.2 as f64),
            median(|t| t.3)
        );
    }
    Ok(())
}

/// A start that is off by up to [`REACH`], in any direction.
fn start(truth: &Isometry3<f64>, random: &mut Pcg64) -> Isometry3<f64> {
    let mut anywhere = |most: f64| {
        let way = Vector3::from_fn(|_, _| random.random::<f64>() - 0.5).normalize();
        way * (most * random.random::<f64>())
    };
    let (turn, shift) = (anywhere(REACH.angle), anywhere(REACH.distance));
    let camera = Translation3::from(shift) * truth.inverse() * UnitQuaternion::from_scaled_axis(turn);
    camera.inverse()
}

/// What differs between the simulated camera's pictures with and without the robot, in colour or in depth.
fn silhouette(cell: &Cell, scene: &SceneSnapshot) -> anyhow::Result<Grid> {
    let shot = |cell: &Cell| -> anyhow::Result<(Vec<u8>, Vec<u8>)> {
        let mut camera = SimCamera::new(cell)?;
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        camera.render(scene, &mut color, &mut depth);
        Ok((color, depth))
    };
    let (color, depth) = shot(cell)?;
    let (bare, bare_depth) = shot(&Cell { robot: None, tool: None, ..cell.clone() })?;
    let camera = cell.camera.clone().unwrap_or_default();
    Ok(Grid::from_fn(camera.width as usize, camera.height as usize, |x, y| {
        let i = y * camera.width as usize + x;
        let coloured = (0..3).any(|c| color[3 * i + c].abs_diff(bare[3 * i + c]) > 8);
        let at = |depth: &[u8]| u16::from_le_bytes([depth[2 * i], depth[2 * i + 1]]);
        f32::from(u8::from(coloured || at(&depth).abs_diff(at(&bare_depth)) > 3))
    }))
}
