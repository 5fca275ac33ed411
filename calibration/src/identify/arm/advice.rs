//! What to record next: how much narrower the worst interval would be with one more clip like those there are, or with
//! the same motion twice as large. A joint's answer is nearly linear, so twice the motion is four times the information.

use super::finding::Finding;
use crate::answer::identification::Advice;
use crate::identify::used::Used;

/// So many proposals.
const PROPOSALS: usize = 3;

/// Proposals for the number with the widest interval for its size, best first.
pub(super) fn next(finding: &Finding<'_>, clips: &Used) -> Vec<Advice> {
    let fit = &finding.outcome.fit;
    let half = &finding.intervals.half_width;
    let relative = |k: usize| {
        let unknown = &finding.unknowns[k];
        half[k] / fit.shared[k].abs().max(0.05 * (unknown.upper - unknown.lower))
    };
    let told = (0..half.len()).filter(|k| half[*k].is_finite());
    let Some(worst) = told.max_by(|a, b| relative(*a).total_cmp(&relative(*b))) else { return Vec::new() };
    let mut all = Vec::new();
    for (clip, file) in fit.clips.iter().zip(&clips.clips.train) {
        for (gain, record) in [(1.0, format!("one more clip like {file}")), (4.0, format!("{file} twice as large"))] {
            let predicted = finding.intervals.with_more(fit, &(&clip.information * gain))[worst];
            all.push(Advice { record, parameter: finding.unknowns[worst].name.clone(), now: half[worst], predicted });
        }
    }
    all.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
    all.truncate(PROPOSALS);
    all
}
