//! `cell.toml`: what the laboratory knows about its cell. One file a block; this file owns the whole, reading and checking.
//!
//! An absent block means "not known" or "not there"; unknown keys are refused with the nearest known name.

mod background;
mod built_in;
mod camera;
mod controller;
mod gripper;
mod moved;
mod object;
mod objects;
mod ranges;
mod robot;
mod schema;
mod simulation;
mod tolerance;
mod wrench;

pub use background::Background;
pub use camera::{Camera, CameraPose, Intrinsics};
pub use controller::{BetweenCommands, Controller, ControllerKind, TorqueSensing};
pub use gripper::{Gripper, GripperModel};
pub use object::{Object, PoseNoise, RootHold, Support};
pub use ranges::{Range, Ranges};
pub use robot::{Robot, Table, Tool, Topics};
pub use simulation::Simulation;
pub use tolerance::Tolerance;
pub use wrench::{WrenchNoise, WrenchSensor};

use crate::blocks;
use crate::input;
use crate::place;
use crate::toml_file::{self, TomlFileError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Acceleration of free fall [m/s²], against z of the base frame, as simulators and the vendor's model take it; between pole and
/// equator it differs by 0.3 %.
pub const GRAVITY: f64 = 9.81;

/// What the laboratory knows about its cell. Units are SI, quaternions `w, x, y, z`.
///
/// ```
/// use shared_mem::cell::Cell;
/// use std::path::Path;
///
/// let text = r#"
/// [robot]
/// model = "fr3"
///
/// [object]
/// shape = "box"
/// size = [0.08, 0.06, 0.10] # m
/// "#;
/// let cell = Cell::parse(text, Path::new("cell.toml"))?;
/// assert_eq!(cell.base_frame(), "fr3_link0");
/// assert_eq!(cell.dof_hint(), Some(7));
///
/// // An unknown key is refused with file, line and the nearest known name.
/// let error = Cell::parse("[robot]\nmodl = \"fr3\"\n", Path::new("cell.toml")).unwrap_err();
/// assert!(error.to_string().contains("model"), "{error}");
/// # Ok::<(), shared_mem::cell::CellError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// The arm; absent where an object moves alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<Robot>,
    /// How the arm is controlled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<Controller>,
    /// The tool at the flange.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<Tool>,
    /// The table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<Table>,
    /// Topic names of foreign bags.
    #[serde(default, skip_serializing_if = "Topics::is_default")]
    pub topics: Topics,
    /// The object on the table, or several with names.
    #[serde(default, rename = "object", with = "blocks", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "objects::Blocks")]
    pub objects: Vec<Object>,
    /// What stands around the robot, for pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<Background>,
    /// The camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// The gripper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gripper: Option<Gripper>,
    /// The force/torque sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrench: Option<WrenchSensor>,
    /// Which gaps are of no interest.
    #[serde(default, skip_serializing_if = "Tolerance::is_default")]
    pub tolerance: Tolerance,
    /// Where the simulated cell starts; the real one ignores it.
    #[serde(default, skip_serializing_if = "Simulation::is_default")]
    pub simulation: Simulation,
    /// Clips of the session that this file describes, one block each.
    #[serde(default, rename = "clip", skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<ClipEntry>,
    /// Folder of the file: relative paths in it start here.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Place among `objects` of the one that a command is about.
    #[serde(skip)]
    pub in_question: usize,
}

/// One clip of a session.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [[clip]] block")]
pub struct ClipEntry {
    /// File or folder, relative to cell.toml.
    pub file: PathBuf,
    /// What was done in it.
    pub kind: ClipKind,
}

/// What was done in a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClipKind {
    /// The arm moved freely.
    Excitation,
    /// The arm moved, hit the object, and the object slid to rest.
    ControlHitSlide,
    /// An object alone, no robot.
    FreeMotion,
}

/// A cell.toml cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CellError {
    /// Not readable, or a key is wrong.
    #[error(transparent)]
    File(#[from] TomlFileError),
    /// The keys are known, their values make no sense together.
    #[error("{}: {what}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// What is wrong and how to mend it.
        what: String,
    },
}

impl Cell {
    /// Reads and checks a cell.toml. `fr3` is the cell that ships with the project, unless there is a file of that name.
    ///
    /// # Errors
    /// [`CellError`] with file, key and remedy.
    pub fn read(path: &Path) -> Result<Self, CellError> {
        Self::parse(&Self::text(path)?, path)
    }

    /// The text of a cell.toml, or of the cell that is built in.
    ///
    /// # Errors
    /// [`CellError`] where it cannot be read.
    pub fn text(path: &Path) -> Result<String, CellError> {
        match built_in::text(path) {
            Some(text) => Ok(text.to_owned()),
            None => Ok(input::text(path, input::Kind::Configuration).map_err(TomlFileError::from)?),
        }
    }

    /// The same from text, as it rides along with a recording; `path` names it in errors, and relative paths in it
    /// start in its folder.
    ///
    /// # Errors
    /// As [`Cell::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, CellError> {
        if let Some(what) = blocks::both_forms::<Object>(text) {
            return Err(CellError::Value { path: path.to_owned(), what });
        }
        let read = toml_file::parse::<Self>(text, path)?;
        toml_file::refuse_longer_lists(text, &read, path)?;
        read.settle(path)
    }

    /// What is said of a text that is none of what was asked for: where it is a cell.toml, that; else `error`.
    ///
    /// ```
    /// # use shared_mem::{cell::Cell, toml_file};
    /// # use std::path::Path;
    /// let (text, path) = ("[table]\nheight = 0.02\n", Path::new("cell.toml"));
    /// let error = toml_file::parse::<Vec<f64>>(text, path).unwrap_err();
    /// let said = Cell::in_place_of("a list is asked for: give one", text, path, error).to_string();
    /// assert_eq!(said, "cell.toml: describes a cell, and a list is asked for: give one");
    /// ```
    pub fn in_place_of(asked: &str, text: &str, path: &Path, error: TomlFileError) -> TomlFileError {
        match Self::parse(text, path) {
            Ok(_) => TomlFileError::Content {
                path: path.to_owned(),
                line: None,
                what: format!("describes a cell, and {asked}"),
            },
            Err(_) => error,
        }
    }

    fn settle(mut self, path: &Path) -> Result<Self, CellError> {
        self.folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        self.check().map_err(|what| CellError::Value { path: path.to_owned(), what })?;
        Ok(self)
    }

    /// Name of the base frame in force: that of `[robot]`, else the built-in model's first link, else `base`. Recordings, bags and
    /// viewers name it alike.
    pub fn base_frame(&self) -> &str {
        let robot = self.robot.as_ref();
        let built_in = robot.and_then(|robot| robot.model.as_deref()).map(|_| "fr3_link0");
        robot.and_then(|robot| robot.base_frame.as_deref()).or(built_in).unwrap_or("base")
    }

    /// The same cell with paths that hold from any folder, the same however its file was spelt: what goes into another file.
    pub fn at_home_anywhere(&self) -> Self {
        let mut cell = self.clone();
        let anchor = |path: &mut PathBuf| *path = place::from_anywhere(&self.folder.join(&*path));
        cell.robot.iter_mut().filter_map(|robot| robot.urdf.as_mut()).for_each(anchor);
        cell.objects
            .iter_mut()
            .flat_map(|object| [&mut object.mesh, &mut object.splats, &mut object.urdf])
            .flatten()
            .for_each(anchor);
        cell.background.iter_mut().map(|background| &mut background.splats).for_each(anchor);
        cell
    }

    /// The file's text, every default spelled out where it is in force.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("numbers, strings, arrays and tables have a TOML form")
    }

    /// Number of joints, as far as this file alone tells (a URDF knows its own).
    pub fn dof_hint(&self) -> Option<usize> {
        let robot = self.robot.as_ref()?;
        if robot.model.is_some() {
            return Some(7);
        }
        if !robot.joints.is_empty() {
            return Some(robot.joints.len());
        }
        self.controller.as_ref().map(|c| c.stiffness.len()).filter(|n| *n > 0)
    }

    fn check(&self) -> Result<(), String> {
        if let Some(robot) = &self.robot {
            robot.check()?;
        }
        if let Some(controller) = &self.controller {
            controller.check(self.dof_hint())?;
        }
        if let Some(tool) = &self.tool {
            tool.check()?;
        }
        if let Some(table) = &self.table {
            table.check()?;
        }
        self.check_objects()?;
        if let Some(camera) = &self.camera {
            camera.check()?;
        }
        if let Some(gripper) = &self.gripper {
            gripper.check()?;
        }
        if let Some(wrench) = &self.wrench {
            wrench.check()?;
        }
        self.tolerance.check()?;
        self.simulation.check()
    }
}

/// `Ok` when every number is finite and inside `lo..=hi`, else the sentence to print.
fn within(key: &str, values: &[f64], lo: f64, hi: f64) -> Result<(), String> {
    match values.iter().find(|v| !(lo..=hi).contains(*v)) {
        None => Ok(()),
        Some(bad) => Err(format!("`{key}` holds {bad}; it must lie between {lo} and {hi} (SI units)")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Cell, String> {
        let cell: Cell = toml_file::parse(text, Path::new("cell.toml")).map_err(|e| e.to_string())?;
        cell.check()?;
        Ok(cell)
    }

    const LAB: &str = include_str!("../../../config/fr3_cell.toml");

    #[test]
    fn the_shipped_cell_is_valid_and_survives_a_round_trip() {
        let cell = parse(LAB).expect("the shipped file");
        assert_eq!(cell.robot.as_ref().and_then(|r| r.model.as_deref()), Some("fr3"));
        assert_eq!(parse(&cell.to_toml()).expect("own text"), cell);
    }

    #[test]
    fn a_misspelt_key_is_refused_with_the_nearest_name() {
        let error = parse("[table]\nhieght = 0.0\n").unwrap_err();
        assert!(error.contains("did you mean `height`"), "{error}");
        let error = parse("[controler]\n").unwrap_err();
        assert!(error.contains("did you mean `controller`"), "{error}");
    }

    #[test]
    fn what_is_no_block_is_refused_in_the_words_of_the_file() {
        let error = parse("robot = \"fr3\"\n").unwrap_err();
        assert!(error.contains("expected a [robot] block"), "{error}");
        let error = parse("[camera]\npose = 3.0\n").unwrap_err();
        assert!(error.contains("position [m]"), "{error}");
    }

    #[test]
    fn the_wrong_number_of_gains_is_refused() {
        let error = parse("[robot]\nmodel = \"fr3\"\n[controller]\nkind = \"joint_impedance\"\nstiffness = [600.0]\n")
            .unwrap_err();
        assert!(error.contains("7"), "{error}");
    }

    #[test]
    fn a_table_at_no_height_is_refused() {
        let error = parse("[table]\nheight = nan\n").unwrap_err();
        assert!(error.contains("table.height"), "{error}");
    }

    #[test]
    fn a_simulated_start_in_degrees_or_millimetres_is_refused() {
        for (wrong, told) in [
            ("q = [0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0]", "simulation.q`"),
            ("object_position = [550.0, 0.0]", "simulation.object_position"),
            ("object_yaw = 90.0", "simulation.object_yaw"),
            ("q_noise = -1e-6", "simulation.q_noise"),
        ] {
            let error = parse(&format!("[simulation]\n{wrong}\n")).unwrap_err();
            assert!(error.contains(told) && error.contains("SI units"), "{error}");
        }
    }

    #[test]
    fn gripper_and_force_sensor_are_known_by_their_model_and_their_place_on_the_bus() {
        let cell = parse("[gripper]\nmodel = \"robotiq_2f_140\"\n[wrench]\ncan_id = 0x30\n").expect("known keys");
        assert_eq!(cell.gripper.map(|gripper| (gripper.widest(), gripper.counts())), Some((0.14, [3, 230])));
        assert_eq!(cell.wrench.map(|wrench| (wrench.can_id, wrench.rate)), Some((0x30, 500.0)));
        assert_eq!(parse(&cell.to_toml()).expect("own text"), cell);
        for (wrong, told) in [
            ("[gripper]\nmodel = \"robotiq_2f_85\"\ncounts = [230, 3]\n", "gripper.counts"),
            ("[gripper]\nmodel = \"robotiq\"\n", "robotiq_2f_85"),
            ("[wrench]\ncan_id = 128\n", "wrench.can_id"),
            ("[wrench]\nnoise = { force = -1.0 }\n", "wrench.noise.force"),
        ] {
            let error = parse(wrong).unwrap_err();
            assert!(error.contains(told), "{error}");
        }
    }

    #[test]
    fn a_mass_of_nothing_is_refused() {
        let error = parse("[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.0]\n").unwrap_err();
        assert!(error.contains("object.size"), "{error}");
    }
}
