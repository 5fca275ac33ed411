//! Plots as SVG text, the only code that knows plotters. One palette for all: the robot grey, the twin orange before and blue after.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The real robot.
pub(super) const REAL: RGBColor = RGBColor(60, 60, 60);
/// The twin with what the laboratory knows.
pub(super) const BEFORE: RGBColor = RGBColor(213, 94, 0);
/// The twin with the true parameters.
pub(super) const AFTER: RGBColor = RGBColor(0, 114, 178);

/// Size of a plot; the page scales it down, because coordinates are whole numbers and would show as steps otherwise.
const SIZE: (u32, u32) = (2700, 900);
/// Fonts of a plot: whatever the reader's system calls sans-serif.
const FONT: &str = "sans-serif";
/// Most points of a line: more than a screen shows only makes the page heavy.
const MOST_POINTS: usize = 1500;
/// Colour of axes and labels.
const INK: RGBColor = RGBColor(70, 70, 70);

/// A plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw a plot: {0}; please report this")]
pub struct PlotError(String);

/// Values of a group of bars, one a joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bars<'a> {
    /// What it is called in the legend.
    pub(super) name: &'a str,
    /// Colour.
    pub(super) color: RGBColor,
    /// One value a joint.
    pub(super) values: &'a [f64],
}

/// A line over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line<'a> {
    /// What it is called in the legend.
    pub(super) name: &'a str,
    /// Colour.
    pub(super) color: RGBColor,
    /// Width; about three make one on the screen.
    pub(super) width: u32,
    /// Time [s] and value.
    pub(super) points: &'a [[f64; 2]],
}

/// Groups of bars side by side for each joint, each with its value on top.
///
/// # Errors
/// [`PlotError`] when the backend fails.
pub(super) fn bars(groups: &[Bars], unit: &str) -> Result<String, PlotError> {
    let joints = groups.iter().map(|g| g.values.len()).max().unwrap_or(0);
    let [_, top] = span(groups.iter().flat_map(|group| group.values).copied().chain([0.0]));
    draw(|root| {
        let mut chart = ChartBuilder::on(root)
            .margin(30)
            .x_label_area_size(70)
            .y_label_area_size(170)
            .build_cartesian_2d(0.0..joints as f64, 0.0..1.18 * top)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .disable_x_axis()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.15).stroke_width(3))
            .axis_style(INK.mix(0.6).stroke_width(3))
            .label_style((FONT, 42, &INK))
            .y_desc(unit)
            .y_labels(5)
            .draw()?;
        let width = 0.76 / groups.len().max(1) as f64;
        let number = (FONT, 36).into_font().color(&INK).pos(Pos::new(HPos::Center, VPos::Bottom));
        for (place, group) in groups.iter().enumerate() {
            let left = |joint: usize| joint as f64 + 0.12 + width * place as f64;
            let boxes = group.values.iter().enumerate().map(|(joint, v)| {
                Rectangle::new([(left(joint), 0.0), (left(joint) + 0.94 * width, *v)], group.color.filled())
            });
            chart.draw_series(boxes)?.label(group.name).legend(swatch(group.color));
            chart.draw_series(group.values.iter().enumerate().map(|(joint, v)| {
                Text::new(short(*v), (left(joint) + 0.47 * width, *v + 0.015 * top), number.clone())
            }))?;
        }
        let name = (FONT, 42).into_font().color(&INK).pos(Pos::new(HPos::Center, VPos::Top));
        for joint in 0..joints {
            let (x, y) = chart.backend_coord(&(joint as f64 + 0.5, 0.0));
            root.draw(&Text::new(format!("joint {}", joint + 1), (x, y + 24), name.clone()))?;
        }
        legend(&mut chart)
    })
}

/// Lines over time.
///
/// # Errors
/// [`PlotError`] when the backend fails.
pub(super) fn lines(lines: &[Line], unit: &str) -> Result<String, PlotError> {
    let points = || lines.iter().flat_map(|line| line.points);
    let [begin, end] = span(points().map(|p| p[0]));
    let [lo, hi] = span(points().map(|p| p[1]));
    let room = 0.12 * (hi - lo);
    draw(|root| {
        let mut chart = ChartBuilder::on(root)
            .margin(30)
            .x_label_area_size(110)
            .y_label_area_size(170)
            .build_cartesian_2d(begin..end, lo - room..hi + 2.0 * room)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.15).stroke_width(3))
            .axis_style(INK.mix(0.6).stroke_width(3))
            .label_style((FONT, 42, &INK))
            .x_desc("time [s]")
            .y_desc(unit)
            .x_labels(10)
            .y_labels(6)
            .draw()?;
        for line in lines {
            let step = line.points.len().div_ceil(MOST_POINTS).max(1);
            let thinned = line.points.iter().step_by(step).map(|p| (p[0], p[1]));
            chart
                .draw_series(LineSeries::new(thinned, line.color.stroke_width(line.width)))?
                .label(line.name)
                .legend(swatch(line.color));
        }
        legend(&mut chart)
    })
}

/// Smallest and largest value; an axis of some length even where there is nothing to span, because a chart needs one.
fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (lo, hi) = values.filter(|v| v.is_finite()).fold((f64::MAX, f64::MIN), |(lo, hi), v| (lo.min(v), hi.max(v)));
    if hi - lo > 1e-12 {
        [lo, hi]
    } else if hi >= lo {
        [lo, lo + 1.0]
    } else {
        [0.0, 1.0]
    }
}

type Chart<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(paint: impl FnOnce(&DrawingArea<SVGBackend, plotters::coord::Shift>) -> Drawn) -> Result<String, PlotError> {
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    paint(&root).map_err(|e| PlotError(e.to_string()))?;
    root.present().map_err(|e| PlotError(e.to_string()))?;
    drop(root);
    Ok(svg)
}

fn swatch(color: RGBColor) -> impl Fn((i32, i32)) -> Rectangle<(i32, i32)> {
    move |(x, y)| Rectangle::new([(x, y - 15), (x + 42, y + 15)], color.filled())
}

fn legend<'a, 'b: 'a>(chart: &mut Chart<'a, 'b>) -> Drawn {
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .legend_area_size(60)
        .margin(20)
        .label_font((FONT, 42, &INK))
        .draw()?;
    Ok(())
}

/// A number in at most four characters or so: `1.23`, `0.004`, `12.3`.
fn short(value: f64) -> String {
    match value {
        v if v >= 10.0 => format!("{v:.1}"),
        v if v >= 0.01 => format!("{v:.2}"),
        v => format!("{v:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bar_stands_on_its_joint_with_its_value_on_top() {
        let groups = [
            Bars { name: "before", color: BEFORE, values: &[1.5, 0.25] },
            Bars { name: "after", color: AFTER, values: &[0.004, 12.3] },
        ];
        let svg = bars(&groups, "mrad").expect("a plot");
        for text in ["joint 1", "joint 2", "1.50", "0.25", "0.004", "12.3", "before", "after", "mrad"] {
            assert!(svg.contains(&format!("\n{text}\n")), "no {text} in the plot");
        }
        assert!(!svg.contains("joint 3"));
    }

    #[test]
    fn a_long_recording_makes_no_heavy_plot() {
        let points: Vec<[f64; 2]> = (0..60_000).map(|i| [f64::from(i) * 1e-3, f64::from(i).sin()]).collect();
        let svg = lines(&[Line { name: "real", color: REAL, width: 5, points: &points }], "rad").expect("a plot");
        assert!(svg.len() < 40_000, "{} bytes", svg.len());
    }

    #[test]
    fn nothing_to_show_is_still_a_plot() {
        assert!(bars(&[], "mrad").is_ok());
        assert!(lines(&[Line { name: "real", color: REAL, width: 5, points: &[] }], "rad").is_ok());
    }
}
