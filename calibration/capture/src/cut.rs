//! Which pixels of a picture show the object of a scan, by their depth: what stands above the table near the place that is looked at.

use super::shots::Pixels;
use nalgebra::{Isometry3, Point3};
use shared_mem::cell::Intrinsics;
use shared_mem::msg::image::{ImageHeader, PixelEncoding};

/// One sigma of a stereo camera's depth over its square [1/m]: half a per cent at 1 m, the usual figure of a D455.
const DEPTH_NOISE: f64 = 0.005;
/// What is fewer sigmas of depth above the table is the table.
const MIN_HEIGHT_SIGMAS: f64 = 3.0;

/// What is cut out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// The middle of what is looked at, base frame [m].
    pub(super) at: Point3<f64>,
    /// What is further from it than this is no part of the object [m].
    pub(super) radius: f64,
    /// The table's top, base frame [m].
    pub(super) table: f64,
    /// The lens, without distortion.
    pub(super) pinhole: Intrinsics,
}

impl Cut {
    /// A mask of a depth picture, white where the object is; black where nothing was measured.
    pub(super) fn mask(&self, depth: &Pixels, base_from_camera: &Isometry3<f64>) -> Pixels {
        let width = depth.header.width.max(1) as usize;
        let scale = depth.header.depth_scale;
        let Intrinsics { fx, fy, cx, cy } = self.pinhole;
        let label = |(place, bytes): (usize, &[u8])| {
            let z = f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) * scale;
            let (u, v) = ((place % width) as f64, (place / width) as f64);
            let point = base_from_camera * Point3::new((u - cx) / fx * z, (v - cy) / fy * z, z);
            let above = point.z > self.table + MIN_HEIGHT_SIGMAS * DEPTH_NOISE * z * z;
            [if z > 0.0 && above && (point - self.at).norm() < self.radius { 255 } else { 0 }; 3]
        };
        let bytes = depth.bytes.chunks_exact(2).enumerate().flat_map(label).collect();
        let (encoding, stride) = (PixelEncoding::Rgb8, 3 * depth.header.width);
        Pixels { header: ImageHeader { encoding, stride, depth_scale: 0.0, ..depth.header }, bytes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn what_stands_above_the_table_near_the_place_is_white() {
        // Straight down from 0.5 m: the table, something 40 mm high, a hole, the same 0.2 m aside.
        let counts = [500_u16, 460, 0, 460];
        let bytes = counts.iter().flat_map(|count| count.to_le_bytes()).collect();
        let header = ImageHeader { width: 4, height: 1, stride: 8, depth_scale: 0.001, ..ImageHeader::default() };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let base_from_camera = Isometry3::from_parts(Vector3::new(0.5, 0.0, 0.5).into(), turn);
        let pinhole = Intrinsics { fx: 5.0, fy: 5.0, cx: 1.0, cy: 0.0 };
        let cut = Cut { at: Point3::new(0.5, 0.0, 0.02), radius: 0.1, table: 0.0, pinhole };
        let mask = cut.mask(&Pixels { header, bytes }, &base_from_camera);
        assert_eq!(mask.bytes, [[0; 3], [255; 3], [0; 3], [0; 3]].concat());
        assert_eq!((mask.header.stride, mask.header.encoding), (12, PixelEncoding::Rgb8));
    }
}
