//! The likelihood of recorded clips under any parameters of the cell: what the twin makes of every clip, as residuals in sigmas of the
//! sensors, what each of them is about, and what varies from clip to clip.
//!
//! One vector holds the baseline's parameters and those of every effect of the library, each effect at its neutral value. A hypothesis
//! is a choice of which of them are free.
//!
//! | module | owns |
//! |---|---|
//! | [`setting`] | from a vector of numbers to the parameters of a cell |
//! | [`motion`] | who moves the arm: the twin, or another program |
//! | [`arm`] | clips with an arm: what its sensors log |
//! | [`object`] | clips with an object: poses |
//! | [`cell`] | both together, with the arm's joints in contact ([`contact`]) |
//! | [`rows`] | what every residual is about |
//! | [`random_effects`], [`random_effects_scale`] | what varies from clip to clip, and how widely under a hypothesis |
//! | [`recent`] | what was simulated where a search has just been |
//! | [`smoothing`] | logged series smoothed, with slopes |

pub mod arm;
pub mod cell;
pub mod contact;
pub mod motion;
pub mod object;
pub mod random_effects;
pub mod random_effects_scale;
pub mod recent;
pub mod rows;
pub mod setting;
pub mod smoothing;
#[cfg(test)]
mod test_arm_rows;
#[cfg(test)]
mod test_bench;
#[cfg(test)]
mod test_cell;
#[cfg(test)]
mod test_derivatives;
#[cfg(test)]
mod test_elimination;
#[cfg(test)]
mod test_random_effects;
#[cfg(test)]
mod test_servo;
#[cfg(test)]
mod test_setting;
#[cfg(test)]
mod test_smoothing;
mod vertical;

pub use rows::{Channel, Group, Row, StageName};
pub use setting::{Setting, Settings};

use crate::engine::Engine;
use crate::estimate::{ClipModel, Impossible};
use arm::following::Moment;
use random_effects::{OwnNumbers, RandomEffects, WithOwn};
use std::sync::Arc;

/// What a number can change of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    All,
    /// The residuals of the arm that moves alone; what it does in contact and to the object by way of the arm is left out.
    Arm,
    /// All but the residuals of the arm that moves alone.
    Object,
}

/// A point nearby: what can have changed from it, the residuals there, and the parameters there, shared and nuisance ones, where they
/// are known.
pub type Near<'a> = (Reach, &'a [f64], Option<(&'a [f64], &'a [f64])>);

/// Clips that say what each of their residuals is, and what varies from clip to clip: all that a likelihood is made of.
pub trait Likelihood: ClipModel {
    /// Whether clips have nuisance parameters. What is fitted to these clips is of this kind: nuisance parameters mean nothing to a
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
    fn scatter(&self) -> RandomEffects;
    /// Whether an object is in the clips, even where only the arm is looked at: a hit goes elsewhere with the least change of the
    /// gains, so these are fitted as exactly as they can be.
    fn has_object(&self) -> bool {
        self.scatter().count() > 0
    }
    /// One sigma of each channel [N m], where torques along the measured motion are all that is looked at.
    fn torque_sigma(&self) -> Option<&[f64]> {
        None
    }
    /// The slopes of a clip's residuals by a nuisance parameter, where they are known without a simulation.
    fn own_slope(&self, _clip: usize, _own: usize) -> Option<&[f64]> {
        None
    }
}

/// All that was measured, each clip with its nuisance parameters: what a diagnosis is about. Of clips that are looked at in part only
/// [`Likelihood`] is known.
pub type Evidence<'a> = dyn Likelihood<Own = WithOwn> + 'a;
