//! Lines over an axis: residuals with the noise as a band, paths, convergence.

use crate::page::canvas::{Anchor, Canvas};
use crate::page::scale::Scale;
use crate::words::quantity::{Unit, span};
use maud::Markup;

/// Most points of a line: more than a screen shows only makes the page heavy.
const MOST_POINTS: usize = 700;
const LEFT: f64 = 62.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 36.0;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line<'a> {
    /// Colour: `before`, `after`, `data`.
    pub(crate) class: &'a str,
    /// Place on the axis below, and value in SI.
    pub(crate) points: &'a [[f64; 2]],
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chart<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: &'a str,
    /// SI unit of the values.
    pub(crate) unit: &'a str,
    /// Lines, the first at the bottom.
    pub(crate) lines: &'a [Line<'a>],
    /// Half the width of the grey band around zero, in SI.
    pub(crate) band: Option<f64>,
    /// Whether values are laid out by their logarithm, where they span more than one power of ten.
    pub(crate) logarithmic: bool,
    /// Width and height.
    pub(crate) size: [f64; 2],
}

impl Chart<'_> {
    /// The chart as a picture.
    pub(crate) fn draw(&self) -> Markup {
        let [width, height] = self.size;
        let [lo, hi] = self.values();
        let unit = Unit::suited(self.unit, lo.abs().max(hi.abs()));
        let decades = self.spans_decades();
        let shown = |value: f64| if decades { value.log10() } else { unit.scaled(value) };
        let room = if decades { 0.0 } else { 0.06 * (hi - lo) };
        let x = Scale::new(span(self.points().map(|p| p[0])), [LEFT, width - 10.0]);
        let y = Scale::new([shown(lo - room), shown(hi + room)], [height - BOTTOM, TOP + 6.0]);
        let mut canvas = Canvas::new();
        self.draw_frame(&mut canvas, (&x, &y), unit.name());
        if let Some(band) = self.band {
            let [top, bottom] = [band, -band].map(|edge| y.at(shown(edge)));
            canvas.rect("band", [LEFT, top], [width - 10.0 - LEFT, bottom - top]);
        }
        for line in self.lines {
            let thinned = thinned(line.points);
            let place = thinned.iter().map(|[at, value]| [x.at(*at), y.at(shown(*value))]);
            canvas.polyline(&format!("line {}", line.class), place);
        }
        canvas.finish(self.size, self.title)
    }

    fn draw_frame(&self, canvas: &mut Canvas, (x, y): (&Scale, &Scale), unit: &str) {
        let [width, height] = self.size;
        let title = if unit.is_empty() { self.title.to_owned() } else { format!("{} [{unit}]", self.title) };
        canvas.text_within("strong", [0.0, 14.0], Anchor::Start, &title, width);
        for (value, name) in y.ticks(4) {
            let name = if self.spans_decades() { power_of_ten(value) } else { Some(name) };
            canvas.line("grid", [LEFT, y.at(value)], [width - 10.0, y.at(value)]);
            canvas.text("small", [LEFT - 6.0, y.at(value) + 4.0], Anchor::End, &name.unwrap_or_default());
        }
        canvas.line("axis", [LEFT, height - BOTTOM], [width - 10.0, height - BOTTOM]);
        for (value, name) in x.ticks(6) {
            canvas.line("axis", [x.at(value), height - BOTTOM], [x.at(value), height - BOTTOM + 4.0]);
            canvas.text("small", [x.at(value), height - BOTTOM + 16.0], Anchor::Middle, &name);
        }
        canvas.text("small", [0.5 * (LEFT + width - 10.0), height - 4.0], Anchor::Middle, self.x);
    }

    fn points(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.lines.iter().flat_map(|line| line.points)
    }

    fn spans_decades(&self) -> bool {
        let [lo, hi] = span(self.points().map(|p| p[1]));
        self.logarithmic && lo > 0.0 && hi > 10.0 * lo
    }

    /// What the axis must span, in SI: what is shown, and never so little that rounding fills the picture.
    fn values(&self) -> [f64; 2] {
        let band = self.band.into_iter().flat_map(|band| [band, -band]);
        let [lo, hi] = span(self.points().map(|p| p[1]).chain(band));
        let room = if self.logarithmic { 0.0 } else { 0.5 * (least_span(self.unit) - (hi - lo)).max(0.0) };
        [lo - room, hi + room]
    }
}

/// A tenth of what matters of each quantity in a recording, in SI (choices).
fn least_span(unit: &str) -> f64 {
    match unit {
        "s" => 1e-4,
        "rad" => 1e-6,
        "m" => 1e-5,
        "N m" => 1e-3,
        _ => 0.0,
    }
}

/// `10^exponent` where the exponent is whole.
fn power_of_ten(exponent: f64) -> Option<String> {
    let whole = (exponent - exponent.round()).abs() < 1e-9;
    whole.then(|| if exponent.abs() < 3.5 { format!("{}", 10_f64.powf(exponent)) } else { format!("1e{exponent:.0}") })
}

/// At most so many points that a screen can show: lowest and highest of each stretch, so that no peak is lost.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let finite: Vec<[f64; 2]> = points.iter().filter(|p| p[0].is_finite() && p[1].is_finite()).copied().collect();
    if finite.len() <= MOST_POINTS {
        return finite;
    }
    let stretch = finite.len().div_ceil(MOST_POINTS / 2);
    finite
        .chunks(stretch)
        .flat_map(|chunk| {
            let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
            let ends = [chunk.iter().min_by(by_value), chunk.iter().max_by(by_value)];
            let mut ends: Vec<[f64; 2]> = ends.into_iter().flatten().copied().collect();
            ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
            ends
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    fn chart<'a>(lines: &'a [Line<'a>]) -> Chart<'a> {
        Chart {
            title: "clip_03, joint 2",
            x: "time [s]",
            unit: "rad",
            lines,
            band: Some(2e-4),
            logarithmic: false,
            size: [440.0, 170.0],
        }
    }

    #[test]
    fn axes_carry_units_and_the_noise_is_a_band() {
        let points: Vec<[f64; 2]> = (0..100).map(|i| [0.1 * f64::from(i), 2e-3 * f64::from(i).sin()]).collect();
        let svg = chart(&[Line { class: "before", points: &points }]).draw().into_string();
        assert_well_formed(&svg);
        for text in ["clip_03, joint 2 [mrad]", "time [s]", ">-2<", "class=\"band\"", "line before"] {
            assert!(svg.contains(text), "no {text} in {svg}");
        }
    }

    #[test]
    fn a_long_recording_makes_no_heavy_picture_and_keeps_its_peak() {
        let mut points: Vec<[f64; 2]> = (0..60_000).map(|i| [f64::from(i) * 1e-3, 0.0]).collect();
        points[31_234][1] = 7.0;
        assert!(thinned(&points).iter().any(|p| p[1] == 7.0));
        let svg = chart(&[Line { class: "data", points: &points }]).draw().into_string();
        assert!(svg.len() < 12_000, "{} bytes", svg.len());
    }

    #[test]
    fn rounding_does_not_fill_a_picture() {
        let points: Vec<[f64; 2]> = (0..50).map(|i| [f64::from(i), 0.01 + 1e-12 * f64::from(i % 3)]).collect();
        let lines = [Line { class: "data", points: &points }];
        let [lo, hi] = Chart { unit: "s", band: None, ..chart(&lines) }.values();
        assert!(hi - lo > 0.9e-4 && (0.5 * (lo + hi) - 0.01).abs() < 1e-9, "{lo} {hi}");
    }

    #[test]
    fn nothing_or_nonsense_to_show_is_still_a_picture() {
        assert_well_formed(&chart(&[]).draw().into_string());
        let nonsense = [[f64::NAN, 1.0], [1.0, f64::INFINITY], [2.0, 0.0]];
        let lines = [Line { class: "data", points: &nonsense }];
        assert_well_formed(&chart(&lines).draw().into_string());
        assert_well_formed(&Chart { logarithmic: true, band: None, ..chart(&lines) }.draw().into_string());
    }

    #[test]
    fn convergence_is_marked_at_powers_of_ten() {
        let points = [[0.0, 1000.0], [50.0, 0.5]];
        let lines = [Line { class: "after", points: &points }];
        let svg = Chart { logarithmic: true, band: None, unit: "1", ..chart(&lines) }.draw().into_string();
        assert_well_formed(&svg);
        assert!(svg.contains(">1000<") && svg.contains(">1<"), "{svg}");
    }
}
