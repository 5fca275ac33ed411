//! Which RealSense camera, and what became of a recording that was converted.

use crate::device::DeviceFault;
use serde::Serialize;
use shared_mem::output::OutputError;
use shared_mem::recording::{ReadError, WriteError};
use std::fmt;
use std::path::PathBuf;

/// A RealSense camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraSource {
    /// The one that is plugged in.
    Device,
    /// A recording by librealsense, played at its own pace.
    Bag(PathBuf),
}

impl fmt::Display for CameraSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device => f.write_str("the camera realsense"),
            Self::Bag(file) => write!(f, "the camera bag://{}", file.display()),
        }
    }
}

/// What became of a recording: the JSON answer of `rt_bridge convert`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Converted {
    pub file: PathBuf,
    /// Pairs of colour and depth in it.
    pub frames: usize,
    /// Frame numbers between the first and the last that are not in it.
    pub missing: Vec<u64>,
    /// Depth pictures of the recording, by its index, that are not in it: without a colour picture beside them.
    pub unpaired: usize,
    /// How often the recording was played.
    pub passes: u32,
}

/// A recording cannot be converted.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// The recording, or the library to read it.
    #[error(transparent)]
    Device(#[from] DeviceFault),
    #[error(transparent)]
    Write(#[from] WriteError),
    /// What a pass wrote.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Nothing in it.
    #[error("{} holds no pair of colour and depth; record both streams", path.display())]
    Empty { path: PathBuf },
    /// The clip's file.
    #[error(transparent)]
    Output(#[from] OutputError),
}
