//! The report of a scene: held-out photographs beside what splats and surface look like from there.

use super::super::frame::framed;
use super::super::page::{BRIGHTER, differences, picture};
use super::{SceneSummary, ViewNumbers};
use crate::scene::{HeldOut, Scene};
use maud::{Markup, html};

pub(super) fn page(scene: &Scene, summary: &SceneSummary, command: &str) -> String {
    let content = html! {
        (facts(summary))
        @for remark in &summary.remarks { p.remark { (remark.0) } }
        (shape(summary))
        h2 { "Held-out views" }
        p.note {
            "Every eighth view took no part. From the left: the photograph, the splats from there, what the two differ by, "
            (BRIGHTER) " times as bright, and the surface. PSNR is that of the whole picture; depth is how far the surface is "
            "off what was measured, whose noise is in it: the middle of all pixels."
        }
        @for (view, numbers) in scene.held_out.iter().zip(&summary.held_out) { (held_out(view, numbers)) }
    };
    framed("Scene", &content, command)
}

/// A difference of depth in words.
fn off(metres: Option<f64>) -> String {
    metres.map_or("not measured".into(), |metres| format!("{:.1} mm", 1e3 * metres))
}

fn facts(summary: &SceneSummary) -> Markup {
    let height = summary.table.map_or("none".to_owned(), |table| format!("{:.1} mm", 1e3 * table.offset_m));
    let entries = [
        (format!("{:.1} dB", summary.psnr_db), "PSNR of held-out views by splats"),
        (off(summary.depth_off_m), "depth of held-out views off the surface"),
        (height, "the table's distance from the origin"),
        (format!("{:.1} mm", 1e3 * summary.voxel_m), "edge of a voxel"),
    ];
    html! { div.facts { @for (value, what) in &entries { div { b { (value) } span { (what) } } } } }
}

fn shape(summary: &SceneSummary) -> Markup {
    let level = |number: usize| {
        let level = &summary.levels[number];
        let [x, y, z] = level.normal;
        let [_, _, height] = level.middle_m;
        let is_table = if summary.table == Some(*level) { ", the table" } else { "" };
        format!(
            "normal ({x:.4}, {y:.4}, {z:.4}), {:.1} mm along it from the origin, middle at z = {:.1} mm; {} points, {:.2} m²{is_table}",
            1e3 * level.offset_m,
            1e3 * height,
            level.points,
            level.area_m2
        )
    };
    let frame = if summary.in_base_frame { "the robot's base frame" } else { "the scan's frame, in metres" };
    let depth = summary
        .computed_depth
        .map_or(String::new(), |share| format!(", depth computed from them on {:.0} % of their pixels", 100.0 * share));
    let planar = if summary.planar { ", drawn into planes" } else { "" };
    let rows = [
        ("frame", frame.to_owned()),
        ("surface", format!("{} corners, {} triangles in scene.ply", summary.surface[0], summary.surface[1])),
        ("to collide with", format!("{} triangles in scene.obj", summary.collision_triangles)),
        ("splats", format!("{} in splats.ply{planar}", summary.splats)),
        ("scale", format!("one unit of the poses is {:.5} m", summary.scale.metres)),
        ("views", format!("{} to learn from{depth}, {} held out", summary.views, summary.held_out.len())),
    ];
    html! {
        table {
            @for (what, value) in &rows { tr { th { (what) } td { (value) } } }
            @for number in 0..summary.levels.len() { tr { th { "level " (number + 1) } td { (level(number)) } } }
        }
    }
}

fn held_out(view: &HeldOut, numbers: &ViewNumbers) -> Markup {
    let difference = differences(&view.picture, &view.splats);
    let whole = [0, 0, view.width, view.height];
    let pictures = [
        (&view.picture, "photograph"),
        (&view.splats, "splats"),
        (&difference, "difference"),
        (&view.surface, "surface"),
    ];
    html! {
        figure {
            @for (rgb, what) in pictures {
                @if let Some(source) = picture(rgb, view.width, whole) { img src=(source) alt=(format!("{what} of {}", view.name)); }
            }
            figcaption {
                (view.name) ": " (format!(
                    "{:.1} dB; depth off by {}; a surface at {:.1} % of the measured pixels",
                    numbers.psnr_db,
                    off(numbers.depth_off_m),
                    1e2 * numbers.covered
                ))
            }
        }
    }
}
