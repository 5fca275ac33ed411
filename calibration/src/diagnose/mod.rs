//! Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.
//!
//! The baseline is the twin with the paper's own parameters identified. Every effect of the registry is a candidate, alone
//! and with others. Clips are split by command: parameters are fitted on some, effects chosen on others, and the shrink is
//! measured on the rest, which are opened once. The clip is the unit of evidence throughout.
//!
//! Which clips are diagnosed, and what each is for, is said in [`inference::admit`].
//!
//! | folder | step |
//! |---|---|
//! | [`criteria`] | the measured numbers that decide |
//! | [`library`], [`ground`], `known_gains` | the candidates as numbers; where on the table objects slid; how far gains stated by value may be off |
//! | [`fit`] | hypotheses linearised around clips and fitted to them |
//! | [`select`] | extensions of a model taken on while clips that were not fitted are predicted better |
//! | [`judge`] | how well a hypothesis predicts clips, how much of the gap it closes, how sure that is, and what is left |
//! | [`propose`] | which candidates are tried, on what, and where their fits begin |
//! | [`search`] | from the identified baseline to the effects that act together |
//! | [`conclude`] | the verdict in words and numbers, what to do about it, and what to record next |
//! | [`against`] | what changed between two sessions of one robot |
//!
//! Each needs only those above it.

pub mod against;
pub mod conclude;
pub mod criteria;
pub mod fit;
pub mod ground;
pub mod judge;
mod known_gains;
pub mod library;
pub mod propose;
pub mod search;
pub mod select;
#[cfg(test)]
mod test_bench;
#[cfg(test)]
mod test_likelihood;

pub use crate::answer::diagnosis::{
    Basis, Candidate, Change, Clips, Diagnosis, Gap, Kind, Nearest, NextMotion, Place, Remedy, Rest, SensorGap,
    Sensors, Share, StageTest, Status, TorqueRms, Verdict,
};

use conclude::case::Case;
use fit::bench::Bench;
use ground::Ground;
use inference::admit::{Admitted, Refused, admit, torques};
use inference::controller::{self, ControllerError};
use inference::engine::{Engine, EngineError, Quantity, Used};
use inference::interrupt::Interrupt;
use inference::kept::{self, Fingerprint, Kept, Trail};
use inference::likelihood::Evidence;
use inference::likelihood::arm::ArmClips;
use inference::likelihood::cell::CellClips;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::setting::{self, BaseError};
use library::Library;
use shared_mem::cell::Cell;
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use shared_mem::typed;
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
    let session = &as_asked(session, options)?;
    let (session, admitted) = match prepared(session, options, interrupt) {
        Err(DiagnoseError::Refused(Refused::NotTestable(why))) => {
            // A cell that cannot be simulated is an error all the same.
            setting::complete(&session.cell, options.theta.as_ref())?;
            return Ok((conclude::not_testable(session, options, &why), Arc::new(Kept::default())));
        }
        prepared => prepared?,
    };
    let question = Fingerprint::of("diagnose")
        .with(&(options.theta.as_ref().map(Theta::to_toml), options.seed, options.torques))
        .with_cell(&session.cell)
        .with(&options.engine.as_ref().map(|engine| engine.ability().print()))
        .with_clips(&admitted.clips);
    let kept = kept::for_work((options.out.as_deref(), &session.folder, "diagnose"), &question, interrupt);
    let found = diagnosed(&session, &admitted, options, (interrupt, (&kept, "")));
    interrupt.work_is_over();
    // What work says that was cut short is no answer.
    if interrupt.cancelled() {
        return Err(DiagnoseError::Interrupted(kept.farewell(&typed::command())));
    }
    Ok((found?, kept))
}

/// The session whose arm goes where it was measured, where torques are asked about; else as it is.
fn as_asked(session: &Session, options: &Options) -> Result<Session, DiagnoseError> {
    let cell = if options.torques {
        torques::tracking_cell(&session.cell).ok_or(Refused::NoModel)?
    } else {
        session.cell.clone()
    };
    Ok(Session { cell, ..session.clone() })
}

/// The session with what its clips say of the controller, and its clips as they count.
fn prepared(session: &Session, options: &Options, interrupt: &Interrupt) -> Result<(Session, Admitted), DiagnoseError> {
    let admitted = admit(session);
    if interrupt.cancelled() {
        return Err(cut_short());
    }
    let mut admitted = compared(admitted?, options.engine.as_deref())?;
    let alone = admitted.objects_alone();
    let cell = if alone { torques::without_robot(&session.cell) } else { session.cell.clone() };
    let (known, remarks) = (options.theta.as_ref(), &mut admitted.warnings);
    let cell = controller::controlled(cell, &admitted.clips, known, remarks, interrupt)?;
    Ok((Session { cell, ..session.clone() }, admitted.in_parts()))
}

/// Of work of which nothing is kept.
fn cut_short() -> DiagnoseError {
    DiagnoseError::Interrupted("interrupted; start again".into())
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
    if interrupt.cancelled() { Err(cut_short()) } else { found }
}

/// Clips with what an engine reports, too.
fn compared(mut admitted: Admitted, engine: Option<&Engine>) -> Result<Admitted, DiagnoseError> {
    let Some(engine) = engine else { return Ok(admitted) };
    if admitted.with_object {
        engine.admits(admitted.clips.iter())?;
    }
    let ability = engine.ability();
    for clip in &mut admitted.clips {
        let logged = [
            (Quantity::Velocity, &mut clip.measured.dq),
            (Quantity::Torque, &mut clip.measured.tau),
            (Quantity::DesiredTorque, &mut clip.desired.tau),
        ];
        logged.into_iter().filter(|(quantity, _)| !ability.reports(*quantity)).for_each(|(_, rows)| rows.clear());
    }
    Ok(admitted)
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
    let library = Library::new(&session.cell, &base, Ground::crossed(admitted).as_ref(), &peaks);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let nominal = setting::complete(&session.cell, None)?;
    let engine = options.engine.as_ref();
    let mut diagnosis = if admitted.with_object {
        let robot = session.cell.robot.as_ref();
        let arm = robot.map(|_| ArmClips::moments(&session.cell, &admitted.clips, theta)).transpose();
        let arm = arm.map_err(Refused::from)?.map(|arm| arm.moved_by(options.engine.clone(), &nominal));
        let object = ObjectClips::new(&session.cell, admitted.clips.clone(), library.settings.clone())?;
        let evidence =
            CellClips::new(arm, object.simulated_by(engine, &nominal), |numbers: &[f64]| library.felt_by_arm(numbers));
        examine(&evidence, &library, session, admitted, options, work)?
    } else {
        let evidence = ArmClips::moments(&session.cell, &admitted.clips, theta).map_err(Refused::from)?;
        let evidence = evidence.moved_by(options.engine.clone(), &nominal);
        examine(&evidence, &library, session, admitted, options, work)?
    };
    if torques::is_tracking(&session.cell) {
        diagnosis.theta = torques::without_law(diagnosis.theta, options.theta.as_ref());
    }
    diagnosis.engine = engine.map(|engine| engine.used());
    diagnosis.warnings.extend(diagnosis.engine.iter().flat_map(Used::sentences));
    diagnosis.seconds = began.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// What cuts work short, and where its steps are kept.
type Work<'a> = (&'a Interrupt, Trail<'a>);

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

fn examine<E: Evidence>(
    evidence: &E,
    library: &Library,
    session: &Session,
    admitted: &Admitted,
    options: &Options,
    (interrupt, trail): Work<'_>,
) -> Result<Diagnosis, DiagnoseError> {
    let bench = Bench { evidence, library, scatter: evidence.scatter(), interrupt, trail };
    let split = admitted.split(options.seed);
    let plan: &[_] = if admitted.with_object { &fit::stages::OBJECT } else { &fit::stages::ARM };
    let bar = Progress::planned("diagnose", plan, search::baseline::steps(admitted));
    let baseline =
        search::baseline::identify(&bench, &split, &session.cell, admitted, &bar).ok_or(DiagnoseError::NoBaseline)?;
    let refined = |full: &[f64]| {
        let step = bench.step("refined").with_numbers(full);
        trail.0.once(&step, || search::baseline::refined(&bench, &split, &session.cell, admitted, full))
    };
    let found = search::effects::search(&bench, &split, baseline, &refined, &bar).ok_or(DiagnoseError::NoBaseline)?;
    let cut_short = interrupt.spent();
    bar.stage(fit::stages::CONCLUSION, 1);
    let case = Case { bench: &bench, split: &split, found: &found, session, admitted, options };
    let mut concluded = conclude::conclude(&case)?;
    let baseline = library.theta(&found.steps[0].from.full);
    // What the twin makes of the recorded motion says nothing about another program.
    if options.engine.is_none() {
        concluded.stage_test = judge::recorded_arm::stage_test(&session.cell, &baseline, admitted, &split.confirm)?;
    }
    if interrupt.spent() {
        concluded.budget_spent = true;
        concluded.verdict = concluded.verdict.so_far(options.budget.unwrap_or_default(), cut_short);
    }
    Ok(concluded)
}
