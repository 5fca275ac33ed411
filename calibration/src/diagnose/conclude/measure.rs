//! What the confirm clips say of the baseline and of what the search found: they are opened here, and only here.

use super::Case;
use crate::answer::diagnosis::{Place, SensorGap};
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::judge::confirm::{Confirmation, confirm};
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::{self, Fits};
use crate::diagnose::judge::localise::localise;
use crate::diagnose::judge::sizes;
use crate::diagnose::work::DiagnoseError;
use inference::likelihood::Evidence;

/// A hypothesis on the confirm clips.
pub(super) struct OnConfirm {
    /// Its numbers for clips that they were not fitted to.
    pub(super) fits: Fits,
    /// What they leave there.
    pub(super) left: Residuals,
    /// Where they leave it.
    pub(super) places: Vec<Place>,
}

/// What an answer is measured by.
pub(super) struct Measures {
    /// The baseline.
    pub(super) without: OnConfirm,
    /// All that the search found.
    pub(super) with: OnConfirm,
    /// The gap before and after, of every group of sensors, in a clip like most.
    pub(super) left: Vec<SensorGap>,
    pub(super) confirmation: Confirmation,
    /// Of every step of the search.
    pub(super) overdispersion: Vec<f64>,
    /// Whether the gap is of no interest without effects, and with them.
    pub(super) within_tolerance: [bool; 2],
}

/// Opens the confirm clips.
pub(super) fn measure<E: Evidence>(case: &Case<'_, E>) -> Result<Measures, DiagnoseError> {
    let Case { bench, found, session, admitted, options, .. } = *case;
    let weights = &case.first().weights[..];
    let without = on_confirm(case, &case.first().from, weights)?;
    let with = on_confirm(case, &found.last, case.last_weights())?;
    // A clip like most is sought among all: of the few that confirm one alone would decide.
    let all: Vec<usize> = (0..admitted.clips.len()).collect();
    let typical = |hypothesis| {
        let left = Residuals::at(bench, hypothesis, &all).ok_or(DiagnoseError::NoBaseline)?;
        Ok::<_, DiagnoseError>(left.typical())
    };
    let [before, after] = [typical(&case.first().from)?, typical(&found.last)?];
    let both = [(&without.fits, &without.left), (&with.fits, &with.left)];
    let fits_and_left = ([&without.fits, &with.fits], [&without.left, &with.left]);
    Ok(Measures {
        left: SensorGap::of_groups(&before, &after),
        confirmation: confirm(bench, weights, both, options.seed)?,
        overdispersion: found.overdispersion(bench),
        within_tolerance: sizes::within_tolerance(bench, fits_and_left, session, admitted)?,
        without,
        with,
    })
}

fn on_confirm<E: Evidence>(
    case: &Case<'_, E>,
    hypothesis: &Hypothesis,
    weights: &[f64],
) -> Result<OnConfirm, DiagnoseError> {
    let fits = held_out::fits(case.bench, case.split, hypothesis, weights).ok_or(DiagnoseError::NoBaseline)?;
    let left = Residuals::of(case.bench, &fits).ok_or(DiagnoseError::NoBaseline)?;
    Ok(OnConfirm { places: localise(case.bench.evidence, &left), fits, left })
}
