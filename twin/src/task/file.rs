//! The keys of a task file, as they stand there. SI; angles in radians; positions in the world, z up.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;

#[derive(Debug, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a task: horizon, [[body]], [[articulated]], [[success]], [[motion]], [[camera]], [arm]"
)]
pub(super) struct TaskFile {
    pub(super) instruction: Option<String>,
    pub(super) horizon: f64,
    #[serde(default = "half_a_second")]
    pub(super) hold: f64,
    #[serde(default)]
    pub(super) body: Vec<Spanned<BodyEntry>>,
    #[serde(default)]
    pub(super) articulated: Vec<Spanned<ArticulatedEntry>>,
    #[serde(default)]
    pub(super) success: Vec<Spanned<SuccessEntry>>,
    #[serde(default)]
    pub(super) motion: Vec<Spanned<MotionEntry>>,
    #[serde(default)]
    pub(super) camera: Vec<Spanned<CameraEntry>>,
    pub(super) arm: Option<Spanned<ArmEntry>>,
}

fn half_a_second() -> f64 {
    0.5
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a [[body]] block")]
pub(super) struct BodyEntry {
    pub(super) name: String,
    pub(super) piece: Vec<PieceEntry>,
    #[serde(default)]
    pub(super) hold: HoldEntry,
    pub(super) mass: Option<f64>,
    pub(super) centre_of_mass: Option<[f64; 3]>,
    pub(super) friction: f64,
    #[serde(default)]
    pub(super) pad_radius: f64,
    pub(super) colour: Option<[u8; 3]>,
    #[serde(default)]
    pub(super) position: [f64; 3],
    #[serde(default)]
    pub(super) rotation: [f64; 3],
    pub(super) start: Option<StartEntry>,
    pub(super) joint: Option<JointEntry>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum HoldEntry {
    #[default]
    Free,
    Fixed,
    Moved,
}

/// An object out of a URDF.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an [[articulated]] block")]
pub(super) struct ArticulatedEntry {
    pub(super) name: String,
    pub(super) urdf: PathBuf,
    /// Of its root.
    #[serde(default)]
    pub(super) hold: HoldEntry,
    pub(super) friction: f64,
    #[serde(default)]
    pub(super) position: [f64; 3],
    #[serde(default)]
    pub(super) rotation: [f64; 3],
    pub(super) start: Option<StartEntry>,
    /// Where joints start, by name.
    #[serde(default)]
    pub(super) joints: BTreeMap<String, f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a piece: { shape = \"box\", size = [x, y, z] }")]
pub(super) struct PieceEntry {
    pub(super) shape: Option<ShapeEntry>,
    pub(super) size: Option<[f64; 3]>,
    pub(super) radius: Option<f64>,
    pub(super) length: Option<f64>,
    pub(super) mesh: Option<PathBuf>,
    #[serde(default)]
    pub(super) position: [f64; 3],
    #[serde(default)]
    pub(super) rotation: [f64; 3],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ShapeEntry {
    Box,
    Cylinder,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of x, y, yaw, each [low, high]")]
pub(super) struct StartEntry {
    #[serde(default)]
    pub(super) x: [f64; 2],
    #[serde(default)]
    pub(super) y: [f64; 2],
    #[serde(default)]
    pub(super) yaw: [f64; 2],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table: kind, parent, axis, limits")]
pub(super) struct JointEntry {
    pub(super) kind: KindEntry,
    /// Without it the joint is to the world.
    pub(super) parent: Option<String>,
    pub(super) axis: [f64; 3],
    pub(super) limits: Option<[f64; 2]>,
    #[serde(default)]
    pub(super) start: f64,
    #[serde(default)]
    pub(super) friction: f64,
    #[serde(default)]
    pub(super) damping: f64,
    pub(super) drive: Option<DriveEntry>,
    pub(super) follows: Option<FollowsEntry>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum KindEntry {
    Revolute,
    Prismatic,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of target, speed, force")]
pub(super) struct DriveEntry {
    pub(super) target: f64,
    pub(super) speed: f64,
    pub(super) force: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of body, ratio")]
pub(super) struct FollowsEntry {
    pub(super) body: String,
    pub(super) ratio: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a [[success]] block")]
pub(super) struct SuccessEntry {
    pub(super) body: Option<String>,
    pub(super) low: Option<[f64; 3]>,
    pub(super) high: Option<[f64; 3]>,
    pub(super) of: Option<String>,
    pub(super) tilt: Option<f64>,
    pub(super) touching: Option<[String; 2]>,
    pub(super) apart: Option<[String; 2]>,
    pub(super) joint: Option<String>,
    pub(super) between: Option<[f64; 2]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a [[motion]] block")]
pub(super) struct MotionEntry {
    pub(super) body: String,
    pub(super) time: f64,
    pub(super) position: Option<[f64; 3]>,
    #[serde(default)]
    pub(super) rotation: [f64; 3],
    pub(super) relative_to: Option<String>,
    pub(super) target: Option<f64>,
    pub(super) force: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a [[camera]] block")]
pub(super) struct CameraEntry {
    pub(super) name: String,
    pub(super) position: [f64; 3],
    pub(super) look_at: [f64; 3],
    #[serde(default = "columns")]
    pub(super) width: u32,
    #[serde(default = "rows")]
    pub(super) height: u32,
    /// From the upper edge to the lower.
    #[serde(default = "usual_field")]
    pub(super) field_of_view: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an [arm] block")]
pub(super) struct ArmEntry {
    pub(super) body: String,
    #[serde(default)]
    pub(super) base: [f64; 3],
    /// Of the body in the flange.
    #[serde(default)]
    pub(super) position: [f64; 3],
    #[serde(default)]
    pub(super) rotation: [f64; 3],
    /// Of the controller of an arm that gives way.
    pub(super) stiffness: Option<[f64; 7]>,
    pub(super) damping: Option<[f64; 7]>,
}

fn columns() -> u32 {
    320
}

fn rows() -> u32 {
    240
}

fn usual_field() -> f64 {
    0.8
}
