//! Tables of numbers as colour: correlations from -1 (blue) to 1 (orange), and who was taken for whom.

use crate::page::canvas::{Anchor, Canvas, WIDTH, width_of};
use maud::Markup;
use std::collections::BTreeMap;

/// Room for names, at most.
const LONGEST: [f64; 2] = [250.0, 170.0];
/// Width of a cell.
const SIDES: [f64; 2] = [15.0, 40.0];

/// A cell: what is written, how strong the colour is (0 to 1) and of which class.
struct Cell {
    words: String,
    strength: f64,
    class: &'static str,
}

/// Correlations of the named numbers, row by row.
pub(crate) fn correlations(names: &[String], values: &[Vec<f64>]) -> Markup {
    grid(names, names, "correlation matrix", |row, column| {
        let value = values.get(row).and_then(|row| row.get(column)).copied().filter(|value| value.is_finite())?;
        // In hundredths, which fit a small cell.
        let words = if row == column || value.abs() < 0.005 { String::new() } else { format!("{:.0}", 100.0 * value) };
        let strength = if row == column { 0.12 } else { value.abs() };
        Some(Cell { words, strength, class: if value < 0.0 { "after" } else { "before" } })
    })
}

/// How often a truth (down) was called what (across). Blue is right: `right` tells.
pub(crate) fn confusion(
    counts: &BTreeMap<String, BTreeMap<String, usize>>,
    right: impl Fn(&str, &str) -> bool,
) -> Markup {
    let rows: Vec<String> = counts.keys().cloned().collect();
    let mut columns: Vec<String> = counts.values().flat_map(BTreeMap::keys).cloned().collect();
    columns.sort_by_key(|said| (rows.iter().position(|truth| right(truth, said)).unwrap_or(rows.len()), said.clone()));
    columns.dedup();
    grid(&rows, &columns, "confusion matrix", |row, column| {
        let (truth, said) = (&rows[row], &columns[column]);
        let count = *counts.get(truth)?.get(said)?;
        let all: usize = counts.get(truth)?.values().sum();
        let class = if right(truth, said) { "after" } else { "before" };
        Some(Cell { words: count.to_string(), strength: count as f64 / all.max(1) as f64, class })
    })
}

fn grid(rows: &[String], columns: &[String], what: &str, cell: impl Fn(usize, usize) -> Option<Cell>) -> Markup {
    let mut canvas = Canvas::new();
    let room =
        |names: &[String], most: f64| names.iter().map(|name| width_of(name) + 10.0).fold(40.0, f64::max).min(most);
    let (left, top) = (room(rows, LONGEST[0]), room(columns, LONGEST[1]));
    let side = ((WIDTH - left) / columns.len().max(1) as f64).clamp(SIDES[0], SIDES[1]);
    let height = side.clamp(16.0, 26.0);
    for (column, name) in columns.iter().enumerate() {
        canvas.text_upwards("soft", [left + side * (column as f64 + 0.5) + 4.5, top - 6.0], name, top - 8.0);
    }
    for (row, name) in rows.iter().enumerate() {
        let y = top + height * row as f64;
        let base = y + 0.5 * height + 4.5;
        canvas.text_within("", [left - 8.0, base], Anchor::End, name, left - 8.0);
        for column in 0..columns.len() {
            let x = left + side * column as f64;
            canvas.rect("cell", [x, y], [side, height]);
            let Some(Cell { words, strength, class }) = cell(row, column) else { continue };
            canvas.tint(class, strength, [x + 1.0, y + 1.0], [side - 2.0, height - 2.0]);
            let ink = if strength > 0.65 { "on" } else { "" };
            canvas.text(ink, [x + 0.5 * side, base], Anchor::Middle, &words);
        }
    }
    let size = [left + side * columns.len() as f64 + 4.0, top + height * rows.len() as f64 + 8.0];
    canvas.finish(size, what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    #[test]
    fn strong_correlations_stand_out_with_their_sign() {
        let names = ["stiffness 1".to_owned(), "damping 1".to_owned()];
        let svg = correlations(&names, &[vec![1.0, -0.93], vec![-0.93, 1.0]]).into_string();
        assert_well_formed(&svg);
        assert_eq!(svg.matches(">-93<").count(), 2);
        assert_eq!(svg.matches("class=\"after\" fill-opacity=\"0.93\"").count(), 2);
    }

    #[test]
    fn what_was_taken_for_what_is_counted_and_coloured() {
        let said = |entries: &[(&str, usize)]| entries.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect();
        let counts = BTreeMap::from([
            ("payload".to_owned(), said(&[("payload", 3), ("class", 1)])),
            ("nothing".to_owned(), said(&[("none", 8)])),
        ]);
        let right = |truth: &str, said: &str| truth == said || (truth, said) == ("nothing", "none");
        let svg = confusion(&counts, right).into_string();
        assert_well_formed(&svg);
        assert!(svg.contains("class=\"after\" fill-opacity=\"0.75\""), "{svg}");
        assert!(svg.contains("class=\"before\" fill-opacity=\"0.25\""), "{svg}");
        let place = |name: &str| svg.find(name).unwrap_or_else(|| panic!("no {name}"));
        assert!(place(">none<") < place(">class<"), "what is right stands on the diagonal");
    }

    #[test]
    fn neither_long_names_nor_holes_nor_nothing_break_the_picture() {
        let names: Vec<String> = (0..40).map(|i| format!("a parameter with a name that goes on and on {i}")).collect();
        assert_well_formed(&correlations(&names, &[vec![f64::NAN; 3]]).into_string());
        assert_well_formed(&correlations(&[], &[]).into_string());
        assert_well_formed(&confusion(&BTreeMap::new(), |_, _| false).into_string());
    }
}
