//! What a captured stroke was like, and whether it is of use. Units: m, rad.

use super::object_watch::PoseQuality;
use super::quality::Quality;
use serde::Serialize;
use std::path::PathBuf;

/// An object that moved less was not hit [m].
const MIN_OBJECT_MOTION: f64 = 5e-3;
/// Share of lost poses from which a stroke is better repeated.
const POSES_LOST: f64 = 0.1;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipSummary {
    /// File, relative to the session.
    pub file: PathBuf,
    /// What was played, in words.
    pub motion: String,
    /// `true`: entered into cell.toml. A clip that is not stays on disk.
    pub kept: bool,
    pub why: Option<String>,
    /// `true`: the user paused it, so another takes its place.
    pub paused: bool,
    /// `true`: the robot stopped itself, so another takes its place.
    pub reflex: bool,
    /// Direction of the stroke [rad].
    pub heading: f64,
    /// Speed of the hit that was commanded [m/s].
    pub speed: f64,
    /// How far the line passed to the left of the centre [m].
    pub offset: f64,
    /// What was seen of the arm.
    #[serde(flatten)]
    pub quality: Quality,
    /// What was seen of the object.
    #[serde(flatten)]
    pub object: PoseQuality,
    /// Messages in the file.
    pub messages: u64,
    /// Size of the file [bytes].
    pub bytes: u64,
}

/// Why the object's poses make a clip useless, if they do.
pub(super) fn unfit(seen: &PoseQuality, pushed: &[(String, f64, f64)]) -> Option<String> {
    let lost = seen.lost_poses as f64 / (seen.poses + seen.lost_poses).max(1) as f64;
    if seen.moved < MIN_OBJECT_MOTION {
        return Some(format!("the object moved by {:.1} mm only: it was not hit", 1e3 * seen.moved));
    }
    if let Some((name, far, turned)) = pushed.first() {
        let (far, turned) = (1e3 * far, turned.to_degrees());
        return Some(format!("`{name}` moved as well, by {far:.0} mm and {turned:.0} degrees"));
    }
    (lost > POSES_LOST).then(|| format!("{:.0} % of the object's poses are lost", 100.0 * lost))
}

impl ClipSummary {
    /// The clip's quality in a line.
    pub fn line(&self) -> String {
        let verdict = match &self.why {
            None => "keep".to_owned(),
            Some(why) => format!("repeat, because {why}; the file stays, but is not entered into cell.toml"),
        };
        format!(
            "{}: {}, towards {:.0}° at {:.2} m/s, the object moved {:.0} mm and turned {:.0}°, {} packets and {} poses lost, \
             {:.1} MB: {verdict}",
            self.file.display(),
            self.motion,
            self.heading.to_degrees(),
            self.speed,
            1e3 * self.object.moved,
            self.object.turned.to_degrees(),
            self.quality.lost_packets,
            self.object.lost_poses,
            self.bytes as f64 * 1e-6,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_that_hit_nothing_or_something_else_or_lost_the_object_is_to_be_repeated() {
        let seen = PoseQuality { poses: 100, lost_poses: 2, moved: 0.12, turned: 0.1 };
        assert_eq!(unfit(&seen, &[]), None);
        assert!(unfit(&PoseQuality { moved: 1e-3, ..seen }, &[]).is_some_and(|why| why.contains("not hit")));
        assert!(unfit(&PoseQuality { lost_poses: 20, ..seen }, &[]).is_some_and(|why| why.contains("17 %")));
        let pushed = [("milk".to_owned(), 0.012, 0.0)];
        assert!(unfit(&seen, &pushed).is_some_and(|why| why.contains("`milk` moved as well, by 12 mm")));
    }
}
