//! An Intel RealSense camera, or a `.bag` that librealsense has recorded. Built with the feature `realsense`, because it
//! needs the C library; without it `absent` stands in its place.
//!
//! | file | owns |
//! |---|---|
//! | `moment` | colour and depth of one moment, and the topics they go to |
//! | `stream` | frames out of librealsense (the only code that knows it) |
//! | `lens` | its lens models as Brown and Conrady's |
//! | `convert` | a `.bag` as a clip |
//! | `passes` | what several passes over a `.bag` brought, as one clip |
//! | `bag_index` | how many depth pictures a `.bag` holds |

mod bag_index;
mod convert;
mod lens;
mod moment;
mod passes;
mod stream;

pub use convert::convert;

use super::CameraSource;
use crate::device::{Service, ServiceError};
use crate::pump::Notice;
use moment::PictureLines;
use shared_mem::cell::Cell;
use std::sync::mpsc::Sender;
use std::sync::{Arc, OnceLock};
use stream::Stream;

/// Takes the camera into service: its pictures on shared memory, taken up again after it was unplugged.
///
/// # Errors
/// [`ServiceError`] when it cannot be opened, or another camera runs.
pub fn serve(source: &CameraSource, cell: &Cell, notices: Sender<Notice>) -> Result<Service, ServiceError> {
    let (name, camera, source) = (source.to_string(), cell.camera.clone().unwrap_or_default(), source.clone());
    let pixels = Arc::new(OnceLock::new());
    let shared = pixels.clone();
    let open = move || {
        let stream = Stream::open(&source, &camera)?;
        let _as_before = shared.set(stream.pixels());
        Ok(stream)
    };
    let lines = move |node: &_| PictureLines::open(node, pixels.get().copied().unwrap_or_default());
    Service::start("rt_bridge_camera", name, open, lines, notices)
}
