//! The report: both states with the part and its axis, and the numbers.

use super::drawing::{EDGE, SIDES, Window, drawn};
use super::{ArticulatedSummary, LINKS};
use crate::articulated::Articulated;
use crate::assets::frame::framed;
use crate::assets::page::picture;
use crate::assets::{DENSITY, Labels};
use maud::{Markup, html};

pub(super) fn page(object: &Articulated, summary: &ArticulatedSummary, labels: &Labels) -> String {
    let content = html! {
        (facts(summary))
        @for remark in &summary.remarks { p.remark { (remark) } }
        (states(object))
        (numbers(object, summary))
    };
    framed(&summary.name, &content, &labels.command)
}

/// A position with its unit.
fn position(summary: &ArticulatedSummary, value: f64) -> String {
    if summary.joint.kind == "revolute" {
        format!("{:.1}°", value.to_degrees())
    } else {
        format!("{:.1} mm", value * 1e3)
    }
}

fn facts(summary: &ArticulatedSummary) -> Markup {
    let [lower, upper] = summary.joint.limits;
    let kind = if summary.joint.kind == "revolute" { "hinge" } else { "slide" };
    html! {
        div.facts {
            div { b { (kind) } span { "kind of the joint" } }
            div { b { (position(summary, lower)) " to " (position(summary, upper)) } span { "where its part goes" } }
            @for part in &summary.parts {
                div { b { (format!("{:.1} cm³", part.volume_m3 * 1e6)) } span { "volume of the " (part.link) } }
            }
        }
    }
}

fn states(object: &Articulated) -> Markup {
    let window = Window::of(&object.states);
    html! {
        h2 { "States" }
        p.note { "What stays is grey, what moves is orange; the blue line is the axis of a hinge, or the direction of a slide." }
        @for (number, state) in object.states.iter().enumerate() {
            figure {
                @for side in SIDES {
                    @let rgb = drawn(state, &object.joint, &window, side);
                    @if let Some(source) = picture(&rgb, EDGE as u32, [0, 0, EDGE as u32, EDGE as u32]) {
                        img src=(source) alt=(format!("state {}", number + 1));
                    }
                }
                figcaption { "State " (number + 1) }
            }
        }
    }
}

fn numbers(object: &Articulated, summary: &ArticulatedSummary) -> Markup {
    let joint = &summary.joint;
    let [x, y, z] = joint.origin_m.map(|v| v * 1e3);
    let [u, v, w] = joint.axis;
    let mut rows = vec![(
        "axis".to_owned(),
        format!("({u:.4}, {v:.4}, {w:.4}) through ({x:.1}, {y:.1}, {z:.1}) mm of the base's frame"),
    )];
    if let Some(sure) = object.certainty {
        let mut known = format!("direction to {:.2}°", sure.direction.to_degrees());
        known += &if joint.kind == "revolute" {
            format!(", place to {:.2} mm, travel to {:.2}°", sure.place * 1e3, sure.travel.to_degrees())
        } else {
            format!(", travel to {:.2} mm", sure.travel * 1e3)
        };
        rows.push(("standard deviations".into(), known));
        let other = if joint.kind == "revolute" { "a slide" } else { "a hinge" };
        let evidence = if sure.evidence.is_finite() {
            format!("{other} is worse by {:.0} (difference of BIC; above 10 is clear)", sure.evidence)
        } else {
            format!("as {other} its axis would be far from the object")
        };
        rows.push(("kind".into(), evidence));
        rows.push(("noise".into(), format!("{:.2} mm of both surfaces together", sure.noise * 1e3)));
        rows.push(("unexplained".into(), format!("{:.1} % of both surfaces", sure.unexplained * 100.0)));
    }
    let weighed = if summary.weighed {
        "weighed, shared out by volume".to_owned()
    } else {
        format!("from the volume at {DENSITY} kg/m³; weigh it and give --mass")
    };
    for (link, part) in LINKS.iter().zip(&summary.parts) {
        let surface = format!("closed, {} triangles, {} handles", part.surface.triangles, part.surface.genus);
        rows.push(((*link).into(), format!("{surface}; {:.3} kg, {weighed}", part.mass_kg)));
    }
    html! { h2 { "Numbers" } table { @for (what, value) in &rows { tr { th { (what) } td { (value) } } } } }
}
