//! The stages of a diagnosis with about how long each takes beside the others: what the time left begins with.

use shared_mem::progress::Planned;

/// Gains and object are identified without any effect.
pub(super) const BASELINE: &str = "baseline";
/// Every candidate's signature is linearised.
pub(super) const SIGNATURES: &str = "signatures";
/// Candidates on the arm are fitted to the arm alone.
pub(super) const ARM_FITS: &str = "fits to the arm";
/// Candidates are fitted.
pub(super) const FITS: &str = "fits";
/// Those near the best are fitted to the end, and all are compared.
pub(super) const LAST_FITS: &str = "final fits";
/// The best is refined beside what was found before.
pub(super) const REFINEMENT: &str = "refinement";
/// The confirm clips are opened.
pub(super) const CONCLUSION: &str = "conclusion";

/// A search that finds one effect. Whether it then looks for another is not known before: half of such a step is expected,
/// which is about what its fits take.
pub(super) const ARM: [Planned; 7] = [
    (BASELINE, 1.0),
    (SIGNATURES, 1.0),
    (FITS, 2.0),
    (LAST_FITS, 1.0),
    (REFINEMENT, 2.0),
    (FITS, 2.0),
    (CONCLUSION, 0.2),
];

/// The same with an object.
pub(super) const OBJECT: [Planned; 8] = [
    (BASELINE, 1.0),
    (SIGNATURES, 0.5),
    (ARM_FITS, 0.5),
    (FITS, 4.0),
    (LAST_FITS, 1.0),
    (REFINEMENT, 3.0),
    (FITS, 4.0),
    (CONCLUSION, 0.2),
];

/// Fits that the score test did not point to.
pub(super) const MORE_FITS: [Planned; 2] = [(FITS, 2.0), (LAST_FITS, 1.0)];

/// Half of a further step.
pub(super) const FURTHER: [Planned; 1] = [(FITS, 2.0)];
