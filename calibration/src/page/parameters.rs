//! Parameters with their intervals in words and as a picture: one number, or one a joint or axis.

use super::figure::forest::{Group, Row};
use super::quantity::Unit;
use super::words;
use serde::ser::{Serialize, SerializeStruct, Serializer};
use std::collections::BTreeMap;
use twin::effects::{Shape, find};

/// A parameter of one or several numbers, in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    pub values: Vec<f64>,
    /// A 90 % interval each.
    pub ci90: Vec<[f64; 2]>,
    /// SI unit; `1` without.
    pub unit: String,
}

impl Size {
    /// Whether the `k`-th number was fitted; else it was held at its default, and its interval has no width.
    pub fn is_fitted(&self, k: usize) -> bool {
        self.ci90.get(k).is_none_or(|[low, high]| high > low)
    }
}

impl Serialize for Size {
    /// `{"value", "ci90", "unit"}`: a single number stands by itself, several as lists.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Size", 3)?;
        if let ([value], [interval]) = (&self.values[..], &self.ci90[..]) {
            out.serialize_field("value", value)?;
            out.serialize_field("ci90", interval)?;
        } else {
            out.serialize_field("value", &self.values)?;
            out.serialize_field("ci90", &self.ci90)?;
        }
        out.serialize_field("unit", &self.unit)?;
        out.end()
    }
}

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

/// Most numbers that a line names one by one.
const MOST: usize = 3;

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
        if self.values.len() <= MOST {
            let numbers: Vec<String> = self.pairs().map(|(value, interval)| number(&unit, value, interval)).collect();
            return format!("{name} {}", numbers.join(", "));
        }
        let [lo, hi] = super::scale::span(self.values.iter().copied());
        let many = format!("{} {}", self.values.len(), if self.joints { "joints" } else { "numbers" });
        format!("{name} {} to {} over {many}", super::quantity::short(unit.scaled(lo)), unit.with_unit(hi))
    }

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

    fn pairs(&self) -> impl Iterator<Item = (f64, [f64; 2])> {
        let intervals = self.intervals.iter().copied().chain(std::iter::repeat([f64::NAN; 2]));
        self.values.iter().copied().zip(intervals)
    }

    fn shown(&self) -> Unit {
        let [lo, hi] = super::scale::span(self.values.iter().copied());
        Unit::suited(self.unit, lo.abs().max(hi.abs()))
    }
}

/// An effect with what was fitted of it: `command delay (delay 11.9 ms)`; what was held at its default is left out.
pub fn effect_in_words(effect: &str, parameters: &BTreeMap<String, Size>) -> String {
    let fitted = parameters.iter().filter(|(_, size)| (0..size.values.len()).any(|k| size.is_fitted(k)));
    let sizes: Vec<String> = fitted.map(|(name, size)| numbers(effect, name, size).brief()).collect();
    let name = words(effect);
    if sizes.is_empty() { name } else { format!("{name} ({})", sizes.join("; ")) }
}

/// A parameter of an effect.
pub(crate) fn numbers<'a>(effect: &str, name: &'a str, size: &'a Size) -> Numbers<'a> {
    let joints = of_joints(&format!("{effect}.{name}"));
    Numbers { name, joints, unit: &size.unit, values: &size.values, intervals: &size.ci90 }
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
    fn an_effect_is_named_with_what_was_fitted_of_it_and_not_with_its_defaults() {
        let size = |values: Vec<f64>, ci90| Size { values, ci90, unit: "N m".into() };
        let coulomb = size(vec![0.3, 0.4], vec![[0.2, 0.4], [0.3, 0.5]]);
        let creep = size(vec![0.002, 0.002], vec![[0.002; 2]; 2]);
        let parameters = BTreeMap::from([("coulomb".to_owned(), coulomb), ("creep".to_owned(), creep)]);
        let words = effect_in_words("joint_coulomb_friction", &parameters);
        assert_eq!(words, "joint coulomb friction (coulomb 0.300 N m, 0.400 N m)");
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
