//! Long work: where its steps are kept, what cuts it short, and its answer once its parameters are in their file.

use super::error::IdentifyError;
use super::options::Options;
use crate::answer::identification::Identification;
use inference::engine::Used;
use inference::interrupt::Interrupt;
use inference::kept::{self, Fingerprint, Kept};
use shared_mem::recording::SessionFiles;
use shared_mem::theta::Theta;
use shared_mem::typed;
use std::time::Instant;

/// Where the steps of long work are kept, and what cuts it short.
#[derive(Clone, Copy)]
pub(super) struct Work<'a> {
    pub(super) kept: &'a Kept,
    pub(super) interrupt: &'a Interrupt,
}

impl<'a> Work<'a> {
    /// Of which nothing is kept.
    pub(super) fn passing(interrupt: &'a Interrupt) -> Self {
        Self { kept: Kept::nothing(), interrupt }
    }
}

/// Whether the user asked for the end: then what was found so far is taken to its file.
pub(super) fn stopped(Work { kept, interrupt }: Work<'_>) -> Result<(), IdentifyError> {
    if interrupt.asked() { Err(IdentifyError::Interrupted(kept.farewell(&typed::command()))) } else { Ok(()) }
}

/// The answer about a target, by a question, that `find` finds: its steps are kept until the parameters are in their file.
pub(super) fn answered(
    options: &Options,
    target: &str,
    question: &Fingerprint,
    interrupt: &Interrupt,
    find: impl FnOnce(Work<'_>) -> Result<(Identification, Theta), IdentifyError>,
) -> Result<Identification, IdentifyError> {
    let began = Instant::now();
    let verb = format!("identify_{target}");
    let kept = kept::for_work(options.out.as_deref(), &options.session, &verb, question, interrupt);
    let work = Work { kept: &kept, interrupt };
    let found = find(work);
    interrupt.work_is_over();
    // What work says that was cut short is no answer.
    stopped(work)?;
    let (mut answer, theta) = found?;
    if let Some(out) = &options.out {
        theta.write(out)?;
        answer.theta_file = Some(out.clone());
    }
    kept.done();
    answer.session = options.session.display().to_string();
    answer.files = SessionFiles { session: options.session.clone(), cell: options.cell.clone() };
    answer.optimizer = options.optimizer.name().into();
    answer.engine = options.engine.as_ref().map(|engine| engine.used());
    answer.warnings.extend(answer.engine.iter().flat_map(Used::sentences));
    answer.seconds = began.elapsed().as_secs_f64();
    Ok(answer)
}
