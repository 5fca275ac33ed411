//! Shares in one world over shares in another, each with its interval; on the diagonal both are alike.

use super::shares::Shares;
use maud::Markup;

/// One policy on one task.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    /// What shows under the pointer.
    pub(crate) name: String,
    /// Share below and its interval.
    pub(crate) x: [f64; 3],
    /// Share beside and its interval.
    pub(crate) y: [f64; 3],
}

const SIZE: [f64; 2] = [440.0, 420.0];

/// The points; `below` and `beside` name the two worlds.
pub(crate) fn scatter([below, beside]: [&str; 2], points: &[Point]) -> Markup {
    let Shares { mut canvas, x, y } = Shares::new(SIZE, &format!("success in {below}"));
    for Point { name, x: [across, left, right], y: [up, low, high] } in points {
        canvas.hint(name, |canvas| {
            canvas.line("axis", [x.at(*left), y.at(*up)], [x.at(*right), y.at(*up)]);
            canvas.line("axis", [x.at(*across), y.at(*low)], [x.at(*across), y.at(*high)]);
            canvas.circle("dot", [x.at(*across), y.at(*up)], 4.5);
        });
    }
    canvas.text_upwards("small", [16.0, y.at(0.2)], &format!("success in {beside}"), 260.0);
    canvas.finish(SIZE, &format!("success in {beside} over success in {below}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    #[test]
    fn each_point_has_its_name_and_both_intervals() {
        let point = |name: &str, at: f64| Point { name: name.into(), x: [at, at - 0.1, at + 0.1], y: [at; 3] };
        let svg = scatter(["twin", "robot"], &[point("a < b on pick", 0.5), point("c", 0.8)]).into_string();
        assert_well_formed(&svg);
        assert!(svg.contains("a &lt; b on pick") && svg.matches("class=\"dot\"").count() == 2, "{svg}");
        assert_well_formed(&scatter(["twin", "robot"], &[point("nowhere", f64::NAN)]).into_string());
    }
}
