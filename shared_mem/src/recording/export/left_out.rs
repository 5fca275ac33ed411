//! What of a source was not carried over: every topic, or file of a TwinAligner folder, with how much of it.

use super::super::container::Messages;
use super::super::robot::{ROBOT_DESCRIPTION, TF, TF_STATIC};
use super::super::tracked::ObjectTopics;
use super::super::{ReadError, twinaligner};
use super::bag::{EXTERNAL_TORQUES, FLANGE_POSE};
use super::source::{Kind, Source};
use super::{Exported, Format};
use crate::cell::Cell;
use crate::topics;
use serde::Serialize;
use std::collections::BTreeMap;

/// A topic of the source, or a file or folder of a TwinAligner clip, of which something was left out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Its name.
    pub topic: String,
    /// Messages, or files, that were left out.
    pub messages: usize,
}

/// How much of each topic beside joints and poses was carried over.
#[derive(Debug, Default)]
pub(super) struct Carried(BTreeMap<String, usize>);

impl Carried {
    /// One more message of the topic.
    pub(super) fn one(&mut self, topic: &str) {
        match self.0.get_mut(topic) {
            Some(count) => *count += 1,
            None => drop(self.0.insert(topic.to_owned(), 1)),
        }
    }
}

/// What of the source is not in what was written of it.
///
/// # Errors
/// [`ReadError`] when the source cannot be read once more.
pub(super) fn left_out(
    source: &Source,
    cell: &Cell,
    to: Format,
    (exported, carried): (&Exported, &Carried),
) -> Result<Vec<LeftOut>, ReadError> {
    let whole = whole(source, cell, to, exported);
    let objects = match &source.kind {
        Kind::Own(_) => Some(ObjectTopics::own(cell)),
        Kind::Bag => Some(ObjectTopics::ros2(cell)),
        Kind::Folder => None,
    };
    // A folder has room for one object.
    let went = |topic: &str| match (&objects, to) {
        (Some(objects), Format::TwinAligner) => objects.expected() == topic && exported.poses > 0,
        (Some(objects), _) => objects.wants(topic),
        (None, _) => false,
    };
    let rest = |(topic, count): (String, usize)| {
        let carried = if whole.contains(&topic.as_str()) || went(&topic) {
            count
        } else {
            carried.0.get(&topic).map_or(0, |n| *n)
        };
        (count > carried).then(|| LeftOut { topic, messages: count - carried })
    };
    Ok(there(source)?.into_iter().filter_map(rest).collect())
}

/// Topics whose rows are those of the clip's series, and went with them.
fn whole<'a>(source: &Source, cell: &'a Cell, to: Format, exported: &Exported) -> Vec<&'a str> {
    let (joints, poses) = (exported.measured > 0, exported.poses > 0);
    let whole: &[(&str, bool)] = match &source.kind {
        Kind::Own(_) => &[(topics::ARM_STATE.name, joints)],
        Kind::Folder => &[
            (twinaligner::CONTROL, joints),
            (twinaligner::FRAME, joints),
            (twinaligner::POSE, poses),
            // Written anew from the first row and cell.toml.
            ("init.json", to == Format::TwinAligner),
        ],
        Kind::Bag => &[
            (&cell.topics.measured, joints),
            (&cell.topics.desired, joints),
            (EXTERNAL_TORQUES, to == Format::Own),
            (FLANGE_POSE, to == Format::Own),
        ],
    };
    whole.iter().filter(|(_, carried)| *carried).map(|(topic, _)| *topic).collect()
}

/// Everything that the source holds: messages by topic, files by name.
fn there(source: &Source) -> Result<BTreeMap<String, usize>, ReadError> {
    let mut found = BTreeMap::new();
    if matches!(source.kind, Kind::Folder) {
        let failed = || ReadError::io(&source.path);
        for entry in std::fs::read_dir(&source.path).map_err(failed())? {
            let entry = entry.map_err(failed())?;
            let files =
                if entry.path().is_dir() { std::fs::read_dir(entry.path()).map_err(failed())?.count() } else { 1 };
            found.insert(entry.file_name().to_string_lossy().into_owned(), files);
        }
        return Ok(found);
    }
    let mut messages = Messages::open(&source.path)?;
    while let Some(message) = messages.next()? {
        // In an own clip they follow from states and cell.toml.
        if source.is_own() && [TF, TF_STATIC, ROBOT_DESCRIPTION].contains(&message.channel.topic.as_str()) {
            continue;
        }
        match found.get_mut(&message.channel.topic) {
            Some(count) => *count += 1,
            None => drop(found.insert(message.channel.topic.clone(), 1)),
        }
    }
    Ok(found)
}
