//! Trials and steps of a search that say what a test needs.

use super::closing::Closed;
use super::score::Predicted;
use super::trial::{Step, Trial};
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::library::Library;
use crate::diagnose::test_bench::nothing_said_of;
use shared_mem::msg::MAX_JOINTS;

/// Twelve clips that are likelier by so much together [nats].
pub(super) fn likelier(nats: f64) -> Predicted {
    Predicted { clips: (0..12).map(|clip| (clip, 1000.0 - nats / 6.0)).collect() }
}

pub(super) fn trial(library: &Library, candidate: usize, (fitted, nats): (&Hypothesis, f64)) -> Trial {
    Trial {
        fitted: Some((fitted.clone(), likelier(nats).over(&likelier(0.0)))),
        closed: Closed::all(0.9),
        ..Trial::untried(Scored { signal: 30.0, ..nothing_said_of(library, candidate) }, false)
    }
}

pub(super) fn step(from: &Hypothesis, trials: Vec<Trial>) -> Step {
    Step {
        from: from.clone(),
        trials,
        predicted: likelier(0.0),
        weights: vec![1.0; 4 * MAX_JOINTS],
        arm_rows: 100,
        left: Vec::new(),
        whole: Vec::new(),
    }
}
