//! import.toml as it is written: every line with its reason above it, and what is still to be filled in marked.

use super::{Clock, Factor, JointColumns, Mapping, PoseColumns};
use crate::log::{HEADER, Log};
use serde::Serialize;

/// Marks a line that a person has to fill in.
const OPEN: &str = "OPEN: ";
/// Rows that are shown of a table without names.
const FIRST_ROWS: usize = 3;

/// Why a line is as it is, or what it still needs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Note {
    /// Block and key: `measured.q_unit`.
    pub line: String,
    /// The reason, or the question.
    pub why: String,
    /// Whether the line is still to be filled in.
    pub open: bool,
    /// Lines that would say otherwise, or that may answer the question.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instead: Vec<String>,
}

/// The line of import.toml that takes these columns of a table as `key`.
pub(crate) fn instead(table: &str, key: &str, names: &[String]) -> String {
    format!("{key} = {} with table = {}", toml_value(names), toml_value(table))
}

/// A value as TOML writes it; empty where it has no form: numbers, strings and lists of them have one.
fn toml_value(value: impl Serialize) -> String {
    let mut toml = String::new();
    match value.serialize(toml::ser::ValueSerializer::new(&mut toml)) {
        Ok(_) => toml,
        Err(_) => String::new(),
    }
}

/// The file's text. `command` is typed to use it.
pub(crate) fn to_toml(mapping: &Mapping, notes: &[Note], log: &Log, command: &str) -> String {
    let mut text = Text { out: String::new(), notes };
    text.line(&format!("# What the columns of a log mean ({}). Change what is wrong, then:", log.format));
    text.line(&format!("#   {command}"));
    text.line("");
    text.notes("log");
    text.notes("robot");
    text.entry("", "kind", mapping.kind);
    text.entry("", "pieces", mapping.pieces);
    text.entry("", "joints", &mapping.joints);
    for (block, columns) in [("measured", &mapping.measured), ("desired", &mapping.desired)] {
        match columns {
            Some(columns) => text.joints(block, columns),
            None => text.notes(block),
        }
    }
    if let Some(columns) = &mapping.object {
        text.poses(columns);
    }
    text.line("");
    text.line("# The log has:");
    for table in &log.tables {
        let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        text.line(&format!("#   \"{}\": {}", table.name, names.join(", ")));
        // Columns without names are known by what they hold.
        if names.iter().all(|name| name.starts_with("column[")) {
            for row in 0..table.rows().min(FIRST_ROWS) {
                let cells: Vec<String> =
                    table.columns.iter().filter_map(|c| Some(format!("{}", c.values.get(row)?))).collect();
                text.line(&format!("#     row {}: {}", row + 1, cells.join(", ")));
            }
        }
    }
    text.out
}

struct Text<'a> {
    out: String,
    notes: &'a [Note],
}

impl Text<'_> {
    fn line(&mut self, line: &str) {
        // A name from a log stays within its comment.
        self.out += &shared_mem::printable::one_line(line);
        self.out.push('\n');
    }

    fn entry(&mut self, block: &str, key: &str, value: impl Serialize) {
        self.notes(&if block.is_empty() { key.to_owned() } else { format!("{block}.{key}") });
        let toml = toml_value(value);
        if !toml.is_empty() {
            self.out += &format!("{key} = {toml}\n");
        }
    }

    /// What there is to say about a line, above it.
    fn notes(&mut self, line: &str) {
        for note in self.notes.iter().filter(|note| note.line == line) {
            let mark = if note.open { OPEN } else { "" };
            self.line(&format!("# {mark}{}", note.why));
            note.instead.iter().for_each(|instead| self.line(&format!("#   instead: {instead}")));
        }
    }

    fn factor(&mut self, block: &str, key: &str, factor: &Factor) {
        if !factor.is_one() {
            self.entry(block, key, factor);
        }
    }

    fn clock(&mut self, block: &str, Clock { stamps, unit, rate, shift }: Clock<'_>) {
        match stamps {
            Some(stamps) => {
                self.entry(block, "stamps", stamps);
                if stamps != HEADER {
                    self.entry(block, "stamp_unit", unit);
                }
            }
            // Of one table with the block before, it has its rate.
            None if rate.is_none() && !self.notes.iter().any(|note| note.line == format!("{block}.rate")) => {}
            None => self.entry(block, "rate", rate.unwrap_or(0.0)),
        }
        self.entry(block, "shift", shift);
    }

    fn joints(&mut self, block: &str, columns: &JointColumns) {
        self.line("");
        self.line(&format!("[{block}]"));
        self.entry(block, "table", &columns.table);
        self.clock(block, columns.clock());
        self.entry(block, "q", &columns.q);
        // Of columns that are still asked for, nobody knows the units: they are proposed once those are there.
        let is_open = columns.q.is_empty();
        if !is_open {
            self.entry(block, "q_unit", columns.q_unit);
        }
        self.factor(block, "q_factor", &columns.q_factor);
        if !columns.sign.is_empty() {
            self.entry(block, "sign", &columns.sign);
        }
        self.entry(block, "dq", &columns.dq);
        if !is_open {
            self.entry(block, "dq_unit", columns.dq_unit);
        }
        self.factor(block, "dq_factor", &columns.dq_factor);
        self.entry(block, "tau", &columns.tau);
        self.factor(block, "tau_factor", &columns.tau_factor);
        self.entry(block, "torque", columns.torque);
        self.entry(block, "torques_act", columns.torques_act);
    }

    fn poses(&mut self, columns: &PoseColumns) {
        self.line("");
        self.line("[object]");
        self.entry("object", "table", &columns.table);
        self.clock("object", columns.clock());
        self.entry("object", "position", &columns.position);
        self.entry("object", "position_unit", columns.position_unit);
        self.entry("object", "orientation", &columns.orientation);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Column, Table};
    use crate::mapping::{AngleUnit, LengthUnit, Pieces, RateUnit, TimeUnit, Torque, TorquesAct};
    use shared_mem::cell::ClipKind;
    use std::path::Path;

    #[test]
    fn what_is_written_is_read_back_whatever_names_a_log_has() {
        let columns = JointColumns {
            table: "rows \"of\" a\nlog".into(),
            stamps: Some("t".into()),
            stamp_unit: TimeUnit::Millisecond,
            rate: None,
            shift: -0.0125,
            q: vec!["q[0]".into(), "Gelenk \"2\"".into()],
            q_unit: AngleUnit::Degree,
            q_factor: Factor::All(57.3),
            sign: vec![1.0, -1.0],
            dq: vec![],
            dq_unit: RateUnit::DegreePerSecond,
            dq_factor: Factor::default(),
            tau: vec!["tau[0]".into(), "tau[1]".into()],
            tau_factor: Factor::Each(vec![-1.0, 0.23]),
            torque: Torque::WithoutGravity,
            torques_act: TorquesAct::UntilStamp,
        };
        let mapping = Mapping {
            kind: ClipKind::ControlHitSlide,
            pieces: Pieces::AtRests,
            joints: vec!["a".into(), "b".into()],
            measured: Some(columns.clone()),
            desired: Some(JointColumns { stamps: None, rate: Some(250.0), stamp_unit: TimeUnit::Second, ..columns }),
            object: Some(PoseColumns {
                table: "/object".into(),
                stamps: Some("header".into()),
                stamp_unit: TimeUnit::Second,
                rate: None,
                shift: 0.0,
                position: ["x".into(), "y".into(), "z".into()],
                position_unit: LengthUnit::Millimetre,
                orientation: ["w".into(), "i".into(), "j".into(), "k".into()],
            }),
        };
        let note = Note {
            line: "measured.q_unit".into(),
            why: "they exceed\nany angle".into(),
            open: false,
            instead: vec!["q = []\n[x]".into()],
        };
        let open =
            Note { line: "desired.rate".into(), why: "how many rows a second?".into(), open: true, instead: vec![] };
        let table = Table { name: "rows\n[measured]".into(), columns: vec![Column::default()], ..Table::default() };
        let log = Log { tables: vec![table], ..Log::default() };
        let text = to_toml(&mapping, &[note, open], &log, "calibration import a.csv --out s --mapping import.toml");
        let read: Mapping = shared_mem::toml_file::parse(&text, Path::new("import.toml")).expect("own text");
        assert_eq!(read, mapping, "{text}");
        assert!(text.contains("# OPEN: how many rows a second?\nrate = 250.0"), "{text}");
    }

    #[test]
    fn a_misspelt_key_is_refused_with_its_line_and_the_nearest_name() {
        let text = "kind = \"excitation\"\n[measured]\ntable = \"rows\"\nq = [\"q\"]\nq_unitt = \"deg\"\n";
        let error = shared_mem::toml_file::parse::<Mapping>(text, Path::new("import.toml")).expect_err("a wrong key");
        assert!(error.to_string().contains("import.toml:") && error.to_string().contains("`q_unit`"), "{error}");
    }
}
