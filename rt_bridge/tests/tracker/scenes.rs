//! Clips of a simulated cell as its D455 would see them: the object stands, is pushed at half a metre a second, slides to a
//! stop, while the arm follows it. Poses are prescribed, so the truth is known whatever the physics does.

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rt_bridge::tracker::{Estimate, Frame, Sight, Tracker, View};
use shared_mem::cell::{Cell, Object};
use shared_mem::frames::Pose;
use shared_mem::msg::Joints;
use shared_mem::msg::image::ImageHeader;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use twin::arm::ArmModel;
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;

/// Frames in a clip.
pub(crate) const FRAMES: u64 = 60;
const TICK_NS: u64 = 33_333_333;
const SPEED: f64 = 0.5;

/// The shipped cell with a box of this size, its camera and its noise.
pub(crate) fn cell(size: [f64; 3]) -> Cell {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let mut cell = Cell::read(&path).expect("the shipped cell");
    let object = cell.objects.pop().expect("a box");
    cell.objects = vec![Object { size: Some(size), ..object }];
    cell
}

/// One camera and one tracker.
pub(crate) struct Bench {
    camera: SimCamera,
    pub(crate) tracker: Tracker,
    pub(crate) color: Vec<u8>,
    pub(crate) depth: Vec<u8>,
    pub(crate) headers: [ImageHeader; 2],
}

/// Frames for which a search goes on before the one in which a lone object is found.
pub(crate) const SEARCH: u32 = 2;

impl Bench {
    pub(crate) fn new(cell: &Cell) -> Self {
        let camera = SimCamera::new(cell).expect("a camera");
        let mut tracker = Tracker::new(cell).expect("a tracker");
        tracker.set_view(View::new(&camera.info()).expect("a view"));
        let (color, depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        Self { camera, tracker, color, depth, headers: Default::default() }
    }

    /// Takes a picture.
    pub(crate) fn film(&mut self, scene: &SceneSnapshot) {
        self.headers = self.camera.render(scene, &mut self.color, &mut self.depth);
    }

    /// Shows the tracker the picture taken last.
    pub(crate) fn look(&mut self, scene: &SceneSnapshot) -> Sight {
        let view = self.tracker.view().expect("a view").clone();
        let [color, depth] = &self.headers;
        let frame = Frame::new(&view, (depth, &self.depth), Some((color, &self.color))).expect("a frame");
        self.tracker.look(&frame, scene.time_ns as f64 * 1e-9, Some(&scene.q))
    }

    /// Looks at a scene until the search is over but for the last look.
    pub(crate) fn search(&mut self, scene: &SceneSnapshot) {
        self.film(scene);
        for _ in 0..SEARCH {
            let sight = self.look(scene);
            assert!(matches!(sight, Sight::Lost(_)), "found at once: {sight:?}");
        }
    }

    pub(crate) fn see(&mut self, scene: &SceneSnapshot) -> Sight {
        self.film(scene);
        self.look(scene)
    }
}

/// A scene with the object standing at a place, the arm ready.
pub(crate) fn standing(cell: &Cell, x: f64, y: f64, yaw: f64, frame: u64) -> SceneSnapshot {
    let model = ArmModel::from_cell(cell).expect("an arm");
    let half = cell.object().and_then(|o| o.size).map_or(0.0, |size| size[2] / 2.0);
    SceneSnapshot {
        time_ns: frame * TICK_NS,
        dof: 7,
        q: *model.ready(),
        object: Some(Pose::from_isometry(Isometry3::new(Vector3::new(x, y, half), Vector3::z() * yaw))),
        ..SceneSnapshot::default()
    }
}

/// A push and a slide, as drawn by `seed`.
pub(crate) fn clip(cell: &Cell, seed: u64) -> Vec<SceneSnapshot> {
    let mut random = Pcg64::seed_from_u64(seed);
    let model = ArmModel::from_cell(cell).expect("an arm");
    let size = cell.object().and_then(|o| o.size).expect("a box");
    let start = Vector3::new(random.random_range(0.42..0.62), random.random_range(-0.2..0.2), size[2] / 2.0);
    let yaw = random.random_range(0.0..TAU);
    // Towards the middle of the table, give or take a right angle.
    let middle = Vector3::new(0.52, 0.0, 0.0) - start;
    let heading = middle.y.atan2(middle.x) + random.random_range(-PI / 2.0..PI / 2.0);
    let spin = random.random_range(-3.0..3.0);
    let pushed = random.random_range(0.25..0.5);
    let along = Vector3::new(heading.cos(), heading.sin(), 0.0);
    let (stand, braking) = (0.33, 2.9);
    let mut q = *model.ready();
    (0..FRAMES)
        .map(|frame| {
            let time = frame as f64 * TICK_NS as f64 * 1e-9 - stand;
            let slide = (time - pushed).clamp(0.0, SPEED / braking);
            let way = SPEED * time.clamp(0.0, pushed) + SPEED * slide - 0.5 * braking * slide * slide;
            let turned = spin * way / SPEED;
            let tip_way = (SPEED * time.min(pushed)).max(-0.15) - 0.3 * (time - pushed).clamp(0.0, 0.5);
            let tip = start + along * (tip_way - size[0].hypot(size[1]) / 2.0 - 0.012);
            q = reaching(&model, &q, &Vector3::new(tip.x, tip.y, 0.04));
            let place = start + along * way;
            let object = Isometry3::new(place, Vector3::z() * (yaw + turned));
            let object = Some(Pose::from_isometry(object));
            SceneSnapshot { time_ns: frame * TICK_NS, dof: 7, q, object, ..SceneSnapshot::default() }
        })
        .collect()
}

/// Joint positions that bring the tool's tip to a place, pointing down: a few damped steps from `q`.
pub(crate) fn reaching(model: &ArmModel, q: &Joints, place: &Vector3<f64>) -> Joints {
    let mut q = *q;
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    for _ in 0..40 {
        let tip = model.tip(&q).isometry();
        let shift = place - tip.translation.vector;
        let turn = (down * tip.rotation.inverse()).scaled_axis();
        let miss = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        let mut jacobian = nalgebra::SMatrix::<f64, 6, 7>::zeros();
        for joint in 0..7 {
            let mut other = q;
            other[joint] += 1e-6;
            let moved = model.tip(&other).isometry();
            let shift = (moved.translation.vector - tip.translation.vector) * 1e6;
            let turn = (moved.rotation * tip.rotation.inverse()).scaled_axis() * 1e6;
            jacobian.set_column(joint, &Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z));
        }
        let square: Matrix6<f64> = jacobian * jacobian.transpose() + Matrix6::identity() * 1e-4;
        let step = jacobian.transpose() * square.try_inverse().expect("damped") * miss;
        for joint in 0..7 {
            q[joint] += step[joint];
        }
    }
    q
}

/// How far an estimate is from the truth: position [m], turn [rad], the latter up to what looks the same.
pub(crate) fn error(tracker: &Tracker, estimate: &Estimate, truth: &SceneSnapshot) -> (f64, f64) {
    let (pose, truth) = (estimate.pose.isometry(), truth.object.expect("an object").isometry());
    let turned = tracker.model().nearest(&pose, &truth.rotation).rotation.angle_to(&truth.rotation);
    ((pose.translation.vector - truth.translation.vector).norm(), turned)
}
