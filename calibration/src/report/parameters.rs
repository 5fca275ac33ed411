//! Estimated numbers in a line of words, and as rows of a picture.

use super::figure::forest::{Group, Row};
use super::quantity::{Unit, short};
use super::scale::span;
use crate::numbers::{Numbers, Per};

/// Most numbers that a line names one by one.
const MOST: usize = 3;

/// The unit in which all the numbers are told.
pub(super) fn unit(numbers: &Numbers) -> Unit {
    let [lo, hi] = span(numbers.values.iter().copied());
    Unit::suited(&numbers.unit, lo.abs().max(hi.abs()))
}

/// A parameter in a line: `delay 11.9 [11.2, 12.6] ms`, `coulomb 0.28 to 1.10 N m over 7 joints`.
pub(super) fn line(name: &str, numbers: &Numbers) -> String {
    let (name, unit) = (name.replace('_', " "), unit(numbers));
    if numbers.values.len() <= MOST {
        let each: Vec<String> = numbers.pairs().map(|(value, interval)| unit.interval(value, interval)).collect();
        return format!("{name} {}", each.join(", "));
    }
    let [lo, hi] = span(numbers.values.iter().copied());
    let per = if numbers.per == Per::Joint { "joints" } else { "numbers" };
    format!("{name} {} to {} over {} {per}", short(unit.scaled(lo)), unit.with_unit(hi), numbers.values.len())
}

/// A parameter as rows of a picture; `nominal`: what was believed of each number; `warning`: a remark on each.
pub(super) fn group<'a>(
    heading: &'a str,
    numbers: &'a Numbers,
    nominal: &[f64],
    warning: impl Fn(usize) -> Option<String>,
) -> Group<'a> {
    let row = |(k, (value, interval)): (usize, (f64, [f64; 2]))| Row {
        name: numbers.part(k),
        value,
        interval,
        nominal: nominal.get(k).copied(),
        warning: warning(k),
    };
    Group { name: heading, unit: &numbers.unit, rows: numbers.pairs().enumerate().map(row).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_numbers_are_named_and_many_are_spanned() {
        let numbers = |values: &[f64], unit: &str, per| Numbers {
            values: values.to_vec(),
            intervals: vec![],
            unit: unit.into(),
            per,
            ..Numbers::default()
        };
        let delay = Numbers { intervals: vec![[0.0112, 0.0126]], ..numbers(&[0.0119], "s", Per::Cell) };
        assert_eq!(line("delay", &delay), "delay 11.9 [11.2, 12.6] ms");
        let stiffness = numbers(&[600.0, 597.0, 500.0, 668.9], "N m/rad", Per::Joint);
        assert_eq!(line("stiffness", &stiffness), "stiffness 500 to 669 N m/rad over 4 joints");
        assert_eq!(group("stiffness", &stiffness, &[600.0], |_| None).rows[3].name, "joint 4");
        let centre = numbers(&[0.001, -0.002], "m", Per::Axis);
        assert_eq!(line("centre_of_mass", &centre), "centre of mass 1.00 mm, -2.00 mm");
    }
}
