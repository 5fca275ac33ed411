//! Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.
//!
//! The baseline is the twin with the paper's own parameters identified. Every effect of the registry is a candidate, alone
//! and with others. Clips are split by command: parameters are fitted on some, effects chosen on others, and the shrink is
//! measured on the rest, which are opened once. The clip is the unit of evidence throughout.
//!
//! | module | step |
//! |---|---|
//! | [`admit`] | can the clips be diagnosed at all |
//! | [`length`] | how much of long clips counts |
//! | [`split`] | which clips are for what |
//! | [`evidence`], [`arm_clips`], [`cell_clips`] | what is measured against the twin, and where in a clip |
//! | [`scatter`] | what every clip has of its own |
//! | [`library`], [`ground`] | the candidates as numbers, and where on the table they can show |
//! | [`baseline`] | the paper's parameters identified |
//! | [`noise`], [`floor`] | how far residuals can be trusted |
//! | [`sweep`], [`quadratic`] | every candidate's signature, linearised once |
//! | [`shortlist`] | how much of the gap each signature explains |
//! | [`worthy`], [`arm_alone`], [`starts`], [`ripple`] | which of them are fitted, to the arm first, and where a fit begins |
//! | [`fit`], [`freed`] | hypotheses fitted, and clips whose own numbers got stuck |
//! | [`score`] | how well they foretell clips |
//! | [`straying`] | how far clips stray under one of them |
//! | [`closing`] | how much of the gap they close |
//! | [`combine`], [`again`], [`settle`] | which effects act together |
//! | [`flat`] | which of their numbers nothing depends on |
//! | [`leftovers`], [`drift`] | what they leave |
//! | [`gap`], [`localise`] | how large the gap is, and where |
//! | [`parameters`], [`confidence`], [`verdict`] | what is said about it |
//! | [`advice`], [`site`] | what to record next, and the commands for it |
//! | [`remedies`] | what to do about what was named |
//! | [`ranked`] | what is said of every candidate |
//! | [`conclude`], [`answer`] | the answer |
//! | [`command`] | the verb |

pub mod admit;
pub mod advice;
pub mod again;
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
pub mod drift;
pub mod evidence;
pub mod fit;
pub mod flat;
pub mod floor;
pub mod freed;
pub mod gap;
pub mod ground;
pub mod leftovers;
pub mod length;
pub mod library;
pub mod localise;
pub mod noise;
pub mod parameters;
pub mod quadratic;
pub mod ranked;
pub mod remedies;
pub mod ripple;
pub mod scatter;
pub mod score;
pub mod settle;
pub mod shortlist;
pub mod site;
pub mod split;
pub mod starts;
pub mod straying;
pub mod sweep;
#[cfg(test)]
mod test_bench;
pub mod verdict;
pub mod worthy;

pub use remedies::Remedy;

pub use answer::{Candidate, Change, Clips, Diagnosis, Gap, Kind, Nearest, Place, Share, Size, Status, Verdict};

use crate::forward::object::ObjectClips;
use crate::forward::setting::{self, BaseError};
use crate::interrupt::Interrupt;
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
use split::Split;
use std::time::Instant;
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
    /// Ctrl-C.
    #[error("interrupted; nothing was written, start again")]
    Interrupted,
}

/// Diagnoses a session.
///
/// # Errors
/// [`DiagnoseError`]. Clips that do not say enough are no error but a verdict.
pub fn diagnose(session: &Session, options: &Options, interrupt: &Interrupt) -> Result<Diagnosis, DiagnoseError> {
    let admitted = admit(session);
    if interrupt.asked() {
        return Err(DiagnoseError::Interrupted);
    }
    match admitted {
        Err(Refused::NotTestable(why)) => {
            let base = setting::complete(&session.cell, options.theta.as_ref())?;
            Ok(conclude::not_testable(session, options, base, &why))
        }
        admitted => diagnose_clips(session, &admitted?, options, interrupt),
    }
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
    let began = Instant::now();
    let base = setting::complete(&session.cell, options.theta.as_ref())?;
    let peaks = peaks(&session.cell, admitted, &base)?;
    let library = Library::new(&session.cell, &base, admitted.ground().as_ref(), &peaks);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let mut diagnosis = if admitted.with_object {
        let arm = ArmClips::new(&session.cell, &admitted.clips, theta).map_err(Refused::from)?;
        let object = ObjectClips::new(&session.cell, admitted.clips.clone(), library.settings.clone())?;
        let evidence = CellClips::new(Some(arm), object, &library);
        examine(&evidence, &library, session, admitted, options, interrupt)?
    } else {
        let evidence = ArmClips::new(&session.cell, &admitted.clips, theta).map_err(Refused::from)?;
        examine(&evidence, &library, session, admitted, options, interrupt)?
    };
    diagnosis.seconds = began.elapsed().as_secs_f64();
    Ok(diagnosis)
}

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
    interrupt: &Interrupt,
) -> Result<Diagnosis, DiagnoseError> {
    let bench = Bench { evidence, library, scatter: evidence.scatter(), interrupt };
    let split = Split::new(&admitted.groups, options.seed);
    let bar = Progress::new("diagnose", 100);
    bar.show(0, "baseline");
    let baseline = baseline::identify(&bench, &split, &session.cell, admitted).ok_or(DiagnoseError::NoBaseline)?;
    let refined = |full: &[f64]| baseline::refined(&bench, &split, &session.cell, admitted, full);
    let found = combine::search(&bench, &split, baseline, &refined, &bar).ok_or(DiagnoseError::NoBaseline)?;
    if interrupt.asked() {
        return Err(DiagnoseError::Interrupted);
    }
    bar.show(97, "confirm");
    let concluded = conclude::conclude(&bench, &split, &found, session, admitted, options);
    if interrupt.asked() { Err(DiagnoseError::Interrupted) } else { concluded }
}
