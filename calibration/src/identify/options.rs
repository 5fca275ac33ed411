//! What an arm or an object is identified from, and how.

use super::run::Optimizer;
use inference::engine::Engine;
use std::path::PathBuf;
use std::sync::Arc;

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
