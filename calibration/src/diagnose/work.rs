//! What the diagnosis of one session and the comparison of two share: how they are asked, why they fail, what cuts their work short
//! and keeps its steps, and the bench on which the clips lie.

use super::fit::bench::Bench;
use super::ground::Ground;
use super::library::Library;
use inference::admit::{Admitted, Refused};
use inference::controller::ControllerError;
use inference::engine::{Engine, EngineError};
use inference::interrupt::Interrupt;
use inference::kept::{self, Fingerprint, Kept, Trail};
use inference::likelihood::arm::ArmClips;
use inference::likelihood::cell::CellClips;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::setting::{self, BaseError};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use shared_mem::typed;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
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
    /// Another program that simulates arm and object in place of the twin.
    pub engine: Option<Arc<Engine>>,
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
    /// The law that leads the arm cannot be found.
    #[error(transparent)]
    Law(#[from] ControllerError),
    /// The engine cannot be asked for these clips.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// Ctrl-C. What was found is kept, and the words say where.
    #[error("{0}")]
    Interrupted(String),
}

/// What cuts work short, and where its steps are kept.
pub(super) type Work<'a> = (&'a Interrupt, Trail<'a>);

/// Work whose steps are kept in a folder, or beside where the answer goes, for as long as its `question` is asked.
pub(super) fn kept<R>(
    name: &str,
    options: &Options,
    folder: &Path,
    question: &Fingerprint,
    interrupt: &Interrupt,
    work: impl FnOnce(Work<'_>) -> Result<R, DiagnoseError>,
) -> Result<(R, Arc<Kept>), DiagnoseError> {
    let kept = kept::for_work(options.out.as_deref(), folder, name, question, interrupt);
    let found = work((interrupt, (&kept, "")));
    interrupt.work_is_over();
    // What work says that was cut short is no answer.
    if interrupt.cancelled() {
        return Err(DiagnoseError::Interrupted(kept.farewell(&typed::command())));
    }
    Ok((found?, kept))
}

/// Work of which nothing is kept.
pub(super) fn passing<R>(
    interrupt: &Interrupt,
    work: impl FnOnce(Work<'_>) -> Result<R, DiagnoseError>,
) -> Result<R, DiagnoseError> {
    let found = work((interrupt, (Kept::nothing(), "")));
    if interrupt.cancelled() { Err(cut_short()) } else { found }
}

/// Of work of which nothing is kept.
pub(super) fn cut_short() -> DiagnoseError {
    DiagnoseError::Interrupted("interrupted; start again".into())
}

/// What is asked of clips, of an arm alone or of one with an object.
pub(super) trait Question {
    type Answer;

    fn examine(&self, bench: &Bench<'_>) -> Result<Self::Answer, DiagnoseError>;
}

/// Asks clips of a cell with all effects that they may show.
pub(super) fn ask<Q: Question>(
    question: &Q,
    cell: &Cell,
    admitted: &Admitted,
    options: &Options,
    (interrupt, trail): Work<'_>,
) -> Result<Q::Answer, DiagnoseError> {
    let base = setting::complete(cell, options.theta.as_ref())?;
    let peaks = peaks(cell, admitted, &base)?;
    let library = Library::new(cell, &base, Ground::crossed(admitted).as_ref(), &peaks);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let (engine, nominal) = (options.engine.as_ref(), setting::complete(cell, None)?);
    let arm = cell.robot.as_ref().map(|_| ArmClips::moments(cell, &admitted.clips, theta)).transpose();
    let arm = arm.map_err(Refused::from)?.map(|arm| arm.moved_by(engine.cloned(), &nominal));
    match arm {
        Some(arm) if !admitted.with_object => question.examine(&Bench::new(&arm, &library, interrupt, trail)),
        arm => {
            let object = ObjectClips::new(cell, admitted.clips.clone(), library.settings.clone())?;
            let object = object.simulated_by(engine, &nominal);
            let evidence = CellClips::new(arm, object, |numbers: &[f64]| library.felt_by_arm(numbers));
            question.examine(&Bench::new(&evidence, &library, interrupt, trail))
        }
    }
}

/// The largest torque that each joint is asked for in the clips where nothing is wrong [N m].
///
/// # Errors
/// [`DiagnoseError`] when the arm cannot follow the clips; where there is none, nothing is asked for.
pub fn peaks(cell: &Cell, admitted: &Admitted, base: &Theta) -> Result<Joints, DiagnoseError> {
    if cell.robot.is_none() {
        return Ok(Joints::default());
    }
    let arm = ArmClips::moments(cell, &admitted.clips, |_: &[f64]| base.clone()).map_err(Refused::from)?;
    arm.peaks(&[]).map_err(|_| DiagnoseError::NoBaseline)
}
