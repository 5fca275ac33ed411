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
//! | `work` | how it is asked, why it fails, and the bench on which the clips lie |
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
mod work;

pub use crate::answer::diagnosis::{
    Basis, Candidate, Change, Clips, Diagnosis, Gap, JointGap, Kind, Medians, Nearest, NextMotion, Place, Remedy, Rest,
    SensorGap, Sensors, Share, StageTest, Status, TorqueRms, Verdict,
};

pub use work::{DiagnoseError, Options, peaks};

use conclude::Case;
use fit::bench::Bench;
use inference::admit::{Admitted, Refused, Split, admit, torques};
use inference::controller;
use inference::engine::{Engine, Quantity, Used};
use inference::interrupt::Interrupt;
use inference::kept::{Fingerprint, Kept};
use inference::likelihood::setting;
use search::baseline::Baseline;
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use std::sync::Arc;
use std::time::Instant;
use work::{Question, Work, cut_short};

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
    // A tenth is left to conclude.
    let interrupt = &interrupt.within(options.budget.map(|budget| budget * 9 / 10));
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
    let work = |work: Work<'_>| diagnosed(&session, &admitted, options, work);
    work::kept("diagnose", options, &session.folder, &question, interrupt, work)
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
    work::passing(interrupt, |work| diagnosed(session, admitted, options, work))
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
    let cause = Cause { session, admitted, split: admitted.split(options.seed), options };
    let mut diagnosis = work::ask(&cause, &session.cell, admitted, options, work)?;
    if torques::is_tracking(&session.cell) {
        diagnosis.theta = torques::without_law(diagnosis.theta, options.theta.as_ref());
    }
    diagnosis.engine = options.engine.as_ref().map(|engine| engine.used());
    diagnosis.warnings.extend(diagnosis.engine.iter().flat_map(Used::sentences));
    diagnosis.seconds = began.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// What causes the gap of a session.
struct Cause<'a> {
    session: &'a Session,
    admitted: &'a Admitted,
    split: Split,
    options: &'a Options,
}

impl Question for Cause<'_> {
    type Answer = Diagnosis;

    fn examine(&self, bench: &Bench<'_>) -> Result<Diagnosis, DiagnoseError> {
        let Self { session, admitted, split, options } = self;
        let bar = Progress::searching(
            "diagnose",
            &fit::stages::expected(admitted.with_object),
            search::baseline::steps(admitted.with_object),
        );
        let baseline = Baseline { bench, split, cell: &session.cell, admitted };
        let found = baseline.identified(&bar).and_then(|begun| baseline.with_effects(begun, &bar));
        let found = found.ok_or(DiagnoseError::NoBaseline)?;
        let cut_short = bench.interrupt.spent();
        bar.stage(fit::stages::CONCLUSION, 1);
        let mut concluded = conclude::conclude(&Case { bench, split, found: &found, session, admitted, options })?;
        // What the twin makes of the recorded motion says nothing about another program.
        if options.engine.is_none() {
            let baseline = bench.library.theta(&found.steps[0].from.full);
            concluded.stage_test = judge::recorded_arm::stage_test(&session.cell, &baseline, admitted, &split.confirm)?;
        }
        conclude::witnessed::add(&mut concluded, &session.cell, admitted);
        if bench.interrupt.spent() {
            concluded.budget_spent = true;
            concluded.verdict = concluded.verdict.so_far(options.budget.unwrap_or_default(), cut_short);
        }
        Ok(concluded)
    }
}
