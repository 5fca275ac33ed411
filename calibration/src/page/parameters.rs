//! Parameters with their intervals as a picture.

use super::figure::forest::{Group, Row};
use crate::words::parameters::{Numbers, part};

impl Numbers<'_> {
    /// The parameter as rows of a picture; `nominal`: what was believed of each number.
    pub(crate) fn group<'a>(
        &'a self,
        heading: &'a str,
        nominal: &[f64],
        warning: impl Fn(usize) -> Option<String>,
    ) -> Group<'a> {
        let row = |(k, (value, interval)): (usize, (f64, [f64; 2]))| Row {
            name: part(self.joints, self.values.len(), k),
            value,
            interval,
            nominal: nominal.get(k).copied(),
            warning: warning(k),
        };
        Group { name: heading, unit: self.unit, rows: self.pairs().enumerate().map(row).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_named_by_joint_or_axis() {
        let of = |name, joints, values| Numbers { name, joints, unit: "1", values, intervals: &[] };
        let gains = of("stiffness", true, &[600.0, 597.0, 500.0, 668.9]);
        assert_eq!(gains.group("stiffness", &[600.0], |_| None).rows[3].name, "joint 4");
        let centre = of("centre_of_mass", false, &[0.001, -0.002]);
        assert_eq!(centre.group("centre of mass", &[0.0; 2], |_| None).rows[1].name, "y");
    }
}
