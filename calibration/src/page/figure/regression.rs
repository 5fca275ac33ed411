//! Points with the line through them: what was measured over what it depends on, each point a clip, with the slope's error as a band.

use crate::page::canvas::{Anchor, Canvas};
use crate::page::scale::Scale;
use crate::words::quantity::{Unit, span};
use maud::Markup;

/// A line through the origin or a level one, and the points that it was fitted to, in SI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fitted<'a> {
    pub(crate) title: &'a str,
    /// Name and SI unit of the axis below.
    pub(crate) x: [&'a str; 2],
    /// Name and SI unit of the axis beside it.
    pub(crate) y: [&'a str; 2],
    pub(crate) points: &'a [[f64; 2]],
    /// Slope of the line, or its height where it is level.
    pub(crate) value: f64,
    /// One standard error of it.
    pub(crate) error: f64,
    pub(crate) level: bool,
}

const SIZE: [f64; 2] = [440.0, 250.0];
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 40.0;
/// The band holds two standard errors to either side: 95 %.
const BAND: f64 = 2.0;

impl Fitted<'_> {
    /// The line, its value moved by so many standard errors.
    fn line(&self, x: f64, errors: f64) -> f64 {
        let value = self.value + errors * self.error;
        if self.level { value } else { value * x }
    }

    /// The picture.
    pub(crate) fn draw(&self) -> Markup {
        let [width, height] = SIZE;
        let [low, high] = span(self.points.iter().map(|point| point[0]).chain((!self.level).then_some(0.0)));
        let room = 0.04 * (high - low).max(f64::MIN_POSITIVE);
        let ends = [low - room, high + room];
        let edges = ends.into_iter().flat_map(|x| [-BAND, BAND].map(|errors| self.line(x, errors)));
        let [bottom, top] = span(self.points.iter().map(|point| point[1]).chain(edges).chain([0.0]));
        let [below, beside] = [(self.x[1], low.abs().max(high.abs())), (self.y[1], bottom.abs().max(top.abs()))]
            .map(|(unit, largest)| Unit::suited(unit, largest));
        let x = Scale::new(ends.map(|x| below.scaled(x)), [LEFT, width - RIGHT]);
        let margin = 0.05 * (top - bottom);
        let y = Scale::new([bottom - margin, top + margin].map(|y| beside.scaled(y)), [height - BOTTOM, TOP]);
        let at = |[across, up]: [f64; 2]| [x.at(below.scaled(across)), y.at(beside.scaled(up))];
        let mut canvas = Canvas::new();
        self.draw_axes(&mut canvas, (&x, &y), [below.name(), beside.name()]);
        let line = |errors: f64| ends.map(|x| at([x, self.line(x, errors)]));
        for errors in [-BAND, BAND] {
            let [from, to] = line(errors);
            canvas.line("floor", from, to);
        }
        canvas.polyline("line after", line(0.0).into_iter());
        for point in self.points {
            canvas.circle("dot", at(*point), 4.0);
        }
        canvas.finish(SIZE, &format!("{}: {} over {}", self.title, self.y[0], self.x[0]))
    }

    fn draw_axes(&self, canvas: &mut Canvas, (x, y): (&Scale, &Scale), units: [&str; 2]) {
        let [width, height] = SIZE;
        let named = |name: &str, unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
        canvas.text_within("strong", [0.0, 14.0], Anchor::Start, self.title, width);
        canvas.text_within("small", [0.0, 32.0], Anchor::Start, &named(self.y[0], units[1]), width);
        for (value, name) in y.ticks(4) {
            canvas.line("grid", [LEFT, y.at(value)], [width - RIGHT, y.at(value)]);
            canvas.text("small", [LEFT - 6.0, y.at(value) + 4.0], Anchor::End, &name);
        }
        canvas.line("axis", [LEFT, y.at(0.0)], [width - RIGHT, y.at(0.0)]);
        for (value, name) in x.ticks(5) {
            canvas.line("axis", [x.at(value), height - BOTTOM], [x.at(value), height - BOTTOM + 4.0]);
            canvas.text("small", [x.at(value), height - BOTTOM + 16.0], Anchor::Middle, &name);
        }
        let middle = 0.5 * (LEFT + width - RIGHT);
        canvas.text_within("small", [middle, height - 6.0], Anchor::Middle, &named(self.x[0], units[0]), width - 80.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    #[test]
    fn points_lie_about_their_line_and_axes_carry_units() {
        let points = [[0.1, 0.002], [0.2, 0.004], [0.3, 0.0065]];
        let fitted = Fitted {
            title: "camera latency",
            x: ["speed of the push", "m/s"],
            y: ["how deep", "m"],
            points: &points,
            value: 0.02,
            error: 1e-3,
            level: false,
        };
        let svg = fitted.draw().into_string();
        assert_well_formed(&svg);
        assert_eq!((svg.matches("class=\"dot\"").count(), svg.matches("line after").count()), (3, 1));
        assert!(svg.contains("how deep [mm]") && svg.contains("speed of the push [mm/s]"), "{svg}");
        let level = Fitted { level: true, x: ["clip", "1"], points: &[], ..fitted };
        assert_well_formed(&level.draw().into_string());
        assert_eq!(level.line(5.0, 0.0), 0.02);
    }
}
