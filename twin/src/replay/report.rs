//! The gaps of a session, as the JSON that other programs read and the table that people read. SI in JSON; the table
//! shows milliradians and millimetres.

use serde::Serialize;
use shared_mem::origin::Origins;
use shared_mem::recording::Provenance;
use std::fmt;

/// Real against simulated; `None` (`null`) where it does not apply.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Gap {
    /// Root mean square of each joint's error [rad].
    pub joint_rms_rad: Option<Vec<f64>>,
    /// ADD of the object, mean over the poses [m].
    pub object_add_m: Option<f64>,
    /// ADD-S of the object, mean over the poses [m].
    pub object_add_s_m: Option<f64>,
    /// From the clip's start to the first simulated touch of tool and object [s].
    pub contact_time_s: Option<f64>,
}

/// The gap of one clip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipGap {
    /// Name of the clip's file.
    pub file: String,
    #[serde(flatten)]
    pub gap: Gap,
    /// Where the recording comes from, as far as it says.
    pub origins: Origins,
    /// What was odd in the recording, one sentence each.
    pub warnings: Vec<String>,
}

/// A clip that could not be replayed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Failure {
    pub(super) file: String,
    pub(super) error: String,
    /// It was replayed, and its simulation could not be written.
    #[serde(skip)]
    pub(super) unwritten: bool,
}

/// The gaps of a session.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SessionGap {
    /// Clips that were replayed, in the order of cell.toml.
    pub clips: Vec<ClipGap>,
    /// Mean over those clips that have a figure.
    pub mean: Gap,
    /// Clips that could not be replayed, with the reason.
    pub(super) failed: Vec<Failure>,
}

impl SessionGap {
    pub(super) fn new(clips: Vec<ClipGap>, failed: Vec<Failure>) -> Self {
        let mean = Gap {
            joint_rms_rad: mean_rows(clips.iter().filter_map(|c| c.gap.joint_rms_rad.as_deref())),
            object_add_m: mean(clips.iter().filter_map(|c| c.gap.object_add_m)),
            object_add_s_m: mean(clips.iter().filter_map(|c| c.gap.object_add_s_m)),
            contact_time_s: mean(clips.iter().filter_map(|c| c.gap.contact_time_s)),
        };
        Self { clips, mean, failed }
    }

    /// Why clips could not be replayed: file and reason.
    pub fn failures(&self) -> impl Iterator<Item = (&str, &str)> {
        self.failed.iter().map(|failure| (failure.file.as_str(), failure.error.as_str()))
    }

    /// Why the first simulation that was asked for could not be written, if one could not.
    pub fn unwritten(&self) -> Option<&str> {
        self.failed.iter().find(|failure| failure.unwritten).map(|failure| failure.error.as_str())
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    (count > 0.0).then(|| sum / count)
}

fn mean_rows<'a>(rows: impl Iterator<Item = &'a [f64]> + Clone) -> Option<Vec<f64>> {
    let dof = rows.clone().next()?.len();
    (0..dof).map(|joint| mean(rows.clone().filter_map(|row| row.get(joint).copied()))).collect()
}

impl fmt::Display for SessionGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.clips.iter().map(|clip| clip.file.len()).max().unwrap_or(0).max(4);
        let dof = self.mean.joint_rms_rad.as_ref().map_or(0, Vec::len);
        let with_object = self.mean.object_add_m.is_some();
        write!(f, "{:width$}", "clip")?;
        for joint in 1..=dof {
            write!(f, " {:>8}", format!("q{joint}"))?;
        }
        if with_object {
            write!(f, " {:>8} {:>8} {:>9}", "ADD", "ADD-S", "touch")?;
        }
        write!(f, "\n{:width$}", "")?;
        for _ in 0..dof {
            write!(f, " {:>8}", "mrad")?;
        }
        if with_object {
            write!(f, " {:>8} {:>8} {:>9}", "mm", "mm", "s")?;
        }
        writeln!(f)?;
        let rows = self.clips.iter().map(|clip| (clip.file.as_str(), &clip.gap));
        for (file, gap) in rows.chain((self.clips.len() > 1).then_some(("mean", &self.mean))) {
            write!(f, "{file:width$}")?;
            for joint in 0..dof {
                cell(f, 8, gap.joint_rms_rad.as_ref().and_then(|row| row.get(joint)).map(|v| v * 1e3))?;
            }
            if with_object {
                cell(f, 8, gap.object_add_m.map(|v| v * 1e3))?;
                cell(f, 8, gap.object_add_s_m.map(|v| v * 1e3))?;
                cell(f, 9, gap.contact_time_s)?;
            }
            writeln!(f)?;
        }
        let origins = self.clips.iter().map(|clip| (clip.file.as_str(), &clip.origins));
        write!(f, "origin: {}", Provenance::of_clips(origins))
    }
}

fn cell(f: &mut fmt::Formatter<'_>, width: usize, value: Option<f64>) -> fmt::Result {
    match value {
        Some(value) => write!(f, " {value:>width$.3}"),
        None => write!(f, " {:>width$}", "-"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(file: &str, rms: f64, add: Option<f64>) -> ClipGap {
        let gap = Gap { joint_rms_rad: Some(vec![rms, 0.0]), object_add_m: add, ..Gap::default() };
        ClipGap { file: file.into(), gap, origins: Origins::default(), warnings: Vec::new() }
    }

    #[test]
    fn the_mean_counts_only_clips_that_have_a_figure() {
        let session = SessionGap::new(vec![clip("a", 0.001, None), clip("b", 0.003, Some(0.5))], Vec::new());
        assert_eq!(session.mean.joint_rms_rad, Some(vec![0.002, 0.0]));
        assert_eq!((session.mean.object_add_m, session.mean.contact_time_s), (Some(0.5), None));
    }

    #[test]
    fn the_json_holds_the_keys_that_others_read_with_null_where_nothing_applies() {
        let json = serde_json::to_value(SessionGap::new(vec![clip("a", 0.001, None)], Vec::new())).expect("JSON");
        let first = &json["clips"][0];
        assert_eq!(first["file"], "a");
        assert_eq!(first["joint_rms_rad"][0], 0.001);
        for key in ["object_add_m", "object_add_s_m", "contact_time_s"] {
            assert!(first.get(key).is_some_and(serde_json::Value::is_null), "{key}");
            assert!(json["mean"].get(key).is_some(), "{key}");
        }
    }

    #[test]
    fn the_table_leaves_out_columns_that_no_clip_has() {
        let text = SessionGap::new(vec![clip("a.mcap", 0.001, None)], Vec::new()).to_string();
        assert!(text.contains("1.000") && text.contains("q2") && !text.contains("ADD"), "{text}");
    }
}
