//! A motion that runs: its generator, its torques, its lost commands, and how it ends. Called by [`super::robot`] once a
//! cycle.
#![allow(non_snake_case)] // the field's own symbols

use super::faults::{Fault, Verdict};
use super::generator::{Generator, Surroundings};
use super::losses::Losses;
use super::wire::{Controller, GeneratorKind, MotionRequest, SetPoint};
use crate::arm::ReflexErrors;
use crate::safety::TORQUE_RATE;
use shared_mem::msg::{MAX_JOINTS, joints_from};
use shared_mem::time::TICK;
use std::ops::RangeInclusive;
use twin::arm::Joints;

/// What a client's single-precision echo of a torque of 64 to 128 N m may be off, as a rate [N m/s].
const ECHO_RATE: f64 = 4e-6 / TICK;

/// What a cycle of a motion came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    Runs,
    /// The client said that it is done.
    Finished,
}

/// The running motion.
#[derive(Debug)]
pub(super) struct Motion {
    pub(super) request: MotionRequest,
    /// The client's counter of the request; the last word on the motion carries it.
    pub(super) id: u32,
    /// Counter of the state when it began: whatever answers this one or an earlier one belongs to the motion before.
    since: u64,
    pub(super) generator: Generator,
    pub(super) losses: Losses,
    /// Torque of the client, without gravity [N m]; none before the first.
    tau_J_d: Option<Joints>,
}

impl Motion {
    /// A motion that begins at rest with the desired positions `q`.
    pub(super) fn begin(request: MotionRequest, id: u32, since: u64, q: &Joints, around: &Surroundings) -> Self {
        let generator = Generator::at_rest(&request, q, around);
        Self { request, id, since, generator, losses: Losses::new(), tau_J_d: None }
    }

    /// The client's torque in force, without gravity [N m]; none where the robot's own controller acts.
    pub(super) fn torque(&self) -> Option<&Joints> {
        self.tau_J_d.as_ref()
    }

    /// One cycle: `set_point` is the newest that has arrived, `now` the counter of the state it has to answer, `held` the
    /// torque without gravity that the state echoes [N m].
    pub(super) fn cycle(
        &mut self,
        set_point: Option<&SetPoint>,
        now: u64,
        held: &Joints,
        around: &Surroundings,
    ) -> Result<Course, ReflexErrors> {
        let set_point = set_point.filter(|s| self.answers(now).contains(&s.answers));
        if self.request.targets.is_some() {
            return self.plan_on(set_point, around);
        }
        if !self.losses.note(set_point.is_some()) {
            return Err(Fault::CommunicationConstraints.alone());
        }
        if !self.losses.has_begun() {
            return Ok(Course::Runs);
        }
        if let Some(set_point) = set_point
            && self.is_last(set_point)
        {
            self.generator.finish(around)?;
            return Ok(Course::Finished);
        }
        self.generator.follow(set_point, around)?;
        if self.request.controller == Controller::External
            && let Some(set_point) = set_point
        {
            self.take_torque(set_point, held)?;
        }
        Ok(Course::Runs)
    }

    /// Counters of the states that a set point may answer, `now` being the newest: a target may come at any time.
    pub(super) fn answers(&self, now: u64) -> RangeInclusive<u64> {
        let oldest = if self.request.targets.is_some() { 0 } else { now };
        oldest.max(self.since + 1)..=now
    }

    /// A cycle in which a target may have come.
    fn plan_on(&mut self, target: Option<&SetPoint>, around: &Surroundings) -> Result<Course, ReflexErrors> {
        if target.is_some_and(|target| target.motion_finished) {
            return Ok(Course::Finished);
        }
        self.generator.follow(target, around)?;
        Ok(Course::Runs)
    }

    fn is_last(&self, set_point: &SetPoint) -> bool {
        let torques_alone = self.request.generator == GeneratorKind::None;
        if torques_alone { set_point.torque_finished } else { set_point.motion_finished }
    }

    /// The first torque may go on from what the robot's own controller asked for, or begin at none: what a robot
    /// measures it against is not published.
    fn take_torque(&mut self, set_point: &SetPoint, held: &Joints) -> Verdict {
        let (asked, zero) = (joints_from(&set_point.tau_J_d), [0.0; MAX_JOINTS]);
        let continuous = |before: &Joints| {
            let rate = |(now, before): (&f64, &f64)| (now - before).abs() / TICK;
            asked.iter().zip(before).map(rate).all(|rate| rate <= TORQUE_RATE + ECHO_RATE)
        };
        let fits = match &self.tau_J_d {
            Some(before) => continuous(before),
            None => continuous(held) || continuous(&zero),
        };
        if !fits {
            return Err(Fault::TorqueDiscontinuity.alone());
        }
        self.tau_J_d = Some(asked);
        Ok(())
    }
}
