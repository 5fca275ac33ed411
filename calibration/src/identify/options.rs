//! What an arm or an object is identified from, and how; what the answer says of that.

use super::error::IdentifyError;
use super::run::{Optimizer, Work, stopped};
use crate::answer::identification::Identification;
use inference::engine::{Engine, Used};
use inference::interrupt::Interrupt;
use inference::kept::{self, Fingerprint};
use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, SessionFiles};
use shared_mem::theta::Theta;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Of an arm or an object.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The session's folder, or a clip beside a cell.toml.
    pub session: PathBuf,
    /// The cell.toml, where it does not lie beside the clips.
    pub cell: Option<PathBuf>,
    /// Of several objects in cell.toml the one to identify; the one that moves where none is named.
    pub object: Option<String>,
    /// Effects on the arm whose parameters are searched besides.
    pub also: Vec<String>,
    /// The way of searching.
    pub optimizer: Optimizer,
    /// Where the parameters go.
    pub out: Option<PathBuf>,
    /// Parameters that are known already: effects, and for an object gains, which are then not searched.
    pub parameters: Option<PathBuf>,
    /// Points whose cost a search without slopes may ask for.
    pub budget: usize,
    /// Draws the clips that are held out, and the searches.
    pub seed: u64,
    /// Another program that simulates in place of the twin.
    pub engine: Option<Arc<Engine>>,
}

impl Options {
    /// Parameters that are known already.
    pub(super) fn given(&self) -> Result<Option<Theta>, IdentifyError> {
        Ok(self.parameters.as_deref().map(Theta::read).transpose()?)
    }

    /// What the answer about a target depends on.
    pub(super) fn question<'a>(
        &self,
        target: &str,
        given: Option<&Theta>,
        cell: &Cell,
        clips: impl IntoIterator<Item = &'a Clip>,
    ) -> Fingerprint {
        Fingerprint::of("identify")
            .with(&(target, self.optimizer.name(), self.budget, self.seed, &self.also))
            .with(&given.map(Theta::to_toml))
            .with_cell(cell)
            .with(&self.engine.as_ref().map(|engine| engine.ability().print()))
            .with_clips(clips)
    }

    /// The answer to a question that `work` finds, its steps kept until the parameters are in their file.
    pub(super) fn answered(
        &self,
        target: &str,
        question: &Fingerprint,
        interrupt: &Interrupt,
        work: impl FnOnce(Work<'_>) -> Result<(Identification, Theta), IdentifyError>,
    ) -> Result<Identification, IdentifyError> {
        let began = Instant::now();
        let verb = format!("identify_{target}");
        let kept = kept::for_work(self.out.as_deref(), &self.session, &verb, question, interrupt);
        let steps = Work { kept: &kept, interrupt };
        let found = work(steps);
        interrupt.work_is_over();
        // What work says that was cut short is no answer.
        stopped(steps)?;
        let (mut answer, theta) = found?;
        if let Some(out) = &self.out {
            theta.write(out)?;
            answer.theta_file = Some(out.clone());
        }
        kept.done();
        answer.session = self.session.display().to_string();
        answer.files = SessionFiles { session: self.session.clone(), cell: self.cell.clone() };
        answer.optimizer = self.optimizer.name().into();
        answer.engine = self.engine.as_ref().map(|engine| engine.used());
        answer.warnings.extend(answer.engine.iter().flat_map(Used::sentences));
        answer.seconds = began.elapsed().as_secs_f64();
        Ok(answer)
    }
}
