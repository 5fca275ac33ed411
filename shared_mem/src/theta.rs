//! `theta.toml`: what was identified about a cell. Written by identification and diagnosis, read by everything that
//! simulates. What is absent keeps the value of cell.toml.

use crate::toml_file::{self, TomlFileError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The identified parameters.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Theta {
    /// The arm's controller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmTheta>,
    /// The object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<ObjectTheta>,
    /// Effects the nominal cell lacks, by the names of the effect registry.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectTheta>,
}

/// Identified gains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an [arm] block")]
pub struct ArmTheta {
    /// Stiffness of each joint [N m/rad].
    pub stiffness: Vec<f64>,
    /// Damping of each joint [N m s/rad].
    pub damping: Vec<f64>,
}

/// Identified physics of the object.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an [object] block")]
pub struct ObjectTheta {
    /// Coulomb friction between object and table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Mass [kg].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Centre of mass from the geometric centre, object frame [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_of_mass: Option<[f64; 3]>,
    /// Coulomb friction between tool and object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_friction: Option<f64>,
}

/// One effect with its parameters, by the names of the effect registry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectTheta {
    /// Name of the effect.
    pub name: String,
    /// Its parameters: numbers or arrays of numbers, checked by the effect itself.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, toml::Value>,
}

impl Theta {
    /// Reads a theta.toml.
    ///
    /// # Errors
    /// [`TomlFileError`] when it cannot be read or a key is not known.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        toml_file::read(path)
    }

    /// The file's text.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("numbers, strings and arrays have a TOML form")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let theta = Theta {
            arm: Some(ArmTheta { stiffness: vec![600.0; 7], damping: vec![50.0; 7] }),
            object: Some(ObjectTheta { friction: Some(0.28), ..ObjectTheta::default() }),
            effects: vec![EffectTheta {
                name: "command_delay".into(),
                parameters: [("delay".to_owned(), toml::Value::Float(0.012))].into(),
            }],
        };
        let back: Theta = toml_file::parse(&theta.to_toml(), Path::new("theta.toml")).expect("own text");
        assert_eq!(back, theta);
    }
}
