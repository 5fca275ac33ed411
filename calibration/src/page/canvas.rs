//! Pictures as SVG inside the page. Colours come from the page's style through class names, so that one picture serves light,
//! dark and paper. Lengths in user units, of which 900 fill the page.

use maud::{Escaper, Markup, PreEscaped};
use std::fmt::Write as _;

/// Width of a full picture.
pub(crate) const WIDTH: f64 = 900.0;
/// Mean width of a character of the widest font in use at size 13: DejaVu Sans.
const CHARACTER: f64 = 7.6;

/// Which end of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A picture in the making.
#[derive(Debug, Clone)]
pub(crate) struct Canvas {
    body: String,
}

impl Canvas {
    pub(crate) fn new() -> Self {
        Self { body: String::new() }
    }

    pub(crate) fn rect(&mut self, class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        self.element(format_args!(
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            n(x),
            n(y),
            n(width.max(0.0)),
            n(height.max(0.0))
        ));
    }

    /// A rectangle whose colour covers by `strength`, 0 to 1.
    pub(crate) fn tint(&mut self, class: &str, strength: f64, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        self.element(format_args!(
            "<rect class=\"{class}\" fill-opacity=\"{:.2}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            strength.clamp(0.0, 1.0),
            n(x),
            n(y),
            n(width),
            n(height)
        ));
    }

    pub(crate) fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.element(format_args!(
            "<line class=\"{class}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
            n(x1),
            n(y1),
            n(x2),
            n(y2)
        ));
    }

    pub(crate) fn circle(&mut self, class: &str, [x, y]: [f64; 2], radius: f64) {
        self.element(format_args!("<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>", n(x), n(y), n(radius)));
    }

    /// A line through the points, in order.
    pub(crate) fn polyline(&mut self, class: &str, points: impl Iterator<Item = [f64; 2]>) {
        let points: Vec<String> = points.map(|[x, y]| format!("{},{}", n(x), n(y))).collect();
        self.element(format_args!("<polyline class=\"{class}\" points=\"{}\"/>", points.join(" ")));
    }

    pub(crate) fn text(&mut self, class: &str, [x, y]: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.element(format_args!(
            "<text class=\"{class}\" x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\">{}</text>",
            n(x),
            n(y),
            escaped(text)
        ));
    }

    /// A text that is read from below, from `at` upwards, within `room`.
    pub(crate) fn text_upwards(&mut self, class: &str, [x, y]: [f64; 2], text: &str, room: f64) {
        self.element(format_args!("<g transform=\"translate({} {}) rotate(-90)\">", n(x), n(y)));
        self.text_within(class, [0.0, 0.0], Anchor::Start, text, room);
        self.element(format_args!("</g>"));
    }

    /// A text that takes at most `room`: shortened if need be, and then whole under the pointer.
    pub(crate) fn text_within(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str, room: f64) {
        let most = (room / CHARACTER).max(1.0) as usize;
        if text.chars().count() <= most {
            return self.text(class, at, anchor, text);
        }
        let kept: String = text.chars().take(most.saturating_sub(1)).collect();
        self.hint(text, |canvas| canvas.text(class, at, anchor, &format!("{}\u{2026}", kept.trim_end())));
    }

    /// What `draw` draws, with a text that shows under the pointer.
    pub(crate) fn hint(&mut self, text: &str, draw: impl FnOnce(&mut Self)) {
        self.element(format_args!("<g><title>{}</title>", escaped(text)));
        draw(self);
        self.element(format_args!("</g>"));
    }

    /// The picture, with what it shows in words for those who cannot see it.
    pub(crate) fn finish(self, [width, height]: [f64; 2], what: &str) -> Markup {
        PreEscaped(format!(
            "<svg role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\">{}</svg>",
            escaped(what),
            self.body,
            w = n(width),
            h = n(height)
        ))
    }

    fn element(&mut self, text: std::fmt::Arguments) {
        self.body.write_fmt(text).expect("a string takes all text");
    }
}

/// The width that a text takes, at most.
pub(crate) fn width_of(text: &str) -> f64 {
    CHARACTER * text.chars().count() as f64
}

/// A coordinate with one digit behind the point; a number that is none lands at 0, where it breaks no page.
fn n(value: f64) -> String {
    let text = format!("{:.1}", if value.is_finite() { value } else { 0.0 });
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    Escaper::new(&mut out).write_str(text).expect("a string takes all text");
    out
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Asserts that every element is closed in order, no number is missing, and nothing is drawn outside.
    pub(crate) fn assert_well_formed(svg: &str) {
        assert!(!svg.contains("NaN") && !svg.contains("inf\""), "a number is missing: {svg}");
        let mut open = Vec::new();
        for tag in svg.split('<').skip(1).map(|rest| rest.split('>').next().expect("a tag")) {
            match (tag.strip_prefix('/'), tag.ends_with('/')) {
                (Some(name), _) => assert_eq!(open.pop(), Some(name), "{svg}"),
                (None, false) => open.push(tag.split(' ').next().expect("a name")),
                (None, true) => assert_eq!(tag.matches('"').count() % 2, 0, "{tag}"),
            }
        }
        assert!(open.is_empty(), "{open:?} is never closed");
        assert_inside(svg);
    }

    fn assert_inside(svg: &str) {
        let frame = svg.split("viewBox=\"0 0 ").nth(1).and_then(|rest| rest.split('"').next()).expect("a frame");
        let (width, height) = frame.split_once(' ').expect("two numbers");
        let [width, height]: [f64; 2] = [width, height].map(|number| number.parse().expect("a number"));
        for text in svg.split("<text ").skip(1) {
            let value = |key: &str| -> f64 {
                let rest = text.split(&format!("{key}=\"")).nth(1).expect(key);
                rest.split('"').next().and_then(|number| number.parse().ok()).expect("a number")
            };
            let content = text.split('>').nth(1).and_then(|rest| rest.split('<').next()).expect("content");
            let length = 0.8 * width_of(content);
            let left = match text {
                _ if text.contains("\"middle\"") => value("x") - 0.5 * length,
                _ if text.contains("\"end\"") => value("x") - length,
                _ => value("x"),
            };
            assert!(left >= -1.0 && left + length <= width + 1.0, "`{content}` leaves the picture of {width}");
            assert!((0.0..=height).contains(&value("y")), "`{content}` leaves the picture of height {height}");
        }
    }

    #[test]
    fn texts_are_escaped_and_shortened_to_their_room() {
        let mut canvas = Canvas::new();
        canvas.text_within("", [0.0, 20.0], Anchor::Start, "<a very long name & more>", 80.0);
        let svg = canvas.finish([100.0, 30.0], "a \"test\"").into_string();
        assert_well_formed(&svg);
        assert!(svg.contains("<title>&lt;a very long name &amp; more&gt;</title>"), "{svg}");
        assert!(svg.contains(">&lt;a very l\u{2026}</text>"), "{svg}");
        assert!(svg.contains("aria-label=\"a &quot;test&quot;\""), "{svg}");
    }
}
