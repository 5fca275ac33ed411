//! What every format is read into: tables of numbers with named columns and stamps. No meaning yet.

use shared_mem::origin::Origins;
use std::path::PathBuf;

/// Name of the stamps that the format itself gives.
pub(crate) const HEADER: &str = "header";

/// What was recorded at once: a bag, a file, one episode of a data set.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Log {
    /// File or folder it was read from.
    pub(crate) file: PathBuf,
    /// Name of the clip that is made of it, without extension.
    pub(crate) name: String,
    /// Name of the format.
    pub(crate) format: &'static str,
    /// Tables: topics of a bag, files of a folder, the rows of a file.
    pub(crate) tables: Vec<Table>,
    /// What the format itself says about its numbers.
    pub(crate) facts: Facts,
    /// Where it says that it comes from; nothing in logs of other programs.
    pub(crate) origins: Origins,
    /// What is there and is not imported.
    pub(crate) left_out: Vec<LeftOut>,
    /// What was odd in it, one sentence each.
    pub(crate) warnings: Vec<String>,
}

/// Rows of numbers with one clock.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Table {
    /// Topic, file of a folder, or `rows`.
    pub(crate) name: String,
    /// Stamps that the format itself gives [ns]; `None` where a column, or a rate, has to.
    pub(crate) stamps_ns: Option<Vec<u64>>,
    /// Columns, all of one length.
    pub(crate) columns: Vec<Column>,
}

/// Numbers under a name: `tau_J[3]`, `position[fr3_joint4]`, `time`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Column {
    pub(crate) name: String,
    /// One number a row; NaN where a row has none.
    pub(crate) values: Vec<f64>,
}

/// What a format says about its numbers, so that nothing needs to be guessed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Facts {
    /// Unit of a column of stamps [s], with the reason.
    pub(crate) stamp_unit: Option<(f64, &'static str)>,
    /// Rows a second, where rows have no stamps.
    pub(crate) rate: Option<f64>,
    /// Whether torques hold gravity, with the reason.
    pub(crate) torque: Option<(bool, &'static str)>,
    /// Whether torques acted until the stamp of their row, and not from there on.
    pub(crate) torques_end_at_rows: bool,
    /// Whether these are states of a Franka robot.
    pub(crate) franka: bool,
    /// What the format says the robot is.
    pub(crate) robot: Option<String>,
    /// The robot's URDF, where the log holds it.
    pub(crate) description: Option<String>,
    /// Which two columns are one stamp, and why, where stamps were put together.
    pub(crate) two_columns: Option<String>,
    /// Which runs the file holds, where it is one of several.
    pub(crate) runs: Option<String>,
}

/// Something that is there and is not imported.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// Topic, file or column.
    pub what: String,
    pub why: &'static str,
    /// Messages, files or rows.
    pub count: u64,
}

impl Log {
    /// The table of that name.
    pub(crate) fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.name == name)
    }

    /// The same with the names of tables and columns alone.
    pub(crate) fn without_numbers(&self) -> Self {
        let bare = |table: &Table| Table {
            name: table.name.clone(),
            stamps_ns: table.stamps_ns.as_ref().map(|_| Vec::new()),
            columns: table.columns.iter().map(|c| Column { name: c.name.clone(), values: Vec::new() }).collect(),
        };
        Self {
            file: self.file.clone(),
            name: self.name.clone(),
            format: self.format,
            tables: self.tables.iter().map(bare).collect(),
            facts: self.facts.clone(),
            ..Self::default()
        }
    }

    /// Whether there is nothing that could be imported.
    pub(crate) fn is_empty(&self) -> bool {
        self.tables.iter().all(|table| table.rows() == 0)
    }
}

impl Table {
    /// Rows.
    pub(crate) fn rows(&self) -> usize {
        self.stamps_ns.as_ref().map_or_else(|| self.columns.first().map_or(0, |c| c.values.len()), Vec::len)
    }

    /// The column of that name.
    pub(crate) fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }
}
