//! What clips say of the baseline and of what the search found, by numbers that were fitted to others.

use super::Case;
use crate::answer::diagnosis::{Place, SensorGap};
use crate::diagnose::judge::confirm::{Confirmation, confirm};
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::Measured;
use crate::diagnose::judge::localise::localise;
use crate::diagnose::judge::sizes;
use crate::diagnose::work::DiagnoseError;
use inference::likelihood::Evidence;

/// What an answer is measured by.
pub(super) struct Measures {
    /// The baseline.
    pub(super) without: Measured,
    /// All that the search found.
    pub(super) with: Measured,
    /// Where the baseline leaves most.
    pub(super) places: Vec<Place>,
    /// The gap before and after, of every group of sensors, in a clip like most.
    pub(super) left: Vec<SensorGap>,
    pub(super) confirmation: Confirmation,
    /// Of every step of the search.
    pub(super) overdispersion: Vec<f64>,
    /// Whether the gap is of no interest without effects, and with them.
    pub(super) within_tolerance: [bool; 2],
}

/// Measures both.
pub(super) fn measure<E: Evidence>(case: &Case<'_, E>) -> Result<Measures, DiagnoseError> {
    let Case { bench, split, found, session, admitted, options } = *case;
    let weights = &case.first().weights[..];
    let without = Measured::of(bench, split, &case.first().from, weights)?;
    let nothing_found = found.last.full == case.first().from.full;
    let with =
        if nothing_found { without.clone() } else { Measured::of(bench, split, &found.last, case.last_weights())? };
    let typical = |measured: &Measured| {
        let left = Residuals::at(bench, &measured.of_all, &split.confirm).ok_or(DiagnoseError::NoBaseline)?;
        Ok::<_, DiagnoseError>(left.typical())
    };
    let [before, after] = [typical(&without)?, typical(&with)?];
    let both = [&without.held_out, &with.held_out];
    Ok(Measures {
        left: SensorGap::of_groups(&before, &after),
        confirmation: confirm(bench, weights, both, options.seed)?,
        overdispersion: found.overdispersion(bench),
        within_tolerance: sizes::within_tolerance(bench, both, session, admitted)?,
        places: localise(bench.evidence, &without.held_out.left),
        without,
        with,
    })
}
