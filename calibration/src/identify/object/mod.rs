//! The object: friction, mass, centre of mass and tip friction, from clips in which the arm hits it or it was let go.
//!
//! First the arm's gains from the way to the object in the same clips, unless they are known; then the object's numbers.
//!
//! | file | owns |
//! |---|---|
//! | `material` | a session's clips, sorted by their use |
//! | `paper` | the loss on the object's surface, for searches without slopes |
//! | `parts` | how sure tosses leave the numbers |
//! | `polish` | the last stretch to that loss |
//! | `vicinity` | the way down to it by few points |
//! | `finding` | what a fit says, number by number, and what it cannot say |
//! | `doubt` | what speaks against trusting the fit |
//! | [`compare`] | ways of searching side by side |
//! | `figures` | how far the twin is off |

pub mod compare;
mod doubt;
mod figures;
mod finding;
mod material;
mod paper;
mod parts;
mod polish;
mod vicinity;

use super::error::IdentifyError;
pub use super::options::Options;
use super::run::{Optimizer, Outcome, Run, Work, concluded};
use crate::answer::identification::Identification;
use inference::controller;
use inference::engine::Used;
use inference::estimate::Unknown;
use inference::interrupt::Interrupt;
use inference::kept::{self, Fingerprint};
use inference::likelihood::Settings;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::setting::{complete, object_parameters};
use inference::object_fit::{ObjectFit, linearise_object, widths};
use material::Material;
use paper::SurfaceLoss;
use parts::disagreement;
use polish::{Searched, fit_polished};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::progress::Progress;
use shared_mem::recording::{Clip, SessionFiles};
use shared_mem::theta::Theta;
use shared_mem::toml_file;
use std::time::Instant;
use twin::scene::{ObjectModel, ObjectShape};

/// Identifies the object; writes theta.toml where `out` says, with everything that was known before.
///
/// # Errors
/// [`IdentifyError`] naming what is wrong and the remedy.
pub fn identify(options: &Options, interrupt: &Interrupt) -> Result<Identification, IdentifyError> {
    let began = Instant::now();
    let material = Material::open(options)?;
    let parameters = options.parameters.as_deref().map(Theta::read).transpose()?;
    let engine = options.engine.as_ref();
    if let Some(engine) = engine {
        engine.admits(material.usable.iter().map(|usable| &usable.clip))?;
    }
    let question = Fingerprint::of("identify object")
        .with(&(options.optimizer.name(), options.budget, options.seed))
        .with(&parameters.map(|theta| theta.to_toml()))
        .with_cell(&material.cell)
        .with(&engine.map(|engine| engine.ability().print()))
        .with_clips(material.usable.iter().map(|usable| &usable.clip));
    let kept = kept::for_work((options.out.as_deref(), &options.session, "identify_object"), &question, interrupt);
    let work = Work { kept: &kept, interrupt };
    concluded(identify_kept(&material, options, work), options.out.as_deref(), began, work)
}

/// The same from clips in memory; nothing is kept or written.
///
/// # Errors
/// As [`identify`].
pub fn identify_clips(
    cell: &Cell,
    clips: Vec<Clip>,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Identification, IdentifyError> {
    let began = Instant::now();
    let material = Material::of_clips(cell.clone(), clips, options)?;
    let (mut answer, _) = identify_kept(&material, options, Work::passing(interrupt))?;
    answer.seconds = began.elapsed().as_secs_f64();
    Ok(answer)
}

/// The answer, and the parameters that are written.
fn identify_kept(
    material: &Material,
    options: &Options,
    work: Work<'_>,
) -> Result<(Identification, Theta), IdentifyError> {
    let problem = Problem::new(material, options, work)?;
    let (engine, nominal) = (options.engine.as_ref(), complete(&material.cell, None)?);
    let clips = ObjectClips::new(&material.cell, material.train(), problem.settings.clone())?;
    let mut clips = clips.simulated_by(engine, &nominal);
    let found = problem.search(&mut clips, options, work)?;
    let disagreement = disagreement(&found.at.shared, &clips, &problem, work)?;
    let finding = finding::finding(&problem, &found, disagreement.as_deref().unwrap_or_default());
    let theta = problem.settings.theta(&found.at.shared);
    let mut answer = finding::answer(&finding, &found.at.weights, material);
    answer.session = options.session.display().to_string();
    answer.files = SessionFiles { session: options.session.clone(), cell: options.cell.clone() };
    answer.object = material.cell.one_of_several().map(str::to_owned);
    answer.optimizer = options.optimizer.name().into();
    answer.warnings.extend(problem.warnings.iter().cloned());
    if disagreement.is_none() {
        answer
            .warnings
            .push("ended before parts of the tosses were asked: the intervals are too narrow; run it again".into());
    }
    figures::fill(&mut answer, material, [problem.settings.base(), &theta], (engine, &nominal))?;
    let doubts = doubt::doubts(&answer, &material.cell);
    answer.warnings.extend(doubts);
    answer.engine = engine.map(|engine| engine.used());
    answer.warnings.extend(answer.engine.iter().flat_map(Used::sentences));
    // Gains of cell.toml were not found.
    let theta = Theta { arm: problem.known.arm.clone(), ..theta };
    Ok((answer, theta))
}

/// What is searched, and what is known.
struct Problem {
    settings: Settings,
    unknowns: Vec<Unknown>,
    /// What was given, with the gains that were found first.
    known: Theta,
    warnings: Vec<String>,
}

impl Problem {
    fn new(material: &Material, options: &Options, work: Work<'_>) -> Result<Self, IdentifyError> {
        let Work { kept, interrupt } = work;
        let mut given = options.parameters.as_deref().map(Theta::read).transpose()?.unwrap_or_default();
        given = given.about(&material.cell);
        let mut warnings = Vec::new();
        if given.arm.is_none() && material.cell.robot.is_some() {
            let clips = material.train();
            let hits: Vec<Clip> = clips.into_iter().filter(|clip| clip.kind == ClipKind::ControlHitSlide).collect();
            if !hits.is_empty() {
                warnings.push("the arm's gains were found first, from the way to the object in the same clips".into());
                let by = (&material.cell, options.engine.clone());
                let base = complete(&material.cell, Some(&given))?;
                let find = || {
                    let (found, _) = controller::fitted(by, &base, hits, interrupt)?;
                    Ok::<_, IdentifyError>(Theta { arm: found.arm, ..given.clone() })
                };
                // As text: what a person may read a number of effects in is no plain list of fields.
                let text = kept.once_if_ok(&Fingerprint::of("gains"), || find().map(|theta| theta.to_toml()))?;
                given = toml_file::parse::<Theta>(&text, std::path::Path::new("theta.toml"))?.about(&material.cell);
            }
        }
        let base = complete(&material.cell, Some(&given))?;
        let (settings, unknowns) = searched(&material.cell, base);
        Ok(Self { settings, unknowns, known: given, warnings })
    }

    fn search(&self, clips: &mut ObjectClips, options: &Options, work: Work<'_>) -> Result<ObjectFit, IdentifyError> {
        let run = Run {
            unknowns: &self.unknowns,
            random: &[],
            optimizer: options.optimizer,
            seed: options.seed,
            budget: options.budget,
            kept: work.kept,
            interrupt: work.interrupt,
        };
        if options.optimizer == Optimizer::LeastSquares {
            return self.least_squares(clips, &run);
        }
        let shape = self.shape(clips)?;
        let outcome = {
            let loss = SurfaceLoss::new(clips, &shape);
            run.search(&loss, &loss)?
        };
        let at = linearise_object(clips, &self.unknowns, &outcome.fit.shared)?;
        let widths = widths(clips, &self.unknowns, &at)?;
        let Outcome { simulated: evaluations, convergence, arrived: converged, .. } = outcome;
        Ok(ObjectFit { at, widths, evaluations, convergence, converged })
    }

    fn least_squares(&self, clips: &mut ObjectClips, run: &Run<'_>) -> Result<ObjectFit, IdentifyError> {
        let start: Vec<f64> = self.unknowns.iter().map(|unknown| unknown.start).collect();
        let bar = Progress::new("identify", polish::usual_evaluations(clips, &self.unknowns) as u64);
        let shape = self.shape(clips)?;
        let trail = (run.kept, "fit");
        Ok(fit_polished(clips, self.searched(&shape, run.seed), &start, trail, |_, evaluations| {
            bar.show(evaluations as u64, &format!("{evaluations} clips simulated"));
            !run.interrupt.asked()
        })?)
    }

    fn searched<'a>(&'a self, shape: &'a ObjectShape, seed: u64) -> Searched<'a> {
        Searched { unknowns: &self.unknowns, settings: self.settings.settings(), shape, seed }
    }

    fn shape(&self, clips: &ObjectClips) -> Result<ObjectShape, IdentifyError> {
        Ok(ObjectModel::new(clips.cell(), Some(self.settings.base()))?.ok_or(IdentifyError::NoObject)?.shape)
    }
}

/// What is searched of an object.
fn searched(cell: &Cell, base: Theta) -> (Settings, Vec<Unknown>) {
    let (settings, unknowns): (Vec<_>, Vec<_>) = object_parameters(cell, &base).into_iter().unzip();
    (Settings::new(base, settings), unknowns)
}
