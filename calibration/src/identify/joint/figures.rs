//! The answer: friction and damping with their intervals, how far the twin is off, what the clips cannot tell.

use super::fit::Found;
use super::model::Motion;
use super::{Material, OfClip};
use crate::answer::Trace;
use crate::answer::identification::{ClipGap, Clips, Figures, Gap, Identification, NotIdentifiable, Parameter};
use crate::identify::figures::USE_FITTED;
use crate::identify::finding::rows;
use crate::identify::options::Optimizer;
use inference::admit::remarks::grouped;
use inference::estimate::ClipFit;
use std::collections::BTreeMap;

/// Below so many motions the interval rests on how noisy the poses are: whether friction is the same each time remains open (a choice).
const MOTIONS_TO_COMPARE: usize = 3;
/// Residuals so many times the noise are no noise (a choice).
const BEYOND_NOISE: f64 = 1.5;

/// `before` are the motions with what the URDF says, `held_out` each with what the others say.
pub(super) fn answer(
    material: &Material,
    motions: &[Motion],
    found: &Found,
    before: &[ClipFit],
    held_out: Option<&[ClipFit]>,
) -> Identification {
    let subject = &material.subject;
    let rms = |fits: &[ClipFit]| rms(subject.joint.slides, fits, motions);
    let (old, new) = (rms(before), rms(&found.fit.clips));
    let gap = Gap {
        train: new,
        train_before: old,
        holdout: held_out.map(rms).unwrap_or_default(),
        holdout_before: held_out.map(|_| old).unwrap_or_default(),
    };
    let by_clip = by_clip(material, motions, [before, held_out.unwrap_or(&found.fit.clips)], held_out.is_some());
    let train: Vec<String> = by_clip.iter().map(|clip| clip.file.clone()).collect();
    let holdout = if held_out.is_some() { train.clone() } else { Vec::new() };
    Identification {
        target: "joint".into(),
        object: Some(subject.object.clone()),
        joint: Some(subject.joint.name.clone()),
        parameters: parameters(material, found),
        not_identifiable: not_identifiable(found),
        gap,
        clips: Clips { holdout, train, left_out: material.left_out.clone() },
        by_clip,
        optimizer: Optimizer::LeastSquares.name().into(),
        evaluations: found.fit.evaluations,
        witnesses: found.intervals.witnesses,
        misfit: found.fit.misfit().sqrt(),
        converged: found.fit.converged,
        names: found.unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
        correlation: rows(&found.intervals.correlation),
        warnings: warnings(material, motions, found),
        traces: traces(material, motions, [before, &found.fit.clips], found),
        ..Identification::default()
    }
}

/// Errors of every clip with a motion, before and after; `in_turn`: each motion after by what the others say.
fn by_clip(material: &Material, motions: &[Motion], fits: [&[ClipFit]; 2], in_turn: bool) -> Vec<ClipGap> {
    let subject = &material.subject;
    let mut first = 0;
    let clip = |looked: &OfClip| {
        let own = first..first + looked.motions.len();
        first = own.end;
        let [before, after] = fits.map(|fits| rms(subject.joint.slides, &fits[own.clone()], &motions[own.clone()]));
        ClipGap {
            file: looked.file.clone(),
            used: if in_turn { "held out in turn" } else { USE_FITTED }.into(),
            joint_rms_rad: after.joint_rms_rad.into_iter().collect(),
            after,
            before,
            warnings: vec![in_words(looked, subject.units()[0])],
        }
    };
    material.looked.iter().filter(|looked| !looked.motions.is_empty()).map(clip).collect()
}

/// What fits leave of motions, of a slide in metres.
fn rms(slides: bool, fits: &[ClipFit], motions: &[Motion]) -> Figures {
    let rows: usize = fits.iter().map(|fit| fit.rows).sum();
    let sum: f64 = fits.iter().zip(motions).map(|(fit, motion)| fit.chi2 * motion.sigma.powi(2)).sum();
    let rms = Some((sum / rows.max(1) as f64).sqrt());
    if slides {
        Figures { joint_rms_m: rms, ..Figures::default() }
    } else {
        Figures { joint_rms_rad: rms, ..Figures::default() }
    }
}

fn parameters(material: &Material, found: &Found) -> BTreeMap<String, Parameter> {
    let [_, friction, damping] = material.subject.units();
    let joint = &material.subject.joint;
    let parameter = |(k, (unit, start)): (usize, (&str, f64))| {
        let parameter = Parameter {
            value: vec![found.fit.shared[k]],
            ci95: vec![found.interval(k)],
            unit: unit.into(),
            start: vec![start],
            single: true,
        };
        (found.unknowns[k].name.clone(), parameter)
    };
    [(friction, joint.friction), (damping, joint.damping)].into_iter().enumerate().map(parameter).collect()
}

fn not_identifiable(found: &Found) -> Vec<NotIdentifiable> {
    let untold =
        |k: usize| Some(NotIdentifiable { parameter: found.unknowns[k].name.clone(), why: found.open(k)?.into() });
    (0..found.unknowns.len()).filter_map(untold).collect()
}

fn in_words(looked: &OfClip, unit: &str) -> String {
    let stretch = |alone: &super::Alone| {
        let [first, last] = [alone.rows.start, alone.rows.end - 1].map(|row| looked.clip.times[row]);
        let travel = alone.motion.travel();
        format!("moves by itself from {first:.2} to {last:.2} s, over {travel:.3} {unit}")
    };
    looked.motions.iter().map(stretch).collect::<Vec<_>>().join("; ")
}

fn warnings(material: &Material, motions: &[Motion], found: &Found) -> Vec<String> {
    let subject = &material.subject;
    let mut all = vec![format!(
        "in proportion to the inertia that the URDF gives `{}` about its axis or along it, {:.4} {}",
        subject.bodies[1],
        motions[0].joint.inertia,
        if subject.joint.slides { "kg" } else { "kg m^2" }
    )];
    if motions.len() < MOTIONS_TO_COMPARE {
        all.push(format!(
            "only {} of the part: whether friction is the same each time remains open; record at least {MOTIONS_TO_COMPARE} pushes",
            if motions.len() == 1 { "one motion".to_owned() } else { format!("{} motions", motions.len()) }
        ));
    }
    if found.fit.misfit().sqrt() > BEYOND_NOISE {
        all.push(format!(
            "what is left is {:.1} times the noise of the poses: this joint is not slowed by dry friction and damping alone, or not each \
             time alike; the intervals are as much wider",
            found.fit.misfit().sqrt()
        ));
    }
    let [low, high] = found.interval(0);
    match material.holds() {
        Some([least, at]) if least > high => all.push(format!(
            "where the part rests at {at:.2} {}, dry friction would hold {least:.3} {} of its weight, more than was found: something else \
             holds it there, or its mass or centre of mass in the URDF is wrong",
            subject.units()[0],
            subject.units()[1]
        )),
        Some([least, _]) if least > low => all.extend(material.holds_in_words()),
        _ => {}
    }
    all.extend(grouped(material.left_out.iter().map(|clip| (clip.file.as_str(), clip.why.as_str()))));
    all
}

fn traces(material: &Material, motions: &[Motion], fits: [&[ClipFit]; 2], found: &Found) -> Vec<Trace> {
    let joint = &material.subject.joint;
    let files = material.looked.iter().flat_map(|looked| looked.motions.iter().map(move |alone| (looked, alone)));
    let numbers = [[joint.friction, joint.damping], found.numbers()];
    let trace = |(k, (looked, alone)): (usize, (&OfClip, &super::Alone))| {
        let motion = &motions[k];
        let from = looked.clip.times[alone.rows.start];
        let off = |which: usize| {
            let predicted = motion.predicted(numbers[which], &fits[which][k].own);
            let row = |(time, (measured, predicted)): (&f64, (&f64, &f64))| [from + time, measured - predicted];
            motion.times.iter().zip(motion.positions.iter().zip(&predicted)).map(row).collect()
        };
        Trace {
            clip: looked.file.clone(),
            channel: joint.name.clone(),
            unit: material.subject.units()[0].into(),
            sigma: motion.sigma,
            before: off(0),
            after: off(1),
        }
    };
    files.enumerate().map(trace).collect()
}
