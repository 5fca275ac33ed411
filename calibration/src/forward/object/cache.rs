//! What was simulated of a clip and can be used again: the arm's way to the object, and the hit.

use super::rollout::Path;
use nalgebra::Isometry3;
use shared_mem::theta::{ArmTheta, EffectTheta, Theta};
use std::collections::VecDeque;
use twin::effects::{self, Place};
use twin::rollout::{CellTrace, Checkpoint};

/// Hits kept for a clip: a linearisation by as many numbers comes back to its point.
const HITS: usize = 32;
/// Approaches kept for a clip.
const APPROACHES: usize = 4;

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
    pub(super) key: ArmKey,
    pub(super) joints: CellTrace,
    /// `None` when tool and object do not touch.
    pub(super) checkpoint: Option<Checkpoint>,
    pub(super) contact_ns: Option<u64>,
}

/// The hit, to the moment at which the tool has let go.
#[derive(Debug, Clone)]
pub(super) struct Hit {
    pub(super) theta: Theta,
    pub(super) start: Isometry3<f64>,
    pub(super) path: Path,
    pub(super) joints: CellTrace,
    pub(super) checkpoint: Option<Checkpoint>,
    pub(super) contact_ns: Option<u64>,
}

/// What is kept of one clip, the oldest given up first.
#[derive(Debug, Default)]
pub(super) struct ClipCache {
    approaches: VecDeque<Approach>,
    hits: VecDeque<Hit>,
}

impl ArmKey {
    pub(super) fn new(theta: &Theta, start: Isometry3<f64>) -> Self {
        let counts = |effect: &&EffectTheta| {
            effects::find(&effect.name)
                .is_none_or(|effect| !matches!(effect.acts_on, Place::Object | Place::Table | Place::ObjectObservation))
        };
        Self { arm: theta.arm.clone(), effects: theta.effects.iter().filter(counts).cloned().collect(), start }
    }
}

impl ClipCache {
    pub(super) fn approach(&self, key: &ArmKey) -> Option<&Approach> {
        self.approaches.iter().find(|approach| approach.key == *key)
    }

    pub(super) fn keep_approach(&mut self, approach: Approach) {
        self.approaches.truncate(APPROACHES - 1);
        self.approaches.push_front(approach);
    }

    pub(super) fn hit(&self, theta: &Theta, start: &Isometry3<f64>) -> Option<&Hit> {
        self.hits.iter().find(|hit| hit.start == *start && hit.theta == *theta)
    }

    pub(super) fn keep_hit(&mut self, hit: Hit) {
        self.hits.truncate(HITS - 1);
        self.hits.push_front(hit);
    }
}
