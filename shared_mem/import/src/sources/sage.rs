//! A motion as SAGE records it: a folder with `control.csv`, `state_motor.csv`, and where known `joint_list.txt` and
//! `event.csv`, between whose `MOTION_START` and `DISABLE` the motion lies.

use super::{stem, table};
use crate::error::ImportError;
use crate::log::{Facts, Log, Table};
use shared_mem::budget::Budget;
use shared_mem::input::{self, Kind};
use std::path::Path;

const CONTROL: &str = "control.csv";
const STATE: &str = "state_motor.csv";

pub(super) fn is_motion(folder: &Path) -> bool {
    folder.join(CONTROL).is_file() && folder.join(STATE).is_file()
}

pub(super) fn read(folder: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let list = folder.join("joint_list.txt");
    let joints: Vec<String> = if list.is_file() {
        let text = input::text(&list, Kind::Configuration)?;
        text.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
    } else {
        Vec::new()
    };
    let window = window(folder)?;
    let (mut tables, mut warnings) = (Vec::new(), Vec::new());
    for (file, kind) in [(CONTROL, "CONTROL"), (STATE, "STATE_MOTOR")] {
        let path = folder.join(file);
        let mut text = table::text(&path, budget)?;
        let stamps = text.columns.iter().find(|column| column.name == "timestamp").map(|column| column.values.clone());
        let Some(stamps) = stamps else {
            return Err(ImportError::log(&path, "has no column `timestamp`: it is no log of SAGE, or damaged"));
        };
        let of_kind = |row: usize| {
            let cell = text.words.iter().find(|(name, _)| name == "type").and_then(|(_, cells)| cells.get(row));
            cell.is_none_or(|cell| cell == kind)
        };
        let inside = |row: usize| stamps.get(row).is_some_and(|t| window[0] <= *t && *t <= window[1]);
        let kept: Vec<usize> = (0..stamps.len()).filter(|row| of_kind(*row) && inside(*row)).collect();
        for column in &mut text.columns {
            column.values = kept.iter().filter_map(|row| column.values.get(*row).copied()).collect();
            if let Some((base, number)) = column.name.strip_suffix(']').and_then(|name| name.split_once('['))
                && let Some(joint) = number.parse().ok().and_then(|i: usize| joints.get(i))
            {
                column.name = format!("{base}[{joint}]");
            }
        }
        warnings.extend(text.warnings.iter().map(|warning| format!("{file}: {warning}")));
        tables.push(Table { name: file.into(), stamps_ns: None, columns: text.columns });
    }
    Ok(Log {
        file: folder.to_owned(),
        name: stem(folder),
        format: "SAGE folder",
        tables,
        facts: Facts::default(),
        warnings,
        ..Log::default()
    })
}

/// From which stamp to which the motion lies, in the log's own unit.
fn window(folder: &Path) -> Result<[f64; 2], ImportError> {
    let (path, mut window) = (folder.join("event.csv"), [f64::NEG_INFINITY, f64::INFINITY]);
    if !path.is_file() {
        return Ok(window);
    }
    for line in input::text(&path, Kind::List)?.lines() {
        let stamp = line.split(',').find_map(|cell| cell.trim().parse::<f64>().ok());
        let says = |word: &str| line.split(',').any(|cell| cell.trim().trim_matches('"') == word);
        if let Some(stamp) = stamp {
            if says("MOTION_START") {
                window[0] = stamp;
            } else if says("DISABLE") {
                window[1] = stamp;
            }
        }
    }
    Ok(window)
}
