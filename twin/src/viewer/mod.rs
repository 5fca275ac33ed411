//! The live view: robot and twin in 3D, their joints, the gap as curves, the camera's pictures, as a Foxglove WebSocket
//! (the only code that knows the foxglove crate). It is one more reader of shared memory, in a thread of its own, so
//! the shadow's timing does not feel it. Thirty times a second it shows the newest of everything and skips the rest. The
//! robot's shapes are sent once to everybody who comes; from then on the frames move them.
//!
//! Viewers come in by a door of our own (`front`): four at a time, none from a foreign web page, and each is sent the newest
//! 32 messages at most, so that one that does not read costs some tens of megabytes until it is closed.

mod frames;
mod front;
mod newcomers;
mod objects;
mod request;
mod scene;
#[cfg(test)]
mod shown_tests;
#[cfg(test)]
mod test_client;
#[cfg(test)]
mod tests;

use crate::arm::{Joints, ModelError};
use crate::render::LiveView;
use foxglove::messages::{CameraCalibration, FrameTransforms, JointStates, RawImage, SceneUpdate, Timestamp};
use foxglove::{
    Channel, ChannelBuilder, Context, Encode, FoxgloveError, RawChannel, Schema, WebSocketServer, WebSocketServerHandle,
};
use frames::{CAMERA, Look};
use front::{Front, PATIENCE, hidden_address};
use newcomers::Newcomers;
use objects::ObjectChannels;
use scene::Scene;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Pose};
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::msg::twin::TwinGap;
use shared_mem::time::unix_offset_ns;
use shared_mem::topics::{
    ARM_STATE, CAMERA_COLOR, CAMERA_DEPTH, CAMERA_INFO, OBJECT_POSE, OBJECT_POSES, TWIN_GAP, TWIN_OBJECTS, TWIN_STATE,
};
use shared_mem::transport::{ImageSample, ImageSubscriber, Node, TransportError};
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Where the socket listens. This machine only: whoever wants it elsewhere tunnels it on purpose.
const HOST: Ipv4Addr = Ipv4Addr::LOCALHOST;
const PORT: u16 = 8765;
/// Messages that wait for a viewer; where one more comes, the oldest goes. Two pictures' worth of everything, at 0.9 MB for
/// the largest; the robot's shapes are 2 MB, once.
const BACKLOG: usize = 32;
/// Robot, twin and object.
const SCENE: &str = "/scene";
/// Time between two pictures of the scene.
const FRAME: Duration = Duration::from_millis(33);

/// The live view.
pub struct Viewer {
    front: Front,
    server: WebSocketServerHandle,
    scene: Scene,
    scenes: Channel<SceneUpdate>,
    /// Whoever has just come to the scene.
    newcomers: Arc<Newcomers>,
    real_joints: Channel<JointStates>,
    twin_joints: Channel<JointStates>,
    objects: Vec<ObjectChannels>,
    transforms: Channel<FrameTransforms>,
    calibration: Channel<CameraCalibration>,
    color: Channel<RawImage>,
    depth: Channel<RawImage>,
    /// The twin as the camera sees it, where the cell has a camera; on twin, blend, difference.
    live: Option<LiveView>,
    beside: [Channel<RawImage>; 3],
    gap: Arc<RawChannel>,
    /// Server and channels find each other through it, and do not keep it.
    _context: Arc<Context>,
}

/// The live view cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    #[error("cannot listen on {HOST}:{PORT}: {0}; stop the other viewer, or start without --viewer")]
    Listen(io::Error),
    /// The server behind it.
    #[error("the viewer's server cannot be started: {0}; start without --viewer")]
    Server(FoxgloveError),
    #[error("cannot open a channel of the viewer: {0}; start without --viewer")]
    Channel(FoxgloveError),
    /// The arm to draw.
    #[error(transparent)]
    Arm(#[from] ModelError),
    #[error(transparent)]
    Transport(#[from] TransportError),
}

impl Viewer {
    /// Opens the socket; `live` draws the twin beside the camera's pictures.
    ///
    /// # Errors
    /// [`ViewerError`] when the port is taken or cell.toml describes no arm.
    pub fn start(cell: &Cell, live: Option<LiveView>) -> Result<Self, ViewerError> {
        Self::listening_at(SocketAddr::from((HOST, PORT)), cell, live)
    }

    fn listening_at(listen: SocketAddr, cell: &Cell, live: Option<LiveView>) -> Result<Self, ViewerError> {
        let scene = Scene::new(cell)?;
        let newcomers = Arc::new(Newcomers::to(SCENE));
        let context = Context::new();
        let objects = objects::channels(&scene, |topic| channel(&context, topic));
        let server = WebSocketServer::new().name("twinalign shadow").context(&context).listener(newcomers.clone());
        let (front, server) = open(server, listen, PATIENCE)?;
        let schema = r#"{"type":"object","properties":{"joint_error":{"type":"array","items":{"type":"number"}},
            "joint_rms":{"type":"array","items":{"type":"number"}},"object_add_m":{"type":"number"},
            "object_add_s_m":{"type":"number"},"age_s":{"type":"number"},"alignments":{"type":"integer"}}}"#;
        let gap = ChannelBuilder::new(TWIN_GAP.name)
            .message_encoding("json")
            .schema(Schema::new("twinalign.Gap", "jsonschema", schema.as_bytes().to_vec()))
            .context(&context)
            .build_raw()
            .map_err(ViewerError::Channel)?;
        Ok(Self {
            front,
            server,
            scene,
            scenes: channel(&context, SCENE),
            newcomers,
            real_joints: channel(&context, "/arm/joints"),
            twin_joints: channel(&context, "/twin/joints"),
            objects,
            transforms: channel(&context, "/tf"),
            calibration: channel(&context, CAMERA_INFO.name),
            color: channel(&context, CAMERA_COLOR.name),
            depth: channel(&context, CAMERA_DEPTH.name),
            live,
            beside: ["/camera/twin", "/camera/blend", "/camera/difference"].map(|topic| channel(&context, topic)),
            gap,
            _context: context,
        })
    }

    /// Where a person points Foxglove or Lichtblick.
    pub fn address(&self) -> String {
        format!("ws://{}", self.front.address())
    }

    /// Shows what happens on shared memory until `stop` is set.
    ///
    /// # Errors
    /// [`ViewerError::Transport`] when shared memory fails.
    pub fn run(self, stop: &AtomicBool) -> Result<(), ViewerError> {
        self.run_on(&Node::open("twin_viewer")?, stop)
    }

    fn run_on(mut self, node: &Node, stop: &AtomicBool) -> Result<(), ViewerError> {
        let (arm, twin) = (node.subscriber(ARM_STATE)?, node.subscriber(TWIN_STATE)?);
        let (gaps, poses) = (node.subscriber(TWIN_GAP)?, node.subscriber(OBJECT_POSE)?);
        let (named, twins) = (node.subscriber(OBJECT_POSES)?, node.subscriber(TWIN_OBJECTS)?);
        let info = node.subscriber(CAMERA_INFO)?;
        let (color, depth) = (node.image_subscriber(CAMERA_COLOR)?, node.image_subscriber(CAMERA_DEPTH)?);
        while !stop.load(Ordering::Relaxed) {
            let time = timestamp(shared_mem::time::now_ns());
            if self.newcomers.any() {
                self.scene.shapes(time).iter().for_each(|shapes| self.scenes.log(shapes));
            }
            if let Some(state) = arm.newest()? {
                self.real_joints.log(&self.scene.joints(time, &state.q, &state.dq, &state.tau_J));
                self.show_arm(time, Look::Real, &state.q);
            }
            if let Some(state) = twin.newest()? {
                self.twin_joints.log(&self.scene.joints(time, &state.q, &state.dq, &state.tau_J));
                self.show_arm(time, Look::Twin, &state.q);
                let pose = Pose::from_parts(state.object_position, state.object_wxyz);
                self.show_object(time, Look::Twin, 0, pose.filter(|_| state.has_object == 1));
                if let Some(live) = &mut self.live {
                    live.remember(&state);
                }
            }
            if let Some(pose) = poses.newest()? {
                self.show_object(time, Look::Real, 0, pose.pose());
            }
            self.show_others(time, &named, &twins)?;
            if let Some(gap) = gaps.newest()? {
                self.gap.log(gap_json(&gap).to_string().as_bytes());
            }
            if let Some(info) = info.newest()? {
                self.show_camera(time, &info);
            }
            if let Some(sample) = newest(&depth)? {
                show_picture(time, sample.header(), &self.depth, || sample.bytes().to_vec());
            }
            if let Some(sample) = newest(&color)? {
                show_picture(time, sample.header(), &self.color, || sample.bytes().to_vec());
                self.show_beside(time, sample.header(), sample.bytes());
            }
            for ignored in node.newly_ignored() {
                tracing::warn!("{ignored}");
            }
            std::thread::sleep(FRAME);
        }
        let Self { front, server, .. } = self;
        // First: the server waits for viewers to read its farewell, and one of them may be stuck.
        drop(front);
        server.stop().wait_blocking();
        Ok(())
    }

    fn show_arm(&self, time: Timestamp, look: Look, q: &Joints) {
        self.transforms.log(&self.scene.transforms(time, look, q));
        self.scene.capsules(time, look, q).iter().for_each(|capsules| self.scenes.log(capsules));
    }

    /// The twin at the moment of a colour picture, while somebody looks. What cannot be drawn once is not tried again.
    fn show_beside(&mut self, time: Timestamp, header: &ImageHeader, bytes: &[u8]) {
        let Some(live) = &mut self.live else { return };
        if !self.beside.iter().any(Channel::has_sinks) {
            return;
        }
        match live.beside(header, bytes) {
            Ok(Some(seen)) => {
                let header = ImageHeader { stride: 3 * header.width, ..*header };
                for (channel, pixels) in self.beside.iter().zip([seen.twin, seen.blend, seen.difference]) {
                    show_picture(time, &header, channel, || pixels);
                }
            }
            Ok(None) => {}
            Err(error) => {
                tracing::warn!("no twin beside the camera's pictures: {error}");
                self.live = None;
            }
        }
    }

    /// Where the camera stands and how it projects.
    fn show_camera(&self, time: Timestamp, info: &CameraInfo) {
        if let Some(pose) = Pose::<Base, shared_mem::frames::Camera>::from_parts(info.position, info.wxyz) {
            self.transforms.log(&self.scene.frames().camera(time, &pose.isometry()));
        }
        let [fx, fy, cx, cy] = info.intrinsics;
        self.calibration.log(&CameraCalibration {
            timestamp: Some(time),
            frame_id: CAMERA.into(),
            width: info.width,
            height: info.height,
            distortion_model: "plumb_bob".into(),
            d: info.distortion.to_vec(),
            k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        });
    }
}

fn channel<T: Encode>(context: &Arc<Context>, topic: &str) -> Channel<T> {
    ChannelBuilder::new(topic).context(context).build()
}

/// Starts `server` behind a socket at `listen` that closes viewers which read nothing for `patience`.
fn open(
    server: WebSocketServer,
    listen: SocketAddr,
    patience: Duration,
) -> Result<(Front, WebSocketServerHandle), ViewerError> {
    let hidden = hidden_address();
    let server = server.bind(hidden.to_string(), 0).message_backlog_size(BACKLOG);
    let server = server.start_blocking().map_err(ViewerError::Server)?;
    let behind = SocketAddr::from((hidden, server.port()));
    let front = Front::open(listen, behind, patience).map_err(ViewerError::Listen)?;
    Ok((front, server))
}

fn newest(reader: &ImageSubscriber) -> Result<Option<ImageSample>, TransportError> {
    let mut newest = None;
    while let Some(sample) = reader.receive()? {
        newest = Some(sample);
    }
    Ok(newest)
}

/// Nothing is copied or drawn for nobody.
fn show_picture(time: Timestamp, header: &ImageHeader, channel: &Channel<RawImage>, pixels: impl FnOnce() -> Vec<u8>) {
    if !channel.has_sinks() {
        return;
    }
    channel.log(&RawImage {
        timestamp: Some(time),
        frame_id: CAMERA.into(),
        width: header.width,
        height: header.height,
        encoding: header.encoding.name().into(),
        step: header.stride,
        data: pixels().into(),
    });
}

/// NaN, which JSON lacks, becomes null.
fn gap_json(gap: &TwinGap) -> serde_json::Value {
    let dof = gap.dof as usize;
    serde_json::json!({
        "joint_error": gap.joint_error[..dof], "joint_rms": gap.joint_rms[..dof],
        "object_add_m": gap.object_add_m, "object_add_s_m": gap.object_add_s_m,
        "age_s": gap.age_ns as f64 * 1e-9, "alignments": gap.alignments,
    })
}

/// Foxglove shows Unix time.
fn timestamp(monotonic_ns: u64) -> Timestamp {
    let unix_ns = monotonic_ns.saturating_add_signed(unix_offset_ns());
    Timestamp::new((unix_ns / 1_000_000_000) as u32, (unix_ns % 1_000_000_000) as u32)
}
