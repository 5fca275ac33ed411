//! `theta.toml`: what was identified about a cell. Written by identification and diagnosis, read by everything that
//! simulates. What is absent keeps the value of cell.toml.

use crate::blocks::{self, Named};
use crate::cell::Cell;
use crate::input;
use crate::output::{self, OutputError};
use crate::toml_file::{self, TomlFileError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The identified parameters.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "ThetaFile", into = "ThetaFile")]
pub struct Theta {
    /// The arm's controller.
    pub arm: Option<ArmTheta>,
    /// The object that a command is about: of a file the first, [`Self::about`] says another.
    pub object: Option<ObjectTheta>,
    /// Other objects, by their names.
    pub others: Vec<ObjectTheta>,
    /// Effects the nominal cell lacks, by the names of the effect registry.
    pub effects: Vec<EffectTheta>,
}

/// The same as it stands in the file: one `[object]` without a name, or `[[object]]` blocks with one each.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ThetaFile {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    arm: Option<ArmTheta>,
    #[serde(default, rename = "object", with = "blocks", skip_serializing_if = "Vec::is_empty")]
    objects: Vec<ObjectTheta>,
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectTheta>,
}

impl From<ThetaFile> for Theta {
    fn from(ThetaFile { arm, objects, effects }: ThetaFile) -> Self {
        let mut objects = objects.into_iter();
        Self { arm, object: objects.next(), others: objects.collect(), effects }
    }
}

impl From<Theta> for ThetaFile {
    fn from(Theta { arm, object, others, effects }: Theta) -> Self {
        Self { arm, objects: object.into_iter().chain(others).collect(), effects }
    }
}

impl Named for ObjectTheta {
    const KEY: &'static str = "object";

    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }
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
    /// Its name in cell.toml; needed where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
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
///
/// ```
/// use shared_mem::theta::EffectTheta;
///
/// let block: EffectTheta = toml::from_str("name = \"command_delay\"\ndelay = 0.004\n")?; // s
/// assert_eq!(block.numbers("delay"), Some(vec![0.004]));
/// assert_eq!(block.numbers("mass"), None);
/// # Ok::<(), toml::de::Error>(())
/// ```
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
    pub fn numbers(&self, parameter: &str) -> Option<Vec<f64>> {
        let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
        match self.parameters.get(parameter)? {
            toml::Value::Array(all) => all.iter().map(number).collect(),
            single => number(single).map(|number| vec![number]),
        }
    }
}

const ASKED: &str =
    "parameters are asked for: give a file that `calibration identify arm SESSION --out theta.toml` has written";

impl Theta {
    /// Reads a theta.toml.
    ///
    /// # Errors
    /// [`TomlFileError`] when it cannot be read or a key is not known.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        let text = input::text(path, input::Kind::Configuration)?;
        let content = |what: String| TomlFileError::Content { path: path.to_owned(), line: None, what };
        if let Some(what) = blocks::both_forms::<ObjectTheta>(&text) {
            return Err(content(what));
        }
        let read: ThetaFile =
            toml_file::parse(&text, path).map_err(|error| Cell::in_place_of(ASKED, &text, path, error))?;
        blocks::check_names(&read.objects).map_err(content)?;
        Ok(read.into())
    }

    /// With the object in question that `cell`'s is: the one of its name; where no name is given, on either side, the only one.
    pub fn about(self, cell: &Cell) -> Self {
        let Self { arm, object, others, effects } = self;
        let mut all: Vec<ObjectTheta> = object.into_iter().chain(others).collect();
        let wanted = cell.object_name();
        let fits = |object: &ObjectTheta| wanted.is_none() || object.name.is_none() || object.name() == wanted;
        let place = all.iter().position(|object| wanted.is_some() && object.name() == wanted);
        let place = place.or_else(|| all.iter().position(fits));
        let mut object = place.map(|place| all.remove(place));
        if let Some(object) = &mut object {
            object.name = wanted.map(str::to_owned);
        }
        Self { arm, object, others: all, effects }
    }

    /// The file's text.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
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
            effects: vec![effect(0.7)],
            ..Theta::default()
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
    fn objects_are_told_apart_by_name_and_one_that_is_not_asked_about_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("theta.toml");
        let block = |name: &str| format!("[[object]]\nname = \"{name}\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n");
        let mut cell = Cell::parse(&(block("cup") + &block("milk")), &path).expect("a cell");
        std::fs::write(&path, "# weighed\n[[object]]\nname = \"cup\"\nmass = 0.2\n").expect("room");
        cell.about("milk").expect("the milk");
        let mut theta = Theta::read(&path).expect("a theta.toml").about(&cell);
        assert_eq!((theta.object.as_ref(), theta.others.len()), (None, 1));
        theta.object = Some(ObjectTheta { mass: Some(0.5), ..ObjectTheta::default() });
        theta.about(&cell).write(&path).expect("room");
        let of =
            |cell: &Cell| Theta::read(&path).expect("a theta.toml").about(cell).object.and_then(|object| object.mass);
        let milk = of(&cell);
        cell.about("cup").expect("the cup");
        assert_eq!((of(&cell), milk), (Some(0.2), Some(0.5)));
        assert!(std::fs::read_to_string(&path).expect("a file").contains("# weighed"));
        // What was identified before objects had names is about the first.
        std::fs::write(&path, "[object]\nmass = 0.3\n").expect("room");
        assert_eq!(of(&cell), Some(0.3));
        for (text, told) in [
            ("[object]\nmass = 0.3\n[[object]]\nname = \"cup\"\n", "both [object] and [[object]]"),
            ("[[object]]\nmass = 0.3\n[[object]]\nname = \"cup\"\n", "number 1 has no `name`"),
        ] {
            std::fs::write(&path, text).expect("room");
            let error = Theta::read(&path).expect_err(told).to_string();
            assert!(error.contains(told) && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let theta = Theta {
            arm: Some(ArmTheta { stiffness: vec![600.0; 7], damping: vec![50.0; 7] }),
            object: Some(ObjectTheta { friction: Some(0.28), ..ObjectTheta::default() }),
            others: Vec::new(),
            effects: vec![EffectTheta {
                name: "command_delay".into(),
                parameters: [("delay".to_owned(), toml::Value::Float(0.012))].into(),
            }],
        };
        let back: Theta = toml_file::parse(&theta.to_toml(), Path::new("theta.toml")).expect("own text");
        assert_eq!(back, theta);
    }
}
