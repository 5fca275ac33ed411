//! What the sensors of an arm would have read, against what they read: residuals, and what each of them is about.

use super::clip::ArmClip;
use super::moments::ASKED;
use super::regime::Regimes;
use super::{ArmClips, By, Sampling, TORQUE, encoder_age, noise};
use crate::estimate::Impossible;
use crate::likelihood::motion::Stretch;
use crate::likelihood::rows::{Channel, Row, StageName};
use shared_mem::cell::TorqueSensing;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use twin::control::Reading;

/// A simulated joint that is two turns from its reading has left all bounds [rad]; a reading that wraps around is off by one.
const MAX_ERROR: f64 = 4.0 * std::f64::consts::PI;

impl<F: Fn(&[f64]) -> Theta + Sync> ArmClips<F> {
    /// How often the twin is asked for each row.
    pub(super) fn asked(&self) -> usize {
        if self.sampling == Sampling::Moments { ASKED } else { 1 }
    }

    /// At every stamp that a clip asks for.
    pub(super) fn readings(
        &self,
        By { mover, parts }: By<'_>,
        (clip, shared, own): (usize, &[f64], &[f64]),
    ) -> Result<Vec<Reading>, Impossible> {
        let (clip, theta, dof) = (&self.clips[clip], &(self.theta)(shared), self.nominal.dof());
        let measured = &clip.recorded.measured;
        let age = encoder_age::of(own.get(2 * dof));
        let seen = encoder_age::controlled(&self.cell, &clip.recorded.desired, theta, age);
        let (theta, commands) = seen.as_ref().map_or((theta, &clip.commands), |(theta, commands)| (theta, commands));
        let mut out = vec![Reading::default(); clip.asked_ns.len()];
        for (i, run) in clip.runs.iter().enumerate() {
            let ahead = if i == 0 { &own[..own.len().min(2 * dof)] } else { &[] };
            let stretch = Stretch { measured, from: run.from, commands, ahead, parts };
            mover.readings(theta, &stretch, &clip.asked_ns[run.asked.clone()], &mut out[run.asked.clone()])?;
        }
        encoder_age::shift(age, &mut out);
        Ok(out)
    }

    /// Measured less predicted, row by row.
    pub(super) fn compared(&self, clip: &ArmClip, readings: &[Reading]) -> Result<Vec<f64>, Impossible> {
        let near = |(row, reading): (&usize, &Reading)| {
            let measured = clip.recorded.measured.q_row(*row);
            measured.iter().zip(&reading.state.q).all(|(measured, q)| (q - measured).abs() < MAX_ERROR)
        };
        let places = places(clip, self.sampling, self.channels.len());
        let out: Vec<f64> = places.map(|(channel, bin)| self.residual(clip, readings, (channel, bin))).collect();
        let mut rows = clip.rows.iter().zip(readings.iter().step_by(self.asked()));
        let sane = rows.all(near) && out.iter().all(|residual| residual.is_finite());
        if sane { Ok(out) } else { Err(Impossible("the simulated arm left all bounds".into())) }
    }

    /// Mean of measured less predicted over a bin, in sigmas of that mean.
    fn residual(&self, clip: &ArmClip, readings: &[Reading], (channel, bin): (usize, usize)) -> f64 {
        let joint = channel % self.nominal.dof();
        if clip.dead[joint] {
            return 0.0;
        }
        let (bin, quantity, asked) = (&clip.bins[bin], self.channels[channel].quantity, self.asked());
        let (log, values) = series(&clip.recorded, quantity);
        let rows = if quantity == "tau_J_d" { &clip.desired_rows } else { &clip.rows };
        let acting = if clip.recorded.torques_end_at_rows { 0 } else { asked - 1 };
        let error = |k: usize| {
            let at = &readings[asked * k..asked * (k + 1)];
            let predicted = match quantity {
                "q" => at[0].state.q[joint],
                "dq" => at[0].state.dq[joint],
                "tau_J" => at[acting].tau_J[joint],
                TORQUE => self.taken(joint, at),
                _ => at[acting].tau_J_d[joint],
            };
            values[rows[k] * log.dof + joint] - predicted
        };
        let mut variance = bin.len() as f64 * self.sigma[channel].powi(2);
        if quantity == "q" && clip.jitter > 0.0 {
            variance += bin.clone().map(|k| clip.jitter_at(rows[k], joint).powi(2)).sum::<f64>();
        }
        bin.clone().map(error).sum::<f64>() / variance.sqrt()
    }

    /// Torque that a joint's sensor shows of what its motor gives [N m], of readings a control period apart. What friction takes is in it
    /// on either side of the gear: where it arises in a real one is not known.
    fn taken(&self, joint: usize, at: &[Reading]) -> f64 {
        let [now, .., later] = at else { return f64::NAN };
        let motor = now.tau_J_d[joint] + self.nominal.gravity(&now.state.q)[joint];
        let sensing = self.cell.controller.as_ref().map(|controller| controller.torque_sensing);
        if sensing == Some(TorqueSensing::Motor) {
            return motor;
        }
        let acceleration = (later.state.dq[joint] - now.state.dq[joint]) / TICK;
        motor - self.nominal.rotor_inertia()[joint] * acceleration
    }
}

/// The series of a quantity, and its logged values, row by row.
pub(super) fn series<'a>(clip: &'a Clip, quantity: &str) -> (&'a JointSeries, &'a [f64]) {
    match quantity {
        "dq" => (&clip.measured, &clip.measured.dq),
        "tau_J" | TORQUE => (&clip.measured, &clip.measured.tau),
        "tau_J_d" => (&clip.desired, &clip.desired.tau),
        _ => (&clip.measured, &clip.measured.q),
    }
}

pub(super) fn sensor_sigma(clips: &[ArmClip], channel: &Channel) -> f64 {
    let joint = channel.joint.unwrap_or(0);
    let of = |clip: &ArmClip| {
        let (log, values) = series(&clip.recorded, channel.quantity);
        let signal: Vec<f64> = values.iter().skip(joint).step_by(log.dof.max(1)).copied().collect();
        (!clip.dead[joint]).then(|| noise::sigma(&signal))
    };
    noise::of_clips(clips.iter().filter_map(of)).max(noise::floor(channel.quantity))
}

/// Channel and bin of every residual of a clip, in their order.
fn places(clip: &ArmClip, sampling: Sampling, channels: usize) -> impl Iterator<Item = (usize, usize)> {
    let bins = clip.bins.len();
    (0..channels * bins).map(move |row| match sampling {
        Sampling::Means => (row % channels, row / channels),
        Sampling::Moments => (row / bins, row % bins),
    })
}

pub(super) fn rows(clip: &ArmClip, (sampling, channels): (Sampling, &[Channel]), regimes: &Regimes) -> Vec<Row> {
    let Clip { measured, desired, .. } = &clip.recorded;
    let stamp = |row: usize| measured.stamps_ns[clip.rows[row]];
    let row = |(channel, bin): (usize, usize)| {
        let bin = &clip.bins[bin];
        let stamp_ns = stamp(bin.start) + (stamp(bin.end - 1) - stamp(bin.start)) / 2;
        let joint = channels[channel].joint.unwrap_or(0);
        let time = (stamp_ns - measured.stamps_ns[0]) as f64 * 1e-9;
        Row { channel, stage: StageName::Control, regime: regimes.at(desired, stamp_ns, joint), time }
    };
    places(clip, sampling, channels.len()).map(row).collect()
}
