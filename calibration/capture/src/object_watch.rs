//! What the tracker says of the object while strokes are captured: where it stands, whether it stands still, and whether poses
//! are missing; and where the other objects of the cell stand. Base frame; m, rad, s.

use super::obstacle::{Obstacle, corners};
use super::program::Standing;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde::Serialize;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::interrupt::Interrupt;
use shared_mem::msg::object::{NamedPose, ObjectName, ObjectPose};
use shared_mem::statistics::median;
use shared_mem::topics::{OBJECT_POSE, OBJECT_POSES};
use shared_mem::transport::{Node, Subscriber, TransportError};
use std::time::{Duration, Instant};
use twin::scene::{CellBody, MeshFileError, cell_bodies};

/// Poses that say whether it stands still: those of so long a time [s].
const WINDOW_TIME: f64 = 0.4;
/// ... and at least so many.
const MIN_POSES: usize = 6;
/// The halves of the window agree to this where it stands still [m, rad].
const MAX_STILL_MOTION: [f64; 2] = [1e-3, 0.01];
/// No pose for so long: nobody tracks.
const POSE_TIMEOUT: Duration = Duration::from_secs(3);
/// A pose is missing where two are further apart than so many of the usual distances.
const MAX_GAP_RATIO: f64 = 2.5;
/// Another object was moved where the means of so many poses before a clip and at its end are so far apart [m, rad].
const AVERAGED_POSES: usize = 6;
const ALSO_MOVED: [f64; 2] = [3e-3, 0.03];

/// The object cannot be followed.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// Shared memory failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(
        "no object poses arrive on /object/pose; start the tracker, or the bridge with a cell.toml that has [object], then start again"
    )]
    NoPoses,
    /// Nobody tracks one of several.
    #[error(
        "no poses of `{0}` arrive on /object/poses, so nobody knows where it is; have the tracker follow it, or take it off the table \
         and out of cell.toml, then start again"
    )]
    NoPosesOf(String),
    /// It does not come to rest.
    #[error("the object does not come to rest within {0:.0} s; take hands and hoses off the table, then start again")]
    Restless(f64),
    /// One of several does not come to rest.
    #[error("`{0}` does not come to rest within {1:.0} s; take hands and hoses off the table, then start again")]
    RestlessOf(String, f64),
    /// The shape of an object is not known.
    #[error(transparent)]
    Shape(#[from] MeshFileError),
}

/// A seat beside the tracker.
#[derive(Debug)]
pub struct ObjectWatch {
    poses: Poses,
    seen: Vec<Seen>,
    others: Vec<Other>,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

/// Where poses come from.
#[derive(Debug)]
enum Poses {
    /// Of the only object.
    One(Subscriber<ObjectPose>),
    /// Of each by its name; the one that is watched.
    Named(Subscriber<NamedPose>, ObjectName),
}

/// A body beside the object.
#[derive(Debug)]
struct Other {
    name: ObjectName,
    corners: [Point3<f64>; 8],
    seen: Vec<Seen>,
    pose: Option<Isometry3<f64>>,
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
    pub poses: usize,
    /// Poses that should have been there and were not.
    pub lost_poses: usize,
    /// How far the object moved [m].
    pub moved: f64,
    /// How far it turned [rad].
    pub turned: f64,
}

impl ObjectWatch {
    /// Takes the seat in `domain` (default: the one this process was started in), to watch the object of `cell` that is in question.
    ///
    /// # Errors
    /// [`WatchError::Transport`], [`WatchError::Shape`].
    pub fn open(domain: Option<&str>, cell: &Cell) -> Result<Self, WatchError> {
        const NAME: &str = "calibration capture object";
        let node = domain.map_or_else(|| Node::open(NAME), |domain| Node::open_in(domain, NAME))?;
        let (poses, mut others) = match cell.one_of_several().and_then(ObjectName::new) {
            None => (Poses::One(node.subscriber(OBJECT_POSE)?), Vec::new()),
            Some(name) => (Poses::Named(node.subscriber(OBJECT_POSES)?, name), cell_bodies(cell)?),
        };
        others.retain(|body| body.object != cell.in_question);
        let other = |body: CellBody| Other { name: body.name, corners: corners(&body), seen: Vec::new(), pose: None };
        Ok(Self { poses, seen: Vec::new(), others: others.into_iter().map(other).collect(), node })
    }

    /// Forgets what was seen, but for where the others were seen last: a clip begins.
    pub fn begin(&mut self) {
        self.seen.clear();
        for Other { seen, .. } in &mut self.others {
            seen.drain(..seen.len().saturating_sub(AVERAGED_POSES));
        }
    }

    /// Forgets all poses, those that wait to be taken in as well: the cell was started anew.
    ///
    /// # Errors
    /// [`WatchError::Transport`].
    pub fn begin_anew(&mut self) -> Result<(), WatchError> {
        match &mut self.poses {
            Poses::One(poses) => drop(poses.newest()?),
            Poses::Named(poses, _) => drop(poses.newest()?),
        }
        self.seen.clear();
        self.others.iter_mut().for_each(|other| other.seen.clear());
        Ok(())
    }

    /// Takes in what has come.
    ///
    /// # Errors
    /// [`WatchError::Transport`].
    pub fn look(&mut self) -> Result<(), WatchError> {
        let Self { poses, seen, others, node } = self;
        match poses {
            Poses::One(poses) => {
                while let Some(pose) = poses.receive()? {
                    seen.extend(self::seen(&pose));
                }
            }
            Poses::Named(poses, name) => {
                while let Some(pose) = poses.receive()? {
                    let unnamed = pose.unnamed();
                    if pose.name == *name {
                        seen.extend(self::seen(&unnamed));
                    } else if let Some(other) = others.iter_mut().find(|other| other.name == pose.name) {
                        other.seen.extend(self::seen(&unnamed));
                        other.pose = unnamed.pose().map(|pose| pose.isometry()).or(other.pose);
                    }
                }
            }
        }
        for ignored in node.newly_ignored() {
            console::line(ignored);
        }
        Ok(())
    }

    /// Waits until the object and all others stand still and says where it does; `None` when the user gave up first.
    ///
    /// # Errors
    /// [`WatchError`] when nobody tracks, or one of them does not come to rest within `patience`.
    pub fn standing(&mut self, patience: Duration, interrupt: &Interrupt) -> Result<Option<Standing>, WatchError> {
        self.wait(patience, interrupt, true)
    }

    /// The same of the object alone, whatever hides the others meanwhile.
    ///
    /// # Errors
    /// As [`Self::standing`].
    pub fn resting(&mut self, patience: Duration, interrupt: &Interrupt) -> Result<Option<Standing>, WatchError> {
        self.wait(patience, interrupt, false)
    }

    fn wait(
        &mut self,
        patience: Duration,
        interrupt: &Interrupt,
        for_all: bool,
    ) -> Result<Option<Standing>, WatchError> {
        let start = Instant::now();
        let known = self.seen.len();
        let known_others: Vec<usize> = self.others.iter().map(|other| other.seen.len()).collect();
        while !interrupt.asked() {
            self.look()?;
            let still_since = |seen: &[Seen], known: usize| still(&seen[known.min(seen.len())..]);
            let others = || self.others.iter().filter(|_| for_all).zip(&known_others);
            let moving = others().find(|(other, known)| still_since(&other.seen, **known).is_none());
            let standing = still_since(&self.seen, known);
            if let (Some(standing), None) = (standing, moving) {
                return Ok(Some(standing));
            }
            if start.elapsed() > POSE_TIMEOUT {
                if self.seen.len() == known {
                    return Err(self.of_this(WatchError::NoPoses, WatchError::NoPosesOf));
                }
                if let Some((silent, _)) = others().find(|(other, known)| other.seen.len() == **known) {
                    return Err(WatchError::NoPosesOf(silent.name.text().to_owned()));
                }
            }
            if start.elapsed() > patience {
                let seconds = patience.as_secs_f64();
                return Err(match moving.filter(|_| standing.is_some()) {
                    Some((other, _)) => WatchError::RestlessOf(other.name.text().to_owned(), seconds),
                    None => self.of_this(WatchError::Restless(seconds), |name| WatchError::RestlessOf(name, seconds)),
                });
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(None)
    }

    /// What went wrong with the object that is watched, by its name where it is one of several.
    fn of_this(&self, one: WatchError, named: impl FnOnce(String) -> WatchError) -> WatchError {
        match &self.poses {
            Poses::One(_) => one,
            Poses::Named(_, name) => named(name.text().to_owned()),
        }
    }

    /// How the poses since [`Self::begin`] were.
    pub fn quality(&self) -> PoseQuality {
        quality(&self.seen)
    }

    /// The other objects, where they were seen last.
    pub fn obstacles(&self) -> Vec<Obstacle> {
        let at = |other: &Other| Some(Obstacle::at(other.name.text(), &other.corners, other.pose.as_ref()?));
        self.others.iter().filter_map(at).collect()
    }

    /// The bodies of the other objects by name, where each was seen last: the mean of place and heading over its
    /// last poses.
    pub fn others(&self) -> Vec<(ObjectName, Isometry3<f64>)> {
        let of = |other: &Other| {
            let last = other.pose?;
            let seen = &other.seen[other.seen.len().saturating_sub(AVERAGED_POSES)..];
            let Some(mean) = (!seen.is_empty()).then(|| mean(seen)) else { return Some((other.name, last)) };
            let turn = between(mean.yaw, last.rotation.euler_angles().2);
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn) * last.rotation;
            Some((other.name, Isometry3::from_parts(Vector3::from(mean.place).into(), rotation)))
        };
        self.others.iter().filter_map(of).collect()
    }

    /// Those of the other objects that moved since [`Self::begin`]: name, how far [m], and how far they turned [rad].
    pub fn also_moved(&self) -> Vec<(String, f64, f64)> {
        let of = |other: &Other| {
            let [far, turned] = between_ends(&other.seen)?;
            (far > ALSO_MOVED[0] || turned > ALSO_MOVED[1]).then(|| (other.name.text().to_owned(), far, turned))
        };
        self.others.iter().filter_map(of).collect()
    }
}

fn seen(pose: &ObjectPose) -> Option<Seen> {
    let [w, x, y, z] = pose.wxyz;
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    pose.pose().map(|_| Seen { time: pose.device_ns as f64 * 1e-9, place: pose.position, yaw })
}

/// From `b` to `a`, the shorter way round [rad].
pub(super) fn between(a: f64, b: f64) -> f64 {
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

/// How far the last poses are from the first ones [m], and by how much they are turned [rad]; `None` without poses.
fn between_ends(seen: &[Seen]) -> Option<[f64; 2]> {
    let count = AVERAGED_POSES.min(seen.len());
    if count == 0 {
        return None;
    }
    let [first, last] = [mean(&seen[..count]), mean(&seen[seen.len() - count..])];
    let squares = (0..3).map(|axis| (last.place[axis] - first.place[axis]).powi(2));
    Some([squares.sum::<f64>().sqrt(), between(last.yaw, first.yaw).abs()])
}

fn still(seen: &[Seen]) -> Option<Standing> {
    let last = seen.last()?.time;
    let recent = &seen[seen.partition_point(|s| s.time < last - WINDOW_TIME)..];
    let whole = seen[0].time <= last - WINDOW_TIME;
    if !whole || recent.len() < MIN_POSES {
        return None;
    }
    let [before, after] = [mean(&recent[..recent.len() / 2]), mean(&recent[recent.len() / 2..])];
    let moved = (0..3).map(|axis| (after.place[axis] - before.place[axis]).powi(2)).sum::<f64>().sqrt();
    let turned = between(after.yaw, before.yaw).abs();
    let all = mean(recent);
    (moved < MAX_STILL_MOTION[0] && turned < MAX_STILL_MOTION[1])
        .then_some(Standing { place: [all.place[0], all.place[1]], yaw: all.yaw })
}

fn quality(seen: &[Seen]) -> PoseQuality {
    let (Some(first), Some(last)) = (seen.first(), seen.last()) else { return PoseQuality::default() };
    let gaps: Vec<f64> = seen.windows(2).map(|w| w[1].time - w[0].time).collect();
    let usual = median(gaps.iter().copied()).unwrap_or(0.0);
    let lost =
        |gap: &f64| if *gap > MAX_GAP_RATIO * usual && usual > 0.0 { (gap / usual).round() as usize - 1 } else { 0 };
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

    #[test]
    fn an_object_beside_was_moved_where_the_ends_of_a_clip_are_apart_and_not_where_single_poses_err() {
        let noisy =
            |push: f64| track(move |t| (0.5 + 2e-3 * (900.0 * t).sin() + if t > 0.5 { push } else { 0.0 }, 0.0), 0..61);
        let [still, pushed] = [0.0, 8e-3].map(|push| between_ends(&noisy(push)).expect("poses")[0]);
        assert!(still < ALSO_MOVED[0] && pushed > ALSO_MOVED[0], "{still} {pushed}");
        assert_eq!(between_ends(&[]), None);
    }
}
