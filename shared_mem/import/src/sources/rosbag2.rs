//! ROS 2 bags: the files of a folder in order, or one file; storage mcap or sqlite3, messages in CDR.

use super::{go_on, packed, sqlite, stem};
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

/// A bag as it is read.
struct Bag<'a> {
    collector: Collector<'a>,
    /// Messages of a topic that are no ROS 2 messages.
    left_out: BTreeMap<String, u64>,
    origins: Origins,
    warnings: Vec<String>,
    /// Whether the last of its files has the storage mcap.
    is_mcap: bool,
}

pub(super) fn read(path: &Path, files: &[PathBuf], budget: &Budget) -> Result<Log, ImportError> {
    let mut bag = Bag {
        collector: Collector::new(Encoding::Cdr, budget),
        left_out: BTreeMap::new(),
        origins: Origins::default(),
        warnings: Vec::new(),
        is_mcap: true,
    };
    let mut refused = Vec::new();
    for file in files {
        match packed::unpacked(file, budget, |place| bag.file(place)) {
            Ok(read) => {
                bag.warnings.extend(read.read.into_iter().chain(read.damage).map(|what| of_file(files, file, what)))
            }
            Err(error) => refused.push(error.about_a_log()?),
        }
    }
    let Bag { mut collector, left_out, origins, mut warnings, is_mcap } = bag;
    let description = collector.description();
    let (tables, mut out) = collector.finish();
    // A file takes none of the others along.
    if tables.is_empty() || files.len() == 1 {
        match (refused.into_iter().next(), warnings.first()) {
            (Some(error), _) => return Err(error),
            (None, Some(damage)) if tables.is_empty() => {
                return Err(ImportError::log(
                    path,
                    format!("{damage}; nothing of a robot is left of it: leave it out"),
                ));
            }
            (None, _) => {}
        }
    } else {
        warnings.extend(refused.iter().map(|error| format!("left out: {error}")));
    }
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
        warnings,
    })
}

/// What is odd about a file, with its name where there are several.
fn of_file(files: &[PathBuf], file: &Path, what: String) -> String {
    match file.file_name() {
        Some(name) if files.len() > 1 => format!("{}: {what}", name.to_string_lossy()),
        _ => what,
    }
}

impl Bag<'_> {
    /// Takes the messages of a file, and returns what is missing of it.
    fn file(&mut self, path: &Path) -> Result<Option<String>, ImportError> {
        self.is_mcap = !sqlite::is_database(path)?;
        if self.is_mcap { self.mcap(path) } else { sqlite::read(path, &mut self.collector) }
    }

    fn mcap(&mut self, path: &Path) -> Result<Option<String>, ImportError> {
        let mut messages = RawMessages::open(path)?;
        let mut count = 0_u64;
        while let Some(message) = messages.read_next()? {
            count += 1;
            if count.is_multiple_of(1024) {
                go_on(path)?;
            }
            if message.encoding != "cdr" {
                self.collector.budget().step(1).map_err(ImportError::budget(path))?;
                *self.left_out.entry(message.topic.to_owned()).or_default() += 1;
                continue;
            }
            let incoming = Incoming {
                topic: message.topic,
                type_name: message.type_name,
                definition: message.definition,
                log_time_ns: message.log_time_ns,
                data: message.data,
            };
            self.collector.take(&incoming).map_err(ImportError::budget(path))?;
        }
        for origin in messages.origins().iter() {
            self.origins.add(origin.clone());
        }
        Ok(messages.damage().map(|damage| format!("{damage}; the {count} messages that are whole are read")))
    }
}
