//! Clips of an arm as evidence: what [`ArmClips`] measures at moments.

use super::measured::{Channel, Measured, Near, Row};
use inference::estimate::{ClipModel as _, Impossible};
pub use inference::forward::arm::ArmClips;
use inference::forward::arm::following::Moment;
use inference::forward::random_effects::{RandomEffects, WithOwn};
use shared_mem::theta::Theta;

impl<F: Fn(&[f64]) -> Theta + Sync> Measured for ArmClips<F> {
    type Own = WithOwn;

    fn following(&self, clip: usize) -> Vec<Moment> {
        self.following(clip)
    }

    fn in_halves(&self, clip: usize, shared: &[f64]) -> Option<Vec<f64>> {
        // Another simulator has steps of its own.
        (!self.is_moved_by_engine()).then(|| self.residuals_in(2, (clip, shared, &[])).ok())?
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
        self.channels()
    }

    fn rows(&self, clip: usize) -> &[Row] {
        self.rows(clip)
    }

    fn scatter(&self) -> RandomEffects {
        RandomEffects::default()
    }

    fn torque_sigma(&self) -> Option<&[f64]> {
        self.is_of_torques().then_some(self.sigma())
    }
}
