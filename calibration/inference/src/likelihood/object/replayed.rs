//! The figures of `twin replay` for strokes, whoever simulates them.

use super::nuisance::Values;
use super::outcome::Outcome;
use super::{ObjectClips, reported};
use crate::engine::Engine;
use crate::likelihood::Settings;
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use shared_mem::time::seconds_between;
use std::sync::Arc;
use twin::arm::{JointState, Joints};
use twin::control::Reading;
use twin::replay::{ClipGap, Prediction, ReplayError, Replayer};

/// A cell under parameters, ready to replay its strokes.
pub struct Replays {
    replayer: Replayer,
    cell: Cell,
    theta: Theta,
    /// Another program, and the cell's nominal parameters.
    by: Option<(Arc<Engine>, Theta)>,
}

impl Replays {
    /// By the twin, or by another program where there is one; `nominal`: the cell's nominal parameters.
    ///
    /// # Errors
    /// [`ReplayError`] when the cell cannot be simulated.
    pub fn new(
        cell: &Cell,
        theta: &Theta,
        (engine, nominal): (Option<&Arc<Engine>>, &Theta),
    ) -> Result<Self, ReplayError> {
        let by = engine.map(|engine| (Arc::clone(engine), nominal.clone()));
        Ok(Self { replayer: Replayer::new(cell, Some(theta))?, cell: cell.clone(), theta: theta.clone(), by })
    }

    /// Replays a clip: the clip with its joints in the model's order, what was predicted, and how far that is off.
    ///
    /// # Errors
    /// [`ReplayError`] naming the clip and the remedy.
    pub fn replay(&self, clip: Clip) -> Result<(Clip, Prediction, ClipGap), ReplayError> {
        match &self.by {
            None => self.replayer.replay(clip),
            Some(by) => self.replayer.judge(clip, |clip| self.predict(clip, by)),
        }
    }

    fn predict(&self, clip: &Clip, (engine, nominal): &(Arc<Engine>, Theta)) -> Result<Prediction, ReplayError> {
        let alone = Settings::new(self.theta.clone(), Vec::new());
        let clips = ObjectClips::new(&self.cell, vec![clip.clone()], alone)?.simulated_by(Some(engine), nominal);
        clips.replayed().ok_or_else(|| ReplayError::Diverged(clip.file.display().to_string()))
    }
}

impl ObjectClips {
    /// What is predicted for every measured row and every recorded pose of the first clip.
    fn replayed(mut self) -> Option<Prediction> {
        let clip = self.clips.first_mut()?;
        clip.arm_ns.clone_from(&clip.recorded.measured.stamps_ns);
        let first = *clip.arm_ns.first()?;
        self.error.joints = Some(1.0);
        let own = Values::default();
        let outcome = self.outcome(0, &[], &own).ok()?;
        let Outcome { joints, contact_ns, .. } = &*outcome;
        let read = |q: &Joints| Reading { state: JointState { q: *q, ..JointState::default() }, ..Reading::default() };
        Some(Prediction {
            joints: joints.iter().map(read).collect(),
            object: reported(&outcome, &self.clips[0], &own),
            contact_time: contact_ns.map(|stamp| seconds_between(first, stamp)),
            warnings: Vec::new(),
        })
    }
}
