//! The stages of a diagnosis, which its progress counts. How often it looks again depends on what it finds: off by up to five times was the
//! end that it promised by what its stages usually take.

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

/// What the bar says while a candidate is looked at.
pub(in crate::diagnose) fn of(stage: &str, candidate: &str) -> String {
    format!("{stage}: {}", candidate.replace('_', " "))
}

/// What a further step of the search adds.
pub(in crate::diagnose) const OF_A_STEP: [&str; 3] = [SIGNATURES, FITS, LAST_FITS];

/// A search that finds one effect.
pub(in crate::diagnose) fn expected(with_object: bool) -> Vec<&'static str> {
    let on_the_arm: &[&str] = if with_object { &[ARM_FITS] } else { &[] };
    [&[BASELINE, SIGNATURES], on_the_arm, &[FITS, LAST_FITS, REFINEMENT, CONCLUSION]].concat()
}
