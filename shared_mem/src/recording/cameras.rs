//! The cameras that a ROS 2 bag says its pictures were taken with: `sensor_msgs/CameraInfo`.

use super::container::Messages;
use super::error::ReadError;
use super::messages::is_own;
use super::own;
use super::ros2::{self, CameraCalibration};
use crate::lens::calibration::Calibration;
use std::collections::BTreeSet;
use std::path::Path;

/// Cameras of one topic that are kept: two say that they differ.
const MOST: usize = 2;

/// What a bag says of its cameras.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cameras {
    /// Each that differs from those before on its topic: the topic, and the camera or why it is not read.
    pub said: Vec<(String, Result<Calibration, String>)>,
    /// Topics of pictures.
    pub pictures: BTreeSet<String>,
}

impl Cameras {
    /// Of a bag; none of an own clip, whose camera is that of its cell.
    ///
    /// # Errors
    /// [`ReadError`] when the file is missing or no MCAP file.
    pub fn of(path: &Path) -> Result<Self, ReadError> {
        let mut out = Self::default();
        if path.is_dir() {
            return Ok(out);
        }
        let mut messages = Messages::open(path)?;
        if own::is_own(&messages) || messages.peek()?.is_some_and(|message| is_own(message.channel)) {
            return Ok(out);
        }
        while let Some(message) = messages.next()? {
            let topic = &message.channel.topic;
            match message.channel.type_name() {
                ros2::CAMERA_INFO => {
                    let info = CameraCalibration::decode(message.data);
                    let info = info.map_err(|what| format!("a message cannot be decoded: {what}"));
                    let Some(said) = info.and_then(|info| info.calibration()).transpose() else { continue };
                    let mut before = out.said.iter().filter(|(other, _)| other == topic);
                    if before.clone().count() < MOST && before.all(|(_, before)| *before != said) {
                        out.said.push((topic.clone(), said));
                    }
                }
                ros2::IMAGE | ros2::COMPRESSED_IMAGE if !out.pictures.contains(topic) => {
                    out.pictures.insert(topic.clone());
                }
                _ => {}
            }
        }
        Ok(out)
    }
}
