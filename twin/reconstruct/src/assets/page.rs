//! The report of an object: held-out pictures beside what it looks like from there, and where the two differ.

use super::frame::framed;
use super::{Labels, Summary};
use crate::object::{HeldOut, Object};
use crate::scan::ScaleSource;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;

/// Differences are drawn so many times as bright.
pub(super) const BRIGHTER: u8 = 4;
/// Room around the object in a picture [pixel].
const ROOM: u32 = 12;

pub(super) fn page(object: &Object, summary: &Summary, labels: &Labels) -> String {
    let content = html! {
        (facts(summary))
        @for remark in &summary.remarks { p.remark { (remark.0) } }
        (shape(summary))
        h2 { "Held-out views" }
        p.note {
            "Every eighth view took no part. From the left: the picture inside its mask, the object from there, its splats, "
            "and what these differ by from the picture, " (BRIGHTER) " times as bright. PSNR is that inside the mask, its "
            "outermost three pixels left out, with the camera's pose fitted to the object; in brackets with the pose as the "
            "scan has it."
        }
        @for view in &object.held_out { (held_out(view)) }
    };
    framed(&summary.name, &content, &labels.command)
}

fn facts(summary: &Summary) -> Markup {
    let entries = [
        (format!("{:.1} dB", summary.psnr_db), "PSNR of held-out views inside the mask"),
        (format!("{:.1} dB", summary.psnr_splats_db), "PSNR of the splats there"),
        (format!("{:.1} cm³", summary.volume_m3 * 1e6), "volume"),
        (summary.surface.genus.to_string(), "handles (genus)"),
        (format!("{:.2} mm", summary.voxel_m * 1e3), "distance of the grid's nodes"),
    ];
    html! { div.facts { @for (value, what) in &entries { div { b { (value) } span { (what) } } } } }
}

fn shape(summary: &Summary) -> Markup {
    let scale = &summary.scale;
    let source = match scale.source {
        ScaleSource::Given => "given on the command line".to_owned(),
        ScaleSource::Robot => "the robot that held the camera".to_owned(),
        ScaleSource::Depth => {
            format!("depth at points of the COLMAP model, single points spread by {:.1} %", scale.spread * 100.0)
        }
        ScaleSource::Poses => "the poses are in metres, and the depth pictures agree".to_owned(),
    };
    let [x, y, z] = summary.size_m.map(|edge| edge * 1e3);
    let mass = if summary.weighed { "weighed" } else { "from the volume at 500 kg/m³; weigh it and give --mass" };
    let base = summary.table.map_or("as the outlines leave it: nothing says where the table is".to_owned(), |table| {
        let [x, y, z] = table.normal;
        let offset = table.offset_m * 1e3;
        format!(
            "closed in the plane of the table, a guess: {offset:.1} mm along ({x:.4}, {y:.4}, {z:.4}) from the scan's origin ({})",
            table.source.words()
        )
    });
    let share = |share: f64| format!("{:.1} %", 100.0 * share);
    let unknown = format!(
        "{} of the surface is shown by fewer than two views, on {} colours contradict each other, on {} they agree as well deeper (grey in \
         object.ply)",
        share(summary.unknown.unseen),
        share(summary.unknown.contradicted),
        share(summary.unknown.ambiguous)
    );
    let depth = match summary.computed_depth {
        Some(share) => format!(", depth computed from them on {:.0} % of the object's pixels", 100.0 * share),
        None => " with depth".into(),
    };
    let rows = [
        (
            "surface",
            format!(
                "closed and oriented; {} triangles, and {} in object.obj",
                summary.surface.triangles, summary.coarse_triangles
            ),
        ),
        ("size", format!("{x:.1} x {y:.1} x {z:.1} mm along the scan's axes")),
        ("base", base),
        ("not known", unknown),
        (
            "convex pieces",
            format!("{}, {:.1} % of the volume", summary.pieces, 100.0 * summary.pieces_volume_m3 / summary.volume_m3),
        ),
        ("splats", format!("{} in splats.ply", summary.splats)),
        ("mass", format!("{:.3} kg, {mass}", summary.mass_kg)),
        ("scale", format!("one unit of the poses is {:.5} m: {source}", scale.metres)),
        ("views", format!("{} to learn from{}, {} held out", summary.views, depth, summary.held_out.len())),
        (
            "cameras",
            format!("moved by {:.2} mm (root mean square) to agree with each other", summary.cameras_moved_m * 1e3),
        ),
    ];
    html! { table { @for (what, value) in &rows { tr { th { (what) } td { (value) } } } } }
}

fn held_out(view: &HeldOut) -> Markup {
    let difference = differences(&view.picture, &view.splats);
    let window = window(view);
    html! {
        figure {
            @for (rgb, what) in [
                (&view.picture, "photograph"),
                (&view.drawn.rgb, "object"),
                (&view.splats, "splats"),
                (&difference, "difference"),
            ] {
                @if let Some(source) = picture(rgb, view.width, window) { img src=(source) alt=(format!("{what} of {}", view.name)); }
            }
            figcaption {
                (view.name) ": " (format!(
                    "{:.1} dB ({:.1}), splats {:.1} dB; silhouettes agree to {:.1} %",
                    view.psnr,
                    view.psnr_as_given,
                    view.psnr_splats,
                    view.overlap * 100.0
                ))
            }
        }
    }
}

/// What two pictures differ by, [`BRIGHTER`] times as bright.
pub(super) fn differences(one: &[[u8; 3]], other: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let off = |(a, b): (&[u8; 3], &[u8; 3])| std::array::from_fn(|c| a[c].abs_diff(b[c]).saturating_mul(BRIGHTER));
    one.iter().zip(other).map(off).collect()
}

/// First column and row, columns and rows of the part that shows the object.
fn window(view: &HeldOut) -> [u32; 4] {
    let shown = |at: &usize| view.picture[*at] != [0; 3] || view.drawn.opacity[*at] > 0.5;
    let places = (0..view.picture.len()).filter(shown).map(|at| [at as u32 % view.width, at as u32 / view.width]);
    let (low, high) = places.fold(([u32::MAX; 2], [0; 2]), |(low, high), at| {
        ([0, 1].map(|a| low[a].min(at[a])), [0, 1].map(|a| high[a].max(at[a])))
    });
    if low[0] > high[0] {
        return [0, 0, view.width, view.height];
    }
    let first = low.map(|a| a.saturating_sub(ROOM));
    let last = [(high[0] + ROOM).min(view.width - 1), (high[1] + ROOM).min(view.height - 1)];
    [first[0], first[1], last[0] + 1 - first[0], last[1] + 1 - first[1]]
}

/// A part of a picture as the address of an image.
pub(super) fn picture(rgb: &[[u8; 3]], width: u32, [x, y, columns, rows]: [u32; 4]) -> Option<String> {
    let row = |row: u32| {
        let first = (row * width + x) as usize;
        rgb[first..first + columns as usize].as_flattened().iter().copied()
    };
    let pixels: Vec<u8> = (y..y + rows).flat_map(row).collect();
    let packed = pack_picture(PixelEncoding::Rgb8, columns, rows, &pixels).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(packed)))
}
