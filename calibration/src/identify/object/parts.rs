//! How sure tosses leave the numbers, by asking parts of them alone.
//!
//! A body that tumbles answers so unevenly that slopes at one point say nothing of how far an answer may be off. Four
//! parts of the tosses, each fitted by itself, do: their spread is that of the answer, whatever the reason.

use super::Problem;
use super::polish::let_go;
use crate::identify::error::IdentifyError;
use crate::identify::work::Work;
use inference::estimate::ClipModel as _;
use inference::estimate::interval::LEVEL;
use inference::likelihood::object::ObjectClips;
use inference::object_fit::fit_object;
use inference::statistics::student;
use shared_mem::progress::Progress;
use shared_mem::recording::Clip;

/// As few as a spread can be taken of, so that each holds many clips (a choice).
const PARTS: usize = 4;
/// Fewer clips make no part (a choice).
const FEWEST_OF_A_PART: usize = 4;

/// Half of the 95 % interval of every number by what parts of the clips disagree; 0 where the clips are no tosses or too
/// few. `None`: the user asked for the end.
pub(super) fn disagreement(
    at: &[f64],
    clips: &ObjectClips,
    problem: &Problem,
    Work { kept, interrupt }: Work<'_>,
) -> Result<Option<Vec<f64>>, IdentifyError> {
    if !let_go(clips) || clips.clips() < PARTS * FEWEST_OF_A_PART {
        return Ok(Some(vec![0.0; at.len()]));
    }
    let (bar, mut answers) = (Progress::new("intervals", PARTS as u64), Vec::new());
    for part in 0..PARTS {
        bar.show(part as u64, "a part of the tosses by itself");
        // Interleaved, so that what changes over a session is in all of them.
        let of_part = |clip: &usize| clip % PARTS == part;
        let own: Vec<Clip> = (0..clips.clips()).filter(of_part).map(|clip| clips.clip(clip).clone()).collect();
        let mut own = ObjectClips::new(clips.cell(), own, problem.settings.clone())?;
        let name = format!("part {part}");
        answers.push(fit_object(&mut own, &problem.unknowns, at, (kept, &name), |_, _| !interrupt.asked())?.at.shared);
        if interrupt.asked() {
            return Ok(None);
        }
    }
    let half = (0..at.len()).map(|k| half_width(&answers.iter().map(|answer| answer[k]).collect::<Vec<_>>()));
    Ok(Some(half.collect()))
}

/// Half of the 95 % interval of the mean of parts.
fn half_width(parts: &[f64]) -> f64 {
    let count = parts.len() as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let variance = parts.iter().map(|part| (part - mean).powi(2)).sum::<f64>() / (count - 1.0);
    student(LEVEL, parts.len() - 1) * (variance / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_agree_leave_no_doubt_and_others_as_much_as_student_says() {
        assert_eq!(half_width(&[0.18; 4]), 0.0);
        // Mean 0.2, deviation 0.02 * sqrt(4 / 3).
        let half = half_width(&[0.18, 0.22, 0.18, 0.22]);
        assert!((half - student(LEVEL, 3) * 0.02 * (4.0_f64 / 3.0).sqrt() / 2.0).abs() < 1e-12, "{half}");
    }
}
