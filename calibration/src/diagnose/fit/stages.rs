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
/// Two sessions are linearised around one model.
pub(in crate::diagnose) const SLOPES: &str = "slopes of both sessions";
/// Changes between them are fitted.
pub(in crate::diagnose) const CHANGES: &str = "changes";
/// The confirm clips are opened.
pub(in crate::diagnose) const CONCLUSION: &str = "conclusion";

/// About how long each takes beside the others, from the lines that a diagnosis without a terminal writes every ten seconds (sixteen strokes
/// or eight motions of another engine).
const DURATIONS: [Planned; 9] = [
    (BASELINE, 1.0),
    (SIGNATURES, 1.0),
    (ARM_FITS, 0.5),
    (FITS, 5.0),
    (LAST_FITS, 1.5),
    (REFINEMENT, 2.5),
    (SLOPES, 1.0),
    (CHANGES, 1.5),
    (CONCLUSION, 2.0),
];

/// What the bar says while a candidate is looked at.
pub(in crate::diagnose) fn of(stage: &str, candidate: &str) -> String {
    format!("{stage}: {}", candidate.replace('_', " "))
}

/// Stages, each with its duration.
pub(in crate::diagnose) fn planned(stages: &[&str]) -> Vec<Planned> {
    let duration = |stage: &&str| DURATIONS.into_iter().find(|(known, _)| known == stage);
    stages.iter().filter_map(duration).collect()
}

/// A further step.
pub(in crate::diagnose) fn further() -> Vec<Planned> {
    planned(&[SIGNATURES, FITS, LAST_FITS])
}

/// A search that finds one effect; about every other one then looks for another beside it ([`further`] where it does).
pub(in crate::diagnose) fn plan(with_object: bool) -> Vec<Planned> {
    let on_the_arm: &[&str] = if with_object { &[ARM_FITS] } else { &[] };
    let first = [&[BASELINE, SIGNATURES], on_the_arm, &[FITS, LAST_FITS, REFINEMENT]].concat();
    let perhaps = further().into_iter().map(|(stage, duration)| (stage, 0.5 * duration));
    planned(&first).into_iter().chain(perhaps).chain(planned(&[CONCLUSION])).collect()
}
