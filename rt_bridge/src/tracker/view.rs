//! One camera, and one moment of it: rays, counts, colours. Depth is aligned to colour, as `/camera/depth` is.
//!
//! Everything downstream works with *inverse depth* [1/m]: a stereo camera measures a disparity, so its noise is the same
//! everywhere there, and every plane is linear in it.

use nalgebra::{Isometry3, Vector3};
use shared_mem::lens::Distortion;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use twin::render::Pinhole;

/// How a camera projects and where it stands.
#[derive(Debug, Clone)]
pub struct View {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pinhole: Pinhole,
    pub(super) base_from_camera: Isometry3<f64>,
    /// For every pixel of an undistorted picture the pixel of the camera's own picture; none where they are the same.
    source: Option<Vec<u32>>,
}

/// Beyond the picture, in [`View::source`].
const OUTSIDE: u32 = u32::MAX;

impl View {
    /// From what `/camera/info` says; `None` where it describes no camera.
    pub fn new(info: &CameraInfo) -> Option<Self> {
        let [fx, fy, cx, cy] = info.intrinsics.map(|v| v as f32);
        let pose = shared_mem::frames::Pose::<shared_mem::frames::Base, shared_mem::frames::Camera>::from_parts(
            info.position,
            info.wxyz,
        )?;
        let (width, height) = (info.width as usize, info.height as usize);
        if !(fx > 0.0 && fy > 0.0 && width > 0 && height > 0) {
            return None;
        }
        let lens = Distortion::brown(info.distortion);
        let source = lens.is_bent().then(|| undistorted(info, &lens));
        Some(Self { width, height, pinhole: Pinhole { fx, fy, cx, cy }, base_from_camera: pose.isometry(), source })
    }

    /// The ray through a pixel, of depth 1.
    #[inline]
    pub(super) fn ray(&self, u: f32, v: f32) -> Vector3<f32> {
        let Pinhole { fx, fy, cx, cy } = self.pinhole;
        Vector3::new((u - cx) / fx, (v - cy) / fy, 1.0)
    }

    /// Where a point of the base frame lands in a picture without distortion [pixel].
    pub fn project(&self, point: &[f64; 3]) -> [f64; 2] {
        self.pixel(&self.base_from_camera.inverse_transform_point(&nalgebra::Point3::from(*point)).coords)
    }

    /// Where a point of the camera frame lands [pixel].
    pub(super) fn pixel(&self, p: &Vector3<f64>) -> [f64; 2] {
        let Pinhole { fx, fy, cx, cy } = self.pinhole;
        [f64::from(fx) * p.x / p.z + f64::from(cx), f64::from(fy) * p.y / p.z + f64::from(cy)]
    }

    /// Where in the camera's own picture the undistorted pixel lies.
    #[inline]
    fn place(&self, u: usize, v: usize) -> Option<(usize, usize)> {
        match &self.source {
            None => Some((u, v)),
            Some(source) => match source[v * self.width + u] {
                OUTSIDE => None,
                at => Some((at as usize % self.width, at as usize / self.width)),
            },
        }
    }
}

/// For every pixel of the picture that a pinhole would have taken.
fn undistorted(info: &CameraInfo, lens: &Distortion) -> Vec<u32> {
    let [fx, fy, cx, cy] = info.intrinsics;
    let mut source = Vec::with_capacity((info.width * info.height) as usize);
    for v in 0..info.height {
        for u in 0..info.width {
            let seen = lens.bend((f64::from(u) - cx) / fx, (f64::from(v) - cy) / fy).0;
            let (column, row) = ((seen.x * fx + cx).round(), (seen.y * fy + cy).round());
            let inside = (0.0..f64::from(info.width)).contains(&column) && (0.0..f64::from(info.height)).contains(&row);
            source.push(if inside { row as u32 * info.width + column as u32 } else { OUTSIDE });
        }
    }
    source
}

/// Depth, and colour where there is any, of one moment.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    depth: Rows<'a>,
    color: Option<Rows<'a>>,
    /// Metres per count.
    scale: f32,
}

#[derive(Debug, Clone, Copy)]
struct Rows<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Frame<'a> {
    /// From the pictures and their headers; `None` where they are no depth and colour picture of `view`'s size.
    pub fn new(view: &View, depth: (&ImageHeader, &'a [u8]), color: Option<(&ImageHeader, &'a [u8])>) -> Option<Self> {
        let rows = |(header, bytes): (&ImageHeader, &'a [u8]), encoding, pixel: usize| {
            let stride = header.stride as usize;
            let fits = (header.width as usize, header.height as usize) == (view.width, view.height)
                && header.encoding == encoding
                && stride >= view.width * pixel
                && bytes.len() >= stride * (view.height - 1) + view.width * pixel;
            fits.then_some(Rows { bytes, stride })
        };
        let scale = depth.0.depth_scale as f32;
        let depth = rows(depth, PixelEncoding::Depth16, 2)?;
        let color = color.and_then(|color| rows(color, PixelEncoding::Rgb8, 3));
        (scale > 0.0).then_some(Self { depth, color, scale })
    }

    /// Inverse depth at a pixel of the undistorted picture [1/m]; 0 where nothing was measured.
    #[inline]
    pub(super) fn inverse_depth(&self, view: &View, u: usize, v: usize) -> f32 {
        let Some((u, v)) = view.place(u, v) else { return 0.0 };
        let at = v * self.depth.stride + 2 * u;
        match u16::from_le_bytes([self.depth.bytes[at], self.depth.bytes[at + 1]]) {
            0 => 0.0,
            count => 1.0 / (f32::from(count) * self.scale),
        }
    }

    /// Metres per count.
    pub(super) fn scale(&self) -> f32 {
        self.scale
    }

    /// Red, green and blue of a pixel of the undistorted picture.
    #[inline]
    pub(super) fn color(&self, view: &View, u: usize, v: usize) -> Option<[u8; 3]> {
        let rows = self.color.as_ref()?;
        let (u, v) = view.place(u, v)?;
        let at = v * rows.stride + 3 * u;
        Some([rows.bytes[at], rows.bytes[at + 1], rows.bytes[at + 2]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(distortion: [f64; 5]) -> CameraInfo {
        CameraInfo { width: 64, height: 48, intrinsics: [60.0, 60.0, 31.5, 23.5], distortion, ..CameraInfo::default() }
    }

    #[test]
    fn a_lens_that_bends_inwards_is_read_nearer_to_the_middle() {
        let view = View::new(&info([-0.2, 0.0, 0.0, 0.0, 0.0])).expect("a camera");
        assert_eq!(view.place(32, 24), Some((32, 24)));
        let (u, v) = view.place(60, 24).expect("inside");
        assert!((56..60).contains(&u) && v == 24, "{u} {v}");
        assert!(View::new(&info([0.0; 5])).expect("a camera").source.is_none());
        assert!(View::new(&CameraInfo::default()).is_none());
    }

    #[test]
    fn a_picture_of_another_size_or_kind_is_refused() {
        let view = View::new(&info([0.0; 5])).expect("a camera");
        let bytes = vec![1; 64 * 48 * 2];
        let header = ImageHeader {
            width: 64,
            height: 48,
            stride: 128,
            encoding: PixelEncoding::Depth16,
            depth_scale: 0.001,
            ..ImageHeader::default()
        };
        let frame = Frame::new(&view, (&header, &bytes), None).expect("a frame");
        assert!((frame.inverse_depth(&view, 3, 4) - 1.0 / 0.257).abs() < 1e-5);
        assert!(Frame::new(&view, (&header, &bytes[1..]), None).is_none());
        assert!(Frame::new(&view, (&ImageHeader { width: 32, ..header }, &bytes), None).is_none());
        assert!(Frame::new(&view, (&ImageHeader { encoding: PixelEncoding::Rgb8, ..header }, &bytes), None).is_none());
    }
}
