//! ROS 2 bags: the files of a folder in order, or one file; storage mcap or sqlite3, messages in CDR.

use super::{go_on, sqlite, stem};
use crate::error::ImportError;
use crate::log::{Facts, LeftOut, Log};
use crate::ros::{Collector, Encoding, Incoming};
use shared_mem::budget::Budget;
use shared_mem::origin::Origins;
use shared_mem::recording::RawMessages;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Messages that are no ROS 2 messages.
const NOT_CDR: &str = "its messages are not in CDR";

pub(super) fn read(path: &Path, files: &[PathBuf], budget: &Budget) -> Result<Log, ImportError> {
    let mut collector = Collector::new(Encoding::Cdr, budget);
    let mut left_out: BTreeMap<String, u64> = BTreeMap::new();
    let mut origins = Origins::default();
    let mut is_mcap = true;
    for file in files {
        is_mcap = file.extension().is_none_or(|e| e != "db3");
        if is_mcap {
            for origin in mcap(file, &mut collector, &mut left_out)?.iter() {
                origins.add(origin.clone());
            }
        } else {
            sqlite::read(file, &mut collector)?;
        }
    }
    let description = collector.description();
    let (tables, mut out) = collector.finish();
    out.extend(left_out.into_iter().map(|(what, count)| LeftOut { what, why: NOT_CDR, count }));
    let franka = tables.iter().any(|table| table.name.contains("franka"));
    let states = tables.iter().any(|table| table.name.contains("franka_robot_state_broadcaster"));
    let torque = states.then_some((true, "franka_ros2 publishes tau_J, which holds gravity"));
    Ok(Log {
        file: path.to_owned(),
        name: stem(path),
        format: if is_mcap { "ROS 2 bag (mcap)" } else { "ROS 2 bag (sqlite3)" },
        tables,
        facts: Facts { franka, torque, description, ..Facts::default() },
        origins,
        left_out: out,
        warnings: Vec::new(),
    })
}

/// Takes the messages of a file, and returns where it says that it comes from.
fn mcap(
    path: &Path,
    collector: &mut Collector<'_>,
    left_out: &mut BTreeMap<String, u64>,
) -> Result<Origins, ImportError> {
    let mut messages = RawMessages::open(path)?;
    let mut count = 0_u64;
    while let Some(message) = messages.read_next()? {
        count += 1;
        if count.is_multiple_of(1024) {
            go_on(path)?;
        }
        if message.encoding != "cdr" {
            collector.budget().step(1).map_err(ImportError::budget(path))?;
            *left_out.entry(message.topic.to_owned()).or_default() += 1;
            continue;
        }
        let incoming = Incoming {
            topic: message.topic,
            type_name: message.type_name,
            definition: message.definition,
            log_time_ns: message.log_time_ns,
            data: message.data,
        };
        collector.take(&incoming).map_err(|what| what.of(path))?;
    }
    match messages.damage() {
        Some(damage) => {
            let what = format!("{damage}; `ros2 bag convert` writes what is left of it as a new bag, or leave it out");
            Err(ImportError::log(path, what))
        }
        None => Ok(messages.origins()),
    }
}
