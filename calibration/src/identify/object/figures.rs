//! How far the twin is off in every clip, by the figures of `twin replay`.

use super::material::Material;
use crate::answer::Trace;
use crate::answer::identification::{ClipGap, Figures, Identification};
use crate::identify::error::IdentifyError;
use crate::identify::figures::{USE_FITTED, USE_HELD_OUT, gap};
use inference::engine::Engine;
use inference::likelihood::object::Replays;
use rayon::prelude::*;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use shared_mem::time::seconds_between;
use std::sync::Arc;
use twin::replay::{Gap, Prediction};

/// Measured less predicted position of the object, along x and y of the base frame.
pub(super) type Path = [Vec<[f64; 2]>; 2];

/// Another program where it simulates in place of the twin, and the cell's nominal parameters.
pub(super) type By<'a> = (Option<&'a Arc<Engine>>, &'a Theta);

/// Figures of every clip before and after, and their means over clips fitted and held out.
pub(super) fn fill(
    answer: &mut Identification,
    material: &Material,
    [before, after]: [&Theta; 2],
    by: By<'_>,
) -> Result<(), IdentifyError> {
    let ((before, paths_before), (after, paths_after)) = (gaps(material, before, by)?, gaps(material, after, by)?);
    let files = material.usable.iter().map(|usable| usable.file.as_str());
    let paths = files.zip(paths_before).zip(paths_after);
    answer.traces = paths.flat_map(|((file, before), after)| traces(file, material, before, after)).collect();
    for (clip, usable) in material.usable.iter().enumerate() {
        let held_out = material.used.split.confirm.contains(&clip);
        answer.by_clip.push(ClipGap {
            file: usable.file.clone(),
            used: if held_out { USE_HELD_OUT } else { USE_FITTED }.into(),
            joint_rms_rad: after[clip].joint_rms_rad.clone().unwrap_or_default(),
            after: figures(&after[clip]),
            before: figures(&before[clip]),
            warnings: usable.remarks.clone(),
        });
    }
    answer.gap = gap(&answer.by_clip);
    Ok(())
}

fn path(clip: &Clip, prediction: &Prediction) -> Path {
    let along = |axis: usize| {
        let poses = clip.object.poses.iter().zip(&prediction.object);
        let distance = poses.map(|(measured, predicted)| measured.position()[axis] - predicted.position()[axis]);
        let seconds = clip.object.stamps_ns.iter().map(|stamp| seconds_between(clip.object.stamps_ns[0], *stamp));
        seconds.zip(distance).map(|(at, distance)| [at, distance]).collect()
    };
    [along(0), along(1)]
}

fn traces(file: &str, material: &Material, before: Path, after: Path) -> impl Iterator<Item = Trace> {
    let noise = material.cell.object().and_then(|object| object.pose_noise.as_ref());
    let sigma = noise.map_or(0.0, |noise| noise.position);
    let file = file.to_owned();
    ["x", "y"].into_iter().zip(before.into_iter().zip(after)).map(move |(axis, (before, after))| Trace {
        clip: file.clone(),
        channel: axis.into(),
        unit: "m".into(),
        sigma,
        before,
        after,
    })
}

/// Gap of every clip, and what is left of its object's path.
pub(super) fn gaps(material: &Material, theta: &Theta, by: By<'_>) -> Result<(Vec<Gap>, Vec<Path>), IdentifyError> {
    let replays = Replays::new(&material.cell, theta, by)?;
    let replayed = |usable: &inference::admit::Usable| -> Result<(Gap, Path), IdentifyError> {
        let (clip, prediction, report) = replays.replay(usable.clip.clone())?;
        Ok((report.gap, path(&clip, &prediction)))
    };
    let done: Vec<(Gap, Path)> = material.usable.par_iter().map(replayed).collect::<Result<_, _>>()?;
    Ok(done.into_iter().unzip())
}

/// The figures of a gap.
pub(super) fn figures(gap: &Gap) -> Figures {
    let rms = |joints: &Vec<f64>| (joints.iter().map(|v| v * v).sum::<f64>() / joints.len().max(1) as f64).sqrt();
    Figures {
        joint_rms_rad: gap.joint_rms_rad.as_ref().map(rms),
        joint_norm_rad: None,
        object_add_m: gap.object_add_m,
        object_add_s_m: gap.object_add_s_m,
        ..Figures::default()
    }
}
