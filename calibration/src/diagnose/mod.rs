//! Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.
//!
//! The baseline is the twin with the paper's own parameters identified. Every effect of the registry is a candidate, alone
//! and with others. Clips are split by command: parameters are fitted on some, effects chosen on others, and the shrink is
//! measured on the rest, which are opened once. The clip is the unit of evidence throughout.
//!
//! | module | step |
//! |---|---|
//! | [`admit`] | can the clips be diagnosed at all |
//! | `torques` | torques along the measured motion, where no control law is known |
//! | [`length`] | how much of long clips counts |
//! | [`split`] | which clips are for what |
//! | [`evidence`], [`arm_clips`], [`contact`], [`cell_clips`] | what is measured against the twin, and where in a clip |
//! | `deviations` | how the object of a clip deviates from any simulated path |
//! | `recent` | where a search has just been |
//! | [`scatter`] | what every clip has of its own |
//! | [`library`], [`ground`] | the candidates as numbers, and where on the table they can show |
//! | [`baseline`] | the paper's parameters identified |
//! | [`noise`], [`floor`] | how far residuals can be trusted |
//! | [`signatures`], [`sweep`], [`quadratic`] | every candidate's signature, linearised once |
//! | [`shortlist`] | how much of the gap each signature explains |
//! | [`screening`], [`arm_alone`], [`starts`], [`ripple`] | which of them are fitted, to the arm first, and where a fit begins |
//! | [`cost`], [`fit`], [`restart`] | hypotheses fitted, and restarts of clips whose own numbers are stuck in a local minimum |
//! | [`score`] | how well they predict clips: leave-one-clip-out log-likelihood |
//! | [`scatter_scale`] | how widely clips scatter under one of them |
//! | `held_out` | numbers for clips that they were not fitted to |
//! | `confirm` | whether the clips kept for confirming speak for what was found |
//! | [`closing`] | how much of the gap they close |
//! | [`combine`], [`reidentify`], [`refit`] | which effects act together |
//! | `stages` | how long each part of the search takes |
//! | [`undetermined`] | which of their numbers nothing depends on |
//! | [`remainder`], [`drift`] | what they leave |
//! | [`gap`], [`localise`], `sizes` | how large the gap is, and where |
//! | `unproven` | what more clips would prove |
//! | `tolerance` | whether a gap is of interest |
//! | `partly` | what is proven although a part of the gap stays |
//! | [`parameters`], [`confidence`], [`verdict`], [`headline`] | what is said about it |
//! | [`advice`], [`site`] | what to record next, and the commands for it |
//! | [`remedies`] | what to do about what was named |
//! | [`ranked`], `reason` | what is said of every candidate, and why |
//! | [`conclude`], [`answer`] | the answer |
//! | [`against`] | what changed between two sessions of one robot |
//! | [`command`] | the verb |

pub mod admit;
pub mod advice;
pub mod against;
pub mod answer;
pub mod arm_alone;
pub mod arm_clips;
pub mod baseline;
pub mod cell_clips;
pub mod closing;
pub mod combine;
pub mod command;
pub mod conclude;
pub mod confidence;
mod confirm;
pub mod contact;
pub mod cost;
mod deviations;
pub mod drift;
pub mod effort;
pub mod evidence;
pub mod fit;
pub mod floor;
pub mod gap;
pub mod ground;
pub mod headline;
mod held_out;
pub mod length;
pub mod library;
pub mod localise;
pub mod noise;
pub mod parameters;
mod partly;
pub mod quadratic;
pub mod ranked;
mod reason;
mod recent;
pub mod refit;
pub mod reidentify;
pub mod remainder;
pub mod remedies;
pub mod restart;
pub mod ripple;
pub mod scatter;
pub mod scatter_scale;
pub mod score;
pub mod screening;
pub mod shortlist;
pub mod signatures;
pub mod site;
mod sizes;
pub mod split;
mod stages;
pub mod starts;
pub mod sweep;
#[cfg(test)]
mod test_bench;
mod tolerance;
mod torques;
pub mod trial;
pub mod undetermined;
mod unproven;
pub mod verdict;

pub use answer::{
    Basis, Candidate, Change, Clips, Diagnosis, Gap, Kind, Nearest, Place, Remedy, Rest, Share, Size, Status,
    TorqueRms, Verdict,
};

use crate::forward::object::ObjectClips;
use crate::forward::setting::{self, BaseError};
use crate::interrupt::Interrupt;
use crate::kept::{self, Fingerprint, Kept, Trail};
use admit::{Admitted, Refused, admit};
use arm_clips::ArmClips;
use cell_clips::CellClips;
use evidence::Evidence;
use fit::Bench;
use library::Library;
use shared_mem::cell::Cell;
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use shared_mem::typed;
use split::Split;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use twin::arm::Joints;
use twin::replay::ReplayError;
use twin::sim::SimError;

/// How a session is diagnosed.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Parameters that are known already; effects among them act in the baseline.
    pub theta: Option<Theta>,
    /// Draws the split and the bootstrap.
    pub seed: u64,
    /// Whether torques along the measured motion are explained, and not how commands are followed.
    pub torques: bool,
    /// After so long the best answer so far counts.
    pub budget: Option<Duration>,
    /// Where the answer will go: what was found so far is kept beside it; else in the session's folder.
    pub out: Option<PathBuf>,
    /// Where the page will go: commands that are advised write pages of other names.
    pub report: Option<PathBuf>,
}

/// A session cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The session cannot be used.
    #[error(transparent)]
    Refused(#[from] Refused),
    /// The cell's parameters.
    #[error(transparent)]
    Base(#[from] BaseError),
    /// The cell.
    #[error(transparent)]
    Cell(#[from] SimError),
    /// A replay at the end.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The twin has no answer even where nothing is wrong.
    #[error(
        "the twin cannot follow the clips with the parameters of cell.toml; try `twin replay` and follow its advice"
    )]
    NoBaseline,
    /// Ctrl-C. What was found is kept, and the words say where.
    #[error("{0}")]
    Interrupted(String),
}

/// Diagnoses a session; what was found on the way is kept until the answer is there.
///
/// # Errors
/// [`DiagnoseError`]. Clips that do not say enough are no error but a verdict.
pub fn diagnose(session: &Session, options: &Options, interrupt: &Interrupt) -> Result<Diagnosis, DiagnoseError> {
    let (found, kept) = diagnose_kept(session, options, interrupt)?;
    kept.done();
    Ok(found)
}

/// The same, with what was found on the way: to be given up ([`Kept::done`]) once the answer is where it belongs.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_kept(
    session: &Session,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<(Diagnosis, Arc<Kept>), DiagnoseError> {
    let interrupt = &interrupt.within(options.budget);
    let tracking = if options.torques { torques::cell(&session.cell) } else { None };
    let tracking = tracking.map(|cell| Session { cell, ..session.clone() });
    let session = match &tracking {
        None if options.torques => return Err(Refused::NoModel.into()),
        None => session,
        Some(tracking) => tracking,
    };
    let admitted = admit(session);
    if interrupt.cancelled() {
        return Err(DiagnoseError::Interrupted("interrupted; start again".into()));
    }
    let admitted = match admitted {
        Err(Refused::NotTestable(why)) => {
            // A cell that cannot be simulated is an error all the same.
            setting::complete(&session.cell, options.theta.as_ref())?;
            return Ok((conclude::not_testable(session, options, &why), Arc::new(Kept::default())));
        }
        admitted => admitted?,
    };
    let question = Fingerprint::of("diagnose")
        .with(&(session.cell.to_toml(), options.theta.as_ref().map(Theta::to_toml), options.seed, options.torques))
        .with_clips(&admitted.clips);
    let kept = kept::for_work((options.out.as_deref(), &session.folder, "diagnose"), &question, interrupt);
    let found = diagnosed(session, &admitted, options, (interrupt, (&kept, "")));
    interrupt.work_is_over();
    // What work says that was cut short is no answer.
    if interrupt.cancelled() {
        return Err(DiagnoseError::Interrupted(kept.farewell(&typed::command())));
    }
    Ok((found?, kept))
}

/// Diagnoses clips that were admitted already; of the session only the cell and the name count.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose_clips(
    session: &Session,
    admitted: &Admitted,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Diagnosis, DiagnoseError> {
    let found = diagnosed(session, admitted, options, (interrupt, (Kept::nothing(), "")));
    if interrupt.cancelled() { Err(DiagnoseError::Interrupted("interrupted; start again".into())) } else { found }
}

fn diagnosed(
    session: &Session,
    admitted: &Admitted,
    options: &Options,
    work: Work<'_>,
) -> Result<Diagnosis, DiagnoseError> {
    let began = Instant::now();
    let base = setting::complete(&session.cell, options.theta.as_ref())?;
    let peaks = peaks(&session.cell, admitted, &base)?;
    let library = Library::new(&session.cell, &base, admitted.ground().as_ref(), &peaks);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let mut diagnosis = if admitted.with_object {
        let arm = ArmClips::new(&session.cell, &admitted.clips, theta).map_err(Refused::from)?;
        let object = ObjectClips::new(&session.cell, admitted.clips.clone(), library.settings.clone())?;
        let evidence = CellClips::new(Some(arm), object, &library);
        examine(&evidence, &library, session, admitted, options, work)?
    } else {
        let evidence = ArmClips::new(&session.cell, &admitted.clips, theta).map_err(Refused::from)?;
        examine(&evidence, &library, session, admitted, options, work)?
    };
    if torques::is_tracking(&session.cell) {
        diagnosis.theta = torques::without_law(diagnosis.theta, options.theta.as_ref());
    }
    diagnosis.seconds = began.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// What cuts work short, and where its steps are kept.
type Work<'a> = (&'a Interrupt, Trail<'a>);

/// The largest torque that each joint is asked for in the clips where nothing is wrong [N m].
///
/// # Errors
/// [`DiagnoseError`] when the cell has no arm, or it cannot follow the clips.
pub fn peaks(cell: &Cell, admitted: &Admitted, base: &Theta) -> Result<Joints, DiagnoseError> {
    let arm = ArmClips::new(cell, &admitted.clips, |_: &[f64]| base.clone()).map_err(Refused::from)?;
    arm.peaks(&[]).map_err(|_| DiagnoseError::NoBaseline)
}

fn examine<E: Evidence>(
    evidence: &E,
    library: &Library,
    session: &Session,
    admitted: &Admitted,
    options: &Options,
    (interrupt, trail): Work<'_>,
) -> Result<Diagnosis, DiagnoseError> {
    let bench = Bench { evidence, library, scatter: evidence.scatter(), interrupt, trail };
    let split = Split::new(&admitted.groups, options.seed);
    let plan: &[_] = if admitted.with_object { &stages::OBJECT } else { &stages::ARM };
    let bar = Progress::planned("diagnose", plan, baseline::steps(admitted));
    let baseline =
        baseline::identify(&bench, &split, &session.cell, admitted, &bar).ok_or(DiagnoseError::NoBaseline)?;
    let refined = |full: &[f64]| {
        let step = bench.step("refined").with_numbers(full);
        trail.0.once(&step, || baseline::refined(&bench, &split, &session.cell, admitted, full))
    };
    let found = combine::search(&bench, &split, baseline, &refined, &bar).ok_or(DiagnoseError::NoBaseline)?;
    let cut_short = interrupt.spent();
    bar.stage(stages::CONCLUSION, 1);
    let mut concluded = conclude::conclude(&bench, &split, &found, session, admitted, options)?;
    if interrupt.spent() {
        concluded.budget_spent = true;
        concluded.verdict = concluded.verdict.so_far(options.budget.unwrap_or_default(), cut_short);
    }
    Ok(concluded)
}
