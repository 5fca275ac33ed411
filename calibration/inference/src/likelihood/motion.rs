//! Who moves an arm that touches nothing: the twin's own dynamics, or another program's ([`crate::engine`]).
//!
//! With an engine the nominal model is the engine's. What it knows of gains and effects is asked of it; of what it does not
//! know, the twin's own roll-outs with and without it differ by something, and that is added to the engine's states:
//!
//! ```text
//! states(theta) = engine(known) + twin(theta) - twin(known)        known: the part of theta that the engine simulates itself
//! ```
//!
//! So every effect of the library remains a candidate, and is judged by what it does beside the engine's own model. The sum is
//! exact where an effect does the same in both models, and off by its cross terms with what the two models differ by. Slopes are the
//! twin's own for the same reason, and cost no roll-out of the engine. The state in which a clip begins is estimated with the twin's
//! model from its first 20 ms, in which two models of one arm do the same.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use crate::engine::{Engine, NoStates, Quantity, Question};
use crate::estimate::Impossible;
use shared_mem::cell::Cell;
use shared_mem::ending;
use shared_mem::recording::JointSeries;
use shared_mem::theta::{EffectTheta, Theta};
use shared_mem::time::TICK_NS;
use std::ops::Range;
use std::sync::Arc;
use twin::arm::{ArmModel, JointState, Joints};
use twin::control::{ArmRollout, CommandTrack, Plant, Reading};
use twin::effects::{Effects, Place, find};

/// So long before a clip a command may have been given that still counts: the longest delay that an effect has, and a bit [ticks].
const HISTORY: u64 = 2100;

/// A part of a clip that is simulated in one go.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'a> {
    /// What the arm did, and from where it began.
    pub measured: &'a JointSeries,
    /// The row at which it begins.
    pub from: usize,
    /// What the arm was commanded to do.
    pub commands: &'a CommandTrack,
    /// Added to the state in which it begins: positions, then velocities; nothing where it is empty.
    pub ahead: &'a [f64],
    /// In so many parts the twin integrates a period; 1 is how it does it.
    pub parts: u32,
}

/// Moves the arm of a cell.
#[derive(Debug, Clone)]
pub struct Mover {
    cell: Cell,
    nominal: ArmModel,
    /// With the gains of cell.toml.
    known: Theta,
    engine: Option<Arc<Engine>>,
    /// What an engine is asked for.
    wanted: Vec<Quantity>,
}

impl Mover {
    /// By the twin's own dynamics. `nominal`: the arm as cell.toml describes it.
    pub fn own(cell: &Cell, nominal: &ArmModel) -> Self {
        Self { cell: cell.clone(), nominal: nominal.clone(), known: Theta::default(), engine: None, wanted: Vec::new() }
    }

    /// By another program, where there is one; `known`: the cell's nominal parameters; `wanted`: what is compared of what it
    /// reports. Velocities are asked for besides, where it reports them: they say where joints were a moment ago.
    pub fn by(self, engine: Option<Arc<Engine>>, known: Theta, mut wanted: Vec<Quantity>) -> Self {
        wanted.push(Quantity::Velocity);
        wanted.retain(|quantity| engine.as_ref().is_some_and(|engine| engine.ability().reports(*quantity)));
        wanted.sort_unstable();
        wanted.dedup();
        Self { engine, known, wanted, ..self }
    }

    /// What the sensors read at the ascending stamps, in `out`; quantities that an engine is not asked for are without
    /// meaning, velocities the twin's.
    ///
    /// # Errors
    /// [`Impossible`] where the arm cannot be simulated, or leaves all bounds.
    pub fn readings(
        &self,
        theta: &Theta,
        stretch: &Stretch<'_>,
        stamps_ns: &[u64],
        out: &mut [Reading],
    ) -> Result<(), Impossible> {
        let Some(engine) = &self.engine else {
            return self.twin(theta, stretch, stamps_ns, out).map(drop);
        };
        // What the twin's own time step does is in neither its states nor in a difference.
        let stretch = &Stretch { parts: 1, ..*stretch };
        let theta = &felt_by_arm(theta);
        let known = engine.ability().part(theta, &self.known);
        let whole = known == *theta && self.wanted.contains(&Quantity::Velocity);
        let (start, mut without) = if whole {
            (self.prepared(theta)?.start(stretch)?, Vec::new())
        } else {
            let mut without = vec![Reading::default(); out.len()];
            let start = self.twin(&known, stretch, stamps_ns, &mut without)?;
            self.twin(theta, stretch, stamps_ns, out)?;
            (start, without)
        };
        let states = self.asked(engine, &known, (stretch, &start), stamps_ns)?;
        let dof = self.nominal.dof();
        let columns = self.wanted.len() * dof;
        for (i, (row, out)) in states.chunks_exact(columns).zip(out).enumerate() {
            let before = without.get_mut(i).map(|without| quantities(without).map(|joints| *joints));
            for (quantity, theirs) in self.wanted.iter().zip(row.chunks_exact(dof)) {
                let joints = &mut quantities(out)[*quantity as usize][..dof];
                match &before {
                    None => joints.copy_from_slice(theirs),
                    Some(before) => (joints.iter_mut().zip(theirs).zip(&before[*quantity as usize]))
                        .for_each(|((joint, theirs), before)| *joint += theirs - before),
                }
            }
        }
        Ok(())
    }

    /// What the twin makes of it, in `out`, and where it began.
    fn twin(
        &self,
        theta: &Theta,
        stretch: &Stretch<'_>,
        stamps_ns: &[u64],
        out: &mut [Reading],
    ) -> Result<JointState, Impossible> {
        let prepared = self.prepared(theta)?;
        let start = prepared.start(stretch)?;
        let first = stretch.measured.stamps_ns[stretch.from];
        prepared.rollout(stretch.parts).readings(&start, first, stretch.commands, stamps_ns, out);
        if ending::asked() {
            return Err(Impossible("interrupted".into()));
        }
        if out.last().is_some_and(|last| last.state.q.iter().any(|q| !q.is_finite())) {
            return Err(Impossible(
                "the simulated arm diverges; the damping may be too large for a 1 kHz controller".into(),
            ));
        }
        Ok(start)
    }

    fn prepared(&self, theta: &Theta) -> Result<Prepared, Impossible> {
        let fail = |error: &dyn std::fmt::Display| Impossible(error.to_string());
        let dof = self.nominal.dof();
        let effects = Effects::of(self.cell.controller.as_ref(), &theta.effects, dof).map_err(|e| fail(&e))?;
        let plant = Plant::new(&self.cell, self.nominal.clone(), Some(theta), &effects.arm).map_err(|e| fail(&e))?;
        Ok(Prepared { plant, dof })
    }

    fn asked(
        &self,
        engine: &Engine,
        theta: &Theta,
        (stretch, start): (&Stretch<'_>, &JointState),
        stamps_ns: &[u64],
    ) -> Result<Arc<Vec<f64>>, Impossible> {
        let dof = self.nominal.dof();
        let first_ns = stretch.measured.stamps_ns[stretch.from];
        let last_ns = stamps_ns.last().copied().unwrap_or(first_ns);
        let (commands, before) = commands(stretch.commands, first_ns..last_ns, dof);
        let times: Vec<f64> = stamps_ns.iter().map(|stamp| stamp.saturating_sub(first_ns) as f64 * 1e-9).collect();
        let start = [&start.q[..dof], &start.dq[..dof]].concat();
        let question = Question {
            theta,
            dof,
            start: &start,
            before,
            commands: &commands,
            readings: &self.wanted,
            times: &times,
            object: None,
        };
        states(engine, &question)
    }
}

/// What an engine answers.
///
/// # Errors
/// [`Impossible`] where it has no answer, or none that an arm or an object can have.
pub(super) fn states(engine: &Engine, question: &Question<'_>) -> Result<Arc<Vec<f64>>, Impossible> {
    engine.roll_out(question).map_err(|error| match error {
        NoStates::Impossible(why) => Impossible(format!("the engine has no answer: {why}")),
        NoStates::Failed(error) => Impossible(error.to_string()),
    })
}

/// Of parameters those that an arm feels as long as it touches nothing.
pub(super) fn felt_by_arm(theta: &Theta) -> Theta {
    let counts = |effect: &&EffectTheta| {
        let acts_on = find(&effect.name).map(|effect| effect.acts_on);
        !matches!(acts_on, Some(Place::Object | Place::Table | Place::ObjectObservation))
    };
    let effects = theta.effects.iter().filter(counts).cloned().collect();
    Theta { arm: theta.arm.clone(), effects, ..Theta::default() }
}

/// The twin's arm under parameters.
struct Prepared {
    plant: Plant,
    dof: usize,
}

impl Prepared {
    fn rollout(&self, parts: u32) -> ArmRollout<'_> {
        ArmRollout { parts, ..self.plant.rollout() }
    }

    fn start(&self, stretch: &Stretch<'_>) -> Result<JointState, Impossible> {
        let rollout = self.rollout(stretch.parts);
        let start = rollout.start_state(stretch.measured, stretch.from, stretch.commands);
        let mut start = start.ok_or_else(|| Impossible("no measured joints".into()))?;
        for joint in 0..self.dof {
            start.q[joint] += stretch.ahead.get(joint).unwrap_or(&0.0);
            start.dq[joint] += stretch.ahead.get(self.dof + joint).unwrap_or(&0.0);
        }
        Ok(start)
    }
}

/// The command in force in each control period, desired positions, then velocities; and how many rows are of the time before.
pub(super) fn commands(track: &CommandTrack, over: Range<u64>, dof: usize) -> (Vec<f64>, usize) {
    let first = |ticks: u64| over.start.checked_sub(ticks * TICK_NS).map_or(0, |tick_ns| track.at(tick_ns));
    let given = (1..HISTORY).take_while(|ticks| first(*ticks) > 0).count() as u64;
    // The row before them all, where the first command is not in force yet.
    let before = if first(0) == 0 { 0 } else { given + 1 };
    let ticks = (over.end - over.start).div_ceil(TICK_NS).max(1);
    let mut out = Vec::with_capacity(2 * dof * (before + ticks) as usize);
    let mut push = |row: usize| {
        out.extend_from_slice(&track.q_d(row)[..dof]);
        out.extend_from_slice(&track.dq_d(row)[..dof]);
    };
    (1..=before).rev().for_each(|ticks| push(first(ticks)));
    let mut row = first(0);
    for tick in 0..ticks {
        row = track.in_force(over.start + tick * TICK_NS, row);
        push(row);
    }
    (out, before as usize)
}

/// What a reading holds, in the order of [`Quantity`].
fn quantities(reading: &mut Reading) -> [&mut Joints; 4] {
    [&mut reading.state.q, &mut reading.state.dq, &mut reading.tau_J, &mut reading.tau_J_d]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_is_told_the_command_in_force_in_each_period_and_those_before_the_start() {
        let ms = |n: u64| n * TICK_NS;
        let series = JointSeries {
            dof: 1,
            stamps_ns: vec![ms(10), ms(12), ms(14), ms(16)],
            q: vec![1.0, 2.0, 3.0, 4.0],
            dq: vec![0.1, 0.2, 0.3, 0.4],
            ..JointSeries::default()
        };
        let track = CommandTrack::new(&series).expect("commands");
        let (rows, before) = commands(&track, ms(13)..ms(16), 1);
        // 11 ms, in which the first command holds as before it; 12 ms; then 13, 14, 15 ms.
        assert_eq!((rows, before), (vec![1.0, 0.1, 2.0, 0.2, 2.0, 0.2, 3.0, 0.3, 3.0, 0.3], 2));
        let (rows, before) = commands(&track, ms(10)..ms(11), 1);
        assert_eq!((rows, before), (vec![1.0, 0.1], 0));
    }
}
