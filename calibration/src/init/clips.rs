//! Recorded clips: which lie in a folder, what the first of them says about its robot, and at which rates they were recorded.

use anyhow::{Context as _, ensure};
use import::Contents;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::place;
use shared_mem::recording::{Clip, ObjectSeries, read_clip, read_clip_info};
use std::path::{Path, PathBuf};
use twin::arm::ArmModel;
use twin::replay::in_model_order;

/// An object that was hit slides farther than this, and no tracker is off by as much [m].
const SHORTEST_SLIDE: f64 = 0.01;

/// What the first of some clips tells.
#[derive(Debug, Clone, Default)]
pub(super) struct About {
    /// The cell.toml that an own clip carries.
    pub(super) cell: Option<Cell>,
    /// What a log of another program holds.
    pub(super) contents: Contents,
}

/// The clips in a folder, in the order of their names: own clips, ROS 2 bags of the storage mcap, TwinAligner folders.
pub(super) fn list(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        if is_mcap(&path) || is_twinaligner(&path) {
            found.push(path);
        } else if path.join("metadata.yaml").is_file() {
            found.extend(entries(&path)?.into_iter().filter(|path| is_mcap(path)));
        }
    }
    ensure!(
        !found.is_empty(),
        "{} holds no clip: no .mcap, no bag folder, no TwinAligner folder; logs of other kinds become clips with `calibration import`",
        folder.display()
    );
    Ok(found)
}

/// The files of a bag that every verb reads as clips as they are: those of the storage mcap.
pub(super) fn of_bag(bag: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let files = if bag.is_dir() { entries(bag)? } else { vec![bag.to_owned()] };
    Ok(files.into_iter().filter(|path| is_mcap(path)).collect())
}

fn entries(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let read = std::fs::read_dir(folder).and_then(|entries| entries.collect::<Result<Vec<_>, _>>());
    let read = read.with_context(|| format!("{} cannot be read; give an existing folder", folder.display()))?;
    let is_hidden = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    let mut paths: Vec<PathBuf> = read.iter().map(std::fs::DirEntry::path).filter(|path| !is_hidden(path)).collect();
    paths.sort();
    Ok(paths)
}

fn is_mcap(path: &Path) -> bool {
    path.is_file() && path.extension().is_some_and(|end| end == "mcap")
}

fn is_twinaligner(path: &Path) -> bool {
    path.join("control.json").is_file() && path.join("frame.json").is_file()
}

/// What a clip says about the cell that it was recorded in.
pub(super) fn about(clip: &Path) -> anyhow::Result<About> {
    if is_twinaligner(clip) {
        let joints = read_clip(clip, ClipKind::Excitation, &Cell::default())?.joint_names;
        let contents = Contents { format: "TwinAligner folder", joints, ..Contents::default() };
        return Ok(About { cell: None, contents });
    }
    if let Some(info) = if is_mcap(clip) { read_clip_info(clip)? } else { None } {
        let cell = info.cell_toml.map(|text| Cell::parse(&text, clip)).transpose()?;
        let cell = cell.map(|cell| Cell { clips: Vec::new(), ..cell.at_home_anywhere() });
        return Ok(About { cell, contents: Contents { format: "own clip", ..Contents::default() } });
    }
    Ok(About { cell: None, contents: import::look(clip)? })
}

/// A clip as cell.toml lists it, and one line on what was recorded in it.
pub(super) fn listed(
    clip: &Path,
    cell: &Cell,
    arm: Option<&ArmModel>,
    out: &Path,
) -> anyhow::Result<(ClipEntry, String)> {
    let kind = if cell.robot.is_some() { ClipKind::Excitation } else { ClipKind::FreeMotion };
    let mut read = read_clip(clip, kind, cell)?;
    let mut kind = kind;
    if cell.robot.is_some() && cell.object().is_some() {
        let strokes = read_clip(clip, ClipKind::ControlHitSlide, cell);
        let hit = |clip: &Clip| has_moved(&clip.object) || clip.others.iter().any(|other| has_moved(&other.series));
        if let Some(strokes) = strokes.ok().filter(hit) {
            (read, kind) = (strokes, ClipKind::ControlHitSlide);
        }
    }
    let remark = recorded(&read);
    if let Some(arm) = arm.filter(|_| !read.joint_names.is_empty()) {
        in_model_order(read, arm)?;
    }
    Ok((ClipEntry { file: place::beside(out, clip), kind }, remark))
}

/// Whether an object lies elsewhere in the end than in the beginning: an arm may have moved beside one that nothing hit.
fn has_moved(object: &ObjectSeries) -> bool {
    let ends = object.poses.first().zip(object.poses.last());
    ends.is_some_and(|(first, last)| {
        let squares = first.position().into_iter().zip(last.position()).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt() > SHORTEST_SLIDE
    })
}

/// Rows a second of each series.
fn recorded(clip: &Clip) -> String {
    let mut parts = Vec::new();
    let (measured, desired, object) = (&clip.measured, &clip.desired, &clip.object);
    for (what, stamps) in
        [("states", &measured.stamps_ns), ("commands", &desired.stamps_ns), ("poses", &object.stamps_ns)]
    {
        parts.extend(rate(stamps).map(|rate| format!("{rate} {what}/s")));
    }
    let with = |name: &str, series: &shared_mem::recording::JointSeries| {
        let logged = [("velocities", !series.dq.is_empty()), ("torques", !series.tau.is_empty())];
        let there: Vec<&str> = logged.iter().filter(|(_, there)| *there).map(|(name, _)| *name).collect();
        (!there.is_empty()).then(|| format!("{name} with {}", there.join(" and ")))
    };
    parts.extend(with("states", measured));
    parts.extend(with("commands", desired));
    parts.join(", ")
}

/// Rows a second, in three figures.
fn rate(stamps_ns: &[u64]) -> Option<f64> {
    let seconds = (stamps_ns.last()? - stamps_ns.first()?) as f64 * 1e-9;
    let rate = (seconds > 0.0).then(|| (stamps_ns.len() - 1) as f64 / seconds)?;
    let scale = 10_f64.powf(2.0 - rate.log10().floor());
    Some((rate * scale).round() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::frames::Pose;

    #[test]
    fn an_object_that_trembles_was_not_hit() {
        let at = |x: f64| Pose::from_parts([x, 0.1, 0.05], [1.0, 0.0, 0.0, 0.0]).expect("a pose");
        let series = |poses: Vec<_>| ObjectSeries { stamps_ns: (0..poses.len() as u64).collect(), poses };
        assert!(!has_moved(&ObjectSeries::default()));
        assert!(!has_moved(&series(vec![at(0.5), at(0.502), at(0.499)])));
        assert!(has_moved(&series(vec![at(0.5), at(0.51), at(0.62)])));
    }

    #[test]
    fn rates_have_three_figures() {
        assert_eq!(rate(&[0, 20_040_000, 40_080_000]), Some(49.9));
        assert_eq!((rate(&[5]), rate(&[5, 5])), (None, None));
    }
}
