//! The simulated camera: renders the simulated cell straight into shared memory, colour and depth of one moment, at the
//! pace and with the latency of the camera in cell.toml. Intrinsics and pose go out once a second.

use rtrb::Consumer;
use shared_mem::msg::image::CameraInfo;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{ImagePublisher, Node, Publisher, TransportError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;

/// How often the thread looks for the next scene that wants a picture.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How often intrinsics and pose are sent [ns].
const INFO_EVERY_NS: u64 = 1_000_000_000;

/// The topics of a camera.
pub(super) struct Ports {
    color: ImagePublisher,
    depth: ImagePublisher,
    info: Publisher<CameraInfo>,
}

/// Opens the topics, in the thread that will use them.
pub(super) fn open(camera: &SimCamera) -> Result<(Node, Ports), TransportError> {
    let node = Node::open("rt_bridge_camera")?;
    let ports = Ports {
        color: node.image_publisher(topics::CAMERA_COLOR, camera.color_bytes())?,
        depth: node.image_publisher(topics::CAMERA_DEPTH, camera.depth_bytes())?,
        info: node.publisher(topics::CAMERA_INFO)?,
    };
    Ok((node, ports))
}

/// Takes pictures until `stop`.
pub(super) fn film(
    mut camera: SimCamera,
    mut scenes: Consumer<SceneSnapshot>,
    ports: &Ports,
    latency_ns: u64,
    stop: &AtomicBool,
) -> Result<(), TransportError> {
    let mut next_info_ns = 0;
    while !stop.load(Ordering::Relaxed) {
        if now_ns() >= next_info_ns {
            ports.info.send(&CameraInfo { stamp_ns: now_ns(), ..camera.info() })?;
            next_info_ns = now_ns() + INFO_EVERY_NS;
        }
        ports.info.greet_new_readers()?;
        let (seen_ns, mut due, mut newest_ns) = (now_ns(), None, 0);
        while let Ok(scene) = scenes.pop() {
            newest_ns = scene.time_ns;
            // Behind by more than a picture: the newest due moment is the one worth showing.
            if camera.is_due(scene.time_ns) {
                due = Some(scene);
            }
        }
        if let Some(scene) = due {
            let taken_ns = seen_ns.saturating_sub(newest_ns - scene.time_ns);
            send(&mut camera, &scene, taken_ns + latency_ns, ports)?;
        }
        thread::sleep(LOOK_EVERY);
    }
    Ok(())
}

/// Renders into both topics' memory at once and hands the pictures over when the device would have.
fn send(camera: &mut SimCamera, scene: &SceneSnapshot, arrives_ns: u64, ports: &Ports) -> Result<(), TransportError> {
    let mut depth_sent = Ok(());
    ports.color.send_with(camera.color_bytes(), |color| {
        let (depth_bytes, mut color_header) = (camera.depth_bytes(), None);
        depth_sent = ports.depth.send_with(depth_bytes, |depth| {
            let [mut color_head, mut depth_head] = camera.render(scene, color, depth);
            thread::sleep(Duration::from_nanos(arrives_ns.saturating_sub(now_ns())));
            (color_head.stamp_ns, depth_head.stamp_ns) = (now_ns(), now_ns());
            color_header = Some(color_head);
            depth_head
        });
        color_header.unwrap_or_default()
    })?;
    depth_sent
}
