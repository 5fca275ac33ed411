//! How exactly `calibration viewpoint` finds the simulated cell's camera from random starts, and what the particle swarm
//! needs for it.
//!
//! `cargo run --release -p tools --example viewpoint_trials -- [TRIALS] [PICTURES] [SWARM TRIALS]`
//!
//! How often its 95 % intervals hold the truth: cameras anywhere around the cell, arm poses, noise and blur of the pictures,
//! and starts, all drawn anew for every view; axis by axis.
//!
//! `cargo run --release -p tools --example viewpoint_trials -- coverage [VIEWS] [PICTURES] [colour|silhouette|depth] [SEED]`

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use shared_mem::cell::{Camera, CameraPose, Cell};
use std::path::Path;
use std::time::Instant;
use tools::coverage::{Printed, Session, table};
use twin::render::{Hand, RobotSurface};
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;
use vision::viewpoint::fit::{Method, fit};
use vision::viewpoint::frame::{Evidence, Frame};
use vision::viewpoint::grid::Grid;
use vision::viewpoint::interval::interval;
use vision::viewpoint::lens::Lens;
use vision::viewpoint::picture::Pixels;
use vision::viewpoint::refine::{self, refine};
use vision::viewpoint::search::Reach;
use vision::viewpoint::shape::Shape;
use vision::viewpoint::step;

/// Starts lie within this of the truth [rad, m].
const REACH: Reach = Reach { angle: 0.349, distance: 0.3 };

fn main() -> anyhow::Result<()> {
    if std::env::args().nth(1).as_deref() == Some("coverage") {
        return coverage();
    }
    let count = |n: usize, default: usize| std::env::args().nth(n).map_or(Ok(default), |text| text.parse());
    let (trials, pictures, swarms) = (count(1, 100)?, count(2, 1)?, count(3, 2)?);
    let mut cell = Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/fr3_cell.toml"))?;
    cell.object_mut().expect("an object").pose_noise = None;
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

/// Starts of views lie within this of the truth [rad, m].
const NEAR: Reach = Reach { angle: 0.02, distance: 0.02 };
/// Grey levels of noise, one sigma, and blur of the lens, one sigma [pixel], at most.
const NOISE: f64 = 2.0;
const BLUR: f64 = 0.7;
/// Share of a picture that the robot covers in a view that somebody would choose.
const IN_VIEW: std::ops::Range<f64> = 0.02..0.5;

/// What the silhouettes are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Source {
    Colour,
    Silhouette,
    Depth,
}

fn coverage() -> anyhow::Result<()> {
    let argument = |n: usize| std::env::args().nth(n);
    let number = |n: usize, default: u64| argument(n).map_or(Ok(default), |text| text.parse());
    let (views, pictures, seed) = (number(2, 100)?, number(3, 6)?, number(5, 1)?);
    let source = match argument(4).as_deref() {
        None | Some("colour") => Source::Colour,
        Some("silhouette") => Source::Silhouette,
        Some("depth") => Source::Depth,
        Some(other) => anyhow::bail!("{other} is none of colour, silhouette, depth"),
    };
    let cell = Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/fr3_cell.toml"))?;
    let mut sessions = Vec::new();
    for view in seed..seed + views {
        let session = seen(&cell, source, pictures, view)?;
        let inside = session.printed.iter().filter(|printed| printed.holds()).count();
        let off = |printed: &Printed| {
            format!(" {:.2e}±{:.1e}", printed.value - printed.truth, printed.value - printed.interval[0])
        };
        let off: String = session.printed.iter().map(off).collect();
        println!(
            "view {view}: {inside} of {}{off} {}",
            session.printed.len(),
            session.left_out.as_deref().unwrap_or("")
        );
        sessions.push(session);
    }
    print!("{}", table(&sessions, 0.95));
    Ok(())
}

/// One view, drawn from its number, and what is found in its pictures.
fn seen(cell: &Cell, source: Source, pictures: u64, view: u64) -> anyhow::Result<Session> {
    let mut random = Pcg64::seed_from_u64(view);
    let mut cell = cell.clone();
    let shape = Shape::new(RobotSurface::new(&cell, Hand::None)?);
    let (truth, frames) = loop {
        let truth = placed(&mut random);
        let (position, turn) = (truth.translation.vector.into(), truth.rotation);
        let orientation = [turn.w, turn.i, turn.j, turn.k];
        let pose = CameraPose { position, orientation };
        cell.camera = Some(Camera { pose, ..cell.camera.clone().unwrap_or_default() });
        let blur = BLUR * random.random::<f64>();
        if let Some(frames) = taken(&cell, &shape, source, (pictures, blur), &mut random)? {
            break (truth.inverse(), frames);
        }
    };
    let start = near(&truth, NEAR, &mut random);
    // The last two steps of a fit: it is the interval that is asked about, not the search.
    let fine = refine(&frames, &shape, &start, refine::FINE);
    let found = fine.and_then(|fine| refine(&frames, &shape, &fine.camera_from_base, refine::LAST));
    let Some((found, interval)) =
        found.and_then(|found| interval(&found, frames.len()).map(|printed| (found, printed)))
    else {
        return Ok(Session { world: view, printed: Vec::new(), left_out: Some("no pose, or no interval".into()) });
    };
    let (truth, found) = (truth.inverse(), found.camera_from_base.inverse());
    let turned = (found.rotation * truth.rotation.inverse()).scaled_axis();
    let off = found.translation.vector - truth.translation.vector;
    let printed = (0..6).map(|i| {
        let (truth, value, half) = match i {
            0..3 => (truth.translation.vector[i], truth.translation.vector[i] + off[i], interval.position[i]),
            _ => (0.0, turned[i - 3], interval.rotation[i - 3]),
        };
        let name = ["x [m]", "y [m]", "z [m]", "about x [rad]", "about y [rad]", "about z [rad]"][i].to_owned();
        Printed { name, truth, value, interval: [value - half, value + half] }
    });
    Ok(Session { world: view, printed: printed.collect(), left_out: None })
}

/// A camera before the robot, 1.2 to 1.9 m away, that looks at it, about upright. The optical frame in the base.
fn placed(random: &mut Pcg64) -> Isometry3<f64> {
    let mut within = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let (far, azimuth, height) = (within(1.2, 1.9), within(-1.3, 1.3), within(0.2, 0.9));
    let middle = Point3::new(0.25 + within(-0.1, 0.1), within(-0.1, 0.1), 0.35 + within(-0.1, 0.1));
    let flat = far * height.cos();
    let eye = middle + Vector3::new(flat * azimuth.cos(), flat * azimuth.sin(), far * height.sin());
    let z = (middle - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let rotation = Rotation3::from_basis_unchecked(&[x, z.cross(&x), z]);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), within(-0.1, 0.1));
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&rotation) * roll)
}

/// Pictures of the robot in as many poses; `None` where it is hardly in view.
fn taken(
    cell: &Cell,
    shape: &Shape,
    source: Source,
    (pictures, blur): (u64, f64),
    random: &mut Pcg64,
) -> anyhow::Result<Option<Vec<Frame>>> {
    let camera = cell.camera.clone().unwrap_or_default();
    let (lens, size) = (Lens::new(&camera.pinhole()), [camera.width as usize, camera.height as usize]);
    let mut frames = Vec::new();
    for number in 0..pictures {
        let mut q = *shape.surface().model().ready();
        q.iter_mut().take(7).for_each(|angle| *angle += random.random::<f64>() - 0.5);
        let scene = SceneSnapshot { q, dof: 7, ..SceneSnapshot::default() };
        let mask = silhouette(cell, &scene)?;
        let covered = mask.values.iter().map(|v| f64::from(*v)).sum::<f64>() / mask.values.len() as f64;
        if !IN_VIEW.contains(&covered) {
            return Ok(None);
        }
        let evidence = if source == Source::Silhouette {
            Evidence::Mask(mask)
        } else {
            let mut camera = SimCamera::new(cell)?;
            let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
            camera.render(&scene, &mut color, &mut depth);
            let channels = if source == Source::Colour {
                let seen = |c| Grid::from_fn(size[0], size[1], |x, y| f32::from(color[3 * (y * size[0] + x) + c]));
                (0..3).map(|c| noisy(blurred(seen(c), blur), random)).collect()
            } else {
                let at = |x: usize, y: usize| 2 * (y * size[0] + x);
                let depth = |x, y| f32::from(u16::from_le_bytes([depth[at(x, y)], depth[at(x, y) + 1]]));
                vec![Grid::from_fn(size[0], size[1], depth)]
            };
            Pixels { size, channels }.alone(&lens, "the picture")?
        };
        frames.push(Frame::new(number.to_string(), q, lens, &evidence, shape));
    }
    Ok(Some(frames))
}

/// With the noise of a sensor, in whole grey levels.
fn noisy(grid: Grid, random: &mut Pcg64) -> Grid {
    let values = grid.values.into_iter().map(|value| {
        let noise = NOISE * random.sample::<f64, _>(StandardNormal);
        (f64::from(value) + noise).round().clamp(0.0, 255.0) as f32
    });
    Grid { values: values.collect(), ..grid }
}

/// Through a lens that draws a point as a bell of this sigma [pixel].
fn blurred(grid: Grid, sigma: f64) -> Grid {
    // Weights beside the middle of three that have the bell's variance, in both directions.
    let beside = (0.5 * sigma * sigma) as f32;
    let (width, height) = (grid.width, grid.height);
    let across = Grid::from_fn(width, height, |x, y| {
        let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
        (1.0 - 2.0 * beside) * grid.at(x, y) + beside * (grid.at(left, y) + grid.at(right, y))
    });
    Grid::from_fn(width, height, |x, y| {
        let (up, down) = (y.saturating_sub(1), (y + 1).min(height - 1));
        (1.0 - 2.0 * beside) * across.at(x, y) + beside * (across.at(x, up) + across.at(x, down))
    })
}

/// A start that is off by up to [`REACH`], in any direction.
fn start(truth: &Isometry3<f64>, random: &mut Pcg64) -> Isometry3<f64> {
    near(truth, REACH, random)
}

fn near(truth: &Isometry3<f64>, reach: Reach, random: &mut Pcg64) -> Isometry3<f64> {
    let mut anywhere = |most: f64| {
        let way = Vector3::from_fn(|_, _| random.random::<f64>() - 0.5).normalize();
        way * (most * random.random::<f64>())
    };
    let (turn, shift) = (anywhere(reach.angle), anywhere(reach.distance));
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
