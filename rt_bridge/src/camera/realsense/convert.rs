//! A `.bag` as a clip. librealsense plays a recording at the pace it was made with and drops what the reader is too slow
//! for, so it is played again until a pass lacks nothing that another had.

use super::stream;
use crate::camera::{CameraSource, ConvertError, Converted};
use shared_mem::cell::Camera;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::recording::{ClipInfo, ClipWriter};
use shared_mem::time::now_ns;
use shared_mem::topics;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Passes at most.
const PASSES: u32 = 4;

/// Writes colour, aligned depth and intrinsics of `bag` to the new clip `out`. Stamps keep the distances of the camera's
/// clock; `camera` says where the camera stands.
///
/// # Errors
/// [`ConvertError`] when the recording cannot be read or the clip not written.
pub fn convert(bag: &Path, camera: &Camera, out: &Path, info: &ClipInfo) -> Result<Converted, ConvertError> {
    if out.exists() {
        return Err(ConvertError::Exists { path: out.to_owned() });
    }
    let source = CameraSource::Bag(bag.to_owned());
    let unfinished = out.with_extension("mcap.unfinished");
    let mut known = BTreeSet::new();
    for pass in 1..=PASSES {
        remove(&unfinished)?;
        let frames = play(&source, camera, &unfinished, info)?;
        known.extend(&frames);
        let gaps = missing(&frames);
        // Two passes that agree, or one without a gap, have it all.
        let whole = frames == known && (gaps.is_empty() || pass > 1);
        if whole || pass == PASSES {
            if frames.is_empty() {
                remove(&unfinished)?;
                return Err(ConvertError::Empty { path: bag.to_owned() });
            }
            std::fs::rename(&unfinished, out).map_err(|source| ConvertError::File { path: out.to_owned(), source })?;
            let dropped = known.difference(&frames).count();
            return Ok(Converted { file: out.to_owned(), frames: frames.len(), missing: gaps, dropped, passes: pass });
        }
    }
    unreachable!("the last pass returns")
}

fn remove(path: &PathBuf) -> Result<(), ConvertError> {
    match std::fs::remove_file(path) {
        Err(source) if path.exists() => Err(ConvertError::File { path: path.clone(), source }),
        _ => Ok(()),
    }
}

/// One pass; the numbers of the frames written.
fn play(source: &CameraSource, camera: &Camera, out: &Path, info: &ClipInfo) -> Result<BTreeSet<u64>, ConvertError> {
    let mut writer = ClipWriter::create(out, info)?;
    let mut frames = BTreeSet::new();
    let mut shift_ns = None;
    stream::play(source, camera, |moment| -> Result<(), ConvertError> {
        // The camera's clock, begun at this machine's now.
        let shift_ns = *shift_ns.get_or_insert_with(|| now_ns().wrapping_sub(moment.depth.device_ns));
        let stamped = |header: ImageHeader| ImageHeader { stamp_ns: header.device_ns.wrapping_add(shift_ns), ..header };
        let (color, depth) = (stamped(moment.color), stamped(moment.depth));
        if frames.is_empty() {
            writer.camera_info(&CameraInfo { stamp_ns: depth.stamp_ns, ..moment.info })?;
        }
        if frames.insert(depth.sequence) {
            writer.image(topics::CAMERA_COLOR, &color, &moment.color_pixels)?;
            writer.image(topics::CAMERA_DEPTH, &depth, &moment.depth_pixels)?;
        }
        Ok(())
    })?;
    writer.finish()?;
    Ok(frames)
}

/// Numbers between the first and the last that are not there.
fn missing(frames: &BTreeSet<u64>) -> Vec<u64> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Vec::new() };
    (*first..*last).filter(|number| !frames.contains(number)).collect()
}
