//! Tables of one topic each that were printed during one run (`rostopic echo -p`, `ros2 topic echo --csv`), or that hold its states and
//! its commands by their names, as the log that they are together.

use super::{packed, stem, table};
use crate::error::ImportError;
use crate::log::{Log, Table};
use crate::naming;
use shared_mem::budget::Budget;
use std::path::{Path, PathBuf};

/// The share of the shorter of two tables that lies within the other where both are of one run.
const SHARE: f64 = 0.5;

/// Reads the tables: a log for those that cover the same time, and one for each of the others.
pub(super) fn read(folder: &Path, files: &[PathBuf], budget: &Budget) -> Result<Vec<Log>, ImportError> {
    let (mut logs, mut refused): (Vec<Log>, _) = (Vec::new(), Vec::new());
    for file in files {
        let mut log = match packed::log(file, budget, table::read) {
            Ok(log) => log,
            Err(error) => {
                refused.push(error.about_a_log()?);
                continue;
            }
        };
        log.warnings = log.warnings.iter().map(|warning| format!("{}: {warning}", stem(file))).collect();
        log.tables.iter_mut().for_each(|table| table.name = stem(file));
        match logs.iter_mut().find(|other| of_one_run(&other.tables, &log.tables)) {
            Some(other) => {
                other.tables.append(&mut log.tables);
                other.warnings.append(&mut log.warnings);
                other.file = folder.to_owned();
            }
            None => logs.push(log),
        }
    }
    if let [whole] = logs.as_mut_slice()
        && files.len() > 1
    {
        whole.name = stem(folder);
    }
    // A table alone is called as every other.
    for log in logs.iter_mut().filter(|log| log.tables.len() == 1) {
        log.tables.iter_mut().for_each(|only| only.name = table::ROWS.into());
    }
    match logs.first_mut() {
        Some(first) => first.warnings.extend(refused.iter().map(|error| format!("left out: {error}"))),
        None => return refused.into_iter().next().map_or(Ok(logs), Err),
    }
    Ok(logs)
}

/// Whether tables cover the same time.
fn of_one_run(tables: &[Table], others: &[Table]) -> bool {
    let span = |tables: &[Table]| {
        let all: Vec<(f64, f64)> = tables.iter().filter_map(time).collect();
        all.into_iter().reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    };
    span(tables).zip(span(others)).is_some_and(|((a, b), (c, d))| {
        let shared = b.min(d) - a.max(c);
        shared > 0.0 && shared >= SHARE * (b - a).min(d - c)
    })
}

/// The first and last stamp of a table: its own [ns], or those of its column of time in the unit of that.
fn time(table: &Table) -> Option<(f64, f64)> {
    if let Some(stamps) = &table.stamps_ns {
        return stamps.iter().min().zip(stamps.iter().max()).map(|(first, last)| (*first as f64, *last as f64));
    }
    let column = table.columns.iter().find(|column| naming::is_time(&column.name))?;
    let finite = column.values.iter().copied().filter(|v| v.is_finite());
    let (first, last) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    (first < last).then_some((first, last))
}
