//! `theta.toml`: what was identified about a cell. Written by identification and diagnosis, read by everything that
//! simulates. What is absent keeps the value of cell.toml.

use crate::cell::Cell;
use crate::input;
use crate::output::{self, OutputError};
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

impl EffectTheta {
    /// The numbers of a parameter, one or many; `None` where it is not given or is none.
    #[must_use]
    pub fn numbers(&self, parameter: &str) -> Option<Vec<f64>> {
        let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
        match self.parameters.get(parameter)? {
            toml::Value::Array(all) => all.iter().map(number).collect(),
            single => number(single).map(|number| vec![number]),
        }
    }
}

const IS_A_CELL: &str = "describes a cell, and parameters are asked for: give a file that `calibration identify arm SESSION --out theta.toml` has written";

impl Theta {
    /// Reads a theta.toml.
    ///
    /// # Errors
    /// [`TomlFileError`] when it cannot be read or a key is not known.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        toml_file::read(path).map_err(|error| match Cell::read(path) {
            Ok(_) => TomlFileError::Content { path: path.to_owned(), line: None, what: IS_A_CELL.to_owned() },
            Err(_) => error,
        })
    }

    /// The file's text.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("numbers, strings and arrays have a TOML form")
    }

    /// Writes the file, whole or not at all. Of one that is there, comments and whatever this says nothing about stay; its
    /// effects are replaced by these.
    ///
    /// # Errors
    /// [`OutputError`]; what was there before is unchanged.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let before = input::text(path, input::Kind::Configuration).ok().filter(|_| path.is_file());
        let text = before.and_then(|before| toml_file::updated(&before, &self.to_toml(), &["effect"]));
        output::write(path, text.unwrap_or_else(|| self.to_toml()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_that_is_given_for_parameters_is_said_to_be_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cell.toml");
        std::fs::write(&path, include_str!("../../config/fr3_cell.toml")).expect("room");
        let error = Theta::read(&path).expect_err("a cell").to_string();
        assert!(error.contains("describes a cell") && !error.contains('\n'), "{error}");
        std::fs::write(&path, "[arm]\nstifness = [1.0]\n").expect("room");
        assert!(Theta::read(&path).expect_err("a wrong key").to_string().contains("did you mean `stiffness`?"));
    }

    #[test]
    fn a_file_that_is_there_keeps_its_comments_and_what_was_not_found() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("theta.toml");
        let text = "# monday, new gripper\n[arm]\nstiffness = [1.0, 2.0] # soft\ndamping = [3.0, 4.0]\n\n# weighed twice\n\
            [object]\nmass = 0.31\n\n[[effect]]\nname = \"payload\"\nmass = 0.5 # the flange\n\n[[effect]]\nname = \"torque_delay\"\ndelay = 0.001\n";
        std::fs::write(&path, text).expect("room");
        let effect = |mass: f64| EffectTheta {
            name: "payload".into(),
            parameters: [("mass".to_owned(), toml::Value::Float(mass))].into(),
        };
        let found = Theta {
            arm: Some(ArmTheta { stiffness: vec![5.0, 6.0], damping: vec![7.0, 8.0] }),
            object: None,
            effects: vec![effect(0.7)],
        };
        found.write(&path).expect("room");
        let written = std::fs::read_to_string(&path).expect("a file");
        let read = Theta::read(&path).expect("a theta.toml");
        assert_eq!((read.arm, read.effects), (found.arm.clone(), found.effects.clone()));
        assert_eq!(read.object.and_then(|object| object.mass), Some(0.31));
        for comment in ["# monday, new gripper", "# soft", "# weighed twice", "# the flange"] {
            assert!(written.contains(comment), "{comment} is gone:\n{written}");
        }
        let none = Theta { effects: Vec::new(), ..found };
        none.write(&path).expect("room");
        assert_eq!(Theta::read(&path).expect("a theta.toml").effects, []);
        std::fs::write(&path, "no = [toml").expect("room");
        none.write(&path).expect("room");
        assert_eq!(Theta::read(&path).expect("a theta.toml"), none);
    }

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
