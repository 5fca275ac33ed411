//! Tables of numbers as colour: correlations from -1 (blue) to 1 (orange), and who was taken for whom.

use crate::report::canvas::{Anchor, Canvas, WIDTH, width_of};
use maud::Markup;

/// Room for names, at most.
const LONGEST: f64 = 260.0;
const WIDEST: f64 = 40.0;
/// Room for the number of a row.
const NUMBER: f64 = 28.0;

/// A cell: what is written, how strong the colour is (0 to 1) and of which class.
struct Cell {
    words: String,
    strength: f64,
    class: &'static str,
}

/// Correlations of the named numbers, row by row. Columns are numbered like rows.
pub(in crate::report) fn correlations(names: &[String], values: &[Vec<f64>]) -> Markup {
    let columns: Vec<String> = (1..=names.len()).map(|k| k.to_string()).collect();
    grid(names, &columns, "correlation matrix", |row, column| {
        let value = values.get(row).and_then(|row| row.get(column)).copied().filter(|value| value.is_finite())?;
        let words = if row == column || value.abs() < 0.005 { String::new() } else { hundredths(value) };
        let strength = if row == column { 0.12 } else { value.abs() };
        Some(Cell { words, strength, class: if value < 0.0 { "after" } else { "before" } })
    })
}

/// A correlation in hundredths, which fits a small cell.
fn hundredths(value: f64) -> String {
    format!("{:.0}", 100.0 * value)
}

fn grid(rows: &[String], columns: &[String], what: &str, cell: impl Fn(usize, usize) -> Option<Cell>) -> Markup {
    let mut canvas = Canvas::new();
    let left = rows.iter().map(|name| width_of(name) + NUMBER).fold(60.0, f64::max).min(LONGEST);
    let side = ((WIDTH - left) / columns.len().max(1) as f64).min(WIDEST);
    let height = side.clamp(16.0, 26.0);
    for (column, name) in columns.iter().enumerate() {
        canvas.text("small", [left + side * (column as f64 + 0.5), 13.0], Anchor::Middle, name);
    }
    for (row, name) in rows.iter().enumerate() {
        let y = 20.0 + height * row as f64;
        let base = y + 0.5 * height + 4.5;
        canvas.text_within("", [left - NUMBER, base], Anchor::End, name, left - NUMBER);
        canvas.text("small", [left - 6.0, base], Anchor::End, &(row + 1).to_string());
        for column in 0..columns.len() {
            let x = left + side * column as f64;
            canvas.rect("cell", [x, y], [side, height]);
            let Some(Cell { words, strength, class }) = cell(row, column) else { continue };
            canvas.tint(class, strength, [x + 1.0, y + 1.0], [side - 2.0, height - 2.0]);
            let ink = if strength > 0.65 { "on" } else { "" };
            canvas.text(ink, [x + 0.5 * side, y + 0.5 * height + 4.5], Anchor::Middle, &words);
        }
    }
    let width = left + side * columns.len() as f64;
    canvas.finish([width.max(80.0), 28.0 + height * rows.len() as f64], what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::canvas::tests::assert_well_formed;

    #[test]
    fn strong_correlations_stand_out_with_their_sign() {
        let names = ["stiffness 1".to_owned(), "damping 1".to_owned()];
        let svg = correlations(&names, &[vec![1.0, -0.93], vec![-0.93, 1.0]]).into_string();
        assert_well_formed(&svg);
        assert_eq!(svg.matches(">-93<").count(), 2);
        assert_eq!(svg.matches("class=\"after\" fill-opacity=\"0.93\"").count(), 2);
    }

    #[test]
    fn neither_long_names_nor_holes_nor_nothing_break_the_picture() {
        let names: Vec<String> = (0..40).map(|i| format!("a parameter with a name that goes on and on {i}")).collect();
        assert_well_formed(&correlations(&names, &[vec![f64::NAN; 3]]).into_string());
        assert_well_formed(&correlations(&[], &[]).into_string());
    }
}
