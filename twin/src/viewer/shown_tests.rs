//! What a viewer is shown: the robot's shapes where the robot is, one tree of frames, and how the camera projects.

use super::Viewer;
use super::test_client::TestClient;
use crate::arm::{ArmModel, MAX_JOINTS};
use crate::render::{Hand, RobotSurface};
use crate::shipped::shipped;
use foxglove::Decode as _;
use foxglove::messages::{CameraCalibration, FrameTransforms, PoseInFrame, SceneEntity, SceneUpdate};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::CameraInfo;
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::twin::TwinState;
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_STATE, CAMERA_INFO, OBJECT_POSE, TWIN_STATE};
use shared_mem::transport::Node;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Long enough for a busy machine; only a fault uses it up.
const LONG: Duration = Duration::from_secs(60);

const TOPICS: [(&str, &str); 4] = [
    ("/scene", "foxglove.SceneUpdate"),
    ("/tf", "foxglove.FrameTransforms"),
    ("/camera/info", "foxglove.CameraCalibration"),
    ("/object/pose", "foxglove.PoseInFrame"),
];

/// Joint positions of robot and twin [rad].
const REAL: [f64; MAX_JOINTS] = [0.3, -0.8, 0.2, -2.2, 0.1, 1.6, 0.7, 0.0];
const TWIN: [f64; MAX_JOINTS] = [0.35, -0.7, 0.2, -2.2, 0.1, 1.6, 0.7, 0.0];

/// What a viewer was shown, the newest of each kind.
#[derive(Default)]
struct Seen {
    entities: BTreeMap<String, SceneEntity>,
    /// By child: parent, and the child's frame in it.
    frames: BTreeMap<String, (String, Isometry3<f64>)>,
    camera: Option<CameraCalibration>,
    object: Option<PoseInFrame>,
}

impl Seen {
    fn take(&mut self, topic: &str, data: &[u8]) {
        match topic {
            "/scene" => {
                let update = SceneUpdate::decode(data).expect("a scene");
                self.entities.extend(update.entities.into_iter().map(|entity| (entity.id.clone(), entity)));
            }
            "/tf" => {
                for frame in FrameTransforms::decode(data).expect("frames").transforms {
                    let (t, q) = (frame.translation.expect("a place"), frame.rotation.expect("a turn"));
                    let turn = UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z));
                    let at = Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), turn);
                    self.frames.insert(frame.child_frame_id, (frame.parent_frame_id, at));
                }
            }
            "/camera/info" => self.camera = Some(CameraCalibration::decode(data).expect("a calibration")),
            _ => self.object = Some(PoseInFrame::decode(data).expect("a pose")),
        }
    }

    /// A frame in `base`.
    fn in_base(&self, base: &str, frame: &str) -> Isometry3<f64> {
        let (mut at, mut name) = (Isometry3::identity(), frame);
        for _ in 0..20 {
            if name == base {
                return at;
            }
            let (parent, step) =
                self.frames.get(name).unwrap_or_else(|| panic!("{name}, and so {frame}, hangs nowhere"));
            (at, name) = (step * at, parent);
        }
        panic!("{frame} hangs on itself")
    }

    /// The corners of all that hangs on frames that `wanted` likes, in the base.
    fn corners(&self, base: &str, wanted: impl Fn(&str) -> bool) -> Vec<Point3<f64>> {
        let mut all = Vec::new();
        for entity in self.entities.values().filter(|entity| wanted(&entity.id)) {
            let base_from_entity = self.in_base(base, &entity.frame_id);
            for list in &entity.triangles {
                assert!(list.indices.iter().all(|i| (*i as usize) < list.points.len()));
                all.extend(list.points.iter().map(|p| base_from_entity * Point3::new(p.x, p.y, p.z)));
            }
        }
        all
    }
}

/// Shows a cell to viewers one after the other, and hands out what each of `viewers` saw until it had seen enough.
fn shown(name: &str, cell: &Cell, viewers: usize, enough: impl Fn(&Seen) -> bool) -> Vec<Seen> {
    let viewer = Viewer::listening_at(SocketAddr::from(([127, 0, 0, 1], 0)), cell, None).expect("a viewer");
    let address = viewer.front.address();
    let domain = format!("viewer-{name}-{}", std::process::id());
    let (stop, shown_domain) = (Arc::new(AtomicBool::new(false)), domain.clone());
    let stopped = stop.clone();
    let thread = std::thread::spawn(move || {
        let node = Node::open_in(&shown_domain, "twin_viewer").expect("shared memory");
        viewer.run_on(&node, &stopped)
    });
    let stopping = stop.clone();
    let robot = std::thread::spawn(move || {
        let node = Node::open_in(&domain, "robot").expect("shared memory");
        let (arm, twin) = (node.publisher(ARM_STATE).expect("a place"), node.publisher(TWIN_STATE).expect("a place"));
        let (camera, poses) =
            (node.publisher(CAMERA_INFO).expect("a place"), node.publisher(OBJECT_POSE).expect("a place"));
        while !stopping.load(Ordering::Relaxed) {
            let stamp_ns = now_ns();
            let state = ArmState { stamp_ns, dof: 7, q: REAL, ..ArmState::default() };
            arm.send(&state).expect("room");
            let object_position = [0.5, 0.1, 0.05];
            let mirrored =
                TwinState { stamp_ns, dof: 7, q: TWIN, has_object: 1, object_position, ..TwinState::default() };
            twin.send(&mirrored).expect("room");
            let intrinsics = [600.0, 601.0, 319.5, 239.5];
            let place = ([1.0, 0.2, 0.7], [1.0, 0.0, 0.0, 0.0]);
            let info = CameraInfo { stamp_ns, width: 640, height: 480, intrinsics, ..CameraInfo::default() };
            camera.send(&CameraInfo { position: place.0, wxyz: place.1, ..info }).expect("room");
            let pose = ObjectPose { stamp_ns, position: object_position, ..ObjectPose::default() };
            poses.send(&pose).expect("room");
            std::thread::sleep(Duration::from_millis(10));
        }
    });
    let look = || {
        let (mut client, mut seen, begin) = (TestClient::of(address, &TOPICS), Seen::default(), Instant::now());
        while !enough(&seen) {
            let (topic, data) = client.next();
            seen.take(&topic, &data);
            let (frames, entities) = (seen.frames.len(), seen.entities.len());
            assert!(begin.elapsed() < LONG, "{frames} frames and {entities} entities are all that is shown");
        }
        seen
    };
    let seen = (0..viewers).map(|_| look()).collect();
    stop.store(true, Ordering::Relaxed);
    robot.join().expect("it does not panic");
    thread.join().expect("it does not panic").expect("it shows to the end");
    seen
}

#[test]
fn everybody_who_comes_sees_the_robots_own_shapes_where_robot_and_twin_are() {
    let mut cell = shipped();
    cell.robot.as_mut().expect("an arm").base_frame = Some("bench".into());
    let all = shown("fr3", &cell, 2, |seen| {
        seen.frames.len() >= 19 && seen.entities.len() >= 20 && seen.camera.is_some() && seen.object.is_some()
    });
    let surface = RobotSurface::new(&cell, Hand::None).expect("a robot");
    for seen in &all {
        // Links, flange and object of both, and the camera: all in one tree whose base has the name of cell.toml.
        for frame in seen.frames.keys() {
            seen.in_base("bench", frame);
        }
        for own in ["", "twin/"] {
            for name in (1..=7).map(|link| format!("fr3_link{link}")).chain(["flange".into()]) {
                assert!(seen.frames.contains_key(&format!("{own}{name}")), "{own}{name}");
            }
        }
        let looks = [("real/", REAL, 1e-5), ("twin/", TWIN, 5e-3)];
        for (look, q, off) in looks {
            let shown = seen.corners("bench", |id| id.starts_with(look));
            let mut expected = Vec::new();
            let mut places = vec![Isometry3::identity(); surface.parts().len()];
            surface.for_each(&q, |part, at| places[part] = at);
            // In the order of the entities: by link.
            let mut order: Vec<usize> = (0..places.len()).collect();
            order.sort_by_key(|part| surface.links()[*part]);
            for part in order {
                expected.extend(surface.parts()[part].points.iter().map(|p| places[part] * p.cast::<f64>()));
            }
            assert_eq!(shown.len(), expected.len(), "{look}");
            let furthest = shown.iter().zip(&expected).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(furthest < off && shown.len() > 10_000, "{look}: {furthest} m off, {} corners", shown.len());
        }
        let camera = seen.camera.as_ref().expect("a calibration");
        assert_eq!((camera.frame_id.as_str(), camera.width, camera.k[0], camera.k[4]), ("camera", 640, 600.0, 601.0));
        assert_eq!(camera.p.len(), 12);
        assert!((seen.in_base("bench", "camera").translation.vector.x - 1.0).abs() < 1e-12);
        assert_eq!(seen.object.as_ref().expect("a pose").frame_id, "bench");
    }
}

#[test]
fn an_arm_from_a_urdf_has_its_own_links_as_frames_and_capsules_for_shapes() {
    let folder = tempfile::tempdir().expect("a folder");
    let arm: String = (1..=7)
        .map(|i| {
            let (before, axis) = (i - 1, if i % 2 == 0 { "0 1 0" } else { "0 0 1" });
            format!(
                "<link name=\"part_{i}\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" \
                 iyz=\"0\" izz=\"0.01\"/></inertial></link><joint name=\"joint_{i}\" type=\"continuous\"><parent \
                 link=\"part_{before}\"/><child link=\"part_{i}\"/><origin xyz=\"0 0 0.2\"/><axis xyz=\"{axis}\"/></joint>"
            )
        })
        .collect();
    std::fs::write(folder.path().join("arm.urdf"), format!("<robot name=\"a\"><link name=\"part_0\"/>{arm}</robot>"))
        .expect("a file");
    let text = "[robot]\nurdf = \"arm.urdf\"\n";
    let cell = Cell::parse(text, &folder.path().join("cell.toml") as &Path).expect("a cell");
    let all = shown("urdf", &cell, 1, |seen| seen.frames.len() >= 18 && seen.entities.len() >= 2);
    let model = ArmModel::from_cell(&cell).expect("an arm");
    for (name, at) in model.named_links(&REAL) {
        let shown = all[0].in_base("base", name);
        assert!(
            (shown.translation.vector - at.translation.vector).norm() < 1e-9
                && shown.rotation.angle_to(&at.rotation) < 1e-7,
            "{name}"
        );
    }
    // At rest the links of this arm are not turned against its base, although every second axis is.
    assert!(model.named_links(&[0.0; MAX_JOINTS]).all(|(_, at)| at.rotation.angle() < 1e-9));
    assert!(!all[0].entities["real/arm"].cylinders.is_empty() && !all[0].entities["twin/arm"].cylinders.is_empty());
}
