//! What a likelihood is made of: residuals of clips under the parameters of every hypothesis at once.
//!
//! One vector holds the baseline's parameters and those of every effect of the library, each effect at its neutral value. A hypothesis
//! is a choice of which of them are free.

use inference::engine::Engine;
use inference::estimate::{ClipModel, Impossible};
use inference::forward::arm::following::Moment;
use inference::forward::random_effects::{OwnNumbers, RandomEffects, WithOwn};
pub use inference::forward::rows::{Channel, Group, Row, StageName};
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
    /// The slopes of a clip's residuals by a number of its own, where they are known without a simulation.
    fn own_slope(&self, _clip: usize, _own: usize) -> Option<&[f64]> {
        None
    }
}

/// All that was measured, each clip with its own numbers: what a diagnosis is about. Of clips that are looked at in part only
/// [`Measured`] is known.
pub trait Evidence: Measured<Own = WithOwn> {}

impl<E: Measured<Own = WithOwn>> Evidence for E {}
