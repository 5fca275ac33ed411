//! Colour and depth of one moment, as a camera beside the arm hands them over, and the topics they go to.

use crate::device::{Device, Lines};
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{ImagePublisher, Node, Publisher, TransportError};

/// How often intrinsics and pose are sent [ns].
const INFO_EVERY_NS: u64 = 1_000_000_000;

/// Colour and depth of one moment; depth is aligned to colour.
#[derive(Debug, Clone)]
pub(super) struct Moment {
    /// Of the colour picture.
    pub(super) color: ImageHeader,
    /// RGB8, row by row without padding.
    pub(super) color_pixels: Vec<u8>,
    /// Of the depth picture.
    pub(super) depth: ImageHeader,
    /// Little-endian counts, row by row without padding; 0 where nothing was measured.
    pub(super) depth_pixels: Vec<u8>,
    /// How both project. `stamp_ns` is the publisher's to set.
    pub(super) info: CameraInfo,
}

/// The topics of a camera.
pub(super) struct PictureLines {
    color: ImagePublisher,
    depth: ImagePublisher,
    info: Publisher<CameraInfo>,
    next_info_ns: u64,
}

impl PictureLines {
    /// Opens them for pictures of so many pixels.
    pub(super) fn open(node: &Node, pixels: usize) -> Result<Self, TransportError> {
        Ok(Self {
            color: node.image_publisher(topics::CAMERA_COLOR, 3 * pixels)?,
            depth: node.image_publisher(topics::CAMERA_DEPTH, 2 * pixels)?,
            info: node.publisher(topics::CAMERA_INFO)?,
            next_info_ns: 0,
        })
    }
}

impl<D: Device<Sample = Moment, Order = ()>> Lines<D> for PictureLines {
    fn order(&mut self) -> Result<Option<()>, TransportError> {
        self.info.greet_new_readers()?;
        Ok(None)
    }

    fn publish(&mut self, moment: &Moment) -> Result<(), TransportError> {
        if now_ns() >= self.next_info_ns {
            self.info.send(&CameraInfo { stamp_ns: now_ns(), ..moment.info })?;
            self.next_info_ns = now_ns() + INFO_EVERY_NS;
        }
        for (port, header, pixels) in
            [(&self.depth, &moment.depth, &moment.depth_pixels), (&self.color, &moment.color, &moment.color_pixels)]
        {
            port.send_with(pixels.len(), |bytes| {
                bytes.copy_from_slice(pixels);
                *header
            })?;
        }
        Ok(())
    }
}
