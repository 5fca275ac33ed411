//! Parameters with their intervals as a picture: one number, or one a joint or axis.

use super::figure::forest::{Group, Row};

/// A parameter of one or several numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Numbers<'a> {
    /// Name in files: `stiffness`, `centre_of_mass`, `delay`.
    pub(super) name: &'a str,
    /// SI unit.
    pub(super) unit: &'a str,
    /// The numbers.
    pub(super) values: &'a [f64],
    /// An interval each.
    pub(super) intervals: &'a [[f64; 2]],
}

impl Numbers<'_> {
    /// The parameter as rows of a picture; `nominal`: what was believed of each number.
    pub(super) fn group<'a>(
        &'a self,
        heading: &'a str,
        nominal: &[f64],
        warning: impl Fn(usize) -> Option<String>,
    ) -> Group<'a> {
        let row = |(k, (value, interval)): (usize, (f64, [f64; 2]))| Row {
            name: part(self.values.len(), k),
            value,
            interval,
            nominal: nominal.get(k).copied(),
            warning: warning(k),
        };
        Group { name: heading, unit: self.unit, rows: self.pairs().enumerate().map(row).collect() }
    }

    fn pairs(&self) -> impl Iterator<Item = (f64, [f64; 2])> {
        let intervals = self.intervals.iter().copied().chain(std::iter::repeat([f64::NAN; 2]));
        self.values.iter().copied().zip(intervals)
    }
}

/// What the `k`-th of `count` numbers belongs to; empty for the only one.
pub(super) fn part(count: usize, k: usize) -> String {
    match count {
        1 => String::new(),
        2 | 3 => ["x", "y", "z"].get(k).map_or_else(String::new, |axis| (*axis).to_owned()),
        _ => format!("joint {}", k + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_named_by_joint_or_axis() {
        let gains = [600.0, 597.0, 500.0, 668.9];
        let stiffness = Numbers { name: "stiffness", unit: "N m/rad", values: &gains, intervals: &[] };
        assert_eq!(stiffness.group("stiffness", &[600.0], |_| None).rows[3].name, "joint 4");
        let centre = Numbers { name: "centre_of_mass", unit: "m", values: &[0.001, -0.002], intervals: &[] };
        assert_eq!(centre.group("centre of mass", &[0.0; 2], |_| None).rows[1].name, "y");
    }
}
