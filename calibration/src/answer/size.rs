//! A parameter of an effect with its interval, in SI units.

use crate::words::parameters::{Numbers, of_joints};
use crate::words::words;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use twin::effects::{Role, find};

/// One number, or one a joint or axis. As JSON, `{"value", "ci90", "unit"}`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    #[serde(rename = "value", serialize_with = "one_or_list")]
    pub values: Vec<f64>,
    /// A 90 % interval each.
    #[serde(serialize_with = "one_or_list")]
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

/// As JSON, a single value stands by itself, and several are a list.
///
/// # Errors
/// As of the value itself.
pub(crate) fn one_or_list<T: Serialize, S: Serializer>(values: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    match values {
        [one] => one.serialize(serializer),
        several => several.serialize(serializer),
    }
}

/// An effect with what was fitted of it: `command delay (delay 11.9 ms)`, how strong it is before what form it has. What was held at its
/// default is left out, and so is a form that may be the default as well.
pub fn effect_in_words(effect: &str, parameters: &BTreeMap<String, Size>) -> String {
    let known = |name: &str| find(effect)?.parameters.iter().find(|parameter| parameter.name == name);
    let default_of_form = |name: &str| {
        let parameter = known(name)?;
        matches!(parameter.role, Role::Form { .. }).then(|| parameter.resting_value())
    };
    let says_something = |(name, size): &(&String, &Size)| {
        let default = default_of_form(name);
        let differs = |k: usize| default.is_none_or(|default| !(size.ci90[k][0]..=size.ci90[k][1]).contains(&default));
        (0..size.values.len()).any(|k| size.is_fitted(k) && differs(k))
    };
    let mut said: Vec<(&String, &Size)> = parameters.iter().filter(says_something).collect();
    said.sort_by_key(|(name, _)| default_of_form(name).is_some());
    let sizes: Vec<String> = said.into_iter().map(|(name, size)| numbers(effect, name, size).brief()).collect();
    let name = words(effect);
    if sizes.is_empty() { name } else { format!("{name} ({})", sizes.join("; ")) }
}

/// A parameter of an effect.
pub(crate) fn numbers<'a>(effect: &str, name: &'a str, size: &'a Size) -> Numbers<'a> {
    let joints = of_joints(&format!("{effect}.{name}"));
    Numbers { name, joints, unit: &size.unit, values: &size.values, intervals: &size.ci90 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_stands_by_itself_and_several_as_lists() {
        let text = |size: &Size| serde_json::to_string(size).expect("JSON");
        let delay = Size { values: vec![0.012], ci90: vec![[0.011, 0.013]], unit: "s".into() };
        assert_eq!(text(&delay), r#"{"value":0.012,"ci90":[0.011,0.013],"unit":"s"}"#);
        let offset = Size { values: vec![1.0, 2.0], ci90: vec![[0.0, 2.0], [1.0, 3.0]], unit: "m".into() };
        assert_eq!(text(&offset), r#"{"value":[1.0,2.0],"ci90":[[0.0,2.0],[1.0,3.0]],"unit":"m"}"#);
    }

    #[test]
    fn an_effect_is_named_with_what_was_fitted_of_it_and_not_with_its_defaults() {
        let size = |values: Vec<f64>, ci90| Size { values, ci90, unit: "N m".into() };
        let coulomb = size(vec![0.3, 0.4], vec![[0.2, 0.4], [0.3, 0.5]]);
        let creep = size(vec![0.002, 0.002], vec![[0.002; 2]; 2]);
        let parameters = BTreeMap::from([("coulomb".to_owned(), coulomb), ("creep".to_owned(), creep)]);
        let words = effect_in_words("joint_coulomb_friction", &parameters);
        assert_eq!(words, "joint coulomb friction (coulomb 0.300 N m, 0.400 N m)");
        let payload = |centre: f64| {
            let of = |unit: &str, values: Vec<f64>, half: f64| Size {
                ci90: values.iter().map(|value| [value - half, value + half]).collect(),
                values,
                unit: unit.into(),
            };
            let all = [("centre", of("m", vec![centre, 0.0, 0.0], 1e-3)), ("mass", of("kg", vec![0.341], 1e-3))];
            effect_in_words("payload", &all.map(|(name, size)| (name.to_owned(), size)).into())
        };
        assert_eq!(payload(1e-6), "payload (mass 0.341 kg)", "a centre that may be the flange");
        assert!(payload(0.05).starts_with("payload (mass 0.341 kg; centre 50.0 mm"), "{}", payload(0.05));
    }
}
