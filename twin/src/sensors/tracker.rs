//! A simulated object tracker: looks at the object whenever the camera takes a picture, and tells its pose one latency
//! later, with noise. Base frame.

use super::camera_clock_ns;
use crate::effects::{CameraEffects, CameraMemory};
use crate::scene::SceneSnapshot;
use crate::sim::generator;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand_distr::{Distribution as _, StandardNormal};
use shared_mem::cell::{Cell, PoseNoise};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::ObjectPose;
use std::collections::VecDeque;

/// Streams of random numbers: of the first body's tracker, and of the others' behind this.
const OF_THE_FIRST: u64 = 3;
const OF_OTHERS: u64 = 100;

#[derive(Debug, Clone)]
pub struct SimTracker {
    period_ns: u64,
    latency_ns: u64,
    noise: PoseNoise,
    effects: CameraEffects,
    reported: CameraMemory,
    generator: rand_pcg::Pcg64,
    sequence: u64,
    next_picture_ns: u64,
    /// Poses on their way: when they become known (simulated clock), and what they say.
    pending: VecDeque<(u64, ObjectPose)>,
}

impl SimTracker {
    /// The tracker of a cell: rate and latency of its camera, noise of its object. Without `[camera]` those of a D455 at 30 Hz.
    pub fn new(cell: &Cell) -> Self {
        Self::drawing(cell, OF_THE_FIRST)
    }

    /// The tracker of the cell's body of this number, which belongs to the object in question: its noise is its own.
    pub fn of_body(cell: &Cell, number: usize) -> Self {
        Self::drawing(cell, if number == 0 { OF_THE_FIRST } else { OF_OTHERS + number as u64 })
    }

    fn drawing(cell: &Cell, stream: u64) -> Self {
        let camera = cell.camera.clone().unwrap_or_default();
        let exact = PoseNoise { position: 0.0, rotation: 0.0 };
        Self {
            period_ns: (1e9 / camera.rate) as u64,
            latency_ns: (camera.latency * 1e9) as u64,
            noise: cell.object().and_then(|o| o.pose_noise).unwrap_or(exact),
            effects: CameraEffects::default(),
            reported: CameraMemory::default(),
            generator: generator(cell, stream),
            sequence: 0,
            next_picture_ns: 0,
            pending: VecDeque::with_capacity(64),
        }
    }

    /// The same tracker under hidden effects: its poses are then older than their stamps say, or elsewhere.
    pub fn with_effects(self, effects: CameraEffects) -> Self {
        Self { effects, ..self }
    }

    /// Shows the tracker the scene; called every control period. Answers with a pose when one becomes known at that
    /// moment. Its `stamp_ns` is left for the host to set; `device_ns` is the camera's clock when the picture was taken.
    pub fn observe(&mut self, scene: &SceneSnapshot) -> Option<ObjectPose> {
        self.look(scene.time_ns, scene.object)
    }

    /// The same of an object that is there at this moment of the simulated clock [ns].
    pub fn look(&mut self, time_ns: u64, object: Option<Pose<Base, Object>>) -> Option<ObjectPose> {
        if time_ns >= self.next_picture_ns {
            self.next_picture_ns = (time_ns / self.period_ns + 1) * self.period_ns;
            if let Some(object) = object {
                let pose = self.measure(&object, time_ns);
                self.pending.push_back((time_ns + self.latency_ns + self.effects.latency_ns(), pose));
            }
        }
        let (known_at, _) = self.pending.front()?;
        (*known_at <= time_ns).then(|| self.pending.pop_front())?.map(|(_, pose)| pose)
    }

    fn measure(&mut self, object: &Pose<Base, Object>, time_ns: u64) -> ObjectPose {
        let PoseNoise { position, rotation } = self.noise;
        let mut draw = |sigma: f64| Vector3::from_fn(|_, _| sigma * self.draw());
        let shift = draw(position);
        let turn = UnitQuaternion::from_scaled_axis(draw(rotation));
        let true_pose = object.isometry();
        let noisy = Isometry3::from_parts((true_pose.translation.vector + shift).into(), turn * true_pose.rotation);
        let stamp_ns = time_ns + self.effects.latency_ns();
        let seen = self.effects.seen(&mut self.reported, stamp_ns, Pose::<Base, Object>::from_isometry(noisy));
        let mut covariance = [0.0; 36];
        for axis in 0..3 {
            covariance[7 * axis] = position * position;
            covariance[7 * (axis + 3)] = rotation * rotation;
        }
        self.sequence += 1;
        ObjectPose {
            stamp_ns: 0,
            device_ns: camera_clock_ns(stamp_ns),
            sequence: self.sequence - 1,
            position: seen.position(),
            wxyz: seen.wxyz(),
            covariance,
        }
    }

    fn draw(&mut self) -> f64 {
        StandardNormal.sample(&mut self.generator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::Camera;

    fn cell(latency: f64) -> Cell {
        Cell {
            camera: Some(Camera { rate: 50.0, latency, ..Camera::default() }),
            objects: vec![shared_mem::cell::Object {
                size: Some([0.1; 3]),
                pose_noise: Some(PoseNoise { position: 0.001, rotation: 0.01 }),
                ..Default::default()
            }],
            ..Cell::default()
        }
    }

    /// An object that moves at 1 m/s along x.
    fn scene(millisecond: u64) -> SceneSnapshot {
        let at = Isometry3::translation(millisecond as f64 * 1e-3, 0.0, 0.05);
        SceneSnapshot { time_ns: millisecond * 1_000_000, object: Some(Pose::from_isometry(at)), ..Default::default() }
    }

    #[test]
    fn a_pose_comes_at_the_cameras_rate_and_one_latency_late() {
        let mut tracker = SimTracker::new(&cell(0.030));
        let reported: Vec<(u64, ObjectPose)> =
            (0..200).filter_map(|t| tracker.observe(&scene(t)).map(|pose| (t, pose))).collect();
        assert_eq!(reported.iter().map(|(t, _)| *t).collect::<Vec<_>>(), [30, 50, 70, 90, 110, 130, 150, 170, 190]);
        for (i, (t, pose)) in reported.iter().enumerate() {
            assert_eq!(pose.sequence, i as u64);
            assert_eq!(pose.device_ns, camera_clock_ns((t - 30) * 1_000_000));
            let late = *t as f64 * 1e-3 - pose.position[0];
            assert!((late - 0.030).abs() < 0.005, "{late} s late");
        }
    }

    #[test]
    fn an_unknown_latency_makes_poses_late_and_their_stamps_too() {
        let blocks = "[[effect]]\nname = \"camera_latency\"\nlatency = 0.04";
        let theta: shared_mem::theta::Theta =
            shared_mem::toml_file::parse(blocks, std::path::Path::new("theta.toml")).expect("a theta.toml");
        let effects = crate::effects::Effects::from_theta(&theta.effects, 7).expect("a known effect").camera;
        let mut exact = cell(0.030);
        exact.objects[0].pose_noise = None;
        let mut tracker = SimTracker::new(&exact).with_effects(effects);
        let reported: Vec<(u64, ObjectPose)> =
            (0..200).filter_map(|t| tracker.observe(&scene(t)).map(|pose| (t, pose))).collect();
        assert_eq!(reported[0].0, 70, "30 ms that are known and 40 ms that are not");
        for (t, pose) in reported {
            let stamped = (t - 30) as f64 * 1e-3;
            assert_eq!(pose.device_ns, camera_clock_ns((t - 30) * 1_000_000));
            assert!((stamped - pose.position[0] - 0.04).abs() < 1e-12, "{} at {stamped} s", pose.position[0]);
        }
    }

    #[test]
    fn the_noise_has_the_sigma_of_the_cell() {
        let mut tracker = SimTracker::new(&cell(0.0));
        let mut squares = (0.0, 0.0);
        for i in 0..1000 {
            let scene = SceneSnapshot {
                time_ns: i * 20_000_000,
                object: Some(Pose::from_isometry(Isometry3::translation(0.5, 0.0, 0.0))),
                ..Default::default()
            };
            let pose = tracker.observe(&scene).expect("no latency").pose().expect("a pose");
            squares.0 += (pose.position()[0] - 0.5).powi(2) / 1000.0;
            squares.1 += pose.isometry().rotation.scaled_axis().x.powi(2) / 1000.0;
        }
        assert!((squares.0.sqrt() / 0.001 - 1.0).abs() < 0.1, "{}", squares.0.sqrt());
        assert!((squares.1.sqrt() / 0.01 - 1.0).abs() < 0.1, "{}", squares.1.sqrt());
    }
}
