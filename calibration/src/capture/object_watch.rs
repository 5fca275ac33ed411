//! What the tracker says of the object while strokes are captured: where it stands, whether it stands still, and whether poses
//! are missing. Base frame; m, rad, s.

use super::program::Standing;
use crate::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::console;
use shared_mem::msg::object::ObjectPose;
use shared_mem::topics::OBJECT_POSE;
use shared_mem::transport::{Node, Subscriber, TransportError};
use std::time::{Duration, Instant};

/// Poses that say whether it stands still: those of so long a time [s].
const WINDOW: f64 = 0.4;
/// ... and at least so many.
const FEWEST: usize = 6;
/// The halves of the window agree to this where it stands still [m, rad].
const STILL: [f64; 2] = [1e-3, 0.01];
/// No pose for so long: nobody tracks.
const SILENCE: Duration = Duration::from_secs(3);
/// A pose is missing where two are further apart than so many of the usual distances.
const MISSING: f64 = 2.5;

/// The object cannot be followed.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// Shared memory failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Nobody tracks.
    #[error(
        "no object poses arrive on /object/pose; start the tracker, or the bridge with a cell.toml that has [object], then start again"
    )]
    NoPoses,
    /// It does not come to rest.
    #[error("the object does not come to rest within {0:.0} s; take hands and hoses off the table, then start again")]
    Restless(f64),
}

/// A seat beside the tracker.
#[derive(Debug)]
pub struct ObjectWatch {
    poses: Subscriber<ObjectPose>,
    seen: Vec<Seen>,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    time: f64,
    place: [f64; 3],
    yaw: f64,
}

/// How a clip's poses were.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PoseQuality {
    /// Poses received.
    pub poses: usize,
    /// Poses that should have been there and were not.
    pub lost_poses: usize,
    /// How far the object moved [m].
    pub moved: f64,
    /// How far it turned [rad].
    pub turned: f64,
}

impl ObjectWatch {
    /// Takes the seat in `domain` (default: the one this process was started in).
    ///
    /// # Errors
    /// [`WatchError::Transport`].
    pub fn open(domain: Option<&str>) -> Result<Self, WatchError> {
        const NAME: &str = "calibration capture object";
        let node = domain.map_or_else(|| Node::open(NAME), |domain| Node::open_in(domain, NAME))?;
        Ok(Self { poses: node.subscriber(OBJECT_POSE)?, seen: Vec::new(), node })
    }

    /// Forgets what was seen: a clip begins.
    pub fn begin(&mut self) {
        self.seen.clear();
    }

    /// Forgets all poses, those that wait to be taken in as well: the cell was started anew.
    ///
    /// # Errors
    /// [`WatchError::Transport`].
    pub fn begin_anew(&mut self) -> Result<(), WatchError> {
        self.poses.newest()?;
        self.seen.clear();
        Ok(())
    }

    /// Takes in what has come.
    ///
    /// # Errors
    /// [`WatchError::Transport`].
    pub fn look(&mut self) -> Result<(), WatchError> {
        while let Some(pose) = self.poses.receive()? {
            self.seen.extend(seen(&pose));
        }
        for ignored in self.node.newly_ignored() {
            console::line(ignored);
        }
        Ok(())
    }

    /// Waits until the object stands still and says where; `None` when the user gave up first.
    ///
    /// # Errors
    /// [`WatchError`] when nobody tracks, or it does not come to rest within `patience`.
    pub fn standing(&mut self, patience: Duration, interrupt: &Interrupt) -> Result<Option<Standing>, WatchError> {
        let start = Instant::now();
        let known = self.seen.len();
        while !interrupt.asked() {
            self.look()?;
            if let Some(standing) = still(&self.seen[known.min(self.seen.len())..]) {
                return Ok(Some(standing));
            }
            if self.seen.len() == known && start.elapsed() > SILENCE {
                return Err(WatchError::NoPoses);
            }
            if start.elapsed() > patience {
                return Err(WatchError::Restless(patience.as_secs_f64()));
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(None)
    }

    /// How the poses since [`Self::begin`] were.
    #[must_use]
    pub fn quality(&self) -> PoseQuality {
        quality(&self.seen)
    }
}

fn seen(pose: &ObjectPose) -> Option<Seen> {
    let [w, x, y, z] = pose.wxyz;
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    pose.pose().map(|_| Seen { time: pose.device_ns as f64 * 1e-9, place: pose.position, yaw })
}

fn between(a: f64, b: f64) -> f64 {
    (a - b).sin().atan2((a - b).cos())
}

fn mean(seen: &[Seen]) -> Seen {
    let count = seen.len() as f64;
    let first = seen[0].yaw;
    let of = |value: &dyn Fn(&Seen) -> f64| seen.iter().map(value).sum::<f64>() / count;
    Seen {
        time: of(&|s| s.time),
        place: std::array::from_fn(|axis| of(&|s| s.place[axis])),
        yaw: first + of(&|s| between(s.yaw, first)),
    }
}

fn still(seen: &[Seen]) -> Option<Standing> {
    let last = seen.last()?.time;
    let recent = &seen[seen.partition_point(|s| s.time < last - WINDOW)..];
    let whole = seen[0].time <= last - WINDOW;
    if !whole || recent.len() < FEWEST {
        return None;
    }
    let [before, after] = [mean(&recent[..recent.len() / 2]), mean(&recent[recent.len() / 2..])];
    let moved = (0..3).map(|axis| (after.place[axis] - before.place[axis]).powi(2)).sum::<f64>().sqrt();
    let turned = between(after.yaw, before.yaw).abs();
    let all = mean(recent);
    (moved < STILL[0] && turned < STILL[1]).then_some(Standing { place: [all.place[0], all.place[1]], yaw: all.yaw })
}

fn quality(seen: &[Seen]) -> PoseQuality {
    let (Some(first), Some(last)) = (seen.first(), seen.last()) else { return PoseQuality::default() };
    let mut gaps: Vec<f64> = seen.windows(2).map(|w| w[1].time - w[0].time).collect();
    gaps.sort_unstable_by(f64::total_cmp);
    let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
    let lost = |gap: &f64| if *gap > MISSING * usual && usual > 0.0 { (gap / usual).round() as usize - 1 } else { 0 };
    PoseQuality {
        poses: seen.len(),
        lost_poses: gaps.iter().map(lost).sum(),
        moved: (0..3).map(|axis| (last.place[axis] - first.place[axis]).powi(2)).sum::<f64>().sqrt(),
        turned: between(last.yaw, first.yaw).abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(of: impl Fn(f64) -> (f64, f64), times: impl Iterator<Item = u32>) -> Vec<Seen> {
        let one = |k: u32| {
            let time = f64::from(k) / 60.0;
            let (x, yaw) = of(time);
            Seen { time, place: [x, 0.0, 0.05], yaw }
        };
        times.map(one).collect()
    }

    #[test]
    fn an_object_stands_still_only_once_a_whole_window_says_so() {
        let resting = |_: f64| (0.5, 3.1);
        assert_eq!(still(&track(resting, 0..20)), None, "a third of a second is not enough");
        let standing = still(&track(resting, 0..40)).expect("it rests");
        assert!((standing.place[0] - 0.5).abs() < 1e-12 && (standing.yaw.abs() - 3.1).abs() < 1e-9);
        assert_eq!(still(&track(|t| (0.5 + 0.01 * t, 0.0), 0..60)), None, "it creeps");
        assert_eq!(still(&track(|t| (0.5, 0.2 * t), 0..60)), None, "it turns");
    }

    #[test]
    fn missing_poses_are_counted_and_the_way_is_measured() {
        let whole = quality(&track(|t| (0.5 + 0.1 * t, 0.0), 0..61));
        assert_eq!((whole.poses, whole.lost_poses), (61, 0));
        assert!((whole.moved - 0.1).abs() < 1e-9);
        let holed = quality(&track(|t| (0.5 + 0.1 * t, 0.0), (0..61).filter(|k| !(20..27).contains(k))));
        assert_eq!(holed.lost_poses, 7);
    }
}
