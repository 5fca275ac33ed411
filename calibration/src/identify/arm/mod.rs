//! The arm: stiffness and damping of every joint, and effects on request, from clips of any kind in which it moves.
//!
//! | file | owns |
//! |---|---|
//! | `session` | which clips of a session can be used, and for what |
//! | `saturation` | where the search for a limit of the torques begins |
//! | `time_step` | what the twin's time step does to the numbers, and that it is taken out |
//! | `figures` | how far the twin is off |
//! | `verdict` | what the clips cannot tell, and why; what to record next |
//! | `doubt` | what speaks against trusting the fit |

mod doubt;
mod figures;
mod saturation;
mod session;
mod time_step;
mod verdict;

use super::error::IdentifyError;
use super::finding::Finding;
pub use super::options::Options;
use super::run::{Outcome, Run};
use super::used::Used;
use super::work::{Work, answered};
use crate::answer::identification::Identification;
use inference::controller::{controlled, start};
use inference::estimate::interval::LEVEL;
use inference::estimate::{Intervals, Subset, Unknown, at_bounds};
use inference::interrupt::Interrupt;
use inference::kept::Fingerprint;
use inference::likelihood::arm::ArmClips;
use inference::likelihood::setting::{arm_numbers, complete, effect_settings};
use inference::likelihood::{Setting, Settings};
use session::Material;
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use twin::arm::ArmModel;
use twin::effects::{EffectInfo, Robot, Stage, find, registry};

/// Said where a search ended with its budget or was stopped.
const UNFINISHED: &str = "not converged: values and intervals are those of the place where the search stopped; let pso and cma \
                          try more --points, or search for what else acts";

/// What a clip's prediction takes from a vector of numbers.
type Numbers<'a> = Box<dyn Fn(&[f64]) -> Theta + Sync + 'a>;
/// Clips, and what the twin makes of them.
type Model<'a> = ArmClips<Numbers<'a>>;

/// Identifies the arm of a session; writes theta.toml where `out` says, with everything that was known before.
///
/// # Errors
/// [`IdentifyError`] naming file, key or clip, and the remedy.
pub fn identify(options: &Options, interrupt: &Interrupt) -> Result<Identification, IdentifyError> {
    identify_material(session::open(&options.session, options.cell.as_deref())?, options, interrupt)
}

/// The same from clips in memory.
///
/// # Errors
/// As [`identify`].
pub fn identify_clips(
    cell: &Cell,
    clips: Vec<Clip>,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Identification, IdentifyError> {
    identify_material(Material { cell: cell.clone(), clips, left_out: Vec::new() }, options, interrupt)
}

fn identify_material(
    material: Material,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Identification, IdentifyError> {
    if material.cell.robot.is_none() || material.cell.controller.is_none() {
        return Err(IdentifyError::NoArm(if material.cell.robot.is_none() { "[robot]" } else { "[controller]" }));
    }
    let given = options.given()?;
    let question = options.question("arm", given.as_ref(), &material.cell, &material.clips);
    answered(options, "arm", &question, interrupt, |work| identify_kept(material, given, options, work))
}

/// The answer, and the parameters that are written.
fn identify_kept(
    Material { cell, clips, left_out }: Material,
    given: Option<Theta>,
    options: &Options,
    work: Work<'_>,
) -> Result<(Identification, Theta), IdentifyError> {
    let mut remarks = Vec::new();
    let cell = controlled(cell, &clips, given.as_ref(), &mut remarks, work.interrupt)?;
    let base = complete(&cell, given.as_ref())?;
    let (settings, mut unknowns): (Vec<_>, Vec<_>) = searched(&cell, &base, &options.also)?.into_iter().unzip();
    let settings = Settings::new(base, settings);
    let numbers: Numbers<'_> = Box::new(|shared| settings.theta(shared));
    let (model, unusable) = ArmClips::means(&cell, clips, numbers)?;
    let mut model = model.moved_by(options.engine.clone(), &complete(&cell, None)?);
    let clips = session::used(&options.session, &model, left_out, unusable, options.seed)?;
    let before: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let train = &clips.split.train;
    begin(&cell, &mut model, train, settings.settings(), &mut unknowns, work);
    let random = model.random();
    let run = Run { unknowns: &unknowns, random: &random, options, work };
    // A rough fit to a third of the clips brings the rest near for a third of the price.
    let first = Subset { model: &model, clips: &train[..train.len().div_ceil(3)] };
    let outcome = run.search(&Subset { model: &model, clips: train }, &first)?;
    let finding = finding(&model, train, settings.settings(), &run, outcome)?;
    let mut answer = finding.answer("arm", &before);
    answer.warnings.extend((!finding.arrived).then(|| UNFINISHED.to_owned()));
    figures::fill(&mut answer, &model, &clips, &random, [&before, &finding.fit.shared])?;
    answer.not_identifiable = verdict::not_identifiable(&finding, &model, &clips, options.optimizer);
    answer.warnings.extend(doubt::doubts(&answer, &finding, &model, &clips, &before));
    answer.warnings.extend(remarks);
    answer.advice = verdict::next(&finding, &clips);
    answer.warnings.extend(clips.warnings("another motion"));
    Used::add_remarks(&mut answer);
    answer.clips = clips.clips;
    // Of an object nothing was found, and where gains alone do not explain the clips, nothing at all.
    let given = given.unwrap_or_default();
    if answer.is_unexplained() {
        return Ok((answer, given));
    }
    let theta = Theta { object: given.object, others: given.others, ..settings.theta(&finding.fit.shared) };
    Ok((answer, theta))
}

/// Moves the starts to where a coarse look leads, and holds gains of joints that stand still. A joint that the others feel move only
/// reads as if it stood still: it follows its command unseen from then on, and its gains are free again.
fn begin(
    cell: &Cell,
    model: &mut Model<'_>,
    train: &[usize],
    settings: &[Setting],
    unknowns: &mut [Unknown],
    Work { kept, interrupt }: Work<'_>,
) {
    let free = unknowns.to_vec();
    session::hold_dead(model, train, settings, unknowns);
    let starts: Vec<f64> = kept.once(&Fingerprint::of("starts"), || {
        let mut unknowns = unknowns.to_vec();
        start::improve(cell, model, train, settings, &mut unknowns, interrupt);
        saturation::improve(model, train, settings, &mut unknowns, interrupt);
        unknowns.into_iter().map(|unknown| unknown.start).collect()
    });
    model.settle_dead_joints(&starts);
    for ((unknown, free), start) in unknowns.iter_mut().zip(free).zip(starts) {
        *unknown = Unknown { start, ..free };
    }
    session::hold_dead(model, train, settings, unknowns);
}

/// What a search found, the error of the twin's time step taken out and what stays open of it in the intervals.
fn finding<'a>(
    model: &Model<'_>,
    train: &[usize],
    settings: &'a [Setting],
    &Run { unknowns, random, work, .. }: &Run<'a>,
    Outcome { mut fit, simulated, convergence, arrived }: Outcome,
) -> Result<Finding<'a>, IdentifyError> {
    let error = work
        .kept
        .once_if_ok(&Fingerprint::of("time step"), || time_step::error(model, train, unknowns, random, &fit))?;
    let open = time_step::taken_out(&mut fit, unknowns, &error);
    saturation::forget_unreached(model, settings, &mut fit);
    let held = at_bounds(unknowns, &fit.shared);
    let mut intervals = Intervals::new(&fit, &held, LEVEL);
    intervals.half_width.iter_mut().zip(&open).for_each(|(half, open)| *half = half.hypot(*open));
    Ok(Finding { settings, unknowns, fit, held, intervals, simulated, convergence, arrived })
}

/// Gains, and the parameters of the effects that were asked for.
fn searched(cell: &Cell, base: &Theta, also: &[String]) -> Result<Vec<(Setting, Unknown)>, IdentifyError> {
    let mut all = arm_numbers(cell, base);
    let dof = base.arm.as_ref().map_or(0, |arm| arm.stiffness.len());
    let robot = Robot::of(&ArmModel::from_cell(cell)?);
    for name in also {
        let on_arm = |effect: &&EffectInfo| effect.stage == Stage::Control;
        let effect = find(name).filter(|effect| on_arm(effect)).ok_or_else(|| {
            let known: Vec<&str> = registry().iter().filter(on_arm).map(|effect| effect.name).collect();
            IdentifyError::Effect { given: name.clone(), known: known.join(", ") }
        })?;
        let asked = effect_settings(effect, &robot, dof).into_iter();
        let new: Vec<_> = asked.filter(|(asked, _)| all.iter().all(|(setting, _)| setting != asked)).collect();
        all.extend(new);
    }
    Ok(all)
}
