//! The messages: docs/engine.md explains each. Units SI; joints in the order of `joints`.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The version of the protocol that is spoken here.
pub(super) const VERSION: u32 = 2;
/// The oldest that is understood: engines of it know no object, and are asked for what they know.
pub(super) const OLDEST: u32 = 1;

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
    /// The object that takes part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) object: Option<ObjectBlock<'a>>,
}

/// An object that stands on the table when a roll-out begins. Its frame is its geometric centre.
#[derive(Debug, Serialize)]
pub(super) struct ObjectBlock<'a> {
    #[serde(flatten)]
    pub(super) body: &'a ObjectBody,
    /// Where it stands, in the base frame [m].
    pub(super) position: [f64; 3],
    /// Unit quaternion w, x, y, z, from its frame to the base's.
    pub(super) orientation: [f64; 4],
    /// Times at which its pose is asked for.
    pub(super) poses: usize,
}

/// The numbers of an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectBody {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass from the geometric centre, object frame [m].
    pub centre_of_mass: [f64; 3],
    /// Inertia about the centre of mass along the object's axes [kg m²], row by row.
    pub inertia: [[f64; 3]; 3],
    /// Coulomb friction on the table.
    pub friction: f64,
    /// Coulomb friction against the tool.
    pub tip_friction: f64,
    /// Restitution against the table, 0 to 1.
    pub restitution: f64,
    /// Edges of the box, or of the mesh's bounding box [m].
    pub size: [f64; 3],
    /// The mesh, whose bounding box has its middle in the geometric centre; none of a box.
    pub mesh: Option<String>,
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
    Impossible { why: String },
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
    /// Numbers of controller and object that can be set.
    #[serde(default)]
    pub(super) parameters: Vec<String>,
    /// Effects, each with the parameters that it knows.
    #[serde(default)]
    pub(super) effects: BTreeMap<String, Vec<String>>,
    /// What it may be asked for: of `q`, `dq`, `tau_J`, `tau_J_d`.
    pub(super) readings: Vec<String>,
    /// Whether it simulates an object that the arm hits.
    #[serde(default)]
    pub(super) object: bool,
}
