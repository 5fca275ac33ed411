//! How far the twin is off in every clip, by the figures of `twin replay`.

use super::ObjectError;
use super::material::Material;
use crate::identify::answer::{ClipGap, Figures, Identification};
use rayon::prelude::*;
use shared_mem::theta::Theta;
use twin::replay::{Gap, Replayer};

/// Figures of every clip before and after, and their means over clips fitted and held out.
pub(super) fn fill(
    answer: &mut Identification,
    material: &Material,
    [before, after]: [&Theta; 2],
) -> Result<(), ObjectError> {
    let gaps = |theta: &Theta| -> Result<Vec<Gap>, ObjectError> {
        let replayer = Replayer::new(&material.cell, Some(theta))?;
        let gap = |usable: &super::material::Usable| Ok(replayer.replay(usable.clip.clone())?.2.gap);
        material.usable.par_iter().map(gap).collect()
    };
    let (before, after) = (gaps(before)?, gaps(after)?);
    for (clip, usable) in material.usable.iter().enumerate() {
        let held_out = material.split.holdout.contains(&clip);
        answer.by_clip.push(ClipGap {
            file: usable.file.clone(),
            used: if held_out { "held out" } else { "fitted" }.into(),
            joint_rms_rad: after[clip].joint_rms_rad.clone().unwrap_or_default(),
            after: figures(&after[clip]),
            before: figures(&before[clip]),
            warnings: usable.remarks.clone(),
        });
    }
    let mean = |numbers: &[usize], gaps: &[Gap]| {
        Figures::mean(&numbers.iter().map(|clip| figures(&gaps[*clip])).collect::<Vec<_>>())
    };
    let (train, holdout) = (&material.split.train, &material.split.holdout);
    (answer.gap.train, answer.gap.train_before) = (mean(train, &after), mean(train, &before));
    (answer.gap.holdout, answer.gap.holdout_before) = (mean(holdout, &after), mean(holdout, &before));
    Ok(())
}

fn figures(gap: &Gap) -> Figures {
    let rms = |joints: &Vec<f64>| (joints.iter().map(|v| v * v).sum::<f64>() / joints.len().max(1) as f64).sqrt();
    Figures {
        joint_rms_rad: gap.joint_rms_rad.as_ref().map(rms),
        joint_norm_rad: None,
        object_add_m: gap.object_add_m,
        object_add_s_m: gap.object_add_s_m,
    }
}
