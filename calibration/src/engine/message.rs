//! The messages: docs/engine.md explains each. Units SI; joints in the order of `joints`.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The version of the protocol that is spoken here.
pub(super) const VERSION: u32 = 1;

/// The first message to an engine: which cell it is to simulate.
#[derive(Debug, Serialize)]
pub(super) struct Greeting<'a> {
    pub(super) message: &'static str,
    pub(super) protocol: u32,
    /// Names of the joints, in the order of all arrays.
    pub(super) joints: &'a [String],
    /// The controller's period [s].
    pub(super) period: f64,
    /// cell.toml, its keys as they stand there.
    pub(super) cell: Value,
    /// The session's folder, from which paths in `cell` count.
    pub(super) folder: String,
}

/// One roll-out: parameters, and of which shapes the numbers behind are.
#[derive(Debug, Serialize)]
pub(super) struct RollOut<'a> {
    pub(super) message: &'static str,
    /// Joints.
    pub(super) dof: usize,
    /// Rows of commands from before the start.
    pub(super) before: usize,
    /// Rows of commands from the start on, one a period.
    pub(super) ticks: usize,
    /// Times at which states are asked for.
    pub(super) rows: usize,
    /// What a row of states is to be made of, in this order.
    pub(super) readings: Vec<&'static str>,
    /// `stiffness`, `damping`: a number for each joint; only those that the engine knows.
    pub(super) parameters: BTreeMap<&'static str, &'a [f64]>,
    /// Effects that act, with parameters that the engine knows; null is infinite.
    pub(super) effects: Vec<BTreeMap<String, Value>>,
}

/// What comes back.
#[derive(Debug, Deserialize)]
#[serde(tag = "message", rename_all = "lowercase")]
pub(super) enum Reply {
    /// To the greeting.
    Hello(Hello),
    /// The states that were asked for.
    States,
    /// The engine has no answer for these parameters; others may do.
    Impossible {
        /// The reason.
        why: String,
    },
    /// The engine cannot go on at all.
    Error {
        /// The reason, and what to do.
        why: String,
    },
}

/// What an engine can do.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Hello {
    pub(super) protocol: u32,
    /// Name and version, for reports.
    pub(super) name: String,
    /// Of `stiffness`, `damping`.
    #[serde(default)]
    pub(super) parameters: Vec<String>,
    /// Effects, each with the parameters that it knows.
    #[serde(default)]
    pub(super) effects: BTreeMap<String, Vec<String>>,
    /// What it may be asked for: of `q`, `dq`, `tau_J`, `tau_J_d`.
    pub(super) readings: Vec<String>,
}
