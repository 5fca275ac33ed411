//! LeRobot data sets: `meta/info.json` and parquet files, one an episode (version 2) or many episodes in one (version 3). Each
//! episode is a log.

use super::parquet_file::{self, Numbers};
use super::{stem, walk};
use crate::error::ImportError;
use crate::log::{Column, Facts, LeftOut, Log, Table};
use serde::Deserialize;
use shared_mem::budget::Budget;
use shared_mem::input::{self, Kind};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// The only table of an episode.
const FRAMES: &str = "frames";
/// Counters that are no quantities.
const EPISODE: &str = "episode_index";
const FRAME: &str = "frame_index";
const COUNTERS: [&str; 5] = [EPISODE, FRAME, "index", "task_index", "next.done"];
/// What a column or a feature takes in each episode, beside its numbers [bytes].
const IN_EPISODE: usize = 128;

/// What `meta/info.json` says, as far as it is used.
#[derive(Debug, Deserialize)]
struct Info {
    codebase_version: String,
    #[serde(default)]
    robot_type: Option<String>,
    fps: f64,
    total_frames: usize,
    total_episodes: usize,
    features: BTreeMap<String, Feature>,
}

#[derive(Debug, Deserialize)]
struct Feature {
    dtype: String,
    #[serde(default)]
    names: serde_json::Value,
}

pub(super) fn is_data_set(folder: &Path) -> bool {
    folder.join("meta/info.json").is_file() && folder.join("data").is_dir()
}

/// The files that hold its numbers, in order.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let mut files = walk::files(&folder.join("data"))?;
    files.retain(|path| path.extension().is_some_and(|e| e == "parquet"));
    files.sort();
    Ok(files)
}

pub(super) fn read(folder: &Path, budget: &Budget) -> Result<Vec<Log>, ImportError> {
    let path = folder.join("meta/info.json");
    let info: Info = serde_json::from_str(&input::text(&path, Kind::Configuration)?)
        .map_err(|e| ImportError::log(&path, format!("is no info.json of a LeRobot data set ({e}); copy it again")))?;
    if !info.codebase_version.starts_with("v2") && !info.codebase_version.starts_with("v3") {
        let what =
            format!("is of version {}; convert the data set to v3.0 with LeRobot's own scripts", info.codebase_version);
        return Err(ImportError::log(&path, what));
    }
    if !(info.fps.is_finite() && info.fps > 0.0) {
        return Err(ImportError::log(&path, format!("says {} frames a second; write the data set's rate", info.fps)));
    }
    let mut episodes: BTreeMap<u64, Log> = BTreeMap::new();
    let (mut frames, mut refused) = (0_usize, Vec::new());
    for file in &files(folder)? {
        // What is said of the rows costs nothing to read; the rows may cost more than there is.
        let left = info.total_frames.saturating_sub(frames);
        let mut of_file = BTreeMap::new();
        let read = parquet_file::read(file, left, budget).and_then(|(rows, columns)| {
            take(file, (rows, &columns), (folder, &info, budget), &mut of_file).map(|()| rows)
        });
        match read {
            Ok(rows) => {
                frames += rows;
                of_file.into_iter().for_each(|(episode, log)| append(&mut episodes, episode, log));
            }
            // A file takes none of the others along.
            Err(error) => refused.push(error.about_a_log()?),
        }
    }
    let is_whole = frames == info.total_frames && episodes.len() == info.total_episodes;
    let missing = format!(
        "{frames} of {} frames and {} of {} episodes are there",
        info.total_frames,
        episodes.len(),
        info.total_episodes
    );
    match (episodes.values_mut().next(), refused.first()) {
        (None, Some(_)) => return refused.into_iter().next().map_or(Ok(Vec::new()), Err),
        (None, None) => {
            let what = format!("holds no episode: {missing}; take its parquet files from their source again");
            return Err(ImportError::log(folder, what));
        }
        (Some(first), _) if !is_whole => {
            let why = refused.iter().map(|error| format!("left out: {error}"));
            first.warnings.push(format!("the data set is not whole: {missing}; these are read"));
            first.warnings.extend(why);
        }
        (Some(_), _) => {}
    }
    Ok(episodes.into_values().collect())
}

/// Puts the frames of an episode behind those that an earlier file holds of it.
fn append(episodes: &mut BTreeMap<u64, Log>, episode: u64, mut log: Log) {
    let Some(before) = episodes.get_mut(&episode).and_then(|before| before.tables.first_mut()) else {
        episodes.insert(episode, log);
        return;
    };
    let Some(after) = log.tables.first_mut() else { return };
    let filled = before.stamps_ns.as_ref().map_or(0, Vec::len);
    before.stamps_ns.get_or_insert_default().append(after.stamps_ns.get_or_insert_default());
    for mut column in after.columns.drain(..) {
        match before.columns.iter_mut().find(|known| known.name == column.name) {
            Some(known) => known.values.append(&mut column.values),
            None => {
                column.values.splice(0..0, std::iter::repeat_n(f64::NAN, filled));
                before.columns.push(column);
            }
        }
    }
}

/// Takes the episodes of a file over.
fn take(
    file: &Path,
    (rows, columns): (usize, &[Numbers]),
    (folder, info, budget): (&Path, &Info, &Budget),
    episodes: &mut BTreeMap<u64, Log>,
) -> Result<(), ImportError> {
    let spent = ImportError::budget(file);
    let counter = |name: &str| {
        let column = columns.iter().find(|column| column.name == name && column.width == 1);
        column.ok_or_else(|| {
            ImportError::log(file, format!("has no column `{name}`: it is no file of a LeRobot data set"))
        })
    };
    let (of_row, frame) = (counter(EPISODE)?, counter(FRAME)?);
    let count = |value: f64| ((0.0..1e15).contains(&value) && value.fract() == 0.0).then_some(value as u64);
    let quantities =
        columns.iter().filter(|column| !COUNTERS.contains(&column.name.as_str()) && column.name != "timestamp");
    let mut named = Vec::new();
    for column in quantities {
        budget.elements(column.width, size_of::<String>() + column.name.len()).map_err(&spent)?;
        named.push((column, labels(info, column)));
    }
    let width: usize = named.iter().map(|(numbers, _)| numbers.width).sum();
    // Rows of an episode follow each other, so that its columns are looked for once.
    let (mut at_work, mut places) = (None, Vec::new());
    for row in 0..rows {
        let (Some(episode), Some(frame)) =
            (of_row.values.get(row).and_then(|v| count(*v)), frame.values.get(row).and_then(|v| count(*v)))
        else {
            return Err(ImportError::log(
                file,
                format!(
                    "row {row} belongs to no episode: the file is damaged; copy it from its source again, or leave it out"
                ),
            ));
        };
        budget.elements(width + 1, size_of::<f64>()).map_err(&spent)?;
        if at_work != Some(episode) {
            budget.elements(width + info.features.len() + 1, IN_EPISODE).map_err(&spent)?;
        }
        let log = episodes.entry(episode).or_insert_with(|| empty(folder, info, episode));
        let Some(table) = log.tables.first_mut() else { continue };
        if at_work != Some(episode) {
            places = columns_of(table, &named);
            at_work = Some(episode);
        }
        // Stamps in the file are single precision; frames are counted.
        table.stamps_ns.get_or_insert_default().push((frame as f64 / info.fps * 1e9).round() as u64);
        for ((numbers, _), first) in named.iter().zip(&places) {
            let values = numbers.values.get(row * numbers.width..(row + 1) * numbers.width).unwrap_or(&[]);
            let columns = table.columns.iter_mut().skip(*first);
            columns.zip(values).for_each(|(column, value)| column.values.push(*value));
        }
    }
    Ok(())
}

/// Where the columns of each quantity begin in the table of an episode, which gets those that it lacks.
fn columns_of(table: &mut Table, named: &[(&Numbers, Vec<String>)]) -> Vec<usize> {
    let filled = table.stamps_ns.as_ref().map_or(0, Vec::len);
    let known: HashMap<String, usize> =
        table.columns.iter().enumerate().map(|(at, column)| (column.name.clone(), at)).collect();
    let mut places = Vec::new();
    for (_, labels) in named {
        let place = labels.first().and_then(|first| known.get(first)).copied();
        places.push(place.unwrap_or(table.columns.len()));
        if place.is_none() {
            let column = |name: &String| Column { name: name.clone(), values: vec![f64::NAN; filled] };
            table.columns.extend(labels.iter().map(column));
        }
    }
    places
}

/// Names of the columns of a quantity: `observation.state[shoulder_pan]` where the data set names its numbers.
fn labels(info: &Info, numbers: &Numbers) -> Vec<String> {
    let names = info.features.get(&numbers.name).and_then(|feature| names(&feature.names, numbers.width));
    let label = |i: usize| match names.as_ref().and_then(|names| names.get(i)) {
        Some(name) => format!("[{}]", name.strip_suffix(".pos").unwrap_or(name)),
        None if numbers.width == 1 => String::new(),
        None => format!("[{i}]"),
    };
    (0..numbers.width).map(|i| format!("{}{}", numbers.name, label(i))).collect()
}

/// A list of names, wherever the versions keep it.
fn names(value: &serde_json::Value, width: usize) -> Option<Vec<String>> {
    if let Some(list) = value.as_array() {
        let texts: Vec<String> = list.iter().filter_map(|name| name.as_str().map(str::to_owned)).collect();
        return if texts.len() == width { Some(texts) } else { list.iter().find_map(|inside| names(inside, width)) };
    }
    value.as_object()?.values().find_map(|inside| names(inside, width))
}

fn empty(folder: &Path, info: &Info, episode: u64) -> Log {
    let seen = info.features.iter().filter(|(_, feature)| matches!(feature.dtype.as_str(), "video" | "image"));
    let left_out = seen.map(|(name, _)| LeftOut { what: name.clone(), why: "pictures are not imported", count: 1 });
    Log {
        file: folder.to_owned(),
        name: format!("{}_{episode:04}", stem(folder)),
        format: "LeRobot data set",
        tables: vec![Table { name: FRAMES.into(), ..Table::default() }],
        facts: Facts { rate: Some(info.fps), robot: info.robot_type.clone(), ..Facts::default() },
        left_out: left_out.collect(),
        ..Log::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_wherever_a_version_keeps_them() {
        for text in [
            r#"["a.pos","b.pos"]"#,
            r#"{"axes":["a.pos","b.pos"]}"#,
            r#"{"motors":["a.pos","b.pos"]}"#,
            r#"[["a.pos","b.pos"]]"#,
        ] {
            let value = serde_json::from_str(text).expect("JSON");
            assert_eq!(names(&value, 2), Some(vec!["a.pos".into(), "b.pos".into()]), "{text}");
        }
        assert_eq!(names(&serde_json::Value::Null, 2), None);
    }
}
