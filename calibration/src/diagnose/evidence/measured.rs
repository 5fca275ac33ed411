//! What the statistics are told: residuals of clips under the numbers of every hypothesis at once.
//!
//! One vector holds the baseline's numbers and those of every effect of the library, each effect resting where it changes
//! nothing. A hypothesis is a choice of which numbers are free; [`Selected`] makes it a [`ClipModel`] of its own.

use super::scatter::{OwnNumbers, Scatter, WithOwn};
use inference::engine::Engine;
use inference::estimate::{ClipModel, Impossible, Unknown};
use inference::forward::arm::following::Moment;
use std::sync::Arc;

/// Part of a clip to which a channel's gap is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StageName {
    /// The arm follows its command.
    Control,
    /// The object right after the hit.
    Hit,
    /// The object slides.
    Slide,
    /// The object rests: what is wrong there is seen wrongly.
    Rest,
}

impl StageName {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Hit => "hit",
            Self::Slide => "slide",
            Self::Rest => "rest",
        }
    }
}

/// Whose sensors a channel belongs to, and while what happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// The arm's, while it moves alone.
    Arm,
    /// The object's poses.
    Object,
    /// The arm's, from the first touch until the tool has let go of the object: its joints yield to the contact force.
    Contact,
}

/// One measured quantity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// What it is: `q`, `dq`, `tau_J`, `tau_J_d`, `position`, `rotation`.
    pub quantity: &'static str,
    /// Whose: `joint2`, `x`, `yaw`.
    pub place: String,
    /// The joint it belongs to, from 0; `None` for the object's.
    pub joint: Option<usize>,
    pub group: Group,
}

/// Where a residual stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Index into [`Measured::channels`].
    pub channel: usize,
    /// Part of the clip.
    pub stage: StageName,
    /// What was going on: `forward`, `reversal`, `fast`.
    pub regime: &'static str,
    /// Seconds from the clip's start.
    pub time: f64,
}

/// What a number can change of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    All,
    /// The residuals of the arm that moves alone; what it does in contact and to the object by way of the arm is left out.
    Arm,
    /// All but the residuals of the arm that moves alone.
    Object,
}

/// A point nearby: what can have changed from it, the residuals there, and the numbers there, shared and the clip's own, where they
/// are known.
pub type Near<'a> = (Reach, &'a [f64], Option<(&'a [f64], &'a [f64])>);

/// Clips that tell what each of their residuals is.
pub trait Measured: ClipModel {
    /// Whether clips have numbers of their own. What is fitted to these clips is of this kind: a clip's own numbers mean nothing to a
    /// bench that knows none.
    type Own: OwnNumbers;

    /// [`ClipModel::residuals`] where only some can have changed from those of a point nearby: the others may be taken from there,
    /// which saves their simulation.
    ///
    /// # Errors
    /// As [`ClipModel::residuals`].
    fn changed(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        _near: Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.residuals(clip, shared, own, out)
    }

    /// The other program that simulates strokes, where it is not the twin.
    fn engine(&self) -> Option<&Arc<Engine>> {
        None
    }

    /// Moments of a clip along its measured motion, where the arm's law is a spring to the command and a damper to the ground; none
    /// elsewhere.
    fn following(&self, _clip: usize) -> Vec<Moment> {
        Vec::new()
    }

    /// The residuals of a clip with every control period integrated in two parts; `None` where that is not known.
    fn in_halves(&self, _clip: usize, _shared: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// All measured quantities.
    fn channels(&self) -> &[Channel];
    /// The residuals of a clip, in the order of [`ClipModel::residuals`]; rows of one channel ascend in time.
    fn rows(&self, clip: usize) -> &[Row];
    /// What varies from clip to clip.
    fn scatter(&self) -> Scatter;
    /// Whether an object is in the clips, even where only the arm is looked at: a hit goes elsewhere with the least change of the
    /// gains, so these are fitted as exactly as they can be.
    fn has_object(&self) -> bool {
        self.scatter().count() > 0
    }
    /// One sigma of each channel [N m], where torques along the measured motion are all that is looked at.
    fn torque_sigma(&self) -> Option<&[f64]> {
        None
    }
    /// The slopes of a clip's residuals by a number of its own, where they are known without a simulation.
    fn own_slope(&self, _clip: usize, _own: usize) -> Option<&[f64]> {
        None
    }
}

/// All that was measured, each clip with its own numbers: what a diagnosis is about. Of clips that are looked at in part only
/// [`Measured`] is known.
pub trait Evidence: Measured<Own = WithOwn> {}

impl<E: Measured<Own = WithOwn>> Evidence for E {}

/// A hypothesis on some of the clips: `free` numbers of `full`, every residual times the weight of its channel.
pub struct Selected<'a, E> {
    /// All clips, all numbers.
    pub evidence: &'a E,
    /// Numbers that are not free.
    pub full: Vec<f64>,
    /// Indices of the free ones.
    pub free: Vec<usize>,
    /// Indices of the clips that count.
    pub clips: Vec<usize>,
    /// Factor on the residuals of each channel.
    pub weights: &'a [f64],
}

impl<E: Measured> Selected<'_, E> {
    /// The full vector for values of the free numbers.
    pub fn numbers(&self, shared: &[f64]) -> Vec<f64> {
        let mut full = self.full.clone();
        for (index, value) in self.free.iter().zip(shared) {
            full[*index] = *value;
        }
        full
    }

    /// The free unknowns, beginning at the full vector's values.
    pub fn unknowns(&self, all: &[Unknown]) -> Vec<Unknown> {
        let of = |index: &usize| {
            let unknown = &all[*index];
            Unknown { start: self.full[*index].clamp(unknown.lower, unknown.upper), ..unknown.clone() }
        };
        self.free.iter().map(of).collect()
    }
}

impl<E: Measured> ClipModel for Selected<'_, E> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let clip = self.clips[clip];
        self.evidence.residuals(clip, &self.numbers(shared), own, out)?;
        for (residual, row) in out.iter_mut().zip(self.evidence.rows(clip)) {
            *residual *= self.weights[row.channel];
        }
        Ok(())
    }
}
