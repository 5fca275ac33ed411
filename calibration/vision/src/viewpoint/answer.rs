//! What is said about a camera's pose.

use super::interval::Interval;
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::{input, toml_file};
use std::path::Path;

/// The answer of `calibration viewpoint`.
#[derive(Debug, Clone, Serialize)]
pub struct Viewpoint {
    /// The optical frame (z forward, x right, y down) in the base frame.
    pub camera: Pose,
    /// 95 % interval: half-widths of position [m] and of rotation about the base's axes [rad]; absent where too little was
    /// seen.
    pub interval: Option<Interval>,
    /// Share of wrong pixels (masks), or mean distance of the outline to edges, 0 to 1 (photos).
    pub loss: f64,
    /// Share of the outline that the pictures confirm.
    pub confirmed: f64,
    /// The same of the next best pose that is another one.
    pub rival: Option<f64>,
    /// The start, and how far it was from the answer; absent for a search.
    pub start: Option<Start>,
    pub frames: Vec<FrameAnswer>,
    /// `outline` or `swarm`.
    pub method: &'static str,
    /// Which pictures were used: `depth` or `color`.
    pub pictures: &'static str,
    /// How many times the robot was drawn.
    pub drawings: usize,
    /// Time spent [s].
    pub seconds: f64,
    /// What a reader should know.
    pub warnings: Vec<String>,
}

/// A camera pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pose {
    /// Position [m].
    pub position: [f64; 3],
    /// Orientation `w, x, y, z`.
    pub orientation: [f64; 4],
}

/// The pose that was started from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Start {
    pub camera: Pose,
    /// Distance to the answer [m].
    pub distance_m: f64,
    /// Angle to the answer [rad].
    pub angle_rad: f64,
    /// Median distance of the joints' origins in the picture to where the answer puts them [pixel].
    pub reprojection_px: f64,
    /// Share of the outline that the pictures confirm there.
    pub confirmed: f64,
    /// Whether it lies outside of the answer's interval.
    pub excluded: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameAnswer {
    /// Its file, or clip and time.
    pub name: String,
    pub loss: f64,
    /// Where the robot's joint origins and the flange are in it: column and row [pixel], free of distortion.
    pub joints_px: Vec<[f64; 2]>,
}

/// The cell's text; of a file that is there, all but the camera's block stays as a person wrote it.
pub(super) fn cell_text(cell: &Cell, file: &Path) -> String {
    let before = input::text(file, input::Kind::Configuration).ok().filter(|_| file.is_file());
    let camera = Cell { camera: cell.camera.clone(), ..Cell::default() };
    before
        .and_then(|before| toml_file::updated(&before, &camera.to_toml(), &[]))
        .unwrap_or_else(|| cell.at_home_anywhere().to_toml())
}
