//! What stands in for librealsense where it was not built in: says how to get it.

use super::{CameraSource, ConvertError, Converted};
use crate::device::{DeviceFault, Service, ServiceError};
use crate::pump::Notice;
use shared_mem::cell::{Camera, Cell};
use shared_mem::recording::ClipInfo;
use std::path::Path;
use std::sync::mpsc::Sender;

fn fault(source: &CameraSource) -> DeviceFault {
    DeviceFault::NotOpened {
        device: source.to_string(),
        why: "this program was built without librealsense".into(),
        remedy: "install librealsense 2.56 and build with `cargo build --release -p rt_bridge --features realsense`"
            .into(),
    }
}

/// Refuses.
///
/// # Errors
/// Always, with the remedy.
pub fn serve(source: &CameraSource, _cell: &Cell, _notices: Sender<Notice>) -> Result<Service, ServiceError> {
    Err(fault(source).into())
}

/// Refuses.
///
/// # Errors
/// Always, with the remedy.
pub fn convert(
    bag: &Path,
    _camera: &Camera,
    (_out, _force): (&Path, bool),
    _info: &ClipInfo,
) -> Result<Converted, ConvertError> {
    Err(fault(&CameraSource::Bag(bag.to_owned())).into())
}
