//! Splats trained on photographs: gradient descent (Adam, Kingma & Ba 2015) on the loss of one photograph a step. No splat
//! is added or removed: a cloud that starts on the vertices of a mesh, or on the points of a fused surface, has its places.
//!
//! | module | owns |
//! |---|---|
//! | `photograph` | what is trained on, and how well a cloud shows it |
//! | `adam` | one step of all parameters |
//! | `state` | a training that was stopped, in a file |
//! | `start` | the cloud that a surface begins as |

mod adam;
mod photograph;
mod start;
mod state;
#[cfg(test)]
mod tests;

pub use photograph::{Camera, Photograph, Quality};
pub use state::StateError;

use crate::cloud::SplatCloud;
use crate::gradient::{COLOR_DEPTH, COLOR_PLANE, Frame, Parameters};
use crate::loss::{Loss, Target, Weights};
use adam::Moments;
use nalgebra::Vector3;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// How far a parameter goes in a step at first. The defaults are those of Kerbl et al. 2023 (`train.py` of its first
/// implementation) but for the colours, which go four times as far: thousands of steps are taken here, not tens of thousands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Of centres, in radii of the cameras' places; at the end a hundredth of it, as of all others a tenth.
    pub centre: f64,
    /// Of quaternions.
    pub turn: f64,
    /// Of the logarithm of sigma.
    pub log_sigma: f64,
    /// Of the opacity's logit.
    pub logit: f64,
    /// Of a colour's first coefficient; the others go at a twentieth of it.
    pub color: f64,
}

impl Default for Rates {
    fn default() -> Self {
        Self { centre: 1.6e-4, turn: 1e-3, log_sigma: 5e-3, logit: 5e-2, color: 1e-2 }
    }
}

/// How to train.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How many steps, of one photograph each.
    pub steps: usize,
    /// Of the loss's terms.
    pub weights: Weights,
    /// Weight of the mean, over splats, of the smallest sigma over the largest: splats become flat (PGSR, Chen et al. 2024).
    pub flatten: f64,
    /// What lies behind all splats: red, green, blue, 0 to 1.
    pub background: [f32; 3],
    /// How far a step goes.
    pub rates: Rates,
    /// Of the order of the photographs.
    pub seed: u64,
    /// Where a training is kept, to go on from where it was stopped, or to have its end again; the caller removes the file.
    pub state: Option<PathBuf>,
}

impl Rates {
    /// After a share of the training, that of the centres in metres.
    fn after(&self, share: f64, extent: f64) -> Self {
        let left = LAST_RATE.powf(share);
        Self {
            centre: self.centre * extent * LAST_CENTRE.powf(share),
            turn: self.turn * left,
            log_sigma: self.log_sigma * left,
            logit: self.logit * left,
            color: self.color * left,
        }
    }
}

impl Settings {
    /// For an object with masks, depths where there are any, and splats on its surface.
    pub fn object(steps: usize) -> Self {
        Self {
            steps,
            weights: Weights { similarity: 0.2, mask: 0.1, depth: 0.2, normals: 0.0 },
            flatten: 0.0,
            background: [0.0; 3],
            rates: Rates::default(),
            seed: 1,
            state: None,
        }
    }

    /// For a scene with walls and tables: its splats are drawn into planes.
    pub fn scene(steps: usize) -> Self {
        let weights = Weights { similarity: 0.2, mask: 0.0, depth: 0.2, normals: 0.015 };
        let rates = Rates { centre: ON_SURFACE, ..Rates::default() };
        Self { weights, flatten: 0.05, rates, ..Self::object(steps) }
    }
}

/// How far a training is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Steps that are done.
    pub step: usize,
    /// Of so many.
    pub steps: usize,
    /// The loss of this step's photograph.
    pub loss: f64,
}

/// A cloud cannot be trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Nothing to learn from.
    #[error("there is no photograph to train on: give some with their cameras")]
    NoPhotograph,
    /// Nothing to train.
    #[error("there is no splat to train: begin with the vertices of a mesh, or with points")]
    NoSplat,
    /// A photograph's parts do not fit.
    #[error("photograph {number}: its {what} has {found} pixels and its size says {wanted}; give all in one size")]
    Size {
        /// Which.
        number: usize,
        /// Picture, mask or depth.
        what: &'static str,
        /// Pixels.
        found: usize,
        /// Columns times rows.
        wanted: usize,
    },
    /// It was stopped; a state is kept where one was asked for.
    #[error("stopped after {0} steps")]
    Stopped(usize),
    /// The state of before, or of now.
    #[error(transparent)]
    State(#[from] StateError),
}

/// Rate of centres that begin on fused depth, and are to stay there: an eighth of that of points from pictures.
const ON_SURFACE: f64 = 2e-5;
/// Steps between which the state is kept.
const KEEP: usize = 500;
/// What is left at the end of the centres' rate, and of all others.
const LAST_CENTRE: f64 = 0.01;
const LAST_RATE: f64 = 0.1;

/// Trains a cloud on photographs. `progress` hears of every step and may break it off.
///
/// # Errors
/// [`TrainError`] when there is nothing to do, when it was broken off, or when its state cannot be kept or taken up.
pub fn train(
    cloud: &SplatCloud,
    photographs: &[Photograph],
    settings: &Settings,
    mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<SplatCloud, TrainError> {
    if photographs.is_empty() {
        return Err(TrainError::NoPhotograph);
    }
    if cloud.splats.is_empty() {
        return Err(TrainError::NoSplat);
    }
    photographs.iter().enumerate().try_for_each(|(number, photograph)| photograph.check(number))?;
    let mark = state::mark(cloud, photographs, settings);
    let mut moments = match &settings.state {
        Some(path) => state::read(path, mark, cloud)?,
        None => None,
    }
    .unwrap_or_else(|| Moments::new(Parameters::of(cloud)));
    let extent = extent(photographs);
    let begun = moments.step;
    while moments.step < settings.steps {
        let photograph = &photographs[chosen(settings.seed, moments.step, photographs.len())];
        let (loss, slope) = slope(&moments.at, photograph, settings);
        let share = moments.step as f64 / settings.steps as f64;
        moments.descend(&slope, &settings.rates.after(share, extent));
        let step = moments.step;
        let stops = progress(&Progress { step, steps: settings.steps, loss }).is_break();
        if let Some(path) = settings.state.as_ref().filter(|_| stops || (step % KEEP == 0 && step < settings.steps)) {
            state::write(path, mark, &moments)?;
        }
        if stops {
            return Err(TrainError::Stopped(step));
        }
    }
    if let Some(path) = settings.state.as_ref().filter(|_| begun < settings.steps) {
        state::write(path, mark, &moments)?;
    }
    Ok(moments.at.cloud())
}

/// The loss of one photograph and its slope over all parameters.
fn slope(splats: &Parameters<f32>, photograph: &Photograph, settings: &Settings) -> (f64, Parameters<f32>) {
    let has_normals = settings.weights.normals > 0.0;
    let target = photograph.target(settings.background, has_normals);
    let (loss, mut slope) = if has_normals {
        through::<COLOR_PLANE>(splats, photograph, &target, &settings.weights)
    } else {
        through::<COLOR_DEPTH>(splats, photograph, &target, &settings.weights)
    };
    let flatten = (settings.flatten / splats.len() as f64) as f32;
    if flatten > 0.0 {
        for (slope, log) in slope.log_sigma.iter_mut().zip(&splats.log_sigma).filter(|(slope, _)| **slope != [0.0; 3]) {
            let log = Vector3::from(*log);
            slope[log.imin()] += flatten * (log.min() - log.max()).exp();
        }
    }
    (loss, slope)
}

fn through<const C: usize>(
    splats: &Parameters<f32>,
    photograph: &Photograph,
    target: &Target<f32>,
    weights: &Weights,
) -> (f64, Parameters<f32>) {
    let Camera { lens, camera_from_world } = &photograph.camera;
    let frame = Frame::<f32, C>::new(splats, camera_from_world, lens, photograph.size);
    let seen = frame.planes();
    let cover: Vec<f32> = seen.left.iter().map(|left| 1.0 - left).collect();
    let loss = Loss::new(&seen, &cover, target, weights);
    (f64::from(loss.value), frame.backward(splats, &loss.slope))
}

/// The photograph of a step: each comes once before any comes again, in an order that is another every time.
fn chosen(seed: u64, step: usize, count: usize) -> usize {
    let round = (step / count) as u64;
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut Pcg64Mcg::seed_from_u64(seed.wrapping_add(round.wrapping_mul(0x9e37_79b9_7f4a_7c15))));
    order[step % count]
}

/// Radius around the middle of the cameras' places [m], as 3DGS takes it.
fn extent(photographs: &[Photograph]) -> f64 {
    let places: Vec<Vector3<f64>> =
        photographs.iter().map(|p| p.camera.camera_from_world.inverse().translation.vector).collect();
    let middle = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let far = places.iter().map(|place| (place - middle).norm()).fold(0.0, f64::max);
    // One camera, or all at one place: as far as what it sees is, about.
    if far > 1e-3 { 1.1 * far } else { 1.0 }
}
