//! Capture: plan a motion, have the bridge play it, record it into a session folder.
//!
//! Planning is pure ([`plan`] for excitation, [`stroke`] for Control-Hit-Slide, on [`multisine`], [`line`], [`limits`], [`body`]); playing goes through shared memory only
//! ([`stream`], [`link`]); recording is a process beside us ([`recorder`]); [`excitation`] is the verb that binds them.

pub mod body;
pub mod bridge;
pub mod excess;
pub mod excitation;
pub mod limits;
pub mod line;
pub mod link;
pub mod multisine;
pub mod plan;
pub mod quality;
pub mod recorder;
pub mod session;
pub mod stream;
pub mod stroke;
