//! The stages of a diagnosis with about how long each takes beside the others: what the time left begins with.

use shared_mem::progress::Planned;

/// Gains and object are identified without any effect.
pub(in crate::diagnose) const BASELINE: &str = "baseline";
/// Every candidate's signature is linearised.
pub(in crate::diagnose) const SIGNATURES: &str = "signatures";
/// Candidates on the arm are fitted to the arm alone.
pub(in crate::diagnose) const ARM_FITS: &str = "fits to the arm";
/// Candidates are fitted.
pub(in crate::diagnose) const FITS: &str = "fits";
/// Those near the best are fitted to the end, and all are compared.
pub(in crate::diagnose) const LAST_FITS: &str = "final fits";
/// The best is refined beside what was found before.
pub(in crate::diagnose) const REFINEMENT: &str = "refinement";
/// The confirm clips are opened.
pub(in crate::diagnose) const CONCLUSION: &str = "conclusion";

/// What the bar says while a candidate is looked at.
pub(in crate::diagnose) fn of(stage: &str, candidate: &str) -> String {
    format!("{stage}: {}", candidate.replace('_', " "))
}

/// A search that finds one effect, and then looks for another beside it.
pub(in crate::diagnose) const ARM: [Planned; 9] = [
    (BASELINE, 1.0),
    (SIGNATURES, 1.0),
    (FITS, 2.0),
    (LAST_FITS, 1.0),
    (REFINEMENT, 2.0),
    (SIGNATURES, 1.0),
    (FITS, 2.0),
    (LAST_FITS, 1.0),
    (CONCLUSION, 0.2),
];

/// The same with an object.
pub(in crate::diagnose) const OBJECT: [Planned; 10] = [
    (BASELINE, 1.0),
    (SIGNATURES, 0.5),
    (ARM_FITS, 0.5),
    (FITS, 4.0),
    (LAST_FITS, 1.0),
    (REFINEMENT, 3.0),
    (SIGNATURES, 0.5),
    (FITS, 4.0),
    (LAST_FITS, 1.0),
    (CONCLUSION, 0.2),
];

/// Fits that the score test did not point to.
pub(in crate::diagnose) const MORE_FITS: [Planned; 2] = [(FITS, 2.0), (LAST_FITS, 1.0)];

/// A further step.
pub(in crate::diagnose) const FURTHER: [Planned; 3] = [(SIGNATURES, 1.0), (FITS, 2.0), (LAST_FITS, 1.0)];
