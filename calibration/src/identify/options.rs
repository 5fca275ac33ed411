//! What an arm or an object is identified from, and how; what the answer depends on.

use super::error::IdentifyError;
use inference::engine::Engine;
use inference::kept::Fingerprint;
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use std::path::PathBuf;
use std::sync::Arc;

/// Ways of searching.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Optimizer {
    /// Bounded least squares on rollouts.
    #[default]
    LeastSquares,
    /// A particle swarm.
    Swarm,
    /// Covariance matrix adaptation.
    Evolution,
}

impl Optimizer {
    /// Name on command lines and in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "least-squares",
            Self::Swarm => "pso",
            Self::Evolution => "cma",
        }
    }
}

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
}
