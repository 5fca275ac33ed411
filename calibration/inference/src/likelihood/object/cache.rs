//! What was simulated of a clip and can be used again: the arm's way to the object, the hit, and the whole.

use super::nuisance::Values;
use super::outcome::{Outcome, Path};
use crate::likelihood::motion::felt_by_arm;
use crate::likelihood::recent::Recent;
use nalgebra::Isometry3;
use shared_mem::theta::{ArmTheta, EffectTheta, Theta};
use twin::rollout::{CellTrace, Checkpoint};

/// Approaches kept for a clip [1]: the arm's numbers change seldom while the object's are searched.
const APPROACHES: usize = 4;
/// Hits kept for a clip [1]: a linearisation by as many numbers comes back to its point.
const HITS: usize = 32;
/// Whole runs kept for a clip [1]: a search asks again where it has just been, or with another clock. A fit ends with the slopes of
/// its last place, after trials and restarts from there that led nowhere.
const OUTCOMES: usize = 32;

/// All that counts until the tool touches the object.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ArmKey {
    arm: Option<ArmTheta>,
    effects: Vec<EffectTheta>,
    start: Isometry3<f64>,
}

/// The arm's way to the last tick before the first touch.
#[derive(Debug)]
pub(super) struct Approach {
    pub(super) joints: CellTrace,
    /// `None` when tool and object do not touch.
    pub(super) checkpoint: Option<Checkpoint>,
    pub(super) contact_ns: Option<u64>,
}

/// The hit, to the moment at which the tool has let go.
#[derive(Debug)]
pub(super) struct Hit {
    pub(super) path: Path,
    pub(super) joints: CellTrace,
    pub(super) checkpoint: Option<Checkpoint>,
    pub(super) contact_ns: Option<u64>,
}

/// What is kept of one clip.
#[derive(Debug)]
pub(super) struct ClipCache {
    pub(super) approaches: Recent<ArmKey, Approach>,
    /// By all parameters and where the object stood.
    pub(super) hits: Recent<(Theta, Isometry3<f64>), Hit>,
    /// By all parameters and what a simulation feels of the clip's own.
    pub(super) outcomes: Recent<(Theta, Values), Outcome>,
}

impl Default for ClipCache {
    fn default() -> Self {
        Self { approaches: Recent::of(APPROACHES), hits: Recent::of(HITS), outcomes: Recent::of(OUTCOMES) }
    }
}

impl ArmKey {
    pub(super) fn new(theta: &Theta, start: Isometry3<f64>) -> Self {
        let Theta { arm, effects, .. } = felt_by_arm(theta);
        Self { arm, effects, start }
    }

    /// Parameters that the way to the object is simulated with, whoever asks for it first: rounding of other ones of the
    /// object would be found in every hit that goes on from there.
    pub(super) fn theta(&self) -> Theta {
        Theta { arm: self.arm.clone(), effects: self.effects.clone(), ..Theta::default() }
    }
}
