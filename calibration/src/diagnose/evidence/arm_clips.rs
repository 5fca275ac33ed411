//! Clips of an arm as evidence: positions, velocities and both torques of every joint against the twin's, in sigmas of the
//! sensors. In clips with an object only what comes before the touch counts: the arm alone is simulated. What its joints do from
//! then on belongs to [`super::contact`].
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::measured::{Channel, Group, Measured, Near, Row, StageName};
use super::recent::Recent;
use super::regime::Regimes;
use super::scatter::{Scatter, WithOwn};
use crate::diagnose::clips::torques::is_tracking;
use inference::engine::{Engine, Quantity};
use inference::estimate::{ClipModel, Impossible};
use inference::forward::arm::following::{self, Moment};
use inference::forward::arm::{desired_rows, noise};
use inference::forward::motion::{Mover, Stretch};
use inference::forward::object;
use shared_mem::cell::{Cell, TorqueSensing};
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use shared_mem::time::{TICK, TICK_NS};
use std::sync::Arc;
use twin::arm::{ArmModel, Joints, MAX_JOINTS, ModelError};
use twin::control::{CommandTrack, Reading};

/// At most so many moments of a clip count; more would cost time and, in smooth motion, tell little.
const MOMENTS: usize = 250;
/// A simulated joint that is two turns from its reading has left all bounds [rad]; a reading that wraps around is off by one.
const FLOWN: f64 = 4.0 * std::f64::consts::PI;
/// The four quantities, in the order of their rows.
const QUANTITIES: [&str; 4] = ["q", "dq", "tau_J", "tau_J_d"];
/// Where the arm goes along what was measured: the torque that this takes.
const TORQUE: &str = "tau";
/// Within this time the simulated arm settles on that motion: fifteen time constants of the law that keeps it there [ns].
const SETTLED_NS: u64 = 50_000_000;
/// From this time on it does not matter how fast the arm was when its clip begins [ns]. No log has that better than its velocities
/// are measured, and a controller's damping makes of 1 mrad/s eighty times what the torque asked for is computed to; within 80 ms
/// less than one sigma is left of it (an FR3 with and without gears that yield).
const BEGUN_NS: u64 = 80_000_000;

/// Arm clips and what numbers mean for the cell.
pub struct ArmClips<F> {
    cell: Cell,
    nominal: ArmModel,
    mover: Mover,
    /// The twin's own, where another program is the mover: it gives what a step changes.
    twin: Option<Mover>,
    channels: Vec<Channel>,
    /// One sigma of each channel's sensor.
    sigma: Vec<f64>,
    clips: Vec<Prepared>,
    theta: F,
}

struct Prepared {
    recorded: Clip,
    commands: CommandTrack,
    /// Measured rows that count, and their stamps.
    kept: Vec<usize>,
    /// The desired row of the same moment as each, where there is one.
    desired_rows: Vec<Option<usize>>,
    /// Each followed by the one a control period later: some logs have the torque that acts from a tick on.
    stamps_ns: Vec<u64>,
    rows: Vec<Row>,
    recent: Recent<Vec<f64>>,
    /// The twin's own, from which steps are taken.
    stepped_from: Recent<Vec<f64>>,
    /// From here on the tool may touch the object.
    alone_until_ns: u64,
}

impl<F: Fn(&[f64]) -> Theta + Sync> ArmClips<F> {
    /// Clips of a cell in their order, joints in the model's order. `theta` gives the parameters that go with numbers.
    ///
    /// # Errors
    /// [`ModelError`] when the cell has no usable arm.
    pub fn new(cell: &Cell, clips: &[Clip], theta: F) -> Result<Self, ModelError> {
        let nominal = ArmModel::from_cell(cell)?;
        let dof = nominal.dof();
        let logged = |has: fn(&Clip) -> bool| clips.iter().all(has);
        let looked_at = if is_tracking(cell) { &[TORQUE][..] } else { &QUANTITIES[..] };
        let quantities = looked_at.iter().copied().filter(|quantity| match *quantity {
            "dq" => logged(|clip| !clip.measured.dq.is_empty()),
            "tau_J" => logged(|clip| !clip.measured.tau.is_empty()),
            "tau_J_d" => logged(|clip| !clip.desired.tau.is_empty()),
            _ => true,
        });
        let joints = |quantity| {
            (0..dof).map(move |joint| {
                let place = format!("joint{}", joint + 1);
                Channel { quantity, place, joint: Some(joint), group: Group::Arm }
            })
        };
        let channels: Vec<Channel> = quantities.flat_map(joints).collect();
        let sigma = (0..channels.len()).map(|channel| sensor_sigma(clips, &channels[channel], channel % dof)).collect();
        let regimes = Regimes::of(clips, dof);
        let clips = clips.iter().filter_map(|clip| Prepared::new(clip.clone(), cell, &channels, &regimes)).collect();
        let mover = Mover::own(cell, &nominal);
        Ok(Self { cell: cell.clone(), nominal, mover, twin: None, channels, sigma, clips, theta })
    }

    /// The same moved by another program, where there is one; `known`: the cell's nominal parameters.
    pub fn moved_by(mut self, engine: Option<Arc<Engine>>, known: &Theta) -> Self {
        self.twin = engine.is_some().then(|| self.mover.clone());
        let wanted = self.channels.iter().map(|channel| Quantity::named(channel.quantity)).collect();
        self.mover = self.mover.by(engine, known.clone(), wanted);
        self
    }

    /// One sigma of each channel's sensor, in its unit.
    pub fn sigma(&self) -> &[f64] {
        &self.sigma
    }
}

/// Columns of a recorded series that belong to a channel.
fn series<'a>(clip: &'a Clip, channel: &Channel) -> (&'a JointSeries, &'a [f64]) {
    match channel.quantity {
        "dq" => (&clip.measured, &clip.measured.dq),
        "tau_J" | TORQUE => (&clip.measured, &clip.measured.tau),
        "tau_J_d" => (&clip.desired, &clip.desired.tau),
        _ => (&clip.measured, &clip.measured.q),
    }
}

fn sensor_sigma(clips: &[Clip], channel: &Channel, joint: usize) -> f64 {
    let of = |clip: &Clip| {
        let (log, values) = series(clip, channel);
        noise::sigma(&values.iter().skip(joint).step_by(log.dof.max(1)).copied().collect::<Vec<_>>())
    };
    // A sensor without noise does not exist: below this a log was computed, not measured.
    let least = if channel.quantity.starts_with("tau") { 1e-3 } else { 1e-6 };
    noise::of_clips(clips.iter().map(of)).max(least)
}

impl Prepared {
    fn new(recorded: Clip, cell: &Cell, channels: &[Channel], regimes: &Regimes) -> Option<Self> {
        let commands = CommandTrack::new(&recorded.desired)?;
        let end_ns = object::alone_until(cell, &recorded);
        let stamps = &recorded.measured.stamps_ns;
        let desired = &recorded.desired;
        // The last command holds for as long as that before it did.
        let [.., before, last] = desired.stamps_ns[..] else { return None };
        let used = stamps.partition_point(|stamp| *stamp < end_ns.min(last + (last - before).max(1)));
        let stride = used.div_ceil(MOMENTS).max(1);
        let first = *stamps.first()?;
        // What acted in the period before the first state is not known: neither are its torques.
        let unknown = if is_tracking(cell) { SETTLED_NS } else { BEGUN_NS };
        let begun = stamps.partition_point(|stamp| *stamp < first + unknown);
        let known = begun.max(usize::from(recorded.torques_end_at_rows));
        let at_once = desired_rows(&recorded);
        let of_commands = channels.iter().any(|channel| channel.quantity == "tau_J_d");
        let complete = |row: &usize| !of_commands || at_once[*row].is_some();
        let kept: Vec<usize> = (known..used).step_by(stride).filter(complete).collect();
        let desired_rows = kept.iter().map(|row| at_once[*row]).collect();
        let stamps_ns: Vec<u64> = kept.iter().flat_map(|row| [stamps[*row], stamps[*row] + TICK_NS]).collect();
        let dof = recorded.measured.dof;
        let mut rows = Vec::with_capacity(channels.len() * kept.len());
        for channel in 0..channels.len() {
            for row in &kept {
                let regime = regimes.at(desired, stamps[*row], channel % dof);
                let time = (stamps[*row] - first) as f64 * 1e-9;
                rows.push(Row { channel, stage: StageName::Control, regime, time });
            }
        }
        let (recent, stepped_from) = (Recent::default(), Recent::default());
        Some(Self {
            recorded,
            commands,
            kept,
            desired_rows,
            stamps_ns,
            rows,
            recent,
            stepped_from,
            alone_until_ns: end_ns,
        })
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for ArmClips<F> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], _own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let residuals = self.clips[clip].recent.at(shared, || self.simulated(clip, shared))?;
        out.clone_from(&residuals);
        Ok(())
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> ArmClips<F> {
    /// Largest torque that the controller asks of each joint in any of the clips, gravity included [N m].
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn peaks(&self, shared: &[f64]) -> Result<Joints, Impossible> {
        let mut peaks = [0.0; MAX_JOINTS];
        for clip in 0..self.clips.len() {
            for reading in self.readings((&self.mover, 1), clip, shared)? {
                let gravity = self.nominal.gravity(&reading.state.q);
                let asked = reading.tau_J_d.iter().zip(gravity).map(|(tau, gravity)| (tau + gravity).abs());
                peaks.iter_mut().zip(asked).for_each(|(peak, asked)| *peak = asked.max(*peak));
            }
        }
        Ok(peaks)
    }

    /// By how much a vertical force of 1 N at the tip turns each joint at measured joints [N m].
    pub fn vertical_lever(&self, measured: &[f64]) -> Joints {
        let mut q = [0.0; MAX_JOINTS];
        q[..measured.len()].copy_from_slice(measured);
        let tip = self.nominal.tip(&q).position();
        self.nominal.jacobian(&q, tip).map(|column| column[2])
    }

    /// From which stamp on the tool of a clip may touch the object [ns].
    pub fn alone_until_ns(&self, clip: usize) -> u64 {
        self.clips[clip].alone_until_ns
    }

    /// The residuals of a clip as a simulation gives them, known or not.
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub(in crate::diagnose) fn simulated(&self, clip: usize, shared: &[f64]) -> Result<Vec<f64>, Impossible> {
        self.simulated_by((&self.mover, 1), clip, shared)
    }

    /// By the twin or another simulator, each control period in so many parts where it can.
    fn simulated_by(&self, by: (&Mover, u32), clip: usize, shared: &[f64]) -> Result<Vec<f64>, Impossible> {
        let (readings, mut residuals) = (self.readings(by, clip, shared)?, Vec::new());
        self.compare(&self.clips[clip], &readings, &mut residuals)?;
        Ok(residuals)
    }

    /// At every moment that counts, and a control period later.
    fn readings(&self, (mover, parts): (&Mover, u32), clip: usize, shared: &[f64]) -> Result<Vec<Reading>, Impossible> {
        let clip = &self.clips[clip];
        let measured = &clip.recorded.measured;
        let stretch = Stretch { measured, from: 0, commands: &clip.commands, ahead: &[], parts };
        let mut readings = vec![Reading::default(); clip.stamps_ns.len()];
        mover.readings(&(self.theta)(shared), &stretch, &clip.stamps_ns, &mut readings)?;
        Ok(readings)
    }

    /// Torque that a joint's sensor shows of what its motor gives [N m]; `later`: a control period after `now`. What friction takes is
    /// in it on either side of the gear: where it arises in a real one is not known.
    fn taken(&self, joint: usize, now: &Reading, later: &Reading) -> f64 {
        let motor = now.tau_J_d[joint] + self.nominal.gravity(&now.state.q)[joint];
        let sensing = self.cell.controller.as_ref().map(|controller| controller.torque_sensing);
        if sensing == Some(TorqueSensing::Motor) {
            return motor;
        }
        let acceleration = (later.state.dq[joint] - now.state.dq[joint]) / TICK;
        motor - self.nominal.rotor_inertia()[joint] * acceleration
    }

    fn compare(&self, clip: &Prepared, readings: &[Reading], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let dof = self.nominal.dof();
        out.clear();
        for (channel, (info, sigma)) in self.channels.iter().zip(&self.sigma).enumerate() {
            let joint = channel % dof;
            let (log, values) = series(&clip.recorded, info);
            let later = usize::from(!clip.recorded.torques_end_at_rows);
            for (moment, (row, desired)) in clip.kept.iter().zip(&clip.desired_rows).enumerate() {
                let row = if info.quantity == "tau_J_d" { desired.unwrap_or(*row) } else { *row };
                let predicted = match info.quantity {
                    "q" => readings[2 * moment].state.q[joint],
                    "dq" => readings[2 * moment].state.dq[joint],
                    "tau_J" => readings[2 * moment + later].tau_J[joint],
                    TORQUE => self.taken(joint, &readings[2 * moment], &readings[2 * moment + 1]),
                    _ => readings[2 * moment + later].tau_J_d[joint],
                };
                out.push((values[row * log.dof + joint] - predicted) / sigma);
            }
        }
        let near = |(moment, row): (usize, &usize)| {
            let measured = clip.recorded.measured.q_row(*row);
            measured.iter().zip(&readings[2 * moment].state.q).all(|(measured, q)| (q - measured).abs() < FLOWN)
        };
        let sane = clip.kept.iter().enumerate().all(near) && out.iter().all(|residual| residual.is_finite());
        if sane { Ok(()) } else { Err(Impossible("the simulated arm left all bounds".into())) }
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> Measured for ArmClips<F> {
    type Own = WithOwn;

    fn following(&self, clip: usize) -> Vec<Moment> {
        let Some(controller) = &self.cell.controller else { return Vec::new() };
        let clip = &self.clips[clip];
        let stamps: Vec<u64> = clip.stamps_ns.iter().step_by(2).copied().collect();
        let logged = (&clip.recorded.measured, &clip.commands);
        following::moments((&self.nominal, controller.kind), logged, &stamps).unwrap_or_default()
    }

    fn in_halves(&self, clip: usize, shared: &[f64]) -> Option<Vec<f64>> {
        // Another simulator has steps of its own.
        self.twin.is_none().then(|| self.simulated_by((&self.mover, 2), clip, shared).ok())?
    }

    fn changed(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        (_, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let (Some(twin), Some((at, _))) = (&self.twin, at) else { return self.residuals(clip, shared, own, out) };
        let from = self.clips[clip].stepped_from.at(at, || self.simulated_by((twin, 1), clip, at))?;
        *out = self.simulated_by((twin, 1), clip, shared)?;
        out.iter_mut().zip(base).zip(&*from).for_each(|((out, base), from)| *out += base - from);
        Ok(())
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn rows(&self, clip: usize) -> &[Row] {
        &self.clips[clip].rows
    }

    fn scatter(&self) -> Scatter {
        Scatter::default()
    }

    fn torque_sigma(&self) -> Option<&[f64]> {
        self.channels.iter().all(|channel| channel.quantity == TORQUE).then_some(&self.sigma[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::clips::test_clip::of_one_joint;
    use crate::diagnose::clips::torques;
    use crate::diagnose::test_bench::shipped;
    use shared_mem::msg::arm::ArmState;
    use shared_mem::theta::EffectTheta;
    use twin::control::Drive;
    use twin::sim::SimCell;

    /// A payload, so that torques are not those of an arm at rest, and a joint that swings under it.
    fn clip(cell: &Cell, theta: &Theta, torques_end_at_rows: bool) -> Clip {
        let mut twin = SimCell::new(cell, Some(theta)).expect("a cell");
        let mut state = ArmState::default();
        twin.read(&mut state);
        let (home, mut log) = (state.q, [JointSeries::default(), JointSeries::default()]);
        for tick in 0..400 {
            let t = f64::from(tick) * 1e-3;
            let (mut q_d, mut dq_d) = (home, [0.0; 8]);
            (q_d[3], dq_d[3]) = (q_d[3] + 0.1 * (1.0 - (5.0 * t).cos()), 0.5 * (5.0 * t).sin());
            let mut row = state;
            twin.step(&Drive::JointImpedance { q_d, dq_d });
            twin.read(&mut state);
            if !torques_end_at_rows {
                (row.tau_J, row.tau_J_d) = (state.tau_J, state.tau_J_d);
            }
            let series = [(&row.q, &row.dq, &row.tau_J), (&q_d, &dq_d, &row.tau_J_d)];
            for (log, (q, dq, tau)) in log.iter_mut().zip(series) {
                log.dof = 7;
                log.stamps_ns.push(u64::try_from(tick).expect("not negative") * TICK_NS);
                log.q.extend(&q[..7]);
                log.dq.extend(&dq[..7]);
                log.tau.extend(&tau[..7]);
            }
        }
        let [measured, desired] = log;
        let joint_names = (1..=7).map(|joint| format!("fr3_joint{joint}")).collect();
        let nothing = of_one_joint(Vec::new(), |_| 0.0);
        Clip { joint_names, desired, measured, torques_end_at_rows, ..nothing }
    }

    #[test]
    fn an_arm_that_swings_ever_wider_has_no_residuals_however_finite_its_joints_are() {
        let cell = Cell { objects: Vec::new(), ..shipped() };
        let recorded = clip(&cell, &Theta::default(), true);
        let arm = ArmClips::new(&cell, &[recorded], |_: &[f64]| Theta::default()).expect("an arm");
        let told = |away: f64| {
            let mut readings = arm.readings((&arm.mover, 1), 0, &[]).expect("it can be simulated");
            readings[200].state.q[3] += away;
            arm.compare(&arm.clips[0], &readings, &mut Vec::new())
        };
        assert_eq!(told(0.0), Ok(()));
        assert_eq!(told(std::f64::consts::TAU), Ok(()), "a reading that wraps around");
        assert!(told(1e47).is_err_and(|why| why.0.contains("left all bounds")));
    }

    #[test]
    fn along_a_measured_motion_the_torque_is_what_moves_links_and_overcomes_friction() {
        let mut cell = Cell { objects: Vec::new(), ..shipped() };
        (cell.simulation.q_noise, cell.simulation.dq_noise) = (0.0, 0.0);
        let recorded = clip(&cell, &Theta::default(), true);
        let tracking = torques::cell(&cell).expect("a model");
        let followed = torques::followed(recorded.clone()).expect("long enough");
        let viscous = EffectTheta {
            name: "joint_viscous_friction".into(),
            parameters: [("viscous".to_owned(), 2.0.into())].into(),
        };
        let left = |effects: Vec<EffectTheta>| {
            let theta = Theta { effects, ..Theta::default() };
            let arm = ArmClips::new(&tracking, std::slice::from_ref(&followed), move |_: &[f64]| theta.clone())
                .expect("an arm");
            let mut out = Vec::new();
            arm.residuals(0, &[], &[], &mut out).expect("it can be simulated");
            let dq = |k: usize| followed.measured.dq_row(arm.clips[0].kept[k]).expect("velocities")[3];
            let of_joint = |k: &usize| arm.rows(0)[*k].channel == 3;
            let first = (0..out.len()).find(of_joint).expect("a row");
            (0..out.len()).filter(of_joint).map(|k| (dq(k - first), out[k] * arm.sigma()[3])).collect::<Vec<_>>()
        };
        // The clip's own torques are those behind the gear.
        for (dq, rest) in left(Vec::new()) {
            assert!(rest.abs() < 0.05, "{rest} N m at {dq} rad/s");
        }
        for (dq, rest) in left(vec![viscous]) {
            assert!((rest + 2.0 * dq).abs() < 0.06, "{rest} N m at {dq} rad/s");
        }
    }

    #[test]
    fn torques_agree_whether_a_log_means_the_period_before_or_behind_its_stamp() {
        let mut cell = Cell { objects: Vec::new(), ..shipped() };
        (cell.simulation.q_noise, cell.simulation.dq_noise) = (0.0, 0.0);
        let effect = EffectTheta { name: "payload".into(), parameters: [("mass".to_owned(), 0.3.into())].into() };
        let theta = Theta { effects: vec![effect], ..Theta::default() };
        // Of a part of a clip commands are kept from before it.
        for (end_at_rows, begins_ns) in [(true, 0), (false, 0), (true, 150_000_000), (false, 150_000_000)] {
            let mut recorded = clip(&cell, &theta, end_at_rows);
            recorded.measured = recorded.measured.between(begins_ns..=u64::MAX);
            let arm = ArmClips::new(&cell, &[recorded], |_: &[f64]| theta.clone());
            let (arm, mut out) = (arm.expect("an arm"), Vec::new());
            arm.residuals(0, &[], &[], &mut out).expect("it can be simulated");
            let torques: Vec<f64> =
                arm.rows(0).iter().zip(&out).filter(|(row, _)| row.channel >= 14).map(|(_, r)| *r).collect();
            let worst = torques.iter().fold(0.0, |worst: f64, sigmas| worst.max(sigmas.abs()));
            assert!(torques.len() > 2000 && worst < 3.0, "{end_at_rows}: {worst} sigmas in {} rows", torques.len());
            assert!(arm.rows(0).iter().any(|row| row.channel == 3 && row.regime == "fast forward"));
        }
    }
}
