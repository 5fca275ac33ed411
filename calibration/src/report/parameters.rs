//! Parameters with their intervals in words and as a picture: one number, or one a joint or axis.

use super::figure::forest::{Group, Row};
use super::quantity::Unit;
use twin::effects::{Shape, find};

/// A parameter of one or several numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Numbers<'a> {
    /// Name in files: `stiffness`, `centre_of_mass`, `delay`.
    pub(super) name: &'a str,
    /// Whether there is one number a joint.
    pub(super) joints: bool,
    /// SI unit.
    pub(super) unit: &'a str,
    /// The numbers.
    pub(super) values: &'a [f64],
    /// An interval each.
    pub(super) intervals: &'a [[f64; 2]],
}

/// Most numbers that a line names one by one.
const MOST: usize = 3;

impl Numbers<'_> {
    /// The parameter in a line: `delay 11.9 [11.2, 12.6] ms`, `coulomb 0.28 to 1.10 N m over 7 joints`.
    pub(super) fn line(&self) -> String {
        let name = self.name.replace('_', " ");
        let unit = self.shown();
        if self.values.len() <= MOST {
            let numbers: Vec<String> = self.pairs().map(|(value, interval)| unit.interval(value, interval)).collect();
            return format!("{name} {}", numbers.join(", "));
        }
        let [lo, hi] = super::scale::span(self.values.iter().copied());
        let many = format!("{} {}", self.values.len(), if self.joints { "joints" } else { "numbers" });
        format!("{name} {} to {} over {many}", super::quantity::short(unit.scaled(lo)), unit.with_unit(hi))
    }

    /// The parameter as rows of a picture; `nominal`: what was believed of each number.
    pub(super) fn group<'a>(
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

    fn pairs(&self) -> impl Iterator<Item = (f64, [f64; 2])> {
        let intervals = self.intervals.iter().copied().chain(std::iter::repeat([f64::NAN; 2]));
        self.values.iter().copied().zip(intervals)
    }

    fn shown(&self) -> Unit {
        let [lo, hi] = super::scale::span(self.values.iter().copied());
        Unit::suited(self.unit, lo.abs().max(hi.abs()))
    }
}

/// Whether a parameter, `stiffness` or `effect.parameter`, holds one number a joint.
pub(super) fn of_joints(name: &str) -> bool {
    let Some((effect, parameter)) = name.split_once('.') else { return matches!(name, "stiffness" | "damping") };
    let effect = find(effect.trim_start_matches("1/"));
    let parameter = effect.and_then(|effect| effect.parameters.iter().find(|known| known.name == parameter));
    parameter.is_some_and(|parameter| parameter.shape == Shape::PerJoint)
}

/// What the `k`-th of `count` numbers belongs to, a joint or an axis; empty for the only one.
pub(super) fn part(joints: bool, count: usize, k: usize) -> String {
    match ["x", "y", "z"].get(k) {
        _ if joints => format!("joint {}", k + 1),
        Some(axis) if count > 1 => (*axis).to_owned(),
        _ if count > 1 => (k + 1).to_string(),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_registry_tells_what_belongs_to_joints() {
        assert!(of_joints("damping") && of_joints("joint_coulomb_friction.coulomb"));
        assert!(!of_joints("centre_of_mass") && !of_joints("command_delay.delay") && !of_joints("no.such"));
        assert_eq!([part(true, 1, 0), part(false, 3, 2), part(false, 1, 0)], ["joint 1", "z", ""]);
    }

    #[test]
    fn few_numbers_are_named_and_many_are_spanned() {
        let delay =
            Numbers { name: "delay", joints: false, unit: "s", values: &[0.0119], intervals: &[[0.0112, 0.0126]] };
        assert_eq!(delay.line(), "delay 11.9 [11.2, 12.6] ms");
        let gains = [600.0, 597.0, 500.0, 668.9];
        let stiffness = Numbers {
            name: "stiffness",
            joints: of_joints("stiffness"),
            unit: "N m/rad",
            values: &gains,
            intervals: &[],
        };
        assert_eq!(stiffness.line(), "stiffness 500 to 669 N m/rad over 4 joints");
        assert_eq!(stiffness.group("stiffness", &[600.0], |_| None).rows[3].name, "joint 4");
        let centre =
            Numbers { name: "centre_of_mass", joints: false, unit: "m", values: &[0.001, -0.002], intervals: &[] };
        assert_eq!(centre.line(), "centre of mass 1.00 mm, -2.00 mm");
        assert_eq!(centre.group("centre of mass", &[0.0; 2], |_| None).rows[1].name, "y");
    }
}
