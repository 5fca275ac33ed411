//! How far the twin is off: clip by clip and for each set of clips, with what was found and with what was known before.

use super::Model;
use crate::answer::Trace;
use crate::answer::identification::{ClipGap, Figures, Identification};
use crate::identify::error::IdentifyError;
use crate::identify::figures::{Odd, USE_FITTED, USE_HELD_OUT, gap, odd};
use crate::identify::used::Used;
use inference::estimate::{Random, Schedule, Subset, score};
use rayon::prelude::*;
use shared_mem::time::seconds_between;

/// Points of a picture's line (a choice: one in two pixels).
const POINTS_OF_A_LINE: usize = 400;

/// Measured less predicted positions at the rows that count.
struct Errors {
    /// Seconds from the first row.
    times: Vec<f64>,
    /// Joints, row by row [rad].
    rows: Vec<Vec<f64>>,
}

/// Fills in errors, their pictures, and which clips are odd. `numbers`: before and after.
pub(super) fn fill(
    answer: &mut Identification,
    model: &Model<'_>,
    clips: &Used,
    random: &[Random],
    numbers: [&[f64]; 2],
) -> Result<(), IdentifyError> {
    let train = clips.split.train.iter().map(|clip| (*clip, USE_FITTED));
    let jobs: Vec<(usize, &str)> = train.chain(clips.split.confirm.iter().map(|clip| (*clip, USE_HELD_OUT))).collect();
    let done: Vec<(ClipGap, Trace)> = jobs
        .par_iter()
        .map(|(clip, used)| one(model, *clip, used, random, numbers))
        .collect::<Result<_, IdentifyError>>()?;
    (answer.by_clip, answer.traces) = done.into_iter().unzip();
    answer.gap = gap(&answer.by_clip);
    answer.warnings.extend(odd_clips(&answer.by_clip));
    Ok(())
}

fn odd_clips(clips: &[ClipGap]) -> Vec<String> {
    let all = odd(clips, |clip| clip.after.joint_rms_rad.unwrap_or(0.0), 0.0);
    let all = all.into_iter();
    all.map(|Odd { clip, error, usual }| {
        format!(
            "{}: its error is {:.0} times the usual one: look at its clock, its load and who touched the arm, and identify without it",
            clip.file,
            error / usual
        )
    })
    .collect()
}

fn one(
    model: &Model<'_>,
    clip: usize,
    used: &str,
    random: &[Random],
    [before, after]: [&[f64]; 2],
) -> Result<(ClipGap, Trace), IdentifyError> {
    // What was known before may be beyond what can be simulated: then there is no figure.
    let before = errors(model, clip, random, before).ok();
    let after = errors(model, clip, random, after)?;
    let joint_rms_rad = joint_rms(&after);
    let worst = (0..joint_rms_rad.len()).max_by(|a, b| joint_rms_rad[*a].total_cmp(&joint_rms_rad[*b])).unwrap_or(0);
    let trace = Trace {
        clip: model.clip(clip).name(),
        channel: format!("joint {}", worst + 1),
        unit: "rad".into(),
        sigma: model.sigma()[worst],
        before: before.as_ref().map_or_else(Vec::new, |errors| line(errors, worst)),
        after: line(&after, worst),
    };
    let gap = ClipGap {
        file: model.clip(clip).name(),
        used: used.into(),
        before: before.as_ref().map_or_else(Figures::default, figures),
        after: figures(&after),
        joint_rms_rad,
        warnings: model.clip(clip).warnings.clone(),
    };
    Ok((gap, trace))
}

fn errors(model: &Model<'_>, clip: usize, random: &[Random], numbers: &[f64]) -> Result<Errors, IdentifyError> {
    let own = if random.iter().any(|effect| effect.sigma > 0.0) {
        let alone = Subset { model, clips: &[clip] };
        score(&alone, numbers, random, &Schedule::default())?.swap_remove(0).own
    } else {
        Vec::new()
    };
    let predicted = model.predict_in(1, (clip, numbers, &own))?;
    let clip = model.clip(clip);
    let measured = &clip.recorded.measured;
    let (mut times, mut rows) = (Vec::new(), Vec::new());
    for row in clip.averaged().flatten().copied() {
        times.push(seconds_between(measured.stamps_ns[0], measured.stamps_ns[row]));
        let pairs = measured.q_row(row).iter().zip(&predicted[row].state.q).enumerate();
        // A reading that stands still says nothing of where its joint is.
        rows.push(pairs.map(|(joint, (q, p))| if clip.dead[joint] { 0.0 } else { q - p }).collect());
    }
    Ok(Errors { times, rows })
}

fn joint_rms(errors: &Errors) -> Vec<f64> {
    let count = errors.rows.len().max(1) as f64;
    let mut sums = vec![0.0; errors.rows.first().map_or(0, Vec::len)];
    for row in &errors.rows {
        sums.iter_mut().zip(row).for_each(|(sum, error)| *sum += error * error);
    }
    sums.into_iter().map(|sum| (sum / count).sqrt()).collect()
}

fn figures(errors: &Errors) -> Figures {
    let squares = |row: &Vec<f64>| row.iter().map(|error| error * error).sum::<f64>();
    let values = errors.rows.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let rms = (errors.rows.iter().map(squares).sum::<f64>() / values).sqrt();
    let norm = errors.rows.iter().map(|row| squares(row).sqrt()).sum::<f64>() / errors.rows.len().max(1) as f64;
    Figures { joint_rms_rad: Some(rms), joint_norm_rad: Some(norm), ..Figures::default() }
}

fn line(errors: &Errors, joint: usize) -> Vec<[f64; 2]> {
    let every = errors.times.len().div_ceil(POINTS_OF_A_LINE).max(1);
    errors.times.iter().zip(&errors.rows).step_by(every).map(|(time, row)| [*time, row[joint]]).collect()
}
