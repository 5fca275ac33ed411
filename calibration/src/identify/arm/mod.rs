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
use super::run::{Outcome, Run, Work, concluded};
use super::used::Used;
use crate::answer::identification::Identification;
use inference::controller::{controlled, start};
use inference::engine;
use inference::estimate::interval::LEVEL;
use inference::estimate::{Intervals, Random, Subset, Unknown, at_bounds};

use inference::interrupt::Interrupt;
use inference::kept;
use inference::kept::Fingerprint;
use inference::likelihood::arm::ArmClips;
use inference::likelihood::setting::{arm_numbers, complete, effect_settings};
use inference::likelihood::{Setting, Settings};
use session::Material;
use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, SessionFiles};
use shared_mem::theta::Theta;
use std::time::Instant;
use twin::arm::ArmModel;
use twin::effects::{EffectInfo, Robot, Stage, find, registry};

/// Said where a search ended with its budget or was stopped.
const UNFINISHED: &str = "the search ended before it arrived: values and intervals are those of the place where it stopped; give more \
                          budget, or search for what else acts";

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
    let began = Instant::now();
    if material.cell.robot.is_none() || material.cell.controller.is_none() {
        return Err(IdentifyError::NoArm(if material.cell.robot.is_none() { "[robot]" } else { "[controller]" }));
    }
    let given = options.parameters.as_deref().map(Theta::read).transpose()?;
    let question = Fingerprint::of("identify arm")
        .with(&(options.optimizer.name(), options.budget, options.seed, &options.also))
        .with(&given.as_ref().map(Theta::to_toml))
        .with_cell(&material.cell)
        .with(&options.engine.as_ref().map(|engine| engine.ability().print()))
        .with_clips(&material.clips);
    let kept = kept::for_work((options.out.as_deref(), &options.session, "identify_arm"), &question, interrupt);
    let work = Work { kept: &kept, interrupt };
    let found = identify_kept(material, given.as_ref(), options, work);
    concluded(found, options.out.as_deref(), began, work)
}

/// The answer, and the parameters that are written.
fn identify_kept(
    Material { cell, clips, left_out }: Material,
    given: Option<&Theta>,
    options: &Options,
    work: Work<'_>,
) -> Result<(Identification, Theta), IdentifyError> {
    let Work { kept, interrupt } = work;
    let mut remarks = Vec::new();
    let cell = controlled(cell, &clips, given, &mut remarks, interrupt)?;
    let base = complete(&cell, given)?;
    let (settings, mut unknowns): (Vec<_>, Vec<_>) = searched(&cell, &base, &options.also)?.into_iter().unzip();
    let settings = Settings::new(base, settings);
    let numbers: Numbers<'_> = Box::new(|shared| settings.theta(shared));
    let (model, unusable) = ArmClips::means(&cell, clips, numbers)?;
    let mut model = model.moved_by(options.engine.clone(), &complete(&cell, None)?);
    let clips = session::used(&options.session, &model, left_out, unusable, options.seed)?;
    let free = unknowns.clone();
    session::hold_dead(&model, &clips.split.train, settings.settings(), &mut unknowns);
    let before: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let starts: Vec<f64> = kept.once(&Fingerprint::of("starts"), || {
        let mut unknowns = unknowns.clone();
        start::improve(&cell, &model, &clips.split.train, settings.settings(), &mut unknowns, interrupt);
        saturation::improve(&model, &clips.split.train, settings.settings(), &mut unknowns, interrupt);
        unknowns.into_iter().map(|unknown| unknown.start).collect()
    });
    unknowns.iter_mut().zip(starts).for_each(|(unknown, start)| unknown.start = start);
    model.settle_dead_joints(&unknowns.iter().map(|unknown| unknown.start).collect::<Vec<_>>());
    // What moves unseen shows in its neighbours.
    for (unknown, free) in unknowns.iter_mut().zip(&free) {
        (unknown.lower, unknown.upper) = (free.lower, free.upper);
    }
    session::hold_dead(&model, &clips.split.train, settings.settings(), &mut unknowns);
    let random = model.random();
    let mut outcome = search(options, &model, &clips, (&unknowns, &random), work)?;
    let error = kept.once_if_ok(&Fingerprint::of("time step"), || {
        time_step::error(&model, &clips.split.train, (&unknowns, &random), &outcome.fit)
    });
    let open = time_step::taken_out(&mut outcome.fit, &unknowns, &error?);
    saturation::forget_unreached(&model, settings.settings(), &mut outcome.fit);
    let held = at_bounds(&unknowns, &outcome.fit.shared);
    let mut intervals = Intervals::new(&outcome.fit, &held, LEVEL);
    intervals.half_width.iter_mut().zip(&open).for_each(|(half, open)| *half = half.hypot(*open));
    let Outcome { fit, simulated, convergence, arrived } = outcome;
    let finding = Finding {
        settings: settings.settings(),
        unknowns: &unknowns,
        fit,
        held,
        intervals,
        simulated,
        convergence,
        arrived,
    };
    let mut answer = finding.answer("arm", &before);
    answer.warnings.extend((!arrived).then(|| UNFINISHED.to_owned()));
    answer.session = options.session.display().to_string();
    answer.files = SessionFiles { session: options.session.clone(), cell: options.cell.clone() };
    answer.optimizer = options.optimizer.name().into();
    figures::fill(&mut answer, &model, &clips, &random, [&before, &finding.fit.shared])?;
    answer.not_identifiable = verdict::not_identifiable(&finding, &model, &clips, options.optimizer);
    answer.warnings.extend(doubt::doubts(&answer, &finding, &model, &clips, &before));
    answer.warnings.extend(remarks);
    answer.advice = verdict::next(&finding, &clips);
    answer.warnings.extend(clips.warnings("another motion"));
    Used::add_remarks(&mut answer);
    answer.clips = clips.clips;
    answer.engine = options.engine.as_ref().map(|engine| engine.used());
    answer.warnings.extend(answer.engine.iter().flat_map(engine::Used::sentences));
    // Of an object nothing was found.
    let given = given.cloned().unwrap_or_default();
    let theta = Theta { object: given.object, others: given.others, ..settings.theta(&finding.fit.shared) };
    Ok((answer, theta))
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

fn search(
    options: &Options,
    model: &Model<'_>,
    clips: &Used,
    (unknowns, random): (&[Unknown], &[Random]),
    work: Work<'_>,
) -> Result<Outcome, IdentifyError> {
    let Work { kept, interrupt } = work;
    let run = Run {
        unknowns,
        random,
        optimizer: options.optimizer,
        seed: options.seed,
        budget: options.budget,
        kept,
        interrupt,
    };
    let train = &clips.split.train;
    let all = Subset { model, clips: train };
    // A rough fit to a third of the clips brings the rest near for a third of the price.
    let first = Subset { model, clips: &train[..train.len().div_ceil(3)] };
    run.search(&all, &first)
}
