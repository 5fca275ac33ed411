//! How good it is, by pictures that took no part; and what a person should know about the surface.

use super::bounds::Bounds;
use super::evidence::Evidence;
use super::learn;
use super::pool;
use super::view::{Drawn, draw};
use crate::field::{Field, Grid};
use crate::mesh::{Islands, Mesh};
use crate::remark::Remark;
use crate::scan::Frame;
use crate::splats;
use rayon::prelude::*;
use shared_mem::statistics::median;
use splat::SplatCloud;

/// So near to the mask's border pixels do not count: what is behind shines in [pixel].
const EDGE: i16 = 3;
/// For depth that is expected, pictures of fewer pixels do.
const COARSER: u32 = 6;
/// A corner is certain that so many views show.
const CERTAIN: u8 = 2;
/// Views of a textured object contradict each other on less of its surface, at the edges of its print and of thin parts.
pub(super) const CONTRADICTED: f64 = 0.1;

/// A view that took no part.
#[derive(Debug, Clone)]
pub struct HeldOut {
    /// The picture's path as the scan lists it.
    pub name: String,
    /// The picture, black outside the mask.
    pub picture: Vec<[u8; 3]>,
    /// The same view of the field.
    pub drawn: Drawn,
    /// And of the splats, over black.
    pub splats: Vec<[u8; 3]>,
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Peak signal-to-noise ratio inside the mask, its border left out [dB].
    pub psnr: f64,
    /// The same with the camera where the scan has it, before its pose was fitted to the field [dB].
    pub psnr_as_given: f64,
    /// That of the splats, from where the field has put the camera [dB].
    pub psnr_splats: f64,
    /// What mask and drawn silhouette have in common, of what either has.
    pub overlap: f64,
}

pub(super) fn held_out(field: &Field<f32>, cloud: &SplatCloud, frame: &Frame, bounds: &Bounds) -> HeldOut {
    let pixels = pool::pixels(std::slice::from_ref(frame));
    let pose = learn::placed(field, &pixels, &frame.scan_from_camera, bounds.centre(), bounds.radius());
    let as_given = draw(field, &frame.camera, &frame.scan_from_camera);
    let drawn = draw(field, &frame.camera, &pose);
    let splats: Vec<[u8; 3]> = splats::draw(cloud, &frame.camera, &pose, [0.0; 3]).rgb8().collect();
    let (mut both, mut either) = (0usize, 0usize);
    for (mask, opacity) in frame.mask.iter().zip(&drawn.opacity) {
        both += usize::from(*mask && *opacity > 0.5);
        either += usize::from(*mask || *opacity > 0.5);
    }
    let picture = frame.rgb.iter().zip(&frame.mask).map(|(rgb, mask)| if *mask { *rgb } else { [0; 3] }).collect();
    HeldOut {
        name: frame.name.clone(),
        picture,
        psnr: psnr(frame, &drawn.rgb),
        psnr_as_given: psnr(frame, &as_given.rgb),
        psnr_splats: psnr(frame, &splats),
        drawn,
        splats,
        width: frame.camera.width,
        height: frame.camera.height,
        overlap: both as f64 / either.max(1) as f64,
    }
}

fn psnr(frame: &Frame, drawn: &[[u8; 3]]) -> f64 {
    let border = frame.border_distance(EDGE + 1);
    splats::psnr(&frame.rgb, drawn, |at| border[at] > EDGE)
}

/// How many metres one unit of the poses would have to be for depth to lie on the start's surface; `None` without depth. In a view, the
/// middle ratio of measured to expected depth.
pub(super) fn depth_scale(grid: &Grid, distance: &[f32], frames: &[Frame]) -> Option<f64> {
    let field = Field { grid: *grid, distance: distance.to_vec(), colour: vec![[0.0; 3]; grid.len()] };
    let of = |frame: &Frame| -> Vec<f64> {
        if frame.depth.is_empty() {
            return Vec::new();
        }
        let camera = frame.camera.reduced(COARSER);
        let drawn = draw(&field, &camera, &frame.scan_from_camera);
        let (columns, step) = (camera.width as usize, COARSER as usize);
        let ratio = |at: usize| {
            let whole = (at / columns * step + step / 2) * frame.camera.width as usize + at % columns * step + step / 2;
            let (measured, expected) = (f64::from(frame.depth[whole]), f64::from(drawn.depth[at]));
            (measured > 0.0 && expected > 0.0 && frame.mask[whole]).then(|| measured / expected)
        };
        (0..drawn.depth.len()).filter_map(ratio).collect()
    };
    let ratios: Vec<f64> = frames.par_iter().flat_map_iter(of).collect();
    if ratios.len() > 100 { median(ratios) } else { None }
}

/// What a person should know about the surface.
pub(super) fn remarks(
    evidence: &Evidence,
    mesh: &Mesh,
    islands: &Islands,
    (views, with_depth): (&[HeldOut], bool),
) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let share = evidence.share_shown_by_fewer(mesh, CERTAIN);
    if share > 0.02 {
        remarks.push(Remark(format!(
            "{:.0} % of the surface is shown by fewer than {CERTAIN} views, and is a guess (grey in object.ply): take pictures from there",
            share * 100.0
        )));
    }
    if !with_depth {
        remarks.push(hollows(evidence, mesh));
    }
    if islands.share > 0.02 {
        remarks.push(Remark(format!(
            "{} parts beside the object were left out, {:.0} % of its volume: does the mask show more than one object?",
            islands.bodies,
            islands.share * 100.0
        )));
    }
    let overlap = views.iter().map(|view| view.overlap).sum::<f64>() / views.len().max(1) as f64;
    if overlap < 0.9 {
        remarks.push(Remark(format!(
            "silhouettes of held-out views agree with their masks to {:.0} % only: masks or poses are wrong in parts",
            overlap * 100.0
        )));
    }
    remarks
}

/// Silhouettes show no hollow that opens to one side, and colours only some.
fn hollows(evidence: &Evidence, mesh: &Mesh) -> Remark {
    let share = evidence.share_contradicted(mesh);
    Remark(if share > CONTRADICTED {
        format!(
            "on {:.0} % of the surface the views contradict each other in colour (grey in object.ply): it is not where they see it; without \
             depth a hollow is filled there, and the volume too large: take pictures with depth",
            share * 100.0
        )
    } else {
        "made without depth: a hollow that no silhouette shows, as the inside of a cup, is filled where its colours are even, and has too \
         thick a wall elsewhere: take pictures with depth"
            .into()
    })
}

/// Whether a corner that so many views show is certain.
pub(crate) fn is_certain(shown: u8) -> bool {
    shown >= CERTAIN
}
