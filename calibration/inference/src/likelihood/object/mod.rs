//! Clips with an object: what the twin makes of every clip under any parameters, and how far that is from what was
//! recorded. Called by identification and by the diagnosis.
//!
//! A clip's rows are its poses: position along x, y, z and rotation vector about them, measured less predicted, each in
//! sigmas of the tracker's noise, base frame; and, where asked for, the joints from the hit on: the blow that the arm
//! takes says how heavy the object is. Every clip has nuisance parameters ([`Nuisance`]): the hit above all differs a little
//! from any simulated one, and read as structure that little would be taken for an effect that is not there.
//!
//! | file | owns |
//! |---|---|
//! | `nuisance` | the parameters that each clip has for itself |
//! | `deviations` | how its path deviates from any simulated one |
//! | `clip` | a recorded clip, prepared |
//! | `clearance` | how far tool and object are apart |
//! | `rollout` | a clip in the twin |
//! | `simulator` | a clip by another program, completed by the twin |
//! | `replayed` | the figures of `twin replay`, whoever simulates |
//! | `outcome` | what came of it |
//! | `cache` | what of it can be used again |
//! | `rows` | what every residual is about |

mod cache;
mod clearance;
mod clip;
mod deviations;
mod nuisance;
mod outcome;
mod replayed;
mod rollout;
mod rows;
mod simulator;

pub use clearance::{Clearance, SEEN_MOTION, alone_until};
pub use nuisance::{IDENTIFIED, Nuisance, diagnosed, random_effects};
pub use replayed::Replays;
pub use rows::{Channel, Part, Row};

use super::random_effects::RandomEffects;
use super::{Settings, vertical};
use crate::engine::Engine;
use crate::estimate::{ClipModel, Impossible};
use cache::ClipCache;
use clip::ObjectClip;
use nalgebra::Isometry3;
use nuisance::Values;
use outcome::Outcome;
use rollout::Job;
use shared_mem::cell::{Cell, ClipKind, PoseNoise};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use simulator::{Simulator, composed};
use std::sync::{Arc, Mutex};
use twin::effects::CameraMemory;
use twin::rollout::CellRollout;
use twin::sim::SimError;

/// What the tracker's noise is taken for where cell.toml does not state it, one sigma.
const NOISE: PoseNoise = PoseNoise { position: 1e-3, rotation: 5e-3 };

/// The tracker's noise, one sigma.
pub fn noise_of(cell: &Cell) -> PoseNoise {
    cell.object().and_then(|object| object.pose_noise).unwrap_or(NOISE)
}

/// How far a residual may be off for other reasons than noise, one sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelError {
    /// Of poses between the first touch and the moment the tool lets go [m, rad].
    pub hit: PoseNoise,
    /// Of poses from then on [m, rad]: one error of the whole rest, however many poses show it. Zero where nuisance
    /// parameters take what the hit leaves behind.
    pub rest: PoseNoise,
    /// Of the joints from the hit on [rad]; `None` leaves the arm out.
    pub joints: Option<f64>,
    /// Whether strokes are held against their motion along the table alone. A hit object tips, and how far depends on how the
    /// table yields under its edges, which the twin's rigid one does not: read as structure it would be a centre of mass
    /// that lies too low.
    pub flat: bool,
}

impl Default for ModelError {
    fn default() -> Self {
        let none = PoseNoise { position: 0.0, rotation: 0.0 };
        Self { hit: PoseNoise { position: 3e-3, rotation: 0.03 }, rest: none, joints: None, flat: false }
    }
}

/// Clips with an object, and what numbers mean for the cell.
pub struct ObjectClips {
    cell: Cell,
    noise: PoseNoise,
    error: ModelError,
    clips: Vec<ObjectClip>,
    /// What each clip has of its own, in the order of its numbers.
    nuisance: Vec<Nuisance>,
    caches: Vec<ClipCache>,
    /// The other program where there is one, and what came of it, clip by clip.
    simulator: Option<Simulator>,
    simulated: Vec<ClipCache>,
    /// Idle workers; as many as threads were ever at work.
    workers: Mutex<Vec<CellRollout>>,
    worker: CellRollout,
    settings: Settings,
}

/// What the twin makes of a clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The poses that the tracker would have reported, one for each recorded one.
    pub poses: Vec<Pose<Base, Object>>,
    /// Stamp of the first touch; `None` where tool and object did not touch.
    pub contact_ns: Option<u64>,
}

impl ObjectClips {
    /// Clips of a cell, in their order; those without poses are left out.
    ///
    /// # Errors
    /// [`SimError`] when the cell cannot be simulated.
    pub fn new(cell: &Cell, clips: Vec<Clip>, settings: Settings) -> Result<Self, SimError> {
        let noise = noise_of(cell);
        let worker = CellRollout::new(cell, None)?;
        let prepared = |clip| ObjectClip::new(clip, (cell, worker.cell().arm_model()), noise.position);
        let clips: Vec<ObjectClip> = clips.into_iter().filter_map(prepared).collect();
        let acts = |own: &Nuisance| clips.iter().any(|clip| own.acts_in(clip.recorded.kind));
        let nuisance = IDENTIFIED.iter().copied().filter(acts).collect();
        let [caches, simulated] = [(), ()].map(|()| clips.iter().map(|_| ClipCache::default()).collect());
        let (error, workers) = (ModelError::default(), Mutex::default());
        let (cell, simulator) = (cell.clone(), None);
        Ok(Self { cell, noise, error, clips, nuisance, caches, simulator, simulated, workers, worker, settings })
    }

    /// The same simulated by another program, where there is one; `nominal`: the cell's nominal parameters.
    pub fn simulated_by(mut self, engine: Option<&Arc<Engine>>, nominal: &Theta) -> Self {
        self.simulator = engine.map(|engine| Simulator { engine: Arc::clone(engine), nominal: nominal.clone() });
        self
    }

    /// The other program.
    pub fn engine(&self) -> Option<&Arc<Engine>> {
        self.simulator.as_ref().map(|simulator| &simulator.engine)
    }

    /// How far residuals may be off for other reasons than noise.
    pub fn model_error(&self) -> ModelError {
        self.error
    }

    /// The tracker's noise that poses are held against.
    pub fn noise(&self) -> PoseNoise {
        self.noise
    }

    /// Changes [`Self::model_error`].
    pub fn set_model_error(&mut self, error: ModelError) {
        if error.joints.is_some() != self.error.joints.is_some() {
            self.caches.iter_mut().chain(&mut self.simulated).for_each(|cache| *cache = ClipCache::default());
        }
        self.error = error;
    }

    /// The same with other parameters of each clip's own than [`IDENTIFIED`].
    pub fn with_nuisance(self, nuisance: Vec<Nuisance>) -> Self {
        Self { nuisance, ..self }
    }

    /// What each clip has of its own, with the scatter that is assumed until it is estimated.
    pub fn random(&self) -> RandomEffects {
        random_effects(&self.nuisance, &self.cell)
    }

    /// What one unit of every deviation of the path among these takes off the residuals of a clip's poses [1/m, 1/rad].
    pub fn path_slopes(&self, clip: usize) -> Vec<Vec<f64>> {
        deviations::slopes(self, clip, self.nuisance.iter().filter_map(|own| own.deviation()))
    }

    fn values(&self, clip: usize, own: &[f64]) -> Values {
        Values::new(&self.nuisance, own, self.clips[clip].recorded.kind)
    }

    /// What the twin makes of a clip.
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn predict(&self, clip: usize, shared: &[f64], own: &[f64]) -> Result<Prediction, Impossible> {
        let own = self.values(clip, own);
        let outcome = self.outcome(clip, shared, &own)?;
        Ok(Prediction { poses: reported(&outcome, &self.clips[clip], &own), contact_ns: outcome.contact_ns })
    }

    /// What every residual of a clip is about.
    pub fn rows(&self, clip: usize) -> Vec<Row> {
        rows::rows(&self.clips[clip], self.error.joints.is_some())
    }

    /// What its numbers mean.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What is known about the cell.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// A recorded clip.
    pub fn clip(&self, clip: usize) -> &Clip {
        &self.clips[clip].recorded
    }

    fn outcome(&self, clip: usize, shared: &[f64], own: &Values) -> Result<Arc<Outcome>, Impossible> {
        let theta = self.settings.theta(shared);
        let Some(simulator) = &self.simulator else { return self.by_twin(clip, &theta, own) };
        let outcome = || {
            let (known, nothing) = (simulator.part(&theta), Values::default());
            let theirs = self.job(clip, (&known, &nothing), |mut job| simulator.outcome(&mut job))?;
            // What the twin does not change of what the engine makes of a clip.
            if theta == known && own.felt() == nothing {
                return Ok(theirs);
            }
            let [with, without] = [self.by_twin(clip, &theta, own)?, self.by_twin(clip, &known, &nothing)?];
            Ok(composed(&theirs, &with, &without))
        };
        self.simulated[clip].outcomes.at((theta.clone(), own.felt()), outcome)
    }

    fn by_twin(&self, clip: usize, theta: &Theta, own: &Values) -> Result<Arc<Outcome>, Impossible> {
        let simulated = || self.job(clip, (theta, own), |job| job.run());
        self.caches[clip].outcomes.at((theta.clone(), own.felt()), simulated)
    }

    /// Has something done by an idle worker.
    fn job(
        &self,
        clip: usize,
        (theta, own): (&Theta, &Values),
        work: impl FnOnce(Job<'_>) -> Result<Outcome, Impossible>,
    ) -> Result<Outcome, Impossible> {
        let (clip, cache) = (&self.clips[clip], &self.caches[clip]);
        let idle = self.workers.lock().expect("no rollout has panicked").pop();
        let mut worker = idle.unwrap_or_else(|| self.worker.clone());
        let joints_ns = if self.error.joints.is_some() { &clip.arm_ns[..] } else { &[] };
        let outcome = work(Job { cell: &self.cell, clip, theta, own, joints_ns, worker: &mut worker, cache });
        self.workers.lock().expect("no rollout has panicked").push(worker);
        outcome
    }

    /// Measured less predicted, row by row as [`Self::rows`] says [m, rad].
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn errors(&self, clip: usize, shared: &[f64], own: &[f64]) -> Result<Vec<f64>, Impossible> {
        let own = self.values(clip, own);
        self.errors_of(clip, shared, (&*self.outcome(clip, shared, &own)?, &own))
    }

    /// The same by the twin, whoever simulates: for what a step changes.
    ///
    /// # Errors
    /// As [`Self::errors`].
    pub fn twins_errors(&self, clip: usize, shared: &[f64], own: &[f64]) -> Result<Vec<f64>, Impossible> {
        let own = self.values(clip, own);
        self.errors_of(clip, shared, (&*self.by_twin(clip, &self.settings.theta(shared), &own)?, &own))
    }

    fn errors_of(
        &self,
        clip: usize,
        shared: &[f64],
        (outcome, own): (&Outcome, &Values),
    ) -> Result<Vec<f64>, Impossible> {
        let clip = &self.clips[clip];
        let poses = clip.recorded.object.poses.iter().zip(reported(outcome, clip, own));
        let mut errors: Vec<f64> = poses.flat_map(|(a, b)| difference(&a.isometry(), &b.isometry())).collect();
        if self.error.joints.is_some() {
            let (measured, gains) = (&clip.recorded.measured, self.settings.theta(shared).arm);
            let stiffness = gains.as_ref().map_or(&[][..], |gains| &gains.stiffness);
            for ((row, predicted), lever) in clip.arm_rows.iter().zip(&outcome.joints).zip(&clip.levers) {
                let first = errors.len();
                errors.extend(measured.q_row(*row).iter().zip(predicted).map(|(q, predicted)| q - predicted));
                let vertical: Vec<f64> = vertical::yields(lever, stiffness).collect();
                vertical::take_out(&mut errors[first..], &vertical);
            }
        }
        if errors.iter().all(|error| error.is_finite()) {
            Ok(errors)
        } else {
            Err(Impossible("the twin flies apart with these numbers".into()))
        }
    }

    /// One sigma of every row.
    fn sigmas(&self, clip: usize) -> Vec<f64> {
        let (noise, error, rows) = (self.noise, self.error, self.rows(clip));
        let poses = |part| rows.iter().filter(|row| row.part == part && row.channel == Channel::Position(0)).count();
        // What all resting poses share counts once.
        let many = (poses(Part::After).max(1) as f64).sqrt();
        let of = |row: &Row, noise: f64, hit: f64, rest: f64| match row.part {
            Part::Before => noise,
            Part::Hit => noise.hypot(hit),
            Part::Slide => noise.hypot(rest),
            Part::After => noise.hypot(rest * many),
        };
        let flat = error.flat && self.clips[clip].recorded.kind != ClipKind::FreeMotion;
        let sigma = |row: &Row| match row.channel {
            Channel::Position(2) | Channel::Rotation(0 | 1) if flat => f64::INFINITY,
            Channel::Position(_) => of(row, noise.position, error.hit.position, error.rest.position),
            Channel::Rotation(_) => of(row, noise.rotation, error.hit.rotation, error.rest.rotation),
            Channel::Joint(_) => error.joints.unwrap_or(1.0),
        };
        rows.iter().map(sigma).collect()
    }
}

fn reported(outcome: &Outcome, clip: &ObjectClip, own: &Values) -> Vec<Pose<Base, Object>> {
    let late = outcome.camera.latency_ns() as f64 + own.clock * 1e9;
    let mut memory = CameraMemory::default();
    let stamps = clip.recorded.object.stamps_ns.iter();
    let seen = |stamp: &u64| {
        let pose = Pose::from_isometry(outcome.object.at(*stamp as f64 - late));
        outcome.camera.seen(&mut memory, *stamp, pose)
    };
    stamps.map(seen).collect()
}

impl ClipModel for ObjectClips {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        *out = self.errors(clip, shared, own)?;
        out.iter_mut().zip(self.sigmas(clip)).for_each(|(error, sigma)| *error /= sigma);
        Ok(())
    }

    fn stepped(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        ((from, from_own), base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        if self.simulator.is_none() {
            return self.residuals(clip, shared, own, out);
        }
        let before = self.twins_errors(clip, from, from_own)?;
        *out = self.twins_errors(clip, shared, own)?;
        let rows = out.iter_mut().zip(&before).zip(base).zip(self.sigmas(clip));
        rows.for_each(|(((out, before), base), sigma)| *out = base + (*out - before) / sigma);
        Ok(())
    }
}

/// Measured less predicted: position along x, y, z [m], rotation vector about them [rad], base frame.
fn difference(measured: &Isometry3<f64>, predicted: &Isometry3<f64>) -> [f64; 6] {
    let shift = measured.translation.vector - predicted.translation.vector;
    let turn = (measured.rotation * predicted.rotation.inverse()).scaled_axis();
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

#[cfg(test)]
mod test_rows;
#[cfg(test)]
mod tests;
