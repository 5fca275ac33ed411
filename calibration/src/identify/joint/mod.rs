//! The joint of an object that moves in itself, a laptop's hinge or a drawer's slide: its dry friction and its damping, from clips in
//! which the part moves by itself after a push.
//!
//! Positions come out of the poses of the part and of what carries it; weight and inertia are those of the URDF, so what is found is in
//! proportion to its masses.
//!
//! | file | owns |
//! |---|---|
//! | `subject` | which joint, its file, its part |
//! | `positions` | where the joint is over a clip |
//! | `noise` | how noisy that is |
//! | `model` | what friction and damping make of a motion, and whether what they leave is noise |
//! | `alone` | where in a clip the part moves by itself |
//! | `together` | beginnings cut off and motions left out on which not all agree |
//! | `fit` | both numbers, their intervals, what is not identifiable |
//! | `figures` | the answer |

mod alone;
mod figures;
mod fit;
mod model;
mod noise;
mod positions;
mod subject;
#[cfg(test)]
mod test_answer;
#[cfg(test)]
mod test_motions;
#[cfg(test)]
mod test_positions;
#[cfg(test)]
mod tests;
mod together;

use super::error::IdentifyError;
use crate::answer::identification::Identification;
use alone::Alone;
use fit::{Found, held_out, scored};
use inference::admit::remarks::reasons;
use inference::admit::{LeftOut, Looked, Usable};
use inference::interrupt::Interrupt;
use model::{Motion, travel};
use noise::Noise;
use positions::Positions;
use rayon::prelude::*;
use shared_mem::output;
use shared_mem::progress::Progress;
use shared_mem::recording::{Clip, Session};
use std::path::{Path, PathBuf};
use std::time::Instant;
use subject::Subject;
use twin::arm::{with_files_found_from, with_joint_friction};
use twin::world::LoneJoint;

/// Said of a user's end.
const INTERRUPTED: &str = "interrupted; it takes seconds, and the same command begins anew";
/// A part that rests nearer than this to the end of its joint's range may lie on a stop, as a share of the range (a choice).
const NEAR_A_STOP: f64 = 0.02;

#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The session's folder, or a clip beside a cell.toml.
    pub session: PathBuf,
    /// The cell.toml, where it does not lie beside the clips.
    pub cell: Option<PathBuf>,
    /// Of several objects that move in themselves the one in question.
    pub object: Option<String>,
    /// Of several joints the one in question.
    pub joint: Option<String>,
    /// Where the URDF with what was found goes.
    pub out: Option<PathBuf>,
}

/// A clip, and the motions in it.
struct OfClip {
    file: String,
    clip: Positions,
    motions: Vec<Alone>,
    /// Largest load that friction holds where the part rests [N m or N], and where that is.
    holds: Option<[f64; 2]>,
}

/// What a session has of the joint.
struct Material {
    subject: Subject,
    noise: Noise,
    looked: Vec<OfClip>,
    left_out: Vec<LeftOut>,
}

/// Finds friction and damping of a joint.
///
/// # Errors
/// [`IdentifyError`] in one line.
pub fn identify(options: &Options, interrupt: &Interrupt) -> Result<Identification, IdentifyError> {
    let begun = Instant::now();
    let session = Session::open_with(&options.session, options.cell.as_deref())?;
    let bar = Progress::new("joint", 4);
    let mut material = material(&session, options)?;
    bar.show(1, "motions");
    material.cut_to_agree();
    let motions: Vec<Motion> =
        material.looked.iter().flat_map(|looked| looked.motions.iter().map(|alone| alone.motion.clone())).collect();
    if motions.is_empty() {
        return Err(no_motion(&session, &material));
    }
    let go_on = || if interrupt.asked() { Err(IdentifyError::Interrupted(INTERRUPTED.into())) } else { Ok(()) };
    go_on()?;
    let known = [material.subject.joint.friction, material.subject.joint.damping];
    let part = || IdentifyError::NoFit(material.subject.bodies[1].clone());
    let found = Found::of(&motions, &material.noise).ok_or_else(part)?;
    bar.show(2, "held out");
    go_on()?;
    let before = scored(&motions, known).ok_or_else(part)?;
    let held_out = held_out(&motions);
    bar.show(3, "answer");
    go_on()?;
    let mut answer = figures::answer(&material, &motions, &found, &before, held_out.as_deref());
    answer.session = session.folder.display().to_string();
    answer.files = session.files.clone();
    if let Some(out) = &options.out {
        write(out, &material.subject, &found, &mut answer)?;
    }
    answer.seconds = begun.elapsed().as_secs_f64();
    Ok(answer)
}

fn material(session: &Session, options: &Options) -> Result<Material, IdentifyError> {
    let subject = Subject::of(&session.cell, options.object.as_deref(), options.joint.as_deref())
        .map_err(IdentifyError::Subject)?;
    let in_question = session.cell.object_name();
    let look = |clip: Clip| Ok((Positions::of(&clip, in_question, &subject)?, Vec::new()));
    let Looked { usable, mut left_out } = Looked::of_session(session, |_| true, look);
    let noise = Noise::of(usable.iter().map(|usable| usable.clip.positions.as_slice()));
    let looked: Vec<OfClip> = usable.into_par_iter().map(|usable| OfClip::of(usable, &subject, &noise)).collect();
    for clip in looked.iter().filter(|looked| looked.motions.is_empty()) {
        left_out.push(LeftOut { file: clip.file.clone(), why: clip.why_none() });
    }
    Ok(Material { subject, noise, looked, left_out })
}

impl OfClip {
    fn of(Usable { file, clip, .. }: Usable<Positions>, subject: &Subject, noise: &Noise) -> Self {
        let joint = LoneJoint::new(&subject.joint, &subject.part, &clip.carrier);
        let motions = alone::motions(&clip, &joint, noise);
        let [low, high] = subject.joint.limits;
        // What lies on a stop is held by that, whatever the friction.
        let edge = (NEAR_A_STOP * (high - low)).max(3.0 * noise.sigma);
        let free = alone::rests(&clip, noise).into_iter().filter(|at| (low + edge..high - edge).contains(at));
        let holds = free.map(|at| [joint.load(at).abs(), at]).max_by(|a, b| a[0].total_cmp(&b[0]));
        Self { file, clip, motions, holds }
    }

    fn why_none(&self) -> String {
        format!(
            "moves by {:.2} in all, and no stretch at the end of a motion is long enough that friction and weight alone explain: let go \
             of the part while it moves",
            travel(&self.clip.positions)
        )
    }
}

impl Material {
    /// Leaves of the motions what one friction and one damping explain, and leaves out those that the others contradict.
    fn cut_to_agree(&mut self) {
        let own = self.looked.iter().enumerate();
        let (mut clips, mut all): (Vec<usize>, Vec<Alone>) =
            own.flat_map(|(clip, looked)| looked.motions.iter().map(move |alone| (clip, alone.clone()))).unzip();
        loop {
            together::cut_to_agree(&mut all, &self.noise);
            let motions: Vec<Motion> = all.iter().map(|alone| alone.motion.clone()).collect();
            let Some(odd) = together::odd(&motions) else { break };
            let (clip, from) = (clips.remove(odd), all.remove(odd).rows.start);
            let OfClip { file, clip: Positions { times, .. }, .. } = &self.looked[clip];
            let why = format!(
                "the motion from {:.2} s on is left out: friction that explains the others does not explain it",
                times[from]
            );
            self.left_out.push(LeftOut { file: file.clone(), why });
        }
        self.looked.iter_mut().for_each(|looked| looked.motions.clear());
        clips.into_iter().zip(all).for_each(|(clip, alone)| self.looked[clip].motions.push(alone));
    }

    /// Least friction that the rests show: what it holds, and where.
    fn holds(&self) -> Option<[f64; 2]> {
        let all = self.looked.iter().filter_map(|looked| looked.holds);
        all.max_by(|a, b| a[0].total_cmp(&b[0]))
    }

    /// What it rests on, in words.
    fn holds_in_words(&self) -> Option<String> {
        let [least, at] = self.holds()?;
        let [unit, torque, _] = self.subject.units();
        Some(format!(
            "where the part rests at {at:.2} {unit}, dry friction holds {least:.3} {torque} of its weight: it is at least that"
        ))
    }
}

fn no_motion(session: &Session, material: &Material) -> IdentifyError {
    let mut why = reasons(&material.left_out);
    if let Some(holds) = material.holds_in_words() {
        why = format!("{why}; {holds}");
    }
    IdentifyError::NoMotion {
        session: session.folder.display().to_string(),
        part: material.subject.bodies[1].clone(),
        why,
    }
}

/// The URDF with what was found; nothing is written where the clips do not even tell what slows the part in all.
fn write(out: &Path, subject: &Subject, found: &Found, answer: &mut Identification) -> Result<(), IdentifyError> {
    if !found.tells_sum() {
        answer.warnings.push(format!("{} is not written: the clips do not tell what slows the part", out.display()));
        return Ok(());
    }
    let text = with_joint_friction(&subject.text, &subject.file, &subject.joint.name, found.numbers())?;
    output::write(out, with_files_found_from(&text, &subject.file, out)?)?;
    answer.warnings.push(format!(
        "{} is the URDF with what was found: give it as `urdf` of the object, or of a task's [[articulated]]",
        out.display()
    ));
    Ok(())
}
