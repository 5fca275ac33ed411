//! A stroke from above, before it is done: where the object stands, which way the tool goes, where the object comes to rest.

use crate::obstacle::Obstacle;
use crate::program::Next;
use std::fmt::Write as _;

/// Pixels a metre.
const PIXELS_PER_METRE: f64 = 1400.0;
/// Half the width of what is shown [m].
const HALF_WIDTH: f64 = 0.24;

/// Length of the scale bar [m].
const SCALE: f64 = 0.1;

/// The picture as an SVG file: x of the base frame upwards, y to the left, as seen from behind the robot.
pub(super) fn picture(next: &Next, size: [f64; 3], obstacles: &[Obstacle]) -> String {
    let stroke = &next.stroke;
    let [x0, y0] = stroke.object;
    let at = |x: f64, y: f64| [PIXELS_PER_METRE * (HALF_WIDTH - (y - y0)), PIXELS_PER_METRE * (HALF_WIDTH - (x - x0))];
    let along = [stroke.heading.cos(), stroke.heading.sin()];
    let aside = [-along[1], along[0]];
    let on_line =
        |way: f64| at(x0 + along[0] * way + aside[0] * stroke.offset, y0 + along[1] * way + aside[1] * stroke.offset);
    let width = 2.0 * HALF_WIDTH * PIXELS_PER_METRE;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {:.0}\" font-family=\"sans-serif\" font-size=\"15\">\
         <rect width=\"100%\" height=\"100%\" fill=\"#fbfaf7\"/>",
        width + 40.0
    );
    let mut draw = |text: std::fmt::Arguments| svg.write_fmt(text).expect("a string takes all text");
    for obstacle in obstacles {
        let corners: Vec<[f64; 2]> = obstacle.outline().iter().map(|corner| at(corner.x, corner.y)).collect();
        let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        draw(format_args!("<polygon points=\"{}\" fill=\"#e4e0d8\" stroke=\"#8a8270\"/>", points.join(" ")));
        if let Some([x, y]) = corners.first() {
            draw(format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#8a8270\">{}</text>", obstacle.name()));
        }
    }
    let rest = at(next.rest[0], next.rest[1]);
    let (before, after) =
        (on_line(-stroke.clearance - 0.5 * stroke.speed * stroke.rise), on_line(stroke.follow_through));
    let stop = on_line(stroke.follow_through + 0.5 * stroke.speed * stroke.rise);
    let (sin, cos) = next.object.yaw.sin_cos();
    let corner = |(sx, sy): (f64, f64)| {
        let (a, b) = (0.5 * sx * size[0], 0.5 * sy * size[1]);
        at(x0 + cos * a - sin * b, y0 + sin * a + cos * b)
    };
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner);
    let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    draw(format_args!("<polygon points=\"{}\" fill=\"#d9e4ee\" stroke=\"#37597a\"/>", points.join(" ")));
    draw(format_args!(
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"none\" stroke=\"#37597a\" stroke-dasharray=\"5 5\"/>",
        rest[0],
        rest[1],
        PIXELS_PER_METRE * 0.5 * size[0].hypot(size[1])
    ));
    draw(format_args!(
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#b4552d\" stroke-width=\"4\"/>",
        before[0], before[1], after[0], after[1]
    ));
    draw(format_args!(
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#b4552d\" stroke-width=\"2\" stroke-dasharray=\"4 4\"/>",
        after[0], after[1], stop[0], stop[1]
    ));
    draw(format_args!("<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"7\" fill=\"#b4552d\"/>", before[0], before[1]));
    svg.push_str(&scale(width));
    let mut note = |[x, y]: [f64; 2], text: &str| {
        svg.write_fmt(format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#222\">{text}</text>"))
            .expect("a string takes all text");
    };
    note([before[0] - 70.0, before[1] + 26.0], "the tool comes down here");
    note([rest[0] - 70.0, rest[1] - PIXELS_PER_METRE * 0.5 * size[0].hypot(size[1]) - 8.0], "comes to rest about here");
    note([12.0, 22.0], "from above; the robot's base is below, its left is on the left");
    note(
        [12.0, width + 8.0],
        &format!("object at x {x0:.3} m, y {y0:.3} m, {:.2} m from the robot's base", x0.hypot(y0)),
    );
    let words = format!(
        "towards {:.0}\u{b0} at {:.2} m/s, {:.0} mm beside the centre, {:.0} mm high",
        stroke.heading.to_degrees(),
        stroke.speed,
        1e3 * stroke.offset.abs(),
        1e3 * stroke.height
    );
    note([12.0, width + 28.0], &words);
    svg.push_str("</svg>\n");
    svg
}

/// The scale, and the base's axes, in the lower corners of a picture so wide.
fn scale(width: f64) -> String {
    let foot = width - 14.0;
    let [x, y] = [width - 30.0, foot - 40.0];
    let line = |[x1, y1]: [f64; 2], [x2, y2]: [f64; 2]| {
        format!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#222\" stroke-width=\"2\"/>"
        )
    };
    let note = |[x, y]: [f64; 2], text: &str| format!("<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#222\">{text}</text>");
    [
        line([12.0, foot], [12.0 + PIXELS_PER_METRE * SCALE, foot]),
        note([12.0, foot - 6.0], &format!("{:.0} mm", 1e3 * SCALE)),
        line([x, y], [x, y - 40.0]),
        note([x + 5.0, y - 32.0], "x"),
        line([x, y], [x - 40.0, y]),
        note([x - 40.0, y + 16.0], "y"),
    ]
    .concat()
}
