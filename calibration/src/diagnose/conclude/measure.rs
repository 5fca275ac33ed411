//! What clips say of the baseline and of what the search found, by numbers that were fitted to others.

use super::Case;
use crate::answer::diagnosis::Place;
use crate::diagnose::judge::confirm::{Confirmation, confirm};
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::Measured;
use crate::diagnose::judge::localise::localise;
use crate::diagnose::judge::remainder::Left;
use crate::diagnose::judge::sizes;
use crate::diagnose::work::DiagnoseError;

/// What an answer is measured by.
pub(super) struct Measures {
    /// The baseline.
    pub(super) without: Measured,
    /// All that the search found.
    pub(super) with: Measured,
    /// Where the baseline leaves most.
    pub(super) places: Vec<Place>,
    /// What the baseline and all that was found leave.
    pub(super) left: Left,
    pub(super) confirmation: Confirmation,
    /// Of every step of the search.
    pub(super) overdispersion: Vec<f64>,
    /// Whether the gap is of no interest without effects, and with them.
    pub(super) within_tolerance: [bool; 2],
}

/// Measures both.
pub(super) fn measure(case: &Case<'_>) -> Result<Measures, DiagnoseError> {
    let Case { bench, split, found, session, admitted, options } = *case;
    let weights = &case.first().weights[..];
    let without = Measured::of(bench, split, &case.first().from, weights)?;
    let nothing_found = found.last.full == case.first().from.full;
    let with =
        if nothing_found { without.clone() } else { Measured::of(bench, split, &found.last, case.last_weights())? };
    let left =
        |measured: &Measured| Residuals::at(bench, &measured.of_all, &split.confirm).ok_or(DiagnoseError::NoBaseline);
    let (before, after) = (left(&without)?, left(&with)?);
    let both = [&without.held_out, &with.held_out];
    Ok(Measures {
        left: Left::of(bench, &before, &after),
        confirmation: confirm(bench, weights, both, options.seed)?,
        overdispersion: found.overdispersion(bench),
        within_tolerance: sizes::within_tolerance(bench, both, session, admitted)?,
        places: localise(bench.evidence, &without.held_out.left),
        without,
        with,
    })
}
