//! A policy that is ready to be asked, wherever it is computed.

use super::named::Source;
use super::onnx::{Onnx, OnnxError};
use super::packed::Rows;
use super::served::{Served, ServedError};
use rmpv::Value;

/// A policy that can be asked.
#[derive(Debug)]
pub enum Policy {
    /// By its server.
    Served(Served),
    /// Here.
    Onnx(Onnx),
}

/// A policy could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum PolicyError {
    /// Its server.
    #[error(transparent)]
    Served(#[from] ServedError),
    /// Its file.
    #[error(transparent)]
    Onnx(#[from] OnnxError),
}

impl PolicyError {
    /// Whether nothing went wrong but that the end was asked for.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Served(ServedError::Interrupted) | Self::Onnx(OnnxError::Interrupted))
    }
}

impl Policy {
    /// Opens a policy; `None` of a script, which nobody asks.
    ///
    /// # Errors
    /// [`PolicyError`].
    pub fn open(source: &Source) -> Result<Option<Self>, PolicyError> {
        Ok(match source {
            Source::Expert { .. } => None,
            Source::Served(address) => Some(Self::Served(Served::connect(address)?)),
            Source::Onnx(path) => Some(Self::Onnx(Onnx::open(path)?)),
        })
    }

    /// An episode begins.
    pub fn begin(&mut self) {
        match self {
            // What a server remembers is its own matter: openpi's protocol has no word for it.
            Self::Served(_) => {}
            Self::Onnx(policy) => policy.begin(),
        }
    }

    /// The next actions, a row each.
    ///
    /// # Errors
    /// [`PolicyError`].
    pub fn actions(&mut self, observation: &Value) -> Result<Rows, PolicyError> {
        Ok(match self {
            Self::Served(policy) => policy.actions(observation)?,
            Self::Onnx(policy) => policy.actions(observation)?,
        })
    }

    /// An answer that does not fit the task.
    pub fn answer(&self, what: &dyn std::fmt::Display) -> PolicyError {
        match self {
            Self::Served(policy) => policy.answer(what).into(),
            Self::Onnx(policy) => policy.answer(what).into(),
        }
    }
}
