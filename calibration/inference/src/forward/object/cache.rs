//! What was simulated of a clip and can be used again: the arm's way to the object, the hit, and the whole.

use super::outcome::{Outcome, Path};
use super::own::Values;
use crate::forward::motion::felt_by_arm;
use nalgebra::Isometry3;
use shared_mem::theta::{ArmTheta, EffectTheta, Theta};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use twin::rollout::{CellTrace, Checkpoint};

/// Hits kept for a clip: a linearisation by as many numbers comes back to its point.
const HITS: usize = 32;
/// Approaches kept for a clip.
const APPROACHES: usize = 4;
/// Whole runs kept for a clip: a search asks again where it has just been, or with another clock.
const OUTCOMES: usize = 12;

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
#[derive(Debug)]
pub(super) struct Hit {
    pub(super) theta: Theta,
    pub(super) start: Isometry3<f64>,
    pub(super) path: Path,
    pub(super) joints: CellTrace,
    pub(super) checkpoint: Option<Checkpoint>,
    pub(super) contact_ns: Option<u64>,
}

/// What is kept of one clip, the oldest given up first. It may be asked by many threads; two that miss the same at the
/// same time both simulate it, and find the same.
#[derive(Debug, Default)]
pub(super) struct ClipCache {
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    approaches: VecDeque<Arc<Approach>>,
    hits: VecDeque<Arc<Hit>>,
    outcomes: VecDeque<Arc<Run>>,
}

/// A whole run: its parameters, the clip's own numbers that a simulation feels, what came of it.
#[derive(Debug)]
struct Run {
    theta: Theta,
    own: Values,
    outcome: Arc<Outcome>,
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

impl ClipCache {
    pub(super) fn approach(&self, key: &ArmKey) -> Option<Arc<Approach>> {
        self.with(|kept| kept.approaches.iter().find(|approach| approach.key == *key).cloned())
    }

    pub(super) fn keep_approach(&self, approach: Approach) -> Arc<Approach> {
        let approach = Arc::new(approach);
        self.with(|kept| {
            kept.approaches.truncate(APPROACHES - 1);
            kept.approaches.push_front(Arc::clone(&approach));
        });
        approach
    }

    pub(super) fn hit(&self, theta: &Theta, start: &Isometry3<f64>) -> Option<Arc<Hit>> {
        self.with(|kept| kept.hits.iter().find(|hit| hit.start == *start && hit.theta == *theta).cloned())
    }

    pub(super) fn keep_hit(&self, hit: Hit) -> Arc<Hit> {
        let hit = Arc::new(hit);
        self.with(|kept| {
            kept.hits.truncate(HITS - 1);
            kept.hits.push_front(Arc::clone(&hit));
        });
        hit
    }

    pub(super) fn outcome(&self, theta: &Theta, own: &Values) -> Option<Arc<Outcome>> {
        let own = own.felt();
        let same = |run: &&Arc<Run>| run.own == own && run.theta == *theta;
        self.with(|kept| kept.outcomes.iter().find(same).map(|run| Arc::clone(&run.outcome)))
    }

    pub(super) fn keep_outcome(&self, theta: Theta, own: &Values, outcome: Outcome) -> Arc<Outcome> {
        let outcome = Arc::new(outcome);
        let run = Arc::new(Run { theta, own: own.felt(), outcome: Arc::clone(&outcome) });
        self.with(|kept| {
            kept.outcomes.truncate(OUTCOMES - 1);
            kept.outcomes.push_front(run);
        });
        outcome
    }

    fn with<T>(&self, look: impl FnOnce(&mut Kept) -> T) -> T {
        look(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
