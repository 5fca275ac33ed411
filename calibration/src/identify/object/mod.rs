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
use super::options::Optimizer;
pub use super::options::Options;
use super::run::{Outcome, Run};
use super::work::{Work, answered};
use crate::answer::identification::Identification;
use inference::controller;
use inference::estimate::Unknown;
use inference::interrupt::Interrupt;
use inference::kept::Fingerprint;
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
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use shared_mem::toml_file;
use twin::scene::{ObjectModel, ObjectShape};

/// Identifies the object; writes theta.toml where `out` says, with everything that was known before.
///
/// # Errors
/// [`IdentifyError`] naming what is wrong and the remedy.
pub fn identify(options: &Options, interrupt: &Interrupt) -> Result<Identification, IdentifyError> {
    identify_material(&Material::open(options)?, options, interrupt)
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
    identify_material(&Material::of_clips(cell.clone(), clips, options)?, options, interrupt)
}

fn identify_material(
    material: &Material,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Identification, IdentifyError> {
    let clips = || material.usable.iter().map(|usable| &usable.clip);
    if let Some(engine) = &options.engine {
        engine.admits(clips())?;
    }
    let question = options.question("object", options.given()?.as_ref(), &material.cell, clips());
    answered(options, "object", &question, interrupt, |work| identify_kept(material, options, work))
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
    answer.object = material.cell.one_of_several().map(str::to_owned);
    answer.warnings.extend(problem.warnings.iter().cloned());
    if disagreement.is_none() {
        let ended = "ended before parts of the tosses were asked: the intervals are too narrow; run it again";
        answer.warnings.push(ended.into());
    }
    figures::fill(&mut answer, material, [problem.settings.base(), &theta], (engine, &nominal))?;
    let doubts = doubt::doubts(&answer, &material.cell);
    answer.warnings.extend(doubts);
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
        let mut given = options.given()?.unwrap_or_default().about(&material.cell);
        let mut warnings = Vec::new();
        if given.arm.is_none() && material.cell.robot.is_some() {
            let clips = material.train();
            let hits: Vec<Clip> = clips.into_iter().filter(|clip| clip.kind == ClipKind::ControlHitSlide).collect();
            if !hits.is_empty() {
                warnings.push("the arm's gains were found first, from the way to the object in the same clips".into());
                let base = complete(&material.cell, Some(&given))?;
                let find = || {
                    let engine = options.engine.clone();
                    let (found, _) = controller::fitted(&material.cell, engine, &base, hits, interrupt)?;
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
        let shape = self.shape(clips)?;
        if options.optimizer == Optimizer::LeastSquares {
            return self.least_squares(clips, self.searched(&shape, options.seed), work);
        }
        let run = Run { unknowns: &self.unknowns, random: &[], options, work };
        let outcome = {
            let loss = SurfaceLoss::new(clips, &shape);
            run.search(&loss, &loss)?
        };
        let at = linearise_object(clips, &self.unknowns, &outcome.fit.shared)?;
        let widths = widths(clips, &self.unknowns, &at)?;
        let Outcome { simulated: evaluations, convergence, arrived: converged, .. } = outcome;
        Ok(ObjectFit { at, widths, evaluations, convergence, converged })
    }

    fn least_squares(
        &self,
        clips: &mut ObjectClips,
        searched: Searched<'_>,
        work: Work<'_>,
    ) -> Result<ObjectFit, IdentifyError> {
        let bar = Progress::new("identify", polish::usual_evaluations(clips, &self.unknowns) as u64);
        Ok(fit_polished(clips, searched, &self.start(), (work.kept, "fit"), |_, evaluations| {
            bar.show(evaluations as u64, &format!("{evaluations} clips simulated"));
            !work.interrupt.asked()
        })?)
    }

    /// Where the search begins.
    fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|unknown| unknown.start).collect()
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
