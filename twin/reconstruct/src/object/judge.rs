//! How good it is, by pictures that took no part; and what a person should know about the surface.

use super::evidence::{Certainty, Evidence, SEEN};
use super::extent::Bounds;
use super::learn;
use super::pool;
use super::table::Support;
use super::view::{Drawn, draw};
use super::walls::ThinWalls;
use crate::computed::Computed;
use crate::field::{Field, Grid};
use crate::mesh::{Islands, Mesh};
use crate::remark::Remark;
use crate::scan::Frame;
use crate::splats;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use shared_mem::statistics::median;
use splat::SplatCloud;

/// So near to the mask's border pixels do not count: what is behind shines in [pixel].
const EDGE: i16 = 3;
/// For depth that is expected, pictures of fewer pixels do.
const COARSER: u32 = 6;
/// A tip that is higher is named [voxel]: the lowest corners that views show are known to a voxel.
const TIP: f64 = 1.0;
/// What colours are compared with behind the surface [voxel].
const DEEPER: f64 = 2.0;
/// Thin walls on more of the surface are named [1]: edges of thick parts have some.
const THIN: f64 = 0.05;
/// Handles that things have: a pot has two, a basket or a kettle three.
const HANDLES: i64 = 3;
/// The finest grid that a person may ask for.
const FINEST: u32 = 256;

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

/// Which share of what masks show a mesh leaves empty, their borders left out [1].
fn left_empty(mesh: &Mesh, frames: &[Frame]) -> f64 {
    let points = mesh.points.iter().map(|point| point.cast()).collect();
    let body = splat::Mesh { points, triangles: mesh.triangles.clone(), color: [0; 3] };
    let counts = frames.par_iter().map(|frame| {
        let drawn = splats::draw_mesh(&body, &frame.camera, &frame.scan_from_camera);
        let border = frame.border_distance(EDGE + 1);
        let inside = || border.iter().zip(&drawn.depth).filter(|(steps, _)| **steps > EDGE);
        (inside().filter(|(_, z)| **z <= 0.0).count(), inside().count())
    });
    let (empty, all) = counts.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    empty as f64 / all.max(1) as f64
}

/// What is known of an object, to say what a person should know.
pub(super) struct Found<'a> {
    pub(super) evidence: &'a Evidence,
    pub(super) field: &'a Field<f32>,
    pub(super) mesh: &'a Mesh,
    pub(super) islands: &'a Islands,
    pub(super) genus: i64,
    /// Nodes along each edge, were the grid a cube.
    pub(super) edge: u32,
    pub(super) support: Option<&'a Support>,
    /// Views to learn from and those held out.
    pub(super) frames: [&'a [Frame]; 2],
    pub(super) held_out: &'a [HeldOut],
    /// The depth that was computed where none was measured.
    pub(super) computed: Option<&'a Computed>,
}

/// What a person should know about the surface.
pub(super) fn remarks(found: &Found<'_>) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let share = found.evidence.share(found.mesh, Certainty::Unseen);
    if share > 0.02 {
        remarks.push(Remark(format!(
            "{:.0} % of the surface is shown by fewer than {SEEN} views, and is a guess (grey in object.ply): take pictures from there",
            share * 100.0
        )));
    }
    remarks.extend(underside(found));
    remarks.extend(found.computed.map(|computed| hollows(found, computed)));
    remarks.extend(walls(found));
    remarks.extend(beside(found));
    let views = found.held_out;
    let overlap = views.iter().map(|view| view.overlap).sum::<f64>() / views.len().max(1) as f64;
    if overlap < 0.9 {
        remarks.push(Remark(format!(
            "silhouettes of held-out views agree with their masks to {:.0} % only: masks or poses are wrong in parts",
            overlap * 100.0
        )));
    }
    remarks
}

/// The end of an object below everything that views show, where nothing says on what it stands.
fn underside(found: &Found<'_>) -> Option<Remark> {
    if let Some(support) = found.support {
        let whence = support.source.words();
        return Some(Remark(format!(
            "the base is closed in the plane of the table ({whence}), and is a guess: no picture shows it"
        )));
    }
    let [frames, _] = found.frames;
    let away = |frame: &Frame| (frame.scan_from_camera * Point3::origin() - found.mesh.middle()).normalize();
    let up = frames.iter().map(away).sum::<Vector3<f64>>().try_normalize(1e-6)?;
    let lowest = |counts: &dyn Fn(usize) -> bool| {
        let heights = found.mesh.points.iter().enumerate().filter(|(corner, _)| counts(*corner));
        heights.map(|(_, point)| up.dot(&point.coords)).fold(f64::INFINITY, f64::min)
    };
    let tip = lowest(&|corner| found.evidence.certainty[corner] != Certainty::Unseen) - lowest(&|_| true);
    (tip.is_finite() && tip > TIP * found.field.grid.voxel).then(|| {
        Remark(format!(
            "no picture shows the lowest {:.1} mm: the underside is what the outlines leave open, a tip on which it cannot stand; say where \
             the table is (--table), or take pictures from below",
            tip * 1e3
        ))
    })
}

/// Silhouettes show no hollow that opens to one side, and colours only those that have a print.
fn hollows(found: &Found<'_>, computed: &Computed) -> Remark {
    let share = |is| 100.0 * found.evidence.share(found.mesh, is);
    let (contradicted, ambiguous) = (share(Certainty::Contradicted), share(Certainty::Ambiguous));
    Remark(format!(
        "made without depth pictures: depth was computed from the pictures, on {:.0} % of the object's pixels; elsewhere on {contradicted:.0} % of \
         the surface the views contradict each other in colour, and on {ambiguous:.0} % it is a guess for want of texture: colours agree as \
         well {:.1} mm deeper and no outline shows it (both grey in object.ply): it may lie deeper there, a hollow be filled, a wall be too \
         thick: stick tape with a print there, or take pictures with depth",
        100.0 * computed.share,
        DEEPER * found.field.grid.voxel * 1e3
    ))
}

/// Walls that are thin for the grid, and handles.
fn walls(found: &Found<'_>) -> Vec<Remark> {
    let thin = ThinWalls::of(found.field, found.mesh);
    let mut remarks = Vec::new();
    if thin.share > THIN {
        let edge = thin.edge(found.edge);
        let remedy = if edge <= FINEST {
            format!("--grid {edge} shows them as they are")
        } else {
            format!("--grid {FINEST}, the finest, shows more of them")
        };
        remarks.push(Remark(format!(
            "{:.0} % of the surface is of walls thinner than {:.1} mm, which is the least that this grid shows: their thickness and tunnels \
             through them may be the grid's; {remedy}",
            thin.share * 100.0,
            ThinWalls::limit(found.field.grid.voxel) * 1e3
        )));
    }
    if found.genus > HANDLES {
        remarks.push(Remark(format!(
            "it has {} handles (genus), and few things have more than {HANDLES}: look in object.ply for tunnels that the object does not have",
            found.genus
        )));
    }
    remarks
}

/// Parts that are not connected with the largest one.
fn beside(found: &Found<'_>) -> Option<Remark> {
    let Islands { bodies, share, .. } = found.islands;
    (*share > 0.02).then(|| {
        let empty = 100.0 * left_empty(found.mesh, found.frames[1]);
        let why = if empty > 2.0 {
            format!("without them {empty:.0} % of the masks is empty: do the masks show more than one object?")
        } else {
            "the masks are filled without them: views that few others overlap leave such parts".into()
        };
        Remark(format!("{bodies} parts beside the object were left out, {:.0} % of its volume; {why}", share * 100.0))
    })
}
