//! Before and after, as pairs of bars; a dashed line where noise alone would end.

use crate::page::canvas::{Anchor, Canvas, WIDTH, width_of};
use crate::page::scale::Scale;
use crate::words::quantity::{Unit, span};
use maud::Markup;
use std::collections::BTreeMap;

/// A quantity before and after. Rows of the same unit share a scale.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row<'a> {
    /// What it is.
    pub(crate) name: &'a str,
    pub(crate) unit: &'a str,
    /// Values in the order of the classes.
    pub(crate) values: Vec<f64>,
    /// What noise alone would leave.
    pub(crate) floor: Option<f64>,
}

/// Room for names, at least and at most.
const NAMES: [f64; 2] = [170.0, 300.0];
const RIGHT: f64 = 150.0;
const BAR: f64 = 15.0;
const GAP: f64 = 14.0;
/// Room under a row that has a floor, for the words under it.
const WORDS: f64 = 20.0;

/// Rows of bars, one bar a class: `before` is orange, `after` blue, `track` grey.
pub(crate) fn bars(classes: &[&str], rows: &[Row]) -> Markup {
    let mut canvas = Canvas::new();
    let names = rows.iter().map(|row| width_of(row.name) + 16.0);
    let left = names.fold(NAMES[0], f64::max).min(NAMES[1]);
    let scales = scales(rows, left);
    let mut y = 6.0;
    for row in rows {
        let (unit, scale) = &scales[row.unit];
        let height = BAR * row.values.len() as f64;
        canvas.text_within("", [left - 12.0, y + 0.5 * height + 4.5], Anchor::End, row.name, left - 14.0);
        for (place, (class, value)) in classes.iter().zip(&row.values).enumerate() {
            let top = y + BAR * place as f64;
            let end = if value.is_finite() { scale.at(unit.scaled(*value)) } else { left };
            canvas.rect(class, [left, top], [(end - left).max(1.0), BAR - 2.0]);
            canvas.text("", [end + 7.0, top + BAR - 4.0], Anchor::Start, &unit.with_unit(*value));
        }
        canvas.line("axis", [left, y - 3.0], [left, y + height + 1.0]);
        if let Some(floor) = row.floor {
            draw_floor(&mut canvas, (unit, scale), (y, height), floor);
            y += WORDS;
        }
        y += height + GAP;
    }
    canvas.finish([WIDTH, y.max(20.0)], "bars before and after")
}

/// The floor across a row, with its value under it.
fn draw_floor(canvas: &mut Canvas, (unit, scale): (&Unit, &Scale), (y, height): (f64, f64), floor: f64) {
    let x = scale.at(unit.scaled(floor));
    canvas.line("floor", [x, y - 5.0], [x, y + height + 5.0]);
    let words = format!("noise alone: {}", unit.with_unit(floor));
    canvas.text("small", [x.min(WIDTH - RIGHT), y + height + 17.0], Anchor::Start, &words);
}

fn scales<'a>(rows: &'a [Row], left: f64) -> BTreeMap<&'a str, (Unit, Scale)> {
    let mut largest: BTreeMap<&str, f64> = BTreeMap::new();
    for row in rows {
        let [_, top] = span(row.values.iter().copied().chain(row.floor).chain([0.0]));
        let entry = largest.entry(row.unit).or_default();
        *entry = entry.max(top);
    }
    let scale = |(si, top): (&'a str, f64)| {
        let unit = Unit::suited(si, top);
        let scale = Scale::new([0.0, unit.scaled(top)], [left, WIDTH - RIGHT]);
        (si, (unit, scale))
    };
    largest.into_iter().map(scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    fn row<'a>(name: &'a str, unit: &'a str, values: &[f64], floor: Option<f64>) -> Row<'a> {
        Row { name, unit, values: values.to_vec(), floor }
    }

    #[test]
    fn every_bar_has_its_value_in_a_unit_that_people_use() {
        let rows = [
            row("residual", "\u{3c3}\u{b2}", &[38.4, 1.1], Some(1.0)),
            row("ADD", "m", &[0.0139, 0.0012], None),
            row("ADD-S", "m", &[0.0078, 0.0009], None),
        ];
        let svg = bars(&["before", "after"], &rows).into_string();
        assert_well_formed(&svg);
        for text in [
            "38.4 \u{3c3}\u{b2}",
            "1.10 \u{3c3}\u{b2}",
            "13.9 mm",
            "0.900 mm",
            "noise alone: 1.00 \u{3c3}\u{b2}",
            ">ADD-S<",
        ] {
            assert!(svg.contains(text), "no {text} in {svg}");
        }
        let width = |class: &str, nth: usize| -> f64 {
            let bar = svg.split(&format!("class=\"{class}\" x")).nth(nth).expect("a bar");
            bar.split("width=\"")
                .nth(1)
                .and_then(|w| w.split('"').next())
                .and_then(|w| w.parse().ok())
                .expect("a width")
        };
        assert!((width("before", 3) / width("before", 2) - 0.0078 / 0.0139).abs() < 1e-3, "one scale for one unit");
    }

    #[test]
    fn neither_long_names_nor_missing_numbers_break_the_picture() {
        let long = "mean over all joints and every clip of the confirm set of what the twin misses";
        assert_well_formed(&bars(&["before", "after"], &[row(long, "m", &[f64::NAN, 1e9], Some(2e9))]).into_string());
        assert_well_formed(&bars(&["before", "after"], &[row("zero", "1", &[0.0, 0.0], Some(0.0))]).into_string());
        assert_well_formed(&bars(&[], &[]).into_string());
    }
}
