//! `import.toml`: which columns of a log are which quantity, in which unit and by which clock. Proposed from the log, written
//! with the reasons, and final once it is given.

mod factor;
mod text;
mod units;

pub use factor::Factor;
pub use text::Note;
pub(crate) use text::{instead, to_toml};
pub use units::{AngleUnit, LengthUnit, RateUnit, TimeUnit, Torque, TorquesAct};

use serde::{Deserialize, Serialize};
use shared_mem::cell::ClipKind;
use shared_mem::toml_file::{self, TomlFileError};
use std::path::Path;

/// How a log becomes clips.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pieces {
    #[default]
    Whole,
    /// A clip of each motion, cut where the commands rest, or the joints where there are no commands.
    AtRests,
    /// Clips of equal length.
    Equal,
}

/// What the columns of a log are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// What was done in the clips.
    pub kind: ClipKind,
    /// How the log becomes clips.
    #[serde(default)]
    pub pieces: Pieces,
    /// Joint names, in the order of the columns below. Empty where no arm was recorded.
    #[serde(default)]
    pub joints: Vec<String>,
    /// What the arm did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<JointColumns>,
    /// What the arm was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub desired: Option<JointColumns>,
    /// Where the object was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<PoseColumns>,
}

/// A block of columns of one table: the table and its clock, which all blocks have, and what is the block's own. Flattened
/// structures would say neither the line nor the nearest name of a key that is not known.
macro_rules! block {
    ($(#[$of_block:meta])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$of_block])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, expecting = "a block of columns")]
        pub struct $name {
            /// Topic, file of a folder, or `rows`.
            pub table: String,
            /// Column of stamps, or `header` for those that the format itself gives.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub stamps: Option<String>,
            /// Unit of that column.
            #[serde(default)]
            pub stamp_unit: TimeUnit,
            /// Rows a second where there are no stamps.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub rate: Option<f64>,
            /// What is added to the stamps [s].
            #[serde(default)]
            pub shift: f64,
            $($own)*
        }

        impl $name {
            /// When its rows are.
            pub(crate) fn clock(&self) -> Clock<'_> {
                let Self { stamps, stamp_unit: unit, rate, shift, .. } = self;
                Clock { stamps: stamps.as_deref(), unit: *unit, rate: *rate, shift: *shift }
            }
        }
    };
}

/// When the rows of a block are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock<'a> {
    /// Column of stamps, or `header`.
    pub(crate) stamps: Option<&'a str>,
    /// Unit of that column.
    pub(crate) unit: TimeUnit,
    /// Rows a second where there are no stamps.
    pub(crate) rate: Option<f64>,
    /// What is added to the stamps [s].
    pub(crate) shift: f64,
}

block! {
    /// Columns of joints.
    pub struct JointColumns {
        /// Columns of the positions, one a joint. Empty: not known yet.
        pub q: Vec<String>,
        /// Their unit; where no line says it, it is proposed.
        #[serde(default = "AngleUnit::not_known")]
        pub q_unit: AngleUnit,
        /// What the positions are multiplied with, beside their unit.
        #[serde(default, skip_serializing_if = "Factor::is_one")]
        pub q_factor: Factor,
        /// 1 or -1 a joint, for positions, velocities and torques alike; empty: all 1.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub sign: Vec<f64>,
        /// Columns of the velocities; empty: none.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub dq: Vec<String>,
        #[serde(default)]
        pub dq_unit: RateUnit,
        /// What the velocities are multiplied with, beside their unit.
        #[serde(default, skip_serializing_if = "Factor::is_one")]
        pub dq_factor: Factor,
        /// Columns of the torques [N m]; empty: none.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub tau: Vec<String>,
        /// What the torques are multiplied with: the constant of a motor whose current was logged, -1 for a joint that counts them
        /// the other way round.
        #[serde(default, skip_serializing_if = "Factor::is_one")]
        pub tau_factor: Factor,
        /// Which torque it is.
        #[serde(default)]
        pub torque: Torque,
        /// In which control period it acted.
        #[serde(default)]
        pub torques_act: TorquesAct,
    }
}

block! {
    /// Columns of the object's pose in the base frame.
    pub struct PoseColumns {
        /// Columns of x, y, z.
        pub position: [String; 3],
        #[serde(default)]
        pub position_unit: LengthUnit,
        /// Columns of the quaternion's w, x, y, z.
        pub orientation: [String; 4],
    }
}

impl Mapping {
    /// Reads an import.toml.
    ///
    /// # Errors
    /// [`TomlFileError`] with file, line, and the nearest known name.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        toml_file::read(path)
    }

    /// The same with what one block says for the other: a rate for both where they are of one table; and with names for joints
    /// that have none.
    pub(crate) fn completed(mut self) -> Self {
        if let (Some(measured), Some(desired)) = (&self.measured, &mut self.desired)
            && measured.table == desired.table
            && desired.stamps.is_none()
            && desired.rate.is_none()
        {
            desired.rate = measured.rate;
        }
        if let (Some(measured), Some(desired)) = (&self.measured, &mut self.desired)
            && desired.q_unit == AngleUnit::NotKnown
        {
            desired.q_unit = measured.q_unit;
        }
        if self.joints.is_empty() {
            let count = self.measured.as_ref().map_or(0, |measured| measured.q.len());
            self.joints = (1..=count).map(|i| format!("joint{i}")).collect();
        }
        self
    }

    /// The first line that is still to be filled in: its key.
    pub fn open_line(&self) -> Option<&'static str> {
        let (measured, desired) = (self.measured.as_ref(), self.desired.as_ref());
        let lacks_unit = |c: &JointColumns| c.q_unit == AngleUnit::NotKnown;
        let lacks_clock = |c: &JointColumns| c.stamps.is_none() && c.rate.is_none_or(|rate| rate <= 0.0);
        if measured.is_some_and(|m| m.q.is_empty()) {
            Some("[measured] q")
        } else if desired.is_some_and(|d| d.q.is_empty()) {
            Some("[desired] q")
        } else if measured.is_some_and(lacks_clock) {
            Some("[measured] rate")
        } else if desired.is_some_and(lacks_clock) {
            Some("[desired] rate")
        } else if measured.is_some_and(lacks_unit) {
            Some("[measured] q_unit")
        } else if desired.is_some_and(lacks_unit) {
            Some("[desired] q_unit")
        } else if measured.is_none() && self.object.is_none() {
            Some("[measured] q")
        } else {
            None
        }
    }
}
