//! What a picture tells of the robot: from a mask file, from the difference to a picture without the robot, or, where
//! there is neither, from a photo's own edges or from what stands out of a depth picture's planes.

use super::depth;
use super::frame::Evidence;
use super::grid::Grid;
use super::lens::Lens;
use anyhow::ensure;
use shared_mem::lens::Distortion;
use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::recording::{Picture, read_picture};
use std::path::Path;

/// Pixels as they were taken.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Red, green, blue, 0 to 255; or one depth [mm], 0 where nothing was measured.
    pub channels: Vec<Grid>,
}

/// Two pixels of one place differ when a colour does by this much, or the depth by that share.
const COLOUR: f32 = 24.0;
const DEPTH: f32 = 0.02;
/// A photo whose colours lie closer together than this shows nothing.
const CONTRAST: f32 = 12.0;
/// Shares of a mask that a robot can cover.
const COVERED: std::ops::Range<f64> = 1e-4..0.9;

impl Pixels {
    /// Reads a PNG or JPEG file.
    ///
    /// # Errors
    /// When it is no such file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::new(&read_picture(path)?)
    }

    /// From a recorded picture.
    ///
    /// # Errors
    /// When it is compressed in a way that is not known here.
    pub fn new(picture: &Picture) -> anyhow::Result<Self> {
        match picture {
            Picture::Pixels { header, pixels } => Ok(Self::unpacked(header, pixels)),
            Picture::Compressed { stamp_ns, bytes, .. } => {
                let unpacked = shared_mem::recording::unpack_picture(bytes, *stamp_ns);
                Self::new(&unpacked.map_err(anyhow::Error::msg)?)
            }
        }
    }

    fn unpacked(header: &ImageHeader, bytes: &[u8]) -> Self {
        let size = [header.width as usize, header.height as usize];
        let stride = header.stride as usize;
        let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
        let channels = match header.encoding {
            PixelEncoding::Rgb8 => {
                let channel = |c| Grid::from_fn(size[0], size[1], |x, y| f32::from(byte(y * stride + 3 * x + c)));
                (0..3).map(channel).collect()
            }
            PixelEncoding::Depth16 => {
                // A file does not tell its unit: millimetres, as a D455 writes them.
                let unit = if header.depth_scale > 0.0 { header.depth_scale as f32 * 1e3 } else { 1.0 };
                let depth = |x: usize, y: usize| {
                    unit * f32::from(u16::from_le_bytes([byte(y * stride + 2 * x), byte(y * stride + 2 * x + 1)]))
                };
                vec![Grid::from_fn(size[0], size[1], depth)]
            }
        };
        Self { size, channels }
    }

    /// Whether it shows depths, not colours.
    pub fn is_depth(&self) -> bool {
        self.channels.len() == 1
    }

    /// Free of the lens's distortion; what lies outside of the picture is black.
    pub fn undistorted(self, lens: &Lens, distortion: &Distortion) -> Self {
        if !distortion.is_bent() {
            return self;
        }
        let is_depth = self.is_depth();
        let flat = |grid: Grid| {
            // Between two depths there is nothing.
            if is_depth { grid.undistorted_nearest(lens, distortion) } else { grid.undistorted(lens, distortion, 0.0) }
        };
        Self { channels: self.channels.into_iter().map(flat).collect(), ..self }
    }

    /// The mean of the colours, 0 to 255.
    pub fn grey(&self) -> Grid {
        let share = 1.0 / self.channels.len().max(1) as f32;
        let [width, height] = self.size;
        let mean = |i: usize| self.channels.iter().map(|channel| channel.values[i]).sum::<f32>() * share;
        Grid::from_fn(width, height, |x, y| mean(y * width + x))
    }

    /// The picture by itself, free of distortion: a photo as it is, of a depth picture what stands out of its planes.
    ///
    /// # Errors
    /// When all of it looks the same.
    pub fn alone(&self, lens: &Lens, name: &str) -> anyhow::Result<Evidence> {
        let [r, g, b] = &self.channels[..] else {
            return checked(depth::silhouette(&self.channels[0], lens), name, "stands out of table, floor and walls");
        };
        let spread = |grid: &Grid| {
            let mut values = grid.values.clone();
            let last = values.len().saturating_sub(1);
            let mut at = |share: f64| *values.select_nth_unstable_by((share * last as f64) as usize, f32::total_cmp).1;
            at(0.995) - at(0.005)
        };
        let most = [r, g, b].map(spread).into_iter().fold(0.0, f32::max);
        ensure!(most >= CONTRAST, "{name} shows nothing: all of it is of one colour; check exposure and lens cap");
        Ok(Evidence::Photo([r.clone(), g.clone(), b.clone()]))
    }

    /// The robot as whatever differs from a picture without it.
    ///
    /// # Errors
    /// When the sizes differ, or nothing or everything does.
    pub fn against(&self, background: &Self, name: &str) -> anyhow::Result<Evidence> {
        ensure!(
            self.size == background.size && self.channels.len() == background.channels.len(),
            "{name} and its background are pictures of another kind or size: take both with the same camera"
        );
        let is_depth = self.is_depth();
        let differs = |i: usize| {
            let pairs = self.channels.iter().zip(&background.channels);
            pairs.into_iter().any(|(a, b)| {
                let (a, b) = (a.values[i], b.values[i]);
                if is_depth { a > 0.0 && (b == 0.0 || a < b * (1.0 - DEPTH)) } else { (a - b).abs() > COLOUR }
            })
        };
        let [width, height] = self.size;
        let share = Grid::from_fn(width, height, |x, y| f32::from(u8::from(differs(y * width + x))));
        checked(share, name, "differs from the background")
    }

    /// The robot as a mask file marks it: everything that is not black.
    ///
    /// # Errors
    /// When nothing or everything is marked.
    pub fn mask(&self, name: &str) -> anyhow::Result<Evidence> {
        let [width, height] = self.size;
        let lit = |i: usize| self.channels.iter().any(|grid| grid.values[i] > 127.0);
        let share = Grid::from_fn(width, height, |x, y| f32::from(u8::from(lit(y * width + x))));
        checked(share, name, "is marked")
    }
}

fn checked(share: Grid, name: &str, what: &str) -> anyhow::Result<Evidence> {
    let covered = share.values.iter().map(|v| f64::from(*v)).sum::<f64>() / share.values.len().max(1) as f64;
    ensure!(covered >= COVERED.start, "{name}: nothing to fit: no pixel of it {what}");
    ensure!(covered <= COVERED.end, "{name}: nothing to fit: all of it {what}");
    Ok(Evidence::Mask(share))
}
