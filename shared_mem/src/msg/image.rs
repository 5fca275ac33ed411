//! Pictures: pixels travel as a byte slice, this header beside them.

use super::Message as _;
use super::check::{self, Wrong};
use super::wire::{codes, plain, wire};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// Describes the bytes of one picture. User header of `/camera/color` and `/camera/depth`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImageHeader {
    /// When the picture reached this machine: monotonic clock [ns].
    pub stamp_ns: u64,
    /// The camera's own stamp [ns], in the clock named by `stamp_domain`.
    pub device_ns: u64,
    /// The camera's frame counter. Colour and depth of one moment share it.
    pub sequence: u64,
    /// Exposure time [ns], 0 when not known.
    pub exposure_ns: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// How a pixel is stored.
    pub encoding: PixelEncoding,
    /// Metres per count of a depth pixel; 0 for colour.
    pub depth_scale: f64,
    /// Which clock `device_ns` belongs to.
    pub stamp_domain: StampDomain,
    /// Keeps the size a multiple of 8; always 0.
    pub reserved: u32,
}

impl ImageHeader {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("device_ns", self.device_ns)?;
        check::running("sequence", self.sequence)?;
        check::running("exposure_ns", self.exposure_ns)?;
        check::side("width", self.width)?;
        check::side("height", self.height)?;
        let shortest = u64::from(self.width) * u64::from(self.encoding.bytes_per_pixel());
        check::count("stride", self.stride, shortest, u32::MAX.into())?;
        check::number("depth_scale", self.depth_scale)
    }

    /// Whether the header describes as many bytes as came.
    ///
    /// # Errors
    /// [`Wrong::PictureSize`] when it does not.
    pub fn check_size(&self, bytes: usize) -> Result<(), Wrong> {
        let (bytes, described) = (bytes as u64, u64::from(self.stride) * u64::from(self.height));
        if bytes == described { Ok(()) } else { Err(Wrong::PictureSize { bytes, described }) }
    }
}

wire!("twinalign/ImageHeader/2" ImageHeaderWire: ImageHeader {
    stamp_ns: u64,
    device_ns: u64,
    sequence: u64,
    exposure_ns: u64,
    width: u32,
    height: u32,
    stride: u32,
    encoding: PixelEncoding,
    depth_scale: f64,
    stamp_domain: StampDomain,
    reserved: u32,
});

impl Default for ImageHeaderWire {
    fn default() -> Self {
        ImageHeader::default().to_wire()
    }
}

/// How a pixel is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelEncoding {
    /// Three bytes: red, green, blue.
    #[default]
    Rgb8 = 0,
    /// Little-endian `u16`, in units of `depth_scale`; 0 is no measurement.
    Depth16 = 1,
}

codes!(PixelEncoding: Rgb8, Depth16);

impl PixelEncoding {
    const ALL: [Self; 2] = [Self::Rgb8, Self::Depth16];

    /// Bytes of one pixel.
    pub fn bytes_per_pixel(self) -> u32 {
        match self {
            Self::Rgb8 => 3,
            Self::Depth16 => 2,
        }
    }

    /// What ROS and Foxglove call it (`sensor_msgs/image_encodings.hpp`).
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb8 => "rgb8",
            Self::Depth16 => "16UC1",
        }
    }

    /// The encoding of a [`Self::name`]; `None` for any other.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|encoding| encoding.name() == name)
    }
}

/// Which clock a camera stamped with: librealsense's three domains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StampDomain {
    /// The camera's hardware clock.
    #[default]
    HardwareClock = 0,
    /// The host's clock at arrival: too coarse to calibrate with.
    SystemTime = 1,
    /// The hardware clock mapped to the host's.
    GlobalTime = 2,
}

codes!(StampDomain: HardwareClock, SystemTime, GlobalTime);

/// How the camera projects, and where it stands. Topic `/camera/info`.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/CameraInfo/1")]
#[repr(C)]
pub struct CameraInfo {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths and principal point [pixel]: fx, fy, cx, cy. Pixel centres lie at whole numbers.
    pub intrinsics: [f64; 4],
    /// Brown-Conrady coefficients k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Camera (optical frame) in the base frame: position [m].
    pub position: [f64; 3],
    /// Camera (optical frame) in the base frame: orientation `w, x, y, z`.
    pub wxyz: [f64; 4],
}

impl Default for CameraInfo {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            width: 0,
            height: 0,
            intrinsics: [0.0; 4],
            distortion: [0.0; 5],
            position: [0.0; 3],
            wxyz: [1.0, 0.0, 0.0, 0.0],
        }
    }
}

impl CameraInfo {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::side("width", self.width)?;
        check::side("height", self.height)?;
        check::numbers("intrinsics", &self.intrinsics)?;
        check::numbers("distortion", &self.distortion)?;
        check::numbers("position", &self.position)?;
        check::quaternion("wxyz", &self.wxyz)
    }
}

plain!(CameraInfo);
