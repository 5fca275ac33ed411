//! Clips with an arm: what the twin makes of every clip under any parameters, and how far that is from what the robot
//! logged. Called by identification and by the diagnosis. Base frame, SI.
//!
//! Rows are averages over 5 ms (single rows of slower logs), each in sigmas of its noise, which is estimated from the log
//! itself. Rows of a clip in their order: by time, then channel, then joint. Clips with an object count until the tool
//! may touch it.
//!
//! | file | owns |
//! |---|---|
//! | `clip` | a recorded clip, prepared, or the reason why it cannot be used |
//! | `piece` | the part of a clip that can be simulated in one go |
//! | `following` | what the law had to work with, and what that took of the model, along the measured motion |
//! | `encoder_age` | how old encoder readings are when controller and log get them |
//! | `noise` | how noisy a signal is |
//! | `torque_time` | which control period a logged torque belongs to |
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

mod clip;
mod encoder_age;
pub mod following;
pub mod noise;
mod piece;
mod torque_time;
pub mod velocity;

pub use clip::ArmClipError;
pub use clip::desired_rows;
pub use piece::one_piece;

use super::motion::{Mover, Stretch};
use crate::engine::{Engine, Quantity};
use crate::estimate::{ClipModel, Impossible, Random};
use clip::ArmClip;
use shared_mem::cell::Cell;
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use std::ops::Range;
use std::sync::{Arc, Mutex};
use twin::arm::{ArmModel, ModelError};
use twin::control::Reading;

/// What a robot logs about a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// Position q [rad].
    Position,
    /// Velocity dq [rad/s].
    Velocity,
    /// Torque behind the gear with gravity, tau_J [N m].
    Torque,
    /// Torque asked for without gravity, tau_J_d [N m].
    DesiredTorque,
}

impl Channel {
    fn quantity(self) -> Quantity {
        match self {
            Self::Position => Quantity::Position,
            Self::Velocity => Quantity::Velocity,
            Self::Torque => Quantity::Torque,
            Self::DesiredTorque => Quantity::DesiredTorque,
        }
    }
}

pub const CHANNELS: [Channel; 4] = [Channel::Position, Channel::Velocity, Channel::Torque, Channel::DesiredTorque];

/// Least sigma of each channel: below it a real sensor is not that good, and the twin's own arithmetic is not either.
const LEAST_SIGMA: [f64; 4] = [5e-7, 5e-5, 1e-2, 5e-3];
/// Logs with fewer rows in 20 ms than the start state is taken from have rows further apart than this [s]...
const COARSE_STEP: f64 = 2e-3;
/// ...and clips shorter than this still remember an error in it at their end [s].
const SHORT_CLIP: f64 = 15.0;
/// Scatter of the start velocity that such logs leave, one sigma [rad/s].
const START_VELOCITY: f64 = 0.1;

/// The others feel a joint move when the error is less than this share of what it is with the joint at rest.
const FELT: f64 = 0.9;

/// What one row of residuals is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Middle of the averaged stamps [ns].
    pub stamp_ns: u64,
    pub channel: Channel,
    pub joint: usize,
}

/// Clips with an arm, and what numbers mean for the cell.
pub struct ArmClips<F> {
    cell: Cell,
    nominal: ArmModel,
    mover: Mover,
    /// The twin's own, where another program is the mover: it gives the slopes.
    twin: Option<Mover>,
    channels: Vec<Channel>,
    clips: Vec<ArmClip>,
    /// One sigma of a single logged value, by [`CHANNELS`].
    sigma: [Joints; 4],
    /// Rows by which logged torques are ahead of the twin's.
    torque_lead: usize,
    theta: F,
    /// Memory for predictions that no evaluation holds right now.
    spare: Mutex<Vec<Vec<Reading>>>,
}

/// A clip that was left out, and why.
#[derive(Debug)]
pub struct LeftOut {
    /// Name of its file.
    pub file: String,
    pub why: ArmClipError,
}

impl<F: Fn(&[f64]) -> Theta + Sync> ArmClips<F> {
    /// Clips of a cell in their order, and those that cannot be used. `theta` gives the parameters that go with shared
    /// numbers. Of `channels` those count that are logged in every clip.
    ///
    /// # Errors
    /// [`ModelError`] when the cell has no arm that can be simulated.
    pub fn new(
        cell: &Cell,
        clips: Vec<Clip>,
        channels: &[Channel],
        theta: F,
    ) -> Result<(Self, Vec<LeftOut>), ModelError> {
        let nominal = ArmModel::from_cell(cell)?;
        let (mut usable, mut left_out) = (Vec::new(), Vec::new());
        for clip in clips {
            let file = clip.file.file_name().unwrap_or(clip.file.as_os_str()).to_string_lossy().into_owned();
            match ArmClip::new(clip, cell, &nominal).and_then(ArmClip::long_enough) {
                Ok(clip) => usable.push(clip),
                Err(why) => left_out.push(LeftOut { file, why }),
            }
        }
        let logged = |channel: &Channel| usable.iter().all(|clip| values(clip, *channel).is_some());
        let mut channels: Vec<Channel> = channels.iter().copied().filter(logged).collect();
        channels.sort_unstable();
        channels.dedup();
        let sigma = sigmas(&usable, nominal.dof());
        let (torque_lead, spare) = (torque_time::lead(&usable), Mutex::default());
        let (cell, mover) = (cell.clone(), Mover::own(cell, &nominal));
        Ok((
            Self { cell, nominal, mover, twin: None, channels, clips: usable, sigma, torque_lead, theta, spare },
            left_out,
        ))
    }

    /// The same moved by another program, where there is one; `known`: the cell's nominal parameters.
    pub fn moved_by(mut self, engine: Option<Arc<Engine>>, known: &Theta) -> Self {
        self.twin = engine.is_some().then(|| self.mover.clone());
        let wanted = self.channels.iter().map(|channel| channel.quantity()).collect();
        self.mover = self.mover.by(engine, known.clone(), wanted);
        self
    }

    /// Lets dead joints follow their commands unseen in the clips in which the others feel them move: then it is a reading
    /// that stands still, and not the joint. `shared`: about right.
    pub fn settle_dead_joints(&mut self, shared: &[f64]) {
        for clip in 0..self.clips.len() {
            let Some(unseen) = self.clips[clip].unseen() else { continue };
            let still = self.cost(clip, shared);
            let held = std::mem::replace(&mut self.clips[clip], unseen);
            if self.cost(clip, shared) >= FELT * still {
                self.clips[clip] = held;
            }
        }
    }

    /// Sum of squared residuals; infinite where the twin cannot be simulated.
    fn cost(&self, clip: usize, shared: &[f64]) -> f64 {
        let mut out = Vec::new();
        let told = self.residuals(clip, shared, &[], &mut out);
        told.map_or(f64::INFINITY, |()| out.iter().map(|residual| residual * residual).sum())
    }

    /// What is a clip's own: where the log is too coarse to tell the state in which it begins, that state (positions, then
    /// velocities, of all joints; otherwise their sigmas are 0), and how old its encoders' readings are.
    pub fn random(&self) -> Vec<Random> {
        let coarse = self.clips.iter().any(|clip| {
            let rows = &clip.recorded.measured;
            let step = rows.duration() / (rows.len() - 1) as f64;
            step > COARSE_STEP && rows.duration() < SHORT_CLIP
        });
        let of = |what: &str, sigma: [f64; MAX_JOINTS], step: f64| -> Vec<Random> {
            let one = |joint: usize| Random {
                name: format!("start {what}[{joint}]"),
                sigma: if coarse { sigma[joint] } else { 0.0 },
                step,
            };
            (0..self.nominal.dof()).map(one).collect()
        };
        let mut all = of("q", self.sigma[0], 1e-4);
        all.extend(of("dq", [START_VELOCITY; MAX_JOINTS], 1e-2));
        all.push(encoder_age::random());
        all
    }

    /// The arm's model as the controller knows it.
    pub fn arm(&self) -> &ArmModel {
        &self.nominal
    }

    /// The channels in use.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// One sigma of a single logged value.
    pub fn sigma(&self, channel: Channel, joint: usize) -> f64 {
        self.sigma[channel as usize][joint]
    }

    /// A recorded clip, joints in the model's order.
    pub fn clip(&self, clip: usize) -> &Clip {
        &self.clips[clip].recorded
    }

    /// Name of its file.
    pub fn name(&self, clip: usize) -> String {
        self.clips[clip].name()
    }

    /// What a reader of its figures has to know, one sentence each.
    pub fn warnings(&self, clip: usize) -> &[String] {
        &self.clips[clip].warnings
    }

    /// Whether a joint follows no command in this clip; its rows are 0.
    pub fn is_dead(&self, clip: usize, joint: usize) -> bool {
        self.clips[clip].dead[joint]
    }

    /// Whether a dead joint is taken to stand where it is, rather than to follow its commands unseen.
    pub fn stands_still(&self, clip: usize, joint: usize) -> bool {
        self.clips[clip].stands_still(joint)
    }

    /// Measured rows that count, in the groups that are averaged.
    pub fn averaged(&self, clip: usize) -> &[Range<usize>] {
        &self.clips[clip].bins
    }

    /// What each row of a clip's residuals is about.
    pub fn rows(&self, clip: usize) -> impl Iterator<Item = Row> + '_ {
        let (clip, dof) = (&self.clips[clip], self.nominal.dof());
        let stamps = &clip.recorded.measured.stamps_ns;
        clip.bins.iter().flat_map(move |bin| {
            let stamp_ns = stamps[bin.start] + (stamps[bin.end - 1] - stamps[bin.start]) / 2;
            let channels = self.channels.iter();
            channels.flat_map(move |channel| (0..dof).map(move |joint| Row { stamp_ns, channel: *channel, joint }))
        })
    }

    /// What the sensors would have read at every measured row; rows that are not simulated are left at zero.
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn predict(&self, clip: usize, shared: &[f64], own: &[f64]) -> Result<Vec<Reading>, Impossible> {
        self.predict_in(1, (clip, shared, own))
    }

    /// The same with every control period integrated in `parts`.
    ///
    /// # Errors
    /// As [`ArmClips::predict`].
    pub fn predict_in(&self, parts: u32, of: (usize, &[f64], &[f64])) -> Result<Vec<Reading>, Impossible> {
        let ((clip, shared, own), mut out) = (of, Vec::new());
        self.simulate(&self.mover, &self.clips[clip], (shared, own, parts), &mut out)?;
        Ok(out)
    }

    /// [`ClipModel::residuals`] with every control period integrated in `parts`; 1 is how the twin does it.
    ///
    /// # Errors
    /// [`Impossible`] as there.
    pub fn residuals_in(
        &self,
        parts: u32,
        (clip, shared, own): (usize, &[f64], &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.residuals_by(&self.mover, (clip, shared, own), parts, out)
    }

    fn residuals_by(
        &self,
        mover: &Mover,
        (clip, shared, own): (usize, &[f64], &[f64]),
        parts: u32,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let mut predicted = self.spare.lock().expect("no evaluation panics").pop().unwrap_or_default();
        let clip = &self.clips[clip];
        let answer = self.simulate(mover, clip, (shared, own, parts), &mut predicted);
        if answer.is_ok() {
            out.clear();
            for bin in &clip.bins {
                for channel in &self.channels {
                    self.differences(clip, *channel, bin, &predicted, out);
                }
            }
        }
        self.spare.lock().expect("no evaluation panics").push(predicted);
        answer
    }

    fn simulate(
        &self,
        mover: &Mover,
        clip: &ArmClip,
        (shared, own, parts): (&[f64], &[f64], u32),
        out: &mut Vec<Reading>,
    ) -> Result<(), Impossible> {
        let theta = &(self.theta)(shared);
        let dof = self.nominal.dof();
        let age = encoder_age::of(own.get(2 * dof));
        let seen = encoder_age::controlled(&self.cell, &clip.recorded.desired, theta, age);
        let (theta, commands) = seen.as_ref().map_or((theta, &clip.commands), |(theta, commands)| (theta, commands));
        let measured = &clip.recorded.measured;
        out.clear();
        out.resize(measured.len(), Reading::default());
        for (i, run) in clip.runs.iter().enumerate() {
            let ahead = if i == 0 { &own[..own.len().min(2 * dof)] } else { &[] };
            let stretch = Stretch { measured, from: run.start, commands, ahead, parts };
            mover.readings(theta, &stretch, &measured.stamps_ns[run.clone()], &mut out[run.clone()])?;
        }
        encoder_age::shift(age, out);
        Ok(())
    }
}

/// The logged values of a channel, row-major, and the row at each measured row.
fn values(clip: &ArmClip, channel: Channel) -> Option<&[f64]> {
    let Clip { measured, desired, .. } = &clip.recorded;
    let values = match channel {
        Channel::Position => &measured.q,
        Channel::Velocity => &measured.dq,
        Channel::Torque => &measured.tau,
        Channel::DesiredTorque => &desired.tau,
    };
    (!values.is_empty()).then_some(values)
}

/// Joint by joint.
fn sigmas(clips: &[ArmClip], dof: usize) -> [Joints; 4] {
    CHANNELS.map(|channel| {
        let least = LEAST_SIGMA[channel as usize];
        let mut sigma = [least; MAX_JOINTS];
        for (joint, sigma) in sigma.iter_mut().enumerate().take(dof) {
            let of = |clip: &ArmClip| {
                let signal: Vec<f64> = values(clip, channel)?.iter().skip(joint).step_by(dof).copied().collect();
                (!clip.dead[joint]).then(|| noise::sigma(&signal))
            };
            *sigma = noise::of_clips(clips.iter().filter_map(of)).max(least);
        }
        sigma
    })
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for ArmClips<F> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.residuals_in(1, (clip, shared, own), out)
    }

    fn stepped(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        ((from, from_own), base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let Some(twin) = &self.twin else { return self.residuals(clip, shared, own, out) };
        let mut before = Vec::new();
        self.residuals_by(twin, (clip, from, from_own), 1, &mut before)?;
        self.residuals_by(twin, (clip, shared, own), 1, out)?;
        out.iter_mut().zip(base).zip(&before).for_each(|((out, base), before)| *out += base - before);
        Ok(())
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        let (clip, rows) = (&self.clips[clip], self.channels.len() * self.nominal.dof());
        (1..=clip.bins.len().div_ceil(clip.stretch)).map(|i| (i * clip.stretch).min(clip.bins.len()) * rows).collect()
    }
}

impl<F> ArmClips<F> {
    /// Mean of measured less predicted over a bin, for each joint, in sigmas of that mean.
    fn differences(
        &self,
        clip: &ArmClip,
        channel: Channel,
        bin: &Range<usize>,
        predicted: &[Reading],
        out: &mut Vec<f64>,
    ) {
        let dof = self.nominal.dof();
        let Some(logged) = values(clip, channel) else { return out.extend(std::iter::repeat_n(0.0, dof)) };
        let mut sum = [0.0; MAX_JOINTS];
        let mut count = 0.0;
        for row in bin.clone() {
            let at = if channel == Channel::DesiredTorque { clip.desired_rows[row] } else { Some(row) };
            let Some(logged) = at.and_then(|at| logged.get(at * dof..(at + 1) * dof)) else { continue };
            // The last row of a run has no successor, and its torque is as good as the one before.
            let led = (row + self.torque_lead).min(clip.last_row(row));
            let predicted = match channel {
                Channel::Position => &predicted[row].state.q,
                Channel::Velocity => &predicted[row].state.dq,
                Channel::Torque => &predicted[led].tau_J,
                Channel::DesiredTorque => &predicted[led].tau_J_d,
            };
            count += 1.0;
            for ((sum, logged), predicted) in sum.iter_mut().zip(logged).zip(predicted) {
                *sum += logged - predicted;
            }
        }
        // What is asked for has no noise that averages out: its sigma is the twin's own.
        let gain: f64 = if channel == Channel::DesiredTorque { 1.0 } else { f64::sqrt(count) };
        let sigma = &self.sigma[channel as usize];
        let weight = |joint: usize| if clip.dead[joint] || count == 0.0 { 0.0 } else { gain / (count * sigma[joint]) };
        out.extend((0..dof).map(|joint| sum[joint] * weight(joint)));
    }
}
