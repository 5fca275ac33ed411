//! The pixels of one view: colour, whether they show the object, and depth where it was measured.

use super::{Camera, Mask, ScanError, View};
use nalgebra::Isometry3;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::{Picture, read_alpha, read_picture};
use std::path::Path;

/// One view's pixels, row by row.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The picture's path as the scan lists it.
    pub name: String,
    /// The camera, for a picture of this size.
    pub camera: Camera,
    /// Its pose in the scan's frame [m].
    pub scan_from_camera: Isometry3<f64>,
    /// Red, green, blue.
    pub rgb: Vec<[u8; 3]>,
    /// Whether the object is seen.
    pub mask: Vec<bool>,
    /// Depth along the camera's axis [m], 0 where none was measured; empty without a depth picture.
    pub depth: Vec<f32>,
}

/// Neighbouring depths further apart than this are of two surfaces, and their mean is of none [share of the depth].
const ONE_SURFACE: f32 = 0.03;

/// Samples of a picture, so many bytes a pixel.
fn pixels(path: &Path, camera: &Camera, encoding: PixelEncoding) -> Result<Vec<u8>, ScanError> {
    let Picture::Pixels { header, pixels } = read_picture(path)? else {
        return Err(ScanError::content(path, "is neither a PNG nor a JPEG picture"));
    };
    if (header.width, header.height) != (camera.width, camera.height) {
        let what = format!(
            "has {} x {} pixels, its camera {} x {}; give pictures of the camera's size",
            header.width, header.height, camera.width, camera.height
        );
        return Err(ScanError::content(path, what));
    }
    if header.encoding != encoding {
        let what = match encoding {
            PixelEncoding::Rgb8 => "holds depth; colour or a mask has 8 bits a channel",
            PixelEncoding::Depth16 => "holds no depth; depth is a PNG with 16 bits of grey",
        };
        return Err(ScanError::content(path, what));
    }
    Ok(pixels)
}

impl Frame {
    /// `all`: everything in the picture counts, whatever its mask.
    pub(super) fn read(view: &View, depth_unit: f64, by: u32, all: bool) -> Result<Self, ScanError> {
        let camera = view.camera;
        let rgb: Vec<[u8; 3]> = pixels(&view.picture, &camera, PixelEncoding::Rgb8)?.as_chunks::<3>().0.to_vec();
        let mask: Vec<bool> = match &view.mask {
            _ if all => vec![true; rgb.len()],
            Mask::File(file) => {
                pixels(file, &camera, PixelEncoding::Rgb8)?.chunks_exact(3).map(|p| p[0] >= 128).collect()
            }
            Mask::Alpha => match read_alpha(&view.picture)? {
                Some(alpha) => alpha.iter().map(|a| *a >= 128).collect(),
                None => {
                    let what = "has no mask: give masks/NAME.png (white is the object) or an alpha channel";
                    return Err(ScanError::content(&view.picture, what));
                }
            },
        };
        let depth = match &view.depth {
            None => Vec::new(),
            Some(file) => {
                let counts = pixels(file, &camera, PixelEncoding::Depth16)?;
                let metres = |pair: &[u8]| f32::from(u16::from_le_bytes([pair[0], pair[1]])) * depth_unit as f32;
                counts.chunks_exact(2).map(metres).collect()
            }
        };
        let frame = Self { name: view.name.clone(), camera, scan_from_camera: view.scan_from_camera, rgb, mask, depth };
        Ok(if by > 1 { frame.reduced(by) } else { frame })
    }

    fn reduced(&self, by: u32) -> Self {
        let camera = self.camera.reduced(by);
        let (by, width) = (by as usize, self.camera.width as usize);
        let (mut rgb, mut mask, mut depth) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..camera.height as usize {
            for column in 0..camera.width as usize {
                let block = (0..by * by).map(|i| (row * by + i / by) * width + column * by + i % by);
                let mut sum = [0u32; 3];
                block.clone().for_each(|at| (0..3).for_each(|c| sum[c] += u32::from(self.rgb[at][c])));
                rgb.push(sum.map(|s| (s / (by * by) as u32) as u8));
                mask.push(2 * block.clone().filter(|at| self.mask[*at]).count() > by * by);
                if !self.depth.is_empty() {
                    depth.push(one_depth(block.map(|at| self.depth[at])));
                }
            }
        }
        Self { name: self.name.clone(), camera, scan_from_camera: self.scan_from_camera, rgb, mask, depth }
    }

    /// Pixels that show the object.
    pub fn masked(&self) -> usize {
        self.mask.iter().filter(|inside| **inside).count()
    }

    /// Whether the mask goes on to an edge of the picture, so that a part of the object may lie beside it.
    pub(crate) fn is_cut_off(&self) -> bool {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let mut rows = (0..width).flat_map(|column| [column, (height - 1) * width + column]);
        let mut columns = (0..height).flat_map(|row| [row * width, row * width + width - 1]);
        rows.any(|at| self.mask[at]) || columns.any(|at| self.mask[at])
    }

    /// How far a pixel is from the mask's border [pixel]: positive inside, negative outside, cut at `most`. Distances count steps to
    /// the eight neighbours.
    pub fn border_distance(&self, most: i16) -> Vec<i16> {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let steps = |of: bool| {
            let mut steps: Vec<i16> = self.mask.iter().map(|m| if *m == of { most } else { 0 }).collect();
            let mut lower = |at: usize, neighbour: usize| steps[at] = steps[at].min(steps[neighbour] + 1);
            for at in 0..width * height {
                let (column, row) = (at % width, at / width);
                if column > 0 {
                    lower(at, at - 1);
                }
                if row > 0 {
                    (column.saturating_sub(1)..=(column + 1).min(width - 1))
                        .for_each(|c| lower(at, (row - 1) * width + c));
                }
            }
            for at in (0..width * height).rev() {
                let (column, row) = (at % width, at / width);
                if column + 1 < width {
                    lower(at, at + 1);
                }
                if row + 1 < height {
                    (column.saturating_sub(1)..=(column + 1).min(width - 1))
                        .for_each(|c| lower(at, (row + 1) * width + c));
                }
            }
            steps
        };
        steps(true).iter().zip(steps(false)).map(|(inside, outside)| inside - outside).collect()
    }
}

/// The mean of measured depths where they are of one surface.
fn one_depth(depths: impl Iterator<Item = f32>) -> f32 {
    let measured: Vec<f32> = depths.filter(|z| *z > 0.0).collect();
    let (low, high) = measured.iter().fold((f32::MAX, 0.0f32), |(low, high), z| (low.min(*z), high.max(*z)));
    if measured.is_empty() || high - low > ONE_SURFACE * high {
        0.0
    } else {
        measured.iter().sum::<f32>() / measured.len() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::lens::Distortion;

    fn frame(mask: Vec<bool>, width: u32, height: u32) -> Frame {
        let camera = Camera { width, height, focal: [1.0; 2], centre: [0.0; 2], lens: Distortion::NONE };
        let count = mask.len();
        let pose = Isometry3::identity();
        Frame {
            name: "a".into(),
            camera,
            scan_from_camera: pose,
            rgb: vec![[10, 20, 30]; count],
            mask,
            depth: vec![1.0; count],
        }
    }

    #[test]
    fn the_distance_from_the_border_counts_steps_on_both_sides() {
        let mut mask = vec![false; 49];
        for row in 2..5 {
            (2..5).for_each(|column| mask[row * 7 + column] = true);
        }
        let distance = frame(mask, 7, 7).border_distance(9);
        assert_eq!((distance[3 * 7 + 3], distance[2 * 7 + 2], distance[7 + 1], distance[0]), (2, 1, -1, -2));
    }

    #[test]
    fn fewer_pixels_are_means_and_depth_across_an_edge_is_none() {
        let mut before = frame(vec![true; 16], 4, 4);
        before.depth[5] = 2.0;
        let after = before.reduced(2);
        assert_eq!((after.camera.width, after.rgb[0], after.depth[0], after.depth[1]), (2, [10, 20, 30], 0.0, 1.0));
    }
}
