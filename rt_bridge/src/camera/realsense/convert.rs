//! A `.bag` as a clip. librealsense plays a recording at the pace it was made with and drops what the reader is too slow
//! for, so it is played again for what is still missing, until the clip has what the recording's index counts, or nothing
//! more is to be had.

use super::bag_index::{IndexError, depth_pictures};
use super::passes::{Passes, write};
use super::stream;
use crate::camera::{CameraSource, ConvertError, Converted};
use crate::device::DeviceFault;
use shared_mem::cell::Camera;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::output::{Destination, Output};
use shared_mem::progress::Progress;
use shared_mem::recording::{ClipInfo, ClipWriter};
use shared_mem::time::now_ns;
use std::collections::BTreeSet;
use std::path::Path;

/// Passes at most.
const PASSES: u32 = 30;
/// So many passes in a row that bring nothing new: there is no more.
const FRUITLESS: u32 = 4;
/// The synchroniser gives out no pair for the very first picture.
const NEVER_PAIRED: usize = 1;

/// Writes colour, aligned depth and intrinsics of `bag` to the clip `out`; `force`: in place of one that is there. Stamps keep the distances of the camera's
/// clock; `camera` says where the camera stands.
///
/// # Errors
/// [`ConvertError`] when the recording cannot be read or the clip not written.
pub fn convert(
    bag: &Path,
    camera: &Camera,
    (out, force): (&Path, bool),
    info: &ClipInfo,
) -> Result<Converted, ConvertError> {
    let place = Destination::new(out, force)?;
    let source = CameraSource::Bag(bag.to_owned());
    let recorded = depth_pictures(bag).map_err(|e| refused(&source, &e))?;
    let bar = Progress::new("convert", recorded as u64);
    let mut conversion = Conversion { source, camera, known: BTreeSet::new(), begin: None, bar };
    let mut passes = Passes::new(place);
    let (mut played, mut fruitless) = (0, 0);
    while played < PASSES && fruitless < FRUITLESS && conversion.known.len() + NEVER_PAIRED < recorded {
        let known = conversion.known.len();
        let mut clip = passes.begin(info)?;
        let seen = conversion.play(&mut clip)?;
        played += 1;
        if conversion.known.len() > known {
            passes.keep(clip)?;
            fruitless = 0;
        } else {
            fruitless += 1;
            // A pass without a loss says more than one that lacked something itself.
            if seen == known {
                break;
            }
        }
    }
    let Conversion { known, begin: Some((camera, _)), .. } = conversion else {
        return Err(ConvertError::Empty { path: bag.to_owned() });
    };
    passes.finish(&camera, info)?;
    let unpaired = recorded.saturating_sub(known.len());
    Ok(Converted { file: out.to_owned(), frames: known.len(), missing: missing(&known), unpaired, passes: played })
}

fn refused(source: &CameraSource, error: &IndexError) -> ConvertError {
    let remedy = "give a .bag recorded by librealsense, with colour and depth".into();
    DeviceFault::NotOpened { device: source.to_string(), why: error.to_string(), remedy }.into()
}

/// What all passes have in common.
struct Conversion<'a> {
    source: CameraSource,
    camera: &'a Camera,
    /// Numbers of the pairs written.
    known: BTreeSet<u64>,
    /// How the camera projects; what takes its clock to this machine's [ns].
    begin: Option<(CameraInfo, u64)>,
    bar: Progress,
}

impl Conversion<'_> {
    /// One pass: writes the pairs that are not known yet. Pairs seen.
    fn play(&mut self, clip: &mut ClipWriter<Output>) -> Result<usize, ConvertError> {
        let (known, begin, bar) = (&mut self.known, &mut self.begin, &self.bar);
        let mut seen = BTreeSet::new();
        let mut described = false;
        stream::play(&self.source, self.camera, |moment| -> Result<(), ConvertError> {
            let number = moment.depth.sequence;
            seen.insert(number);
            if known.insert(number) {
                bar.show(known.len() as u64, "");
                // The camera's clock, begun at this machine's now.
                let begun = || (moment.info, now_ns().wrapping_sub(moment.depth.device_ns));
                let (camera, shift_ns) = begin.get_or_insert_with(begun);
                let stamped =
                    |header: ImageHeader| ImageHeader { stamp_ns: header.device_ns.wrapping_add(*shift_ns), ..header };
                let pair = [(stamped(moment.color), moment.color_pixels), (stamped(moment.depth), moment.depth_pixels)];
                write(clip, &pair, (!described).then_some(&*camera))?;
                described = true;
            }
            Ok(())
        })?;
        Ok(seen.len())
    }
}

/// Numbers between the first and the last that are not there.
fn missing(frames: &BTreeSet<u64>) -> Vec<u64> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Vec::new() };
    (*first..*last).filter(|number| !frames.contains(number)).collect()
}
