//! Clips with an arm: what the twin makes of every clip under any parameters, and how far that is from what the robot
//! logged. Called by identification and by the diagnosis. Base frame, SI.
//!
//! Residuals are in sigmas of their noise, which is estimated from the log itself. Clips with an object count until the tool may touch
//! it: the arm alone is simulated.
//!
//! | file | owns |
//! |---|---|
//! | `clip` | a recorded clip, prepared, or the reason why it cannot be used |
//! | `moments` | one that was prepared before, looked at at single rows |
//! | `piece` | the part of a clip that can be simulated in one go |
//! | `following` | what the law had to work with, and what that took of the model, along the measured motion |
//! | `encoder_age` | how old encoder readings are when controller and log get them |
//! | `noise` | how noisy a signal is, and how quiet a sensor can be |
//! | `regime` | what a joint is commanded to do at a moment |
//! | `stamps` | whether stamps say when rows were taken, or jitter |
//! | `residuals` | what the sensors would have read, against what they read |
//! | `velocity` | whether logged velocities are the slopes of the positions |

mod clip;
mod encoder_age;
pub mod following;
mod moments;
pub mod noise;
mod piece;
mod regime;
mod residuals;
mod stamps;
#[cfg(test)]
mod test_noise;
pub mod velocity;

pub use clip::{ArmClip, ArmClipError};
pub use piece::one_piece;

use super::motion::Mover;
use super::random_effects::{RandomEffects, WithOwn};
use super::recent::Recent;
use super::rows::{Channel, Group, Row};
use super::{Likelihood, Near, vertical};
use crate::engine::{Engine, Quantity};
use crate::estimate::{ClipModel, Impossible, Random};
use following::Moment;
use regime::Regimes;
use residuals::{rows, sensor_sigma, series};
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use std::sync::Arc;
use twin::arm::{ArmModel, ModelError};
use twin::control::Reading;

/// What a robot logs of its joints, in the order of the channels.
const QUANTITIES: [&str; 4] = ["q", "dq", "tau_J", "tau_J_d"];
/// Where the arm goes along what was measured: the torque that this takes.
const TORQUE: &str = "tau";

/// Logs with fewer rows in 20 ms than the start state is taken from have rows further apart than this [s]...
const COARSE_STEP: f64 = 2e-3;
/// ...and clips shorter than this still remember an error in it at their end [s].
const SHORT_CLIP: f64 = 15.0;
/// Scatter of the start velocity that such logs leave, one sigma [rad/s].
const START_VELOCITY: f64 = 0.1;

/// The others feel a joint move when the error is less than this share of what it is with the joint at rest [1]: a choice.
const FELT_SHARE: f64 = 0.9;

/// How measured rows become residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sampling {
    /// Positions, what every robot logs and a controller is judged by: means over 5 ms (single rows of slower logs) of clips as they were
    /// recorded, by time, then joint. Each clip has a start state and encoders of its own.
    Means,
    /// All that is logged: some hundred rows of clips that were admitted before, by channel, then time.
    Moments,
}

/// Clips with an arm, and what numbers mean for the cell.
pub struct ArmClips<F> {
    cell: Cell,
    nominal: ArmModel,
    mover: Mover,
    /// The twin's own, where another program is the mover: it gives the slopes.
    twin: Option<Mover>,
    sampling: Sampling,
    channels: Vec<Channel>,
    /// One sigma of a single value of each channel.
    sigma: Vec<f64>,
    clips: Vec<ArmClip>,
    /// What the residuals of each clip are about.
    rows: Vec<Vec<Row>>,
    /// Where a search of each has just been, and from where the twin's steps were taken.
    recent: Vec<[Recent<Vec<f64>, Vec<f64>>; 2]>,
    theta: F,
}

/// A clip that was left out, and why.
#[derive(Debug)]
pub struct LeftOut {
    /// Name of its file.
    pub file: String,
    pub why: ArmClipError,
}

/// Who simulates a clip, and in how many parts the twin integrates a control period.
#[derive(Clone, Copy)]
struct By<'a> {
    mover: &'a Mover,
    parts: u32,
}

/// Whether the arm of a cell goes along what was measured, whatever its controller was.
pub fn is_tracking(cell: &Cell) -> bool {
    cell.controller.as_ref().is_some_and(|law| law.kind == ControllerKind::Tracking)
}

impl<F: Fn(&[f64]) -> Theta + Sync> ArmClips<F> {
    /// Means over recorded clips of a cell in their order, and those that cannot be used. `theta` gives the parameters that go with
    /// shared parameters.
    ///
    /// # Errors
    /// [`ModelError`] when the cell has no arm that can be simulated.
    pub fn means(cell: &Cell, clips: Vec<Clip>, theta: F) -> Result<(Self, Vec<LeftOut>), ModelError> {
        let nominal = ArmModel::from_cell(cell)?;
        let (mut usable, mut left_out) = (Vec::new(), Vec::new());
        for clip in clips {
            let file = clip::name(&clip);
            match ArmClip::new(clip, cell, &nominal).and_then(ArmClip::long_enough) {
                Ok(clip) => usable.push(clip),
                Err(why) => left_out.push(LeftOut { file, why }),
            }
        }
        Ok((Self::of(cell, nominal, (Sampling::Means, &QUANTITIES[..1]), usable, theta), left_out))
    }

    /// Moments of clips that were admitted, joints in the model's order.
    ///
    /// # Errors
    /// As [`Self::means`].
    pub fn moments(cell: &Cell, clips: &[Clip], theta: F) -> Result<Self, ModelError> {
        let logged = |quantity: &&str| clips.iter().all(|clip| !series(clip, quantity).1.is_empty());
        let quantities: Vec<&'static str> = if is_tracking(cell) {
            vec![TORQUE]
        } else {
            QUANTITIES.into_iter().filter(|quantity| *quantity == "q" || logged(quantity)).collect()
        };
        let asked_for = quantities.contains(&"tau_J_d");
        let clips = clips.iter().filter_map(|clip| ArmClip::at_moments(clip.clone(), cell, asked_for)).collect();
        Ok(Self::of(cell, ArmModel::from_cell(cell)?, (Sampling::Moments, &quantities), clips, theta))
    }

    fn of(
        cell: &Cell,
        nominal: ArmModel,
        (sampling, quantities): (Sampling, &[&'static str]),
        clips: Vec<ArmClip>,
        theta: F,
    ) -> Self {
        let joints = |quantity: &&'static str| {
            let quantity = *quantity;
            (0..nominal.dof()).map(move |joint| {
                let place = format!("joint{}", joint + 1);
                Channel { quantity, place, joint: Some(joint), group: Group::Arm }
            })
        };
        let channels: Vec<Channel> = quantities.iter().flat_map(joints).collect();
        let sigma = channels.iter().map(|channel| sensor_sigma(&clips, channel)).collect();
        let regimes = Regimes::of(clips.iter().map(|clip| &clip.recorded.desired), nominal.dof());
        let rows = clips.iter().map(|clip| rows(clip, (sampling, &channels), &regimes)).collect();
        let recent = clips.iter().map(|_| Default::default()).collect();
        let mover = Mover::own(cell, &nominal);
        Self { cell: cell.clone(), nominal, mover, twin: None, sampling, channels, sigma, clips, rows, recent, theta }
    }

    /// The same moved by another program, where there is one; `known`: the cell's nominal parameters.
    pub fn moved_by(mut self, engine: Option<Arc<Engine>>, known: &Theta) -> Self {
        self.twin = engine.is_some().then(|| self.mover.clone());
        let wanted = self.channels.iter().map(|channel| Quantity::named(channel.quantity)).collect();
        self.mover = self.mover.by(engine, known.clone(), wanted);
        self
    }

    /// Lets dead joints follow their commands unseen in the clips in which the others feel them move: then it is a reading
    /// that stands still, and not the joint. `shared`: about right.
    pub fn settle_dead_joints(&mut self, shared: &[f64]) {
        for clip in 0..self.clips.len() {
            let Some(unseen) = self.clips[clip].unseen(&self.cell) else { continue };
            let still = self.cost(clip, shared);
            let held = std::mem::replace(&mut self.clips[clip], unseen);
            self.recent[clip] = Default::default();
            if self.cost(clip, shared) >= FELT_SHARE * still {
                self.clips[clip] = held;
            }
        }
    }

    /// Sum of squared residuals; infinite where the twin cannot be simulated.
    fn cost(&self, clip: usize, shared: &[f64]) -> f64 {
        let residuals = self.residuals_in(1, (clip, shared, &[]));
        residuals.map_or(f64::INFINITY, |residuals| residuals.iter().map(|residual| residual * residual).sum())
    }

    /// The nuisance parameters of clips of which means are taken: where the log is too coarse to show the state in which it begins, that state
    /// (positions, then velocities, of all joints; otherwise their sigmas are 0), and how old its encoders' readings are.
    pub fn random(&self) -> Vec<Random> {
        let coarse = self.clips.iter().any(|clip| {
            let rows = &clip.recorded.measured;
            let step = rows.duration() / (rows.len() - 1) as f64;
            step > COARSE_STEP && rows.duration() < SHORT_CLIP
        });
        let of = |what: &str, joint: usize, sigma: f64, step: f64| Random {
            name: format!("start {what}[{joint}]"),
            sigma: if coarse { sigma } else { 0.0 },
            step,
        };
        let mut all: Vec<Random> =
            self.sigma.iter().enumerate().map(|(joint, sigma)| of("q", joint, *sigma, 1e-4)).collect();
        all.extend((0..self.nominal.dof()).map(|joint| of("dq", joint, START_VELOCITY, 1e-2)));
        all.push(encoder_age::random());
        all
    }

    /// The arm's model as the controller knows it.
    pub fn arm(&self) -> &ArmModel {
        &self.nominal
    }

    /// One sigma of a single value of each channel, in its unit.
    pub fn sigma(&self) -> &[f64] {
        &self.sigma
    }

    /// A clip as it was prepared.
    pub fn clip(&self, clip: usize) -> &ArmClip {
        &self.clips[clip]
    }

    /// By how much a vertical force of 1 N at the tip turns each joint at measured joints [N m].
    pub fn vertical_lever(&self, measured: &[f64]) -> Joints {
        vertical::lever(&self.nominal, measured)
    }

    /// Largest torque that the controller asks of each joint in any of the clips, gravity included [N m].
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn peaks(&self, shared: &[f64]) -> Result<Joints, Impossible> {
        let mut peaks = [0.0; MAX_JOINTS];
        for clip in 0..self.clips.len() {
            for reading in self.readings(self.by(1), (clip, shared, &[]))? {
                let gravity = self.nominal.gravity(&reading.state.q);
                let asked = reading.tau_J_d.iter().zip(gravity).map(|(tau, gravity)| (tau + gravity).abs());
                peaks.iter_mut().zip(asked).for_each(|(peak, asked)| *peak = asked.max(*peak));
            }
        }
        Ok(peaks)
    }

    /// What the sensors would have read at every measured row of a clip, at shared parameters and its own, with every control period
    /// integrated in `parts`; rows that are not simulated are left at zero.
    ///
    /// # Errors
    /// As [`Self::peaks`].
    pub fn predict_in(&self, parts: u32, of: (usize, &[f64], &[f64])) -> Result<Vec<Reading>, Impossible> {
        let (clip, asked) = (&self.clips[of.0], self.asked());
        let mut all = vec![Reading::default(); clip.recorded.measured.len()];
        for (row, reading) in clip.rows.iter().zip(self.readings(self.by(parts), of)?.into_iter().step_by(asked)) {
            all[*row] = reading;
        }
        Ok(all)
    }

    /// [`ClipModel::residuals`] as a simulation gives them, known or not, with every control period integrated in `parts`; 1 is how the
    /// twin does it.
    ///
    /// # Errors
    /// As [`Self::peaks`].
    pub fn residuals_in(&self, parts: u32, of: (usize, &[f64], &[f64])) -> Result<Vec<f64>, Impossible> {
        self.residuals_by(self.by(parts), of)
    }

    fn by(&self, parts: u32) -> By<'_> {
        By { mover: &self.mover, parts }
    }

    fn residuals_by(&self, by: By<'_>, of: (usize, &[f64], &[f64])) -> Result<Vec<f64>, Impossible> {
        self.compared(&self.clips[of.0], &self.readings(by, of)?)
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for ArmClips<F> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let simulated = || self.residuals_in(1, (clip, shared, own));
        match self.sampling {
            Sampling::Means => *out = simulated()?,
            Sampling::Moments => out.clone_from(&*self.recent[clip][0].at(shared.to_vec(), simulated)?),
        }
        Ok(())
    }

    fn stepped(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        ((from, from_own), base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let Some(twin) = &self.twin else { return self.residuals(clip, shared, own, out) };
        let by = By { mover: twin, parts: 1 };
        let from_there = || self.residuals_by(by, (clip, from, from_own));
        let before = self.recent[clip][1].at([from, from_own].concat(), from_there)?;
        *out = self.residuals_by(by, (clip, shared, own))?;
        out.iter_mut().zip(base).zip(&*before).for_each(|((out, base), before)| *out += base - before);
        Ok(())
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        let ArmClip { bins, stretch, .. } = &self.clips[clip];
        let ends = bins.chunks((*stretch).max(1)).scan(0, |rows, bins| {
            *rows += bins.len() * self.channels.len();
            Some(*rows)
        });
        if *stretch == 0 { Vec::new() } else { ends.collect() }
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> Likelihood for ArmClips<F> {
    type Own = WithOwn;

    fn following(&self, clip: usize) -> Vec<Moment> {
        let Some(controller) = &self.cell.controller else { return Vec::new() };
        let clip = &self.clips[clip];
        let stamps: Vec<u64> = clip.rows.iter().map(|row| clip.recorded.measured.stamps_ns[*row]).collect();
        let logged = (&clip.recorded.measured, &clip.commands);
        following::moments((&self.nominal, controller.kind), logged, &stamps).unwrap_or_default()
    }

    fn in_halves(&self, clip: usize, shared: &[f64]) -> Option<Vec<f64>> {
        // Another simulator has steps of its own.
        self.twin.is_none().then(|| self.residuals_in(2, (clip, shared, &[])).ok())?
    }

    fn changed(
        &self,
        clip: usize,
        numbers: (&[f64], &[f64]),
        (_, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        match at {
            Some(at) => self.stepped(clip, numbers, (at, base), out),
            None => self.residuals(clip, numbers.0, numbers.1, out),
        }
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn rows(&self, clip: usize) -> &[Row] {
        &self.rows[clip]
    }

    fn scatter(&self) -> RandomEffects {
        RandomEffects::default()
    }

    fn torque_sigma(&self) -> Option<&[f64]> {
        self.channels.iter().all(|channel| channel.quantity == TORQUE).then_some(&self.sigma[..])
    }
}

#[cfg(test)]
mod tests;
