//! A clip of any kind: its joints and poses as every caller gets them, and everything that was recorded beside them, on
//! the same clock.

use super::super::container::Messages;
use super::super::device_clock::DeviceClock;
use super::super::own::{is_own, well_stamped};
use super::super::ros2::CompressedImage;
use super::super::writer::{METADATA, UNIX_OFFSET_NS};
use super::super::{Clip, ClipMessages, Payload, Picture, ReadError, Session, read_arm_states, twinaligner};
use super::npz;
use crate::cell::{Cell, ClipEntry};
use crate::input;
use crate::msg::arm::ArmState;
use crate::msg::image::{CameraInfo, ImageHeader, PixelEncoding, StampDomain};
use std::path::{Path, PathBuf};

/// What a TwinAligner folder holds beside joints and poses.
const CAMERA: &str = "cam_K.txt";
const COLOUR: &str = "rgb";
const DEPTH: &str = "depth";

/// A clip that is to be written in another format.
pub(super) struct Source {
    pub(super) clip: Clip,
    pub(super) path: PathBuf,
    pub(super) kind: Kind,
}

/// What it was recorded with.
pub(super) enum Kind {
    /// By `rt_bridge record`.
    Own(Own),
    /// A ROS 2 bag.
    Bag,
    /// A TwinAligner folder.
    Folder,
}

/// The clocks of an own clip, and what its states hold beside joints.
pub(super) struct Own {
    /// From its stamps to Unix time [ns].
    unix_offset_ns: i64,
    clock: DeviceClock,
    latency_ns: u64,
    pub(super) states: Vec<ArmState>,
}

/// Something beside joints and poses.
pub(super) struct Beside {
    /// Where the source has it: a topic, or in a folder the file or the folder of files.
    pub(super) topic: String,
    /// On the clock of the clip's series [ns].
    pub(super) stamp_ns: u64,
    pub(super) payload: Payload,
}

impl Source {
    pub(super) fn open(session: &Session, entry: &ClipEntry) -> Result<Self, ReadError> {
        let path = session.folder.join(&entry.file);
        let clip = session.read(entry)?;
        let kind = if path.is_dir() { Kind::Folder } else { kind_of_file(&path, &session.cell)? };
        Ok(Self { clip, path, kind })
    }

    pub(super) fn is_own(&self) -> bool {
        matches!(self.kind, Kind::Own(_))
    }

    /// Unix time of a stamp of the clip, where it has one; the stamp itself otherwise [ns].
    pub(super) fn unix_ns(&self, stamp_ns: u64) -> u64 {
        match &self.kind {
            Kind::Own(own) => stamp_ns.saturating_add_signed(own.unix_offset_ns),
            Kind::Bag | Kind::Folder => stamp_ns,
        }
    }

    /// Everything beside joints and poses, in the order it was recorded.
    pub(super) fn beside(&self) -> Result<Box<dyn Iterator<Item = Result<Beside, ReadError>> + '_>, ReadError> {
        if matches!(self.kind, Kind::Folder) {
            let stamps = twinaligner::picture_stamps_ns(&self.path)?;
            let camera = stamps.first().and_then(|first| camera(&self.path, *first)).map(Ok);
            return Ok(Box::new(camera.into_iter().chain(FolderPictures { folder: &self.path, stamps, next: 0 })));
        }
        let messages = ClipMessages::open(&self.path, &[])?;
        Ok(Box::new(messages.filter_map(|message| match message {
            Err(error) => Some(Err(error)),
            Ok(message) => self.place(message.topic, message.payload).map(Ok),
        })))
    }

    /// `None` for joints, poses and what a twin said.
    fn place(&self, topic: String, payload: Payload) -> Option<Beside> {
        let (stamp_ns, seen) = match &payload {
            Payload::CameraInfo(info) => (info.stamp_ns, false),
            Payload::Picture(Picture::Pixels { header, .. }) => (header.stamp_ns, true),
            Payload::Picture(Picture::Compressed { stamp_ns, .. }) => (*stamp_ns, true),
            Payload::Wrench(wrench) => (wrench.stamp_ns, false),
            Payload::Gripper(gripper) => (gripper.stamp_ns, false),
            Payload::Event(event) => (event.stamp_ns, false),
            _ => return None,
        };
        Some(Beside { topic, stamp_ns: self.clip_ns(stamp_ns, seen), payload })
    }

    /// A recorded stamp by the clock of the clip's series; what was `seen` is stamped when its picture was taken.
    fn clip_ns(&self, stamp_ns: u64, seen: bool) -> u64 {
        match &self.kind {
            Kind::Own(own) => own.clock.map(if seen { stamp_ns.saturating_sub(own.latency_ns) } else { stamp_ns }),
            Kind::Bag | Kind::Folder => stamp_ns,
        }
    }

    /// The states of an own clip with their stamps on the clip's clock.
    pub(super) fn states(&self) -> impl Iterator<Item = (u64, &ArmState)> {
        let own = match &self.kind {
            Kind::Own(own) => Some(own),
            Kind::Bag | Kind::Folder => None,
        };
        own.into_iter().flat_map(|own| own.states.iter().map(|state| (own.clock.map(state.stamp_ns), state)))
    }
}

fn kind_of_file(path: &Path, cell: &Cell) -> Result<Kind, ReadError> {
    let mut messages = Messages::open(path)?;
    messages.next()?;
    if !is_own(&messages) {
        return Ok(Kind::Bag);
    }
    let record = messages.metadata.iter().find(|m| m.name == METADATA);
    let offset = record.and_then(|record| record.pairs.get(UNIX_OFFSET_NS)?.parse().ok());
    // A clip without an arm has no robot's clock.
    let states = read_arm_states(path).unwrap_or_default();
    let stamps = |states: &[ArmState]| states.iter().map(|s| (s.stamp_ns, s.device_ns)).unzip();
    let (host, device): (Vec<u64>, Vec<u64>) = stamps(&states);
    let (kept, _already_said_by_the_clip) = well_stamped(&host, &device).map_err(|what| ReadError::kind(path, what))?;
    let states: Vec<ArmState> = kept.iter().filter_map(|row| states.get(*row).cloned()).collect();
    let (host, device): (Vec<u64>, Vec<u64>) = stamps(&states);
    Ok(Kind::Own(Own {
        unix_offset_ns: offset.unwrap_or(0),
        clock: DeviceClock::new(&host, &device),
        latency_ns: cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64),
        states,
    }))
}

/// What `cam_K.txt` tells about the camera; `None` where it is not there or no matrix. Its pictures tell their size.
fn camera(folder: &Path, stamp_ns: u64) -> Option<Beside> {
    let text = input::text(&folder.join(CAMERA), input::Kind::Configuration).ok()?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
    let &[fx, _, cx, _, fy, cy, ..] = numbers.as_slice() else { return None };
    // A PNG's size stands behind its signature and the name of its first part.
    let png = input::bytes(&folder.join("rgb/00000.png"), input::Kind::Picture).unwrap_or_default();
    let size = |at: usize| png.get(at..at + 4).map_or(0, |b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]));
    let intrinsics = [fx, fy, cx, cy];
    let info = CameraInfo { stamp_ns, width: size(16), height: size(20), intrinsics, ..CameraInfo::default() };
    Some(Beside { topic: CAMERA.into(), stamp_ns, payload: Payload::CameraInfo(Box::new(info)) })
}

/// Colour and depth of each frame of a TwinAligner folder, as far as they are there.
struct FolderPictures<'a> {
    folder: &'a Path,
    stamps: Vec<u64>,
    /// Two a frame: colour, depth.
    next: usize,
}

impl Iterator for FolderPictures<'_> {
    type Item = Result<Beside, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let (frame, is_depth) = (self.next / 2, self.next % 2 == 1);
            let stamp_ns = *self.stamps.get(frame)?;
            self.next += 1;
            let topic = if is_depth { DEPTH } else { COLOUR };
            let file = self.folder.join(topic).join(format!("{frame:05}.{}", if is_depth { "npz" } else { "png" }));
            if !file.is_file() {
                continue;
            }
            let of = if is_depth { input::Kind::Array } else { input::Kind::Picture };
            let picture = input::bytes(&file, of).map_err(ReadError::from).and_then(|bytes| {
                let read = if is_depth { depth(&bytes, stamp_ns) } else { colour(&bytes, stamp_ns) };
                read.map_err(|what| ReadError::kind(&file, what))
            });
            return Some(picture.map(|picture| Beside {
                topic: topic.into(),
                stamp_ns,
                payload: Payload::Picture(picture),
            }));
        }
    }
}

fn colour(bytes: &[u8], stamp_ns: u64) -> Result<Picture, String> {
    Picture::from_compressed(&CompressedImage { stamp_ns, format: "png", data: bytes })
}

/// Metres become counts of a millimetre, as the recorder's camera gave them.
fn depth(bytes: &[u8], stamp_ns: u64) -> Result<Picture, String> {
    let array = npz::parse(bytes, "depth")?;
    let &[height, width] = array.shape.as_slice() else { return Err("is no picture of rows and columns".into()) };
    let count = |metres: &f64| ((metres * 1e3).round().clamp(0.0, 65535.0) as u16).to_le_bytes();
    let size = |n: usize| u32::try_from(n).map_err(|_| "is too large a picture".to_owned());
    let header = ImageHeader {
        stamp_ns,
        device_ns: stamp_ns,
        width: size(width)?,
        height: size(height)?,
        stride: size(2 * width)?,
        encoding: PixelEncoding::Depth16,
        depth_scale: 1e-3,
        stamp_domain: StampDomain::SystemTime,
        ..ImageHeader::default()
    };
    Ok(Picture::Pixels { header, pixels: array.values.iter().flat_map(count).collect() })
}
