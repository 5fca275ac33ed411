//! Parameters in words: one number, or one a joint or axis.

use super::quantity::{Unit, short, span};
use super::words;
use twin::effects::{Shape, find};

/// A parameter of one or several numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Numbers<'a> {
    /// Name in files: `stiffness`, `centre_of_mass`, `delay`.
    pub(crate) name: &'a str,
    /// Whether there is one number a joint.
    pub(crate) joints: bool,
    pub(crate) unit: &'a str,
    pub(crate) values: &'a [f64],
    /// An interval each.
    pub(crate) intervals: &'a [[f64; 2]],
}

/// A line names so many numbers one by one: more do not fit it (a choice).
const NAMED_ONE_BY_ONE: usize = 3;

impl Numbers<'_> {
    /// The parameter in a line: `delay 11.9 [11.2, 12.6] ms`, `coulomb 0.28 to 1.10 N m over 7 joints`.
    pub(crate) fn line(&self) -> String {
        self.written(|unit, value, interval| unit.interval(value, interval))
    }

    /// The same without intervals: `delay 11.9 ms`.
    pub(crate) fn brief(&self) -> String {
        self.written(|unit, value, _| unit.with_unit(value))
    }

    fn written(&self, number: impl Fn(&Unit, f64, [f64; 2]) -> String) -> String {
        let name = words(self.name);
        let unit = self.shown();
        if self.values.len() <= NAMED_ONE_BY_ONE {
            let numbers: Vec<String> = self.pairs().map(|(value, interval)| number(&unit, value, interval)).collect();
            return format!("{name} {}", numbers.join(", "));
        }
        let [lo, hi] = span(self.values.iter().copied());
        let many = format!("{} {}", self.values.len(), if self.joints { "joints" } else { "numbers" });
        format!("{name} {} to {} over {many}", short(unit.scaled(lo)), unit.with_unit(hi))
    }

    pub(crate) fn pairs(&self) -> impl Iterator<Item = (f64, [f64; 2])> {
        let intervals = self.intervals.iter().copied().chain(std::iter::repeat([f64::NAN; 2]));
        self.values.iter().copied().zip(intervals)
    }

    fn shown(&self) -> Unit {
        let [lo, hi] = span(self.values.iter().copied());
        Unit::suited(self.unit, lo.abs().max(hi.abs()))
    }
}

/// A number by its name in files as words: `stiffness[4]` as `stiffness, joint 5`, `centre_of_mass[0]` as `centre of mass, x`.
pub fn number_in_words(name: &str) -> String {
    let split = name.strip_suffix(']').and_then(|rest| rest.split_once('['));
    let Some((parameter, Ok(k))) = split.map(|(parameter, k)| (parameter, k.parse::<usize>())) else {
        return words(name);
    };
    let of = part(of_joints(parameter), usize::MAX, k);
    format!("{}, {of}", words(parameter).replace('.', ": "))
}

/// Whether a parameter, `stiffness` or `effect.parameter`, holds one number a joint.
pub(crate) fn of_joints(name: &str) -> bool {
    let Some((effect, parameter)) = name.split_once('.') else { return matches!(name, "stiffness" | "damping") };
    let effect = find(effect.trim_start_matches("1/"));
    let parameter = effect.and_then(|effect| effect.parameters.iter().find(|known| known.name == parameter));
    parameter.is_some_and(|parameter| parameter.shape == Shape::PerJoint)
}

/// What the `k`-th of `count` numbers belongs to, a joint or an axis; empty for the only one.
pub(crate) fn part(joints: bool, count: usize, k: usize) -> String {
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
    fn the_registry_knows_what_belongs_to_joints() {
        assert!(of_joints("damping") && of_joints("joint_coulomb_friction.coulomb"));
        assert!(!of_joints("centre_of_mass") && !of_joints("command_delay.delay") && !of_joints("no.such"));
        assert_eq!([part(true, 1, 0), part(false, 3, 2), part(false, 1, 0)], ["joint 1", "z", ""]);
        let names = ["stiffness[4]", "centre_of_mass[0]", "tip_friction", "joint_coulomb_friction.coulomb[1]"];
        assert_eq!(
            names.map(number_in_words),
            ["stiffness, joint 5", "centre of mass, x", "tip friction", "joint coulomb friction: coulomb, joint 2"]
        );
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
        let centre =
            Numbers { name: "centre_of_mass", joints: false, unit: "m", values: &[0.001, -0.002], intervals: &[] };
        assert_eq!(centre.line(), "centre of mass 1.00 mm, -2.00 mm");
    }
}
