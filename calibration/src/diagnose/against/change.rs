//! What a number was in one session and is in another, in words.

use super::{Smallest, Values};
use crate::words::parameters::{of_joints, part};
use crate::words::quantity::{Unit, short, span};
use crate::words::words;

/// Most numbers that a line names one by one, and most of the smallest changes that a sentence does.
pub(super) const MAX_LISTED: usize = 3;

/// `mass 0 to 0.520 kg (change 0.52 [0.50, 0.54] kg)`; of many numbers how far they reach.
pub fn between(name: &str, values: &Values) -> String {
    let unit = unit_of(values);
    let name = words(name);
    if values.a.len() <= MAX_LISTED {
        let one = |k: usize| {
            format!(
                "{} to {} (change {})",
                short(unit.scaled(values.a[k])),
                unit.with_unit(values.b[k]),
                unit.interval(values.change[k], values.ci95[k])
            )
        };
        return format!("{name} {}", (0..values.a.len()).map(one).collect::<Vec<_>>().join(", "));
    }
    let reach = |numbers: &[f64]| {
        let [low, high] = span(numbers.iter().copied());
        format!("{} .. {}", short(unit.scaled(low)), unit.with_unit(high))
    };
    let count = values.a.len();
    format!(
        "{name} from {} to {} over {count} numbers (change {})",
        reach(&values.a),
        reach(&values.b),
        reach(&values.change)
    )
}

/// One line for every number: which of them, its value in A and in B, the change with its interval.
pub fn rows(subject: &str, name: &str, values: &Values) -> Vec<[String; 4]> {
    let unit = unit_of(values);
    let joints = of_joints(name) || of_joints(&format!("{subject}.{name}"));
    let one = |k: usize| {
        let part = part(joints, values.a.len(), k);
        let name = words(name);
        let name = if part.is_empty() { name } else { format!("{name}, {part}") };
        let change = unit.interval(values.change[k], values.ci95[k]);
        [name, unit.with_unit(values.a[k]), unit.with_unit(values.b[k]), change]
    };
    (0..values.a.len()).map(one).collect()
}

/// `coulomb 0.021 N m`, `coulomb 0.021 to 0.11 N m, joint by joint`, or `coulomb at no size`.
pub fn smallest_in_words(name: &str, subject: &str, smallest: &Smallest) -> String {
    let [low, high] = span(smallest.values.iter().flatten().copied());
    let unit = Unit::suited(&smallest.unit, high);
    let name = if name == subject { String::new() } else { format!("{} ", words(name)) };
    let (all, blind) = (smallest.values.len(), smallest.values.iter().filter(|value| value.is_none()).count());
    if blind == all {
        return format!("{name}at no size");
    }
    if all < 2 {
        return format!("{name}{}", unit.with_unit(high));
    }
    let what = if of_joints(name.trim()) || of_joints(&format!("{subject}.{}", name.trim())) || of_joints(subject) {
        "joint by joint"
    } else {
        "each alone"
    };
    let not_all = if blind > 0 { format!(", at no size in {blind} of {all}") } else { String::new() };
    format!("{name}{} to {}, {what}{not_all}", short(unit.scaled(low)), unit.with_unit(high))
}

fn unit_of(values: &Values) -> Unit {
    let all = values.a.iter().chain(&values.b).chain(&values.change);
    Unit::suited(&values.unit, all.map(|value| value.abs()).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_told_with_what_it_was_and_many_by_how_far_they_reach() {
        let mass =
            Values { a: vec![0.0], b: vec![0.52], change: vec![0.52], ci95: vec![[0.5, 0.54]], unit: "kg".into() };
        assert_eq!(between("mass", &mass), "mass 0 to 0.520 kg (change 0.520 [0.500, 0.540] kg)");
        let gains = Values {
            a: vec![600.0; 4],
            b: vec![900.0, 1200.0, 1100.0, 1000.0],
            change: vec![300.0, 600.0, 500.0, 400.0],
            ci95: vec![[290.0, 310.0]; 4],
            unit: "N m/rad".into(),
        };
        let text = between("stiffness", &gains);
        assert!(
            text.contains("600 .. 600 N m/rad to 900 .. 1200 N m/rad over 4 numbers (change 300 .. 600 N m/rad)"),
            "{text}"
        );
        let rows = rows("stiffness", "stiffness", &gains);
        assert_eq!(
            rows[1].each_ref().map(String::as_str),
            ["stiffness, joint 2", "600 N m/rad", "1200 N m/rad", "600 [290, 310] N m/rad"]
        );
        let seen = |values: &[Option<f64>]| {
            let smallest = Smallest { values: values.to_vec(), unit: "N m".into() };
            smallest_in_words("coulomb", "joint_coulomb_friction", &smallest)
        };
        assert_eq!(seen(&[Some(0.02), Some(0.1)]), "coulomb 0.020 to 0.100 N m, joint by joint");
        let one_blind = seen(&[Some(0.02), None, Some(0.1)]);
        assert_eq!(one_blind, "coulomb 0.020 to 0.100 N m, joint by joint, at no size in 1 of 3");
        assert_eq!(seen(&[None, None]), "coulomb at no size");
    }
}
