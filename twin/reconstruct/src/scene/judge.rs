//! How good it is, by pictures that took no part.

use crate::computed::Computed;
use crate::remark::Remark;
use crate::scan::Frame;
use crate::splats;
use fusion::Surface;
use fusion::plane::Level;
use shared_mem::statistics::median;
use splat::{Mesh, SplatCloud};

/// Colour of the surface in pictures.
const GREY: [u8; 3] = [200, 200, 200];

/// A view that took no part.
#[derive(Debug, Clone)]
pub struct HeldOut {
    /// The picture's path as the scan lists it.
    pub name: String,
    pub width: u32,
    /// Rows.
    pub height: u32,
    pub picture: Vec<[u8; 3]>,
    /// The same view of the splats.
    pub splats: Vec<[u8; 3]>,
    /// Their depth along the camera's axis [m], 0 where nothing is.
    pub splat_depth: Vec<f32>,
    /// The same view of the surface, shaded.
    pub surface: Vec<[u8; 3]>,
    /// Peak signal-to-noise ratio of the splats over the whole picture [dB].
    pub psnr: f64,
    /// Middle absolute difference of the surface's depth and the measured one, whose noise is in it [m]; `None` where none was measured.
    pub depth_off: Option<f64>,
    /// Share of the measured pixels at which there is a surface.
    pub covered: f64,
}

/// The surface as it is drawn.
pub(super) fn looks(surface: &Surface) -> Mesh {
    Mesh { points: surface.points.clone(), triangles: surface.triangles.clone(), color: GREY }
}

pub(super) fn held_out(
    (cloud, planar): (&SplatCloud, bool),
    looks: &Mesh,
    frame: &Frame,
    background: [f32; 3],
) -> HeldOut {
    let pose = &frame.scan_from_camera;
    let drawn = splats::draw(cloud, &frame.camera, pose, background);
    let surface = splats::draw_mesh(looks, &frame.camera, pose);
    let measured = || frame.depth.iter().zip(&surface.depth).filter(|(measured, _)| **measured > 0.0);
    let offs: Vec<f64> = measured().filter(|(_, z)| **z > 0.0).map(|(a, b)| f64::from((a - b).abs())).collect();
    let compared = offs.len();
    let picture: Vec<[u8; 3]> = drawn.rgb8().collect();
    HeldOut {
        name: frame.name.clone(),
        width: frame.camera.width,
        height: frame.camera.height,
        psnr: splats::psnr(&frame.rgb, &picture, |_| true),
        picture: frame.rgb.clone(),
        splats: picture,
        splat_depth: if planar { splats::plane_depth(cloud, &frame.camera, pose) } else { drawn.depth },
        surface: surface.rgb8().collect(),
        depth_off: median(offs),
        covered: compared as f64 / measured().count().max(1) as f64,
    }
}

/// What a person should know.
pub(super) fn remarks(levels: &[Level], computed: Option<&Computed>) -> Vec<Remark> {
    let level = "there is no level surface: is the table in the pictures, and which way is up?";
    let none = levels.is_empty().then(|| Remark(level.into()));
    let depth = computed.map(|computed| {
        Remark(format!(
            "made without depth pictures: depth was computed from the pictures, on {:.0} % of their pixels; what has no texture is missing: stick \
             tape with a print there, or take pictures with depth",
            100.0 * computed.share
        ))
    });
    none.into_iter().chain(depth).collect()
}
