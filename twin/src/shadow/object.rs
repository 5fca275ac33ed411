//! The object's side of the mirror: compares the tracker's poses with the twin's pose at the moment of the picture, and
//! sets the twin's object onto the real one when it is first seen and whenever that rests untouched.
//!
//! A pose arrives one camera latency after its picture, so the twin's recent poses are kept. A single pose carries the
//! tracker's noise; a resting object is averaged before the twin is set onto it, and then left alone while it agrees.

use crate::metrics::SurfacePoints;
use crate::scene::ObjectShape;
use crate::sim::SimScene;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, PoseNoise};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::ObjectPose;
use std::collections::VecDeque;

/// Why the twin's object was set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObjectEvent {
    /// It was seen for the first time.
    Found,
    /// It rests, and the twin's lay elsewhere.
    Rests,
}

/// The twin's poses that are kept: a second, longer than any camera's latency.
const HISTORY: usize = 1000;
/// Poses that must agree before an object rests.
const REST_POSES: usize = 12;
/// Without a known tracker noise this much counts as agreement, one sigma [m], [rad].
const UNKNOWN_NOISE: PoseNoise = PoseNoise { position: 1e-3, rotation: 5e-3 };
/// Poses agree, and the twin agrees with them, within so many sigmas.
const SIGMAS: f64 = 4.0;

/// One of the objects as tracker and twin see it.
pub(super) struct ObjectMirror {
    /// Its place among the bodies of the twin.
    number: usize,
    latency_ns: u64,
    noise: PoseNoise,
    points: SurfacePoints,
    /// Host stamp of the mirrored state, the twin's pose then, and whether the tool pressed on it.
    history: VecDeque<(u64, Pose<Base, Object>, bool)>,
    recent: VecDeque<Pose<Base, Object>>,
    found: bool,
    latest: Option<(f64, f64)>,
    /// Moment of the newest picture [ns], and the twin's pose then.
    pictured: Option<(u64, Pose<Base, Object>)>,
    sums: (f64, f64),
    count: u64,
}

impl ObjectMirror {
    /// Of the object in question of `cell`, which is body `number` of the twin.
    pub(super) fn new(cell: &Cell, number: usize, shape: &ObjectShape) -> Self {
        let noise = cell.object().and_then(|o| o.pose_noise).unwrap_or(UNKNOWN_NOISE);
        Self {
            number,
            latency_ns: cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64),
            noise: PoseNoise {
                position: noise.position.max(1e-4), // an exact tracker must still tolerate the twin settling on its table
                rotation: noise.rotation.max(1e-3),
            },
            points: SurfacePoints::new(shape),
            history: VecDeque::with_capacity(HISTORY),
            recent: VecDeque::with_capacity(REST_POSES),
            found: false,
            latest: None,
            pictured: None,
            sums: (0.0, 0.0),
            count: 0,
        }
    }

    /// Keeps the twin's pose of the moment of an arm state.
    pub(super) fn remember(&mut self, stamp_ns: u64, twin: &SimScene) {
        let Some(pose) = twin.object(self.number) else { return };
        if self.history.len() == HISTORY {
            self.history.pop_front();
        }
        self.history.push_back((stamp_ns, pose, twin.is_moved(self.number)));
    }

    /// Forgets the real object: the next pose is a first one.
    pub(super) fn lose(&mut self) {
        self.history.clear();
        self.recent.clear();
        self.found = false;
        self.latest = None;
        self.pictured = None;
    }

    pub(super) fn on_pose(&mut self, message: &ObjectPose, twin: &mut SimScene) -> Option<ObjectEvent> {
        let real = message.pose()?;
        let picture_ns = message.stamp_ns.saturating_sub(self.latency_ns);
        if !self.found {
            self.found = true;
            self.set(&real, twin);
            self.pictured = Some((picture_ns, real));
            return Some(ObjectEvent::Found);
        }
        let then = self.history.iter().rev().find(|(stamp, ..)| *stamp <= picture_ns).map(|(_, pose, _)| *pose);
        if let Some(then) = then {
            let (add, add_s) = (self.points.add(&real, &then), self.points.add_s(&real, &then));
            self.latest = Some((add, add_s));
            self.pictured = Some((picture_ns, then));
            (self.sums.0, self.sums.1) = (self.sums.0 + add, self.sums.1 + add_s);
            self.count += 1;
        }
        self.rests(&real, twin)
    }

    /// ADD and ADD-S of the newest pose [m].
    pub(super) fn latest_gap(&self) -> Option<(f64, f64)> {
        self.latest
    }

    /// Moment of the newest picture that could be compared [ns], and the twin's pose then.
    pub(super) fn pictured(&self) -> Option<(u64, Pose<Base, Object>)> {
        self.pictured
    }

    /// Mean ADD and ADD-S over all poses [m].
    pub(super) fn mean_gap(&self) -> Option<(f64, f64)> {
        let count = self.count as f64;
        (self.count > 0).then(|| (self.sums.0 / count, self.sums.1 / count))
    }

    /// Sets the twin's object onto a real one that rests somewhere else.
    fn rests(&mut self, real: &Pose<Base, Object>, twin: &mut SimScene) -> Option<ObjectEvent> {
        if self.recent.len() == REST_POSES {
            self.recent.pop_front();
        }
        self.recent.push_back(*real);
        let touched = self.history.iter().rev().take(HISTORY / 2).any(|(_, _, touched)| *touched);
        let mean = mean(&self.recent);
        if self.recent.len() < REST_POSES || touched || !self.recent.iter().all(|pose| self.agrees(pose, &mean)) {
            return None;
        }
        if self.agrees(&twin.object(self.number)?, &mean) {
            return None;
        }
        self.set(&mean, twin);
        Some(ObjectEvent::Rests)
    }

    fn agrees(&self, a: &Pose<Base, Object>, b: &Pose<Base, Object>) -> bool {
        let apart = (a.isometry().translation.vector - b.isometry().translation.vector).norm();
        // Three axes of noise: the length of the error is up to sqrt(3) sigmas where each axis has one.
        let sigmas = SIGMAS * 3.0f64.sqrt() / 2.0;
        apart < sigmas * self.noise.position && a.angle_to(b) < sigmas * self.noise.rotation
    }

    fn set(&mut self, pose: &Pose<Base, Object>, twin: &mut SimScene) {
        twin.set_object(self.number, pose, Vector3::zeros(), Vector3::zeros());
        self.history.clear();
        self.recent.clear();
    }
}

/// Mean position, and the rotation nearest to all.
fn mean(poses: &VecDeque<Pose<Base, Object>>) -> Pose<Base, Object> {
    let Some(first) = poses.front() else { return Pose::identity() };
    let reference = first.isometry();
    let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
    for pose in poses {
        shift += pose.isometry().translation.vector;
        turn += (reference.rotation.inverse() * pose.isometry().rotation).scaled_axis();
    }
    let share = 1.0 / poses.len() as f64;
    let rotation = reference.rotation * UnitQuaternion::from_scaled_axis(turn * share);
    Pose::from_isometry(Isometry3::from_parts((shift * share).into(), rotation))
}
