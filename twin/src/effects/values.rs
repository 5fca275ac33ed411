//! From an `[[effect]]` block of theta.toml to numbers that an effect can use: every mistake is refused in one line.

use super::parameter::{Parameter, Role, Shape};
use crate::arm::{Joints, MAX_JOINTS};
use shared_mem::msg::joints_from;
use shared_mem::theta::EffectTheta;

/// An `[[effect]]` block cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No such effect.
    #[error("no effect is called `{name}`; did you mean `{nearest}`?")]
    Name {
        /// The name given.
        name: String,
        /// The most similar one.
        nearest: &'static str,
    },
    /// The same effect in two blocks.
    #[error("effect `{0}` is given twice; keep one of its [[effect]] blocks")]
    Twice(String),
    /// No such parameter.
    #[error("effect `{effect}` has no parameter `{given}`; it takes {known}")]
    Parameter {
        effect: &'static str,
        /// The key given.
        given: String,
        known: String,
    },
    /// A parameter is not given.
    #[error("effect `{effect}` lacks `{parameter}` [{unit}]; add `{parameter} = ` and {wanted}")]
    Missing {
        effect: &'static str,
        parameter: &'static str,
        unit: &'static str,
        /// What to write.
        wanted: String,
    },
    /// A parameter is something else than what is wanted.
    #[error("`{parameter}` of effect `{effect}` does not fit; give {wanted} [{unit}]")]
    Form {
        effect: &'static str,
        parameter: &'static str,
        unit: &'static str,
        /// What to write.
        wanted: String,
    },
    /// A value without meaning.
    #[error("`{parameter}` of effect `{effect}` cannot be {value}{}; give {wanted}", behind(unit))]
    Value {
        effect: &'static str,
        parameter: &'static str,
        /// The number given.
        value: f64,
        unit: &'static str,
        /// What would do.
        wanted: String,
    },
}

/// A unit as it stands behind a number; nothing for a pure one.
fn behind(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

/// Checked parameters of one effect.
#[derive(Debug, Clone)]
pub(super) struct Values {
    parameters: &'static [Parameter],
    numbers: Vec<Vec<f64>>,
}

impl Values {
    /// Checks a block against the parameters of the `effect` that it names, for an arm of `dof` joints.
    pub(super) fn read(
        effect: &'static str,
        parameters: &'static [Parameter],
        block: &EffectTheta,
        dof: usize,
    ) -> Result<Self, EffectError> {
        if let Some(given) = block.parameters.keys().find(|key| parameters.iter().all(|p| p.name != *key)) {
            let known = parameters.iter().map(|p| format!("`{}`", p.name)).collect::<Vec<_>>().join(", ");
            return Err(EffectError::Parameter { effect, given: given.clone(), known });
        }
        let numbers = parameters
            .iter()
            .map(|p| match block.parameters.get(p.name) {
                Some(value) => numbers(effect, p, value, dof),
                None => p.absent(effect, dof),
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { parameters, numbers })
    }

    /// Whether the effect changes nothing.
    pub(super) fn are_neutral(&self) -> bool {
        self.parameters.iter().zip(&self.numbers).all(|(p, numbers)| match p.role {
            Role::Size { neutral } => numbers.iter().all(|n| *n == neutral),
            Role::Form { .. } => true,
        })
    }

    /// A single number.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.of(name)[0]
    }

    /// One number for each joint.
    pub(super) fn joints(&self, name: &str) -> Joints {
        match self.of(name) {
            [all] => [*all; MAX_JOINTS],
            each => joints_from(each),
        }
    }

    pub(super) fn vector<const N: usize>(&self, name: &str) -> [f64; N] {
        std::array::from_fn(|i| self.of(name)[i])
    }

    fn of(&self, name: &str) -> &[f64] {
        let at = self.parameters.iter().position(|p| p.name == name);
        &self.numbers[at.expect("an effect asks for its own parameters")]
    }
}

impl Parameter {
    fn absent(&self, effect: &'static str, dof: usize) -> Result<Vec<f64>, EffectError> {
        let count = if let Shape::Vector(n) = self.shape { n } else { 1 };
        match self.role {
            Role::Form { default } => Ok(vec![default; count]),
            Role::Size { .. } => {
                let (parameter, unit, wanted) = (self.name, self.unit, self.wanted(dof));
                Err(EffectError::Missing { effect, parameter, unit, wanted })
            }
        }
    }

    fn wanted(&self, dof: usize) -> String {
        match self.shape {
            Shape::Number => "a number".into(),
            Shape::PerJoint => format!("a number, or {dof} in an array, one for each joint"),
            Shape::Vector(n) => format!("an array of {n} numbers"),
        }
    }

    fn wanted_value(&self) -> String {
        match self.possible {
            [lo, hi] if hi >= f64::MAX && lo <= f64::MIN => "a finite number".into(),
            [lo, hi] if hi >= f64::MAX => format!("{lo} or more"),
            [lo, hi] => format!("{lo} to {hi}"),
        }
    }
}

fn numbers(effect: &'static str, p: &Parameter, value: &toml::Value, dof: usize) -> Result<Vec<f64>, EffectError> {
    let form = || EffectError::Form { effect, parameter: p.name, unit: p.unit, wanted: p.wanted(dof) };
    let given: Option<Vec<f64>> = match (value, p.shape) {
        (toml::Value::Array(_), Shape::Number) => None,
        (toml::Value::Array(all), _) => all.iter().map(number).collect(),
        (_, Shape::Vector(_)) => None,
        (single, _) => number(single).map(|n| vec![n]),
    };
    let given = given.ok_or_else(form)?;
    let fits = match p.shape {
        Shape::Number => given.len() == 1,
        Shape::PerJoint => given.len() == dof || value.as_array().is_none(),
        Shape::Vector(n) => given.len() == n,
    };
    if !fits {
        return Err(form());
    }
    // The resting value may lie outside: an infinite stiffness is no spring.
    let [lo, hi] = p.possible;
    let allowed = |n: &&f64| (lo..=hi).contains(*n) || **n == p.resting_value();
    match given.iter().find(|n| !allowed(n)) {
        Some(value) => {
            let (parameter, unit, wanted) = (p.name, p.unit, p.wanted_value());
            Err(EffectError::Value { effect, parameter, value: *value, unit, wanted })
        }
        None => Ok(given),
    }
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
}
