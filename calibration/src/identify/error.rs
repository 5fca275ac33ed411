//! Why an arm, an object or a joint cannot be identified.

use inference::admit::LeftOut;
use inference::admit::remarks::reasons;
use inference::controller::ControllerError;
use inference::engine::EngineError;
use inference::estimate::Impossible;
use inference::likelihood::setting::BaseError;
use shared_mem::output::OutputError;
use shared_mem::recording::ReadError;
use shared_mem::toml_file::TomlFileError;
use std::path::Path;
use twin::arm::ModelError;
use twin::replay::ReplayError;
use twin::scene::MeshFileError;
use twin::sim::SimError;

/// Names file, key or clip, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The parameters that are known already.
    #[error(transparent)]
    Theta(#[from] TomlFileError),
    #[error(transparent)]
    Base(#[from] BaseError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Controller(#[from] ControllerError),
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    #[error(transparent)]
    Cell(#[from] SimError),
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The engine cannot be asked for these clips.
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error("cell.toml has no {0} block; add it, or identify the object")]
    NoArm(&'static str),
    #[error("cell.toml has no [object] block; add it, or identify the arm")]
    NoObject,
    #[error("--also {given}: no effect on the arm is called so; there are {known}")]
    Effect { given: String, known: String },
    #[error("{session}: no clip can be used for the {target}: {why}")]
    NoClip {
        session: String,
        /// `arm` or `object`.
        target: &'static str,
        /// Reasons, clip by clip.
        why: String,
    },
    /// No joint of an object is asked for, or its part is not known.
    #[error("{0}")]
    Subject(String),
    /// No part moves on its joint by itself.
    #[error("no clip of {session} shows `{part}` move by itself: {why}")]
    NoMotion {
        session: String,
        part: String,
        /// Why not, and what helps.
        why: String,
    },
    /// The motions of a part are not those of one on a joint.
    #[error(
        "no friction and damping explain the motions of `{0}`; give the URDF the masses and the axis of the real object"
    )]
    NoFit(String),
    /// The twin has no answer.
    #[error("the twin cannot be simulated: {0}; check the values of cell.toml and --parameters")]
    Impossible(#[from] Impossible),
    /// Ctrl-C. What was found is kept, and the words say where.
    #[error("{0}")]
    Interrupted(String),
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl IdentifyError {
    /// Of a session that has clips of a target, `arm` or `object`, and none that can be used.
    pub(super) fn no_clip(session: &Path, target: &'static str, left_out: &[LeftOut]) -> Self {
        let why = match reasons(left_out) {
            none if none.is_empty() => format!("it lists none with an {target}"),
            why => why,
        };
        Self::NoClip { session: session.display().to_string(), target, why }
    }
}
