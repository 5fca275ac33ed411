//! Frames out of librealsense: colour with depth aligned to it, the camera's own stamps and their domain, exposure. A
//! device or a `.bag`, which is played at the pace it was recorded with.
//!
//! librealsense's synchroniser hands out pairs; a frame without its partner is left out.

use super::lens;
use super::moment::Moment;
use crate::camera::CameraSource;
use crate::device::{Device, DeviceFault};
use realsense_rust::base::{Rs2Distortion, Rs2Intrinsics};
use realsense_rust::config::Config;
use realsense_rust::context::Context;
use realsense_rust::frame::{ColorFrame, CompositeFrame, DepthFrame, FrameEx, PixelKind};
use realsense_rust::kind::{Rs2DistortionModel, Rs2Format, Rs2FrameMetadata, Rs2StreamKind, Rs2TimestampDomain};
use realsense_rust::pipeline::{ActivePipeline, FrameWaitError, InactivePipeline};
use realsense_rust::processing_blocks::align::Align;
use shared_mem::cell::Camera;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding, StampDomain};
use shared_mem::time::now_ns;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// Longest wait for a frame.
const PATIENCE: Duration = Duration::from_millis(200);
/// So many of them without a frame: a device is gone, a recording over.
const SILENT_AFTER: u32 = 6;

/// Pairs on their way to be aligned. librealsense lends out a few more.
const WAITING: usize = 8;

/// A running camera or recording.
pub(super) struct Stream {
    frames: Frames,
    aligner: Aligner,
}

/// Pairs as they come.
struct Frames {
    pipeline: ActivePipeline,
    source: CameraSource,
    info: CameraInfo,
    silent_for: u32,
}

/// From a pair to a moment.
struct Aligner {
    align: Align,
    source: CameraSource,
    info: CameraInfo,
    domain: StampDomain,
}

impl Stream {
    /// Starts it with the picture size and rate of `camera` (a recording keeps its own).
    pub(super) fn open(source: &CameraSource, camera: &Camera) -> Result<Self, DeviceFault> {
        let frames = Frames::open(source, camera)?;
        Ok(Self { aligner: Aligner::new(source, frames.info)?, frames })
    }

    /// Pixels of a picture.
    pub(super) fn pixels(&self) -> usize {
        self.frames.info.width as usize * self.frames.info.height as usize
    }
}

impl Device for Stream {
    type Sample = Moment;
    type Order = ();

    fn round(&mut self, _order: Option<&()>) -> Result<Option<Moment>, DeviceFault> {
        match self.frames.next()? {
            Some(pair) => self.aligner.moment(pair, now_ns()),
            None => Ok(None),
        }
    }

    fn complaint(&self) -> Option<String> {
        (self.aligner.domain == StampDomain::SystemTime).then(|| {
            "stamps its pictures by the host's clock, too coarse to calibrate with; build librealsense with the RSUSB \
             backend or patch the kernel for metadata"
                .into()
        })
    }
}

/// Plays a recording once and shows every pair to `each`. A thread of its own takes the pairs from librealsense, which keeps
/// no more than the newest for a reader that is late.
pub(super) fn play<E: From<DeviceFault>>(
    source: &CameraSource,
    camera: &Camera,
    mut each: impl FnMut(Moment) -> Result<(), E>,
) -> Result<(), E> {
    let (pairs, waiting) = mpsc::sync_channel(WAITING);
    let (from, seen_by) = (source.clone(), camera.clone());
    let reader = thread::spawn(move || -> Result<(), DeviceFault> {
        let mut frames = Frames::open(&from, &seen_by)?;
        while !frames.have_ended() {
            let Some(pair) = frames.next()? else { continue };
            if pairs.send((pair, now_ns(), frames.info)).is_err() {
                return Ok(());
            }
        }
        Ok(())
    });
    let mut aligner = None;
    for (pair, arrived_ns, info) in waiting {
        let aligner = match &mut aligner {
            Some(aligner) => aligner,
            none => none.insert(Aligner::new(source, info)?),
        };
        if let Some(moment) = aligner.moment(pair, arrived_ns)? {
            each(moment)?;
        }
    }
    let read = reader.join().unwrap_or_else(|_| Err(gone(source, "its reader failed; please report this".into())));
    Ok(read?)
}

fn gone(source: &CameraSource, why: String) -> DeviceFault {
    DeviceFault::Gone { device: source.to_string(), why }
}

fn refused(source: &CameraSource, why: String) -> DeviceFault {
    let remedy = match source {
        CameraSource::Device => {
            "plug it into a USB 3 port, end other programs that use it, and install librealsense's udev rules; \
             [camera] width, height and rate must be ones it has (640, 480, 30)"
        }
        CameraSource::Bag(_) => "give a .bag recorded by librealsense, with colour and depth",
    };
    DeviceFault::NotOpened { device: source.to_string(), why, remedy: remedy.into() }
}

impl Frames {
    fn open(source: &CameraSource, camera: &Camera) -> Result<Self, DeviceFault> {
        let failed = |e: &dyn std::fmt::Display| refused(source, e.to_string());
        let context = Context::new().map_err(|e| failed(&e))?;
        let pipeline = InactivePipeline::try_from(&context).map_err(|e| failed(&e))?;
        let mut config = Config::new();
        match source {
            CameraSource::Device => {
                let (width, height, rate) =
                    (camera.width as usize, camera.height as usize, camera.rate.round() as usize);
                config
                    .enable_stream(Rs2StreamKind::Color, None, width, height, Rs2Format::Rgb8, rate)
                    .and_then(|c| c.enable_stream(Rs2StreamKind::Depth, None, width, height, Rs2Format::Z16, rate))
                    .map_err(|e| failed(&e))?;
            }
            CameraSource::Bag(file) if !file.is_file() => {
                return Err(refused(source, "there is no such file".into()));
            }
            CameraSource::Bag(file) => {
                config.enable_device_from_file(file, false).map_err(|e| failed(&e))?;
            }
        }
        let pipeline = pipeline.start(Some(config)).map_err(|e| failed(&e))?;
        let kinds = pipeline.profile().streams();
        let color = kinds.iter().find(|stream| stream.kind() == Rs2StreamKind::Color);
        let has_depth = kinds.iter().any(|stream| stream.kind() == Rs2StreamKind::Depth);
        let Some(color) = color.filter(|_| has_depth) else {
            return Err(refused(source, "it does not give both colour and depth".into()));
        };
        let info = described(&color.intrinsics().map_err(|e| failed(&e))?, camera);
        Ok(Self { pipeline, source: source.clone(), info, silent_for: 0 })
    }

    /// A recording has come to its end.
    fn have_ended(&self) -> bool {
        matches!(self.source, CameraSource::Bag(_)) && self.silent_for >= SILENT_AFTER
    }

    /// The next pair; `None` where none came in time.
    fn next(&mut self) -> Result<Option<CompositeFrame>, DeviceFault> {
        match self.pipeline.wait(Some(PATIENCE)) {
            Ok(pair) => {
                self.silent_for = 0;
                Ok(Some(pair))
            }
            Err(FrameWaitError::DidTimeoutBeforeFrameArrival) => {
                self.silent_for = self.silent_for.saturating_add(1);
                let device = self.source == CameraSource::Device;
                match device && self.silent_for >= SILENT_AFTER {
                    true => Err(gone(&self.source, "no frame for a second".into())),
                    false => Ok(None),
                }
            }
            Err(e) => Err(gone(&self.source, e.to_string())),
        }
    }
}

impl Aligner {
    fn new(source: &CameraSource, info: CameraInfo) -> Result<Self, DeviceFault> {
        let align = Align::new(Rs2StreamKind::Color, 4).map_err(|e| refused(source, e.to_string()))?;
        Ok(Self { align, source: source.clone(), info, domain: StampDomain::default() })
    }

    /// A pair with its depth as the colour camera would see it; `None` where a part of it is missing.
    fn moment(&mut self, pair: CompositeFrame, arrived_ns: u64) -> Result<Option<Moment>, DeviceFault> {
        let failed = |e: &dyn std::fmt::Display| gone(&self.source, format!("depth cannot be aligned: {e}"));
        self.align.queue(pair).map_err(|e| failed(&e))?;
        let aligned = self.align.wait(PATIENCE).map_err(|e| failed(&e))?;
        let (colors, depths) = (aligned.frames_of_type::<ColorFrame>(), aligned.frames_of_type::<DepthFrame>());
        let (Some(color), Some(depth)) = (colors.first(), depths.first()) else { return Ok(None) };
        let scale = f64::from(depth.depth_units().map_err(|e| failed(&e))?);
        let sequence = depth.frame_number();
        let shared = |header: ImageHeader| ImageHeader { stamp_ns: arrived_ns, sequence, ..header };
        let moment = Moment {
            color: shared(header(color, PixelEncoding::Rgb8, 0.0)),
            color_pixels: rgb(color),
            depth: shared(header(depth, PixelEncoding::Depth16, scale)),
            depth_pixels: counts(depth),
            info: self.info,
        };
        self.domain = moment.depth.stamp_domain;
        let pixels = self.info.width as usize * self.info.height as usize;
        let whole = moment.color_pixels.len() == 3 * pixels && moment.depth_pixels.len() == 2 * pixels;
        Ok(whole.then_some(moment))
    }
}

/// How the colour camera projects, and where cell.toml puts it.
fn described(intrinsics: &Rs2Intrinsics, camera: &Camera) -> CameraInfo {
    let pinhole = [intrinsics.fx(), intrinsics.fy(), intrinsics.ppx(), intrinsics.ppy()].map(f64::from);
    let Rs2Distortion { model, coeffs } = intrinsics.distortion();
    let coefficients = coeffs.map(f64::from);
    let size = [intrinsics.width() as u32, intrinsics.height() as u32];
    let distortion = match model {
        Rs2DistortionModel::BrownConradyInverse => lens::inverted(&coefficients, pinhole, size),
        Rs2DistortionModel::BrownConrady | Rs2DistortionModel::BrownConradyModified => coefficients,
        _ => [0.0; 5],
    };
    CameraInfo {
        stamp_ns: 0,
        width: size[0],
        height: size[1],
        intrinsics: pinhole,
        distortion,
        position: camera.pose.position,
        wxyz: camera.pose.orientation,
    }
}

fn header<K>(frame: &realsense_rust::frame::ImageFrame<K>, encoding: PixelEncoding, depth_scale: f64) -> ImageHeader {
    let bytes = if encoding == PixelEncoding::Rgb8 { 3 } else { 2 };
    // Micro- to nanoseconds; negative is no exposure.
    let exposure = frame.metadata(Rs2FrameMetadata::ActualExposure).and_then(|us| u64::try_from(us).ok());
    ImageHeader {
        device_ns: (frame.timestamp() * 1e6) as u64,
        exposure_ns: exposure.unwrap_or(0) * 1000,
        width: frame.width() as u32,
        height: frame.height() as u32,
        stride: (frame.width() * bytes) as u32,
        encoding,
        depth_scale,
        stamp_domain: match frame.timestamp_domain() {
            Rs2TimestampDomain::HardwareClock => StampDomain::HardwareClock,
            Rs2TimestampDomain::SystemTime => StampDomain::SystemTime,
            Rs2TimestampDomain::GlobalTime => StampDomain::GlobalTime,
        },
        ..ImageHeader::default()
    }
}

fn rgb(frame: &ColorFrame) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(3 * frame.width() * frame.height());
    for pixel in frame.iter() {
        match pixel {
            PixelKind::Rgb8 { r, g, b } | PixelKind::Rgba8 { r, g, b, .. } => pixels.extend([*r, *g, *b]),
            PixelKind::Bgr8 { b, g, r } | PixelKind::Bgra8 { b, g, r, .. } => pixels.extend([*r, *g, *b]),
            _ => {}
        }
    }
    pixels
}

fn counts(frame: &DepthFrame) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(2 * frame.width() * frame.height());
    for pixel in frame.iter() {
        if let PixelKind::Z16 { depth } = pixel {
            pixels.extend(depth.to_le_bytes());
        }
    }
    pixels
}
