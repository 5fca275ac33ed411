//! What verbs print on stderr for a person: a short table, aligned, and the sentence at the end, where eyes are.

use super::identification::{Parameter, Sheet};
use super::quantity::{Unit, short};
use super::scale::span;

/// An identification: each number with its interval and what was believed, the errors, what cannot be told, what to do next.
#[must_use]
pub fn identification(sheet: &Sheet) -> String {
    let mut lines = table(sheet.parameters.iter().flat_map(numbers).collect());
    lines.extend(sheet.errors.iter().map(|error| {
        let unit = Unit::suited(&error.unit, error.before.unwrap_or(error.after));
        let before = error.before.map_or_else(String::new, |before| format!("{} -> ", short(unit.scaled(before))));
        format!("{}: {before}{}", error.name, unit.with_unit(error.after))
    }));
    lines.extend(sheet.not_identifiable.iter().map(|[name, why]| format!("cannot tell {name}: {why}")));
    lines.extend(sheet.advice.iter().map(|advice| format!("next: {advice}")));
    lines.push(sheet.sentence.clone());
    lines.join("\n")
}

/// Rows of a parameter: name, value with interval, what was believed, remark.
fn numbers(parameter: &Parameter) -> Vec<Vec<String>> {
    let name = parameter.name.replace('_', " ");
    let [lo, hi] = span(parameter.values.iter().copied());
    let unit = Unit::suited(&parameter.unit, lo.abs().max(hi.abs()));
    let row = |(k, value): (usize, &f64)| {
        let name = match parameter.part(k) {
            part if part.is_empty() => name.clone(),
            part => format!("{name}, {part}"),
        };
        let interval = parameter.intervals.get(k).copied().unwrap_or([f64::NAN; 2]);
        let nominal =
            parameter.nominal.get(k).map_or_else(String::new, |x| format!("cell.toml {}", short(unit.scaled(*x))));
        let warning = parameter.warnings.get(k).cloned().flatten().unwrap_or_default();
        vec![name, unit.interval(*value, interval), nominal, warning]
    };
    parameter.values.iter().enumerate().map(row).collect()
}

/// Lines with their columns one under the other.
fn table(rows: Vec<Vec<String>>) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        cells.join("   ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::identification::Error;

    #[test]
    fn columns_stand_under_each_other_and_the_sentence_comes_last() {
        let centre = Parameter {
            name: "centre_of_mass".into(),
            unit: "m".into(),
            values: vec![0.0051, -0.002],
            intervals: vec![[0.0042, 0.006], [-0.003, -0.001]],
            nominal: vec![0.0, 0.0],
            warnings: vec![None, Some("at its lower bound".into())],
        };
        let sheet = Sheet {
            parameters: vec![centre],
            errors: vec![Error {
                name: "ADD, held-out clips".into(),
                unit: "m".into(),
                before: Some(0.0139),
                after: 0.002,
            }],
            not_identifiable: vec![["mass".into(), "the arm is much heavier; weigh it".into()]],
            sentence: "The object is known.".into(),
            ..Sheet::default()
        };
        let expected = "\
centre of mass, x   5.1 [4.2, 6.0] mm      cell.toml 0
centre of mass, y   -2.0 [-3.0, -1.0] mm   cell.toml 0   at its lower bound
ADD, held-out clips: 13.9 -> 2.00 mm
cannot tell mass: the arm is much heavier; weigh it
The object is known.";
        assert_eq!(identification(&sheet), expected);
    }
}
