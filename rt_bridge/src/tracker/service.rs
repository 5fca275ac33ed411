//! The tracker's thread: pictures and joint positions from shared memory, poses onto `/object/pose` and `/object/poses`, and a
//! remark when an object is found or lost. Of several objects each has a tracker of its own; they look at the same picture one
//! after the other. It reads the topics of whatever camera runs, so it cannot tell a real one from a simulated one.

use super::{Estimate, Frame, Reason, Sight, Tracker, TrackerError, View};
use crate::pump::Notice;
use crate::sighting::{PosePorts, Sighting};
use crate::starting;
use shared_mem::cell::Cell;
use shared_mem::msg::Joints;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::event::EventLevel;
use shared_mem::msg::image::CameraInfo;
use shared_mem::msg::object::{ObjectName, ObjectPose};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{ImageSample, ImageSubscriber, Node, Subscriber, TransportError, Wake};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::JoinHandle;
use std::time::Duration;

/// Who tracks the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum TrackerChoice {
    /// The simulated cell: the true pose, with the noise of cell.toml.
    Sim,
    /// The bridge, from the camera's colour and depth.
    Rgbd,
    /// The recording's poses.
    Replay,
    /// Nobody, or another process.
    Off,
}

/// Longest sleep before looking whether to stop.
const LONGEST_SLEEP: Duration = Duration::from_millis(20);
/// Joint positions that are kept: more than a second.
const STATES: usize = 1500;
/// A camera that sends depth for so long without colour has none [ns].
const COLOR_LATE_NS: u64 = 500_000_000;
/// Frames without a pose before that is worth a remark.
const LOST_AFTER: u32 = 4;
/// Distances off by more are worth telling, as a share of them.
const WORTH_TELLING: f32 = 0.01;

/// The running tracker. Dropping it ends its thread.
#[derive(Debug)]
pub struct Service {
    stop: Arc<AtomicBool>,
    handle: Option<JoinHandle<()>>,
}

impl Drop for Service {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(handle) = self.handle.take() {
            let _panicked = handle.join();
        }
    }
}

/// Starts to track the cell's objects in the pictures on shared memory.
///
/// # Errors
/// [`TrackerError`] when there is nothing to track, shared memory fails or there is no thread for it.
pub fn serve(cell: &Cell, notices: Sender<Notice>) -> Result<Service, TrackerError> {
    let followed = Followed::all(cell)?;
    let latency_ns = cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
    let stop = Arc::new(AtomicBool::new(false));
    let stopping = stop.clone();
    let body = move |opened: Sender<Result<(), TrackerError>>| {
        // iceoryx2's ports belong to the thread that makes them.
        let ports = match Ports::open() {
            Ok(ports) => ports,
            Err(e) => {
                let _gone = opened.send(Err(e.into()));
                return;
            }
        };
        let _gone = opened.send(Ok(()));
        let mut desk = Trackers { followed, latency_ns, notices };
        if let Err(e) = desk.run(&ports, &stopping) {
            tracing::error!("the tracker stopped: {e}");
        }
    };
    let handle = starting::start("tracker", body)?;
    Ok(Service { stop, handle: Some(handle) })
}

/// What the thread reads and writes.
struct Ports {
    depth: ImageSubscriber,
    color: ImageSubscriber,
    info: Subscriber<CameraInfo>,
    states: Subscriber<ArmState>,
    wake: Wake,
    poses: PosePorts,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

impl Ports {
    fn open() -> Result<Self, TransportError> {
        let node = Node::open("rt_bridge_tracker")?;
        Ok(Self {
            depth: node.image_subscriber(topics::CAMERA_DEPTH)?,
            color: node.image_subscriber(topics::CAMERA_COLOR)?,
            info: node.subscriber(topics::CAMERA_INFO)?,
            states: node.subscriber(topics::ARM_STATE)?,
            wake: node.wake_on(topics::CAMERA_COLOR.name)?,
            poses: PosePorts::open(&node)?,
            node,
        })
    }
}

/// The trackers at work.
struct Trackers {
    followed: Vec<Followed>,
    /// From a picture to its arrival.
    latency_ns: u64,
    notices: Sender<Notice>,
}

/// One object, and who follows it.
struct Followed {
    name: ObjectName,
    tracker: Tracker,
    poses: u64,
    standing: Standing,
}

impl Followed {
    fn all(cell: &Cell) -> Result<Vec<Self>, TrackerError> {
        if let Some(object) = cell.objects.iter().find(|object| object.urdf.is_some()) {
            return Err(TrackerError::Articulated(object.name.clone().unwrap_or_default()));
        }
        let one = |number: usize| {
            let cell = Cell { in_question: number, ..cell.clone() };
            let name = cell.object_name().and_then(ObjectName::new).unwrap_or_default();
            Ok(Self { name, tracker: Tracker::new(&cell)?, poses: 0, standing: Standing::new(cell.one_of_several()) })
        };
        (0..cell.objects.len().max(1)).map(one).collect()
    }
}

impl Trackers {
    fn run(&mut self, ports: &Ports, stop: &AtomicBool) -> Result<(), TransportError> {
        let mut states: VecDeque<(u64, Joints)> = VecDeque::with_capacity(STATES);
        let (mut depth, mut color): (Option<ImageSample>, Option<ImageSample>) = (None, None);
        let mut shown = None;
        while !stop.load(Ordering::Relaxed) {
            ports.wake.wait(LONGEST_SLEEP)?;
            ports.poses.greet_new_readers()?;
            for ignored in ports.node.newly_ignored() {
                // The pump may have ended before; then nobody listens any more.
                let _gone = self.notices.send(Notice { level: EventLevel::Warning, text: ignored.to_string() });
            }
            if let Some(info) = ports.info.newest()? {
                self.place(&info, &mut shown);
            }
            while let Some(state) = ports.states.receive()? {
                if states.len() == STATES {
                    states.pop_front();
                }
                states.push_back((state.stamp_ns, state.q));
            }
            newest(&ports.depth, &mut depth)?;
            newest(&ports.color, &mut color)?;
            let Some(taken) = &depth else { continue };
            let same = color.as_ref().filter(|c| c.header().sequence == taken.header().sequence);
            if same.is_none() && now_ns() < taken.header().stamp_ns + COLOR_LATE_NS {
                continue;
            }
            let moment_ns = taken.header().stamp_ns.saturating_sub(self.latency_ns);
            self.look(ports, taken, same, joints_at(&states, moment_ns))?;
            depth = None;
        }
        Ok(())
    }

    /// Takes over what the camera says of itself, where it is news.
    fn place(&mut self, info: &CameraInfo, shown: &mut Option<CameraInfo>) {
        let info = CameraInfo { stamp_ns: 0, ..*info };
        if shown.replace(info) != Some(info) {
            match View::new(&info) {
                Some(view) => self.followed.iter_mut().for_each(|one| one.tracker.set_view(view.clone())),
                None => tracing::warn!("the tracker cannot use a camera with these intrinsics and this pose: {info:?}"),
            }
        }
    }

    fn look(
        &mut self,
        ports: &Ports,
        depth: &ImageSample,
        color: Option<&ImageSample>,
        q: Option<&Joints>,
    ) -> Result<(), TransportError> {
        let Some(view) = self.followed.first().and_then(|one| one.tracker.view()) else { return Ok(()) };
        let color = color.map(|sample| (sample.header(), sample.bytes()));
        let Some(frame) = Frame::new(view, (depth.header(), depth.bytes()), color) else { return Ok(()) };
        let (stamp_ns, device_ns) = (depth.header().stamp_ns, depth.header().device_ns);
        // Whole seconds of a device's epoch would cost the fraction its digits.
        let at = (device_ns % 1_000_000_000_000_000) as f64 * 1e-9;
        for number in 0..self.followed.len() {
            let (before, rest) = self.followed.split_at_mut(number);
            let Some((one, behind)) = rest.split_first_mut() else { continue };
            let others: Vec<&Tracker> = before.iter().chain(behind.iter()).map(|other| &other.tracker).collect();
            let sight = one.tracker.look_beside(&frame, at, q, &others);
            if let Sight::Tracked(Estimate { pose, covariance }) = sight {
                // Of the picture, not of the answer: what the search takes says nothing about when the object was there.
                let (position, wxyz) = (pose.position(), pose.wxyz());
                let pose = ObjectPose { stamp_ns, device_ns, sequence: one.poses, position, wxyz, covariance };
                ports.poses.send(&Sighting { is_first: number == 0, name: one.name, pose })?;
                one.poses += 1;
            }
            if let Some(notice) = one.standing.after(&sight, &one.tracker) {
                // The pump may have ended before; then nobody listens any more.
                let _gone = self.notices.send(notice);
            }
        }
        Ok(())
    }
}

/// Whether the object is being followed, as last reported.
#[derive(Debug)]
struct Standing {
    /// What it is called: `the object`, or of several by its name.
    object: String,
    followed: bool,
    missing: u32,
    said_lost: bool,
}

impl Standing {
    fn new(one_of_several: Option<&str>) -> Self {
        let object = one_of_several.map_or_else(|| "the object".to_owned(), |name| format!("`{name}`"));
        Self { object, followed: false, missing: 0, said_lost: false }
    }

    /// What is worth telling after a frame.
    fn after(&mut self, sight: &Sight, tracker: &Tracker) -> Option<Notice> {
        match sight {
            Sight::Tracked(estimate) => {
                self.missing = 0;
                self.said_lost = false;
                if std::mem::replace(&mut self.followed, true) {
                    return None;
                }
                Some(Notice { level: EventLevel::Info, text: found(&self.object, estimate, tracker) })
            }
            Sight::Lost(reason) => {
                self.missing += 1;
                if self.missing < LOST_AFTER || self.said_lost {
                    return None;
                }
                (self.followed, self.said_lost) = (false, true);
                Some(Notice { level: EventLevel::Warning, text: lost(&self.object, *reason) })
            }
        }
    }
}

fn found(object: &str, estimate: &Estimate, tracker: &Tracker) -> String {
    let [x, y, _] = estimate.pose.position();
    let others = tracker.equivalent_yaws(&estimate.pose);
    let mut text = format!("the tracker follows {object}, at x {x:.3} m, y {y:.3} m");
    if others.len() > 1 {
        let others: Vec<String> = others[1..].iter().map(|yaw| format!("{:.0}", yaw.to_degrees())).collect();
        text += &format!("; turned by {} degrees it would look the same", others.join(" or "));
    }
    let too_long = tracker.too_long();
    if too_long.abs() > WORTH_TELLING {
        text += &format!(
            "; distances to the table are measured {:.1} % too {}, corrected: check the camera's depth and its pose in cell.toml",
            100.0 * too_long.abs(),
            if too_long > 0.0 { "long" } else { "short" }
        );
    }
    text
}

fn lost(object: &str, reason: Reason) -> String {
    format!("the tracker has lost {object}: {reason}; poses come again by themselves once it is seen")
}

/// The joint positions nearest to a moment.
fn joints_at(states: &VecDeque<(u64, Joints)>, moment_ns: u64) -> Option<&Joints> {
    let after = states.partition_point(|(stamp, _)| *stamp < moment_ns);
    let nearest = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| states.get(i));
    nearest.min_by_key(|(stamp, _)| stamp.abs_diff(moment_ns)).map(|(_, q)| q)
}

fn newest(port: &ImageSubscriber, kept: &mut Option<ImageSample>) -> Result<(), TransportError> {
    while let Some(sample) = port.receive()? {
        *kept = Some(sample);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_joint_positions_are_taken() {
        let states: VecDeque<(u64, Joints)> = (1..4).map(|i| (i * 10, [i as f64; 8])).collect();
        let at = |moment| joints_at(&states, moment).map(|q| q[0]);
        assert_eq!([at(0), at(14), at(16), at(99)], [Some(1.0), Some(1.0), Some(2.0), Some(3.0)]);
        assert!(joints_at(&VecDeque::new(), 5).is_none());
    }
}
