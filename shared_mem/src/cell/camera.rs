//! `[camera]`: how the camera projects and where it stands.

use super::within;
use crate::frames::{Base, Camera as CameraFrame, Pose};
use crate::lens::Distortion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [camera] block")]
pub struct Camera {
    /// Columns.
    #[serde(default = "default_width")]
    pub width: u32,
    /// Rows.
    #[serde(default = "default_height")]
    pub height: u32,
    /// Pictures a second.
    #[serde(default = "default_rate")]
    pub rate: f64,
    /// Pinhole; absent: a D455's colour camera, scaled to the picture's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<Intrinsics>,
    /// k1, k2, p1, p2, k3, with k4, k5, k6 behind them of OpenCV's rational model; `{ fisheye = [k1, k2, k3, k4] }` of a fisheye.
    #[serde(default)]
    #[schemars(with = "WrittenDistortion")]
    pub distortion: Distortion,
    /// Where the camera stands.
    #[serde(default)]
    pub pose: CameraPose,
    /// From the picture to its pose becoming known [s].
    #[serde(default)]
    pub latency: f64,
}

/// How a [`Distortion`] is written.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used")]
enum WrittenDistortion {
    /// Five numbers, or eight.
    Polynomial(Vec<f64>),
    /// Four numbers by name.
    Fisheye { fisheye: [f64; 4] },
}

/// Pinhole intrinsics [pixel].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table of fx, fy, cx and cy [pixel]")]
pub struct Intrinsics {
    /// Focal length along a row.
    pub fx: f64,
    /// Focal length along a column.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
}

/// The optical frame (z forward, x right, y down) in the base frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table of position [m] and orientation (w, x, y, z)")]
pub struct CameraPose {
    /// Position [m].
    pub position: [f64; 3],
    /// Orientation `w, x, y, z`.
    pub orientation: [f64; 4],
}

impl Default for CameraPose {
    /// In front of the robot, 1.3 m away, looking back and down at the table before it.
    fn default() -> Self {
        Self { position: [1.35, 0.0, 0.75], orientation: [0.290_851, -0.644_520, -0.644_520, 0.290_851] }
    }
}

fn default_width() -> u32 {
    640
}
fn default_height() -> u32 {
    480
}
fn default_rate() -> f64 {
    30.0
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            width: default_width(),
            height: default_height(),
            rate: default_rate(),
            intrinsics: None,
            distortion: Distortion::NONE,
            pose: CameraPose::default(),
            latency: 0.0,
        }
    }
}

impl Camera {
    pub(super) fn check(&self) -> Result<(), String> {
        within("camera.width", &[f64::from(self.width)], 16.0, 4096.0)?;
        within("camera.height", &[f64::from(self.height)], 16.0, 4096.0)?;
        within("camera.rate", &[self.rate], 0.1, 240.0)?;
        within("camera.latency", &[self.latency], 0.0, 2.0)?;
        if self.base_from_camera().is_none() {
            return Err("`camera.pose.orientation` must be a quaternion `w, x, y, z` of length 1".into());
        }
        Ok(())
    }

    /// Intrinsics in force: those given, else a D455 colour camera's (fx 912.9 px at 1280 columns, measured on one
    /// device) scaled to this picture with square pixels.
    pub fn pinhole(&self) -> Intrinsics {
        self.intrinsics.unwrap_or_else(|| {
            let (width, height) = (f64::from(self.width), f64::from(self.height));
            // A 4:3 picture is cropped out of the sensor's 16:9 one: the row count sets the scale.
            let focal = 912.9 * (height / 720.0).max(width / 1280.0);
            Intrinsics { fx: focal, fy: focal, cx: (width - 1.0) / 2.0, cy: (height - 1.0) / 2.0 }
        })
    }

    /// Pose of the optical frame in the base frame; `None` when the quaternion has no direction.
    pub fn base_from_camera(&self) -> Option<Pose<Base, CameraFrame>> {
        Pose::from_parts(self.pose.position, self.pose.orientation)
    }
}
