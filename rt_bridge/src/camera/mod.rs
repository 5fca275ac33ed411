//! Cameras: pictures of the simulated cell, of a clip, or of a RealSense camera, onto shared memory.

#[cfg(not(feature = "realsense"))]
#[path = "absent.rs"]
mod realsense;
#[cfg(feature = "realsense")]
mod realsense;
mod replay;
mod sim;
mod source;

pub use realsense::{convert, serve};
pub use source::{CameraSource, ConvertError, Converted};

use crate::replay::ReplayClock;
use crate::starting::{self, ThreadError};
use nalgebra::Isometry3;
use rtrb::Consumer;
use shared_mem::cell::Cell;
use shared_mem::recording::{ClipMessages, ReadError};
use shared_mem::topics;
use shared_mem::transport::{Node, TransportError};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::JoinHandle;
use twin::effects::CameraEffects;
use twin::render::Drawer;
use twin::scene::SceneSnapshot;
use twin::sensors::camera::SimCamera;

/// The running simulated or replayed camera. Dropping it ends the thread.
#[derive(Debug)]
pub struct Camera {
    stop: Arc<AtomicBool>,
    handle: Option<JoinHandle<()>>,
}

/// There are no pictures to be had, or their topics are taken.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// The cell cannot be drawn.
    #[error(transparent)]
    Cell(#[from] twin::sim::SimError),
    /// The splats of its robot.
    #[error(transparent)]
    Splats(#[from] twin::render::session::ViewError),
    #[error(transparent)]
    Clip(#[from] ReadError),
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(transparent)]
    Thread(#[from] ThreadError),
}

impl Camera {
    /// Starts the simulated camera on the scenes of a simulated cell, under hidden effects; `splats`: a folder
    /// with the robot's links as it shall show them; `held`: where the arm holds it, its optical frame in the flange's.
    ///
    /// # Errors
    /// [`CameraError`] when the cell cannot be drawn or another camera runs.
    pub fn simulated(
        cell: &Cell,
        scenes: Consumer<SceneSnapshot>,
        effects: &CameraEffects,
        splats: Option<&Path>,
        held: Option<Isometry3<f64>>,
    ) -> Result<Self, CameraError> {
        let mut camera = SimCamera::new(cell)?;
        if let Some(flange_from_camera) = held {
            camera = camera.held(flange_from_camera);
        }
        camera = camera.with_effects(effects);
        if let Some(folder) = splats {
            camera = camera.with_splats(cell, folder, Drawer::Auto)?;
            camera.remarks().iter().for_each(|remark| tracing::warn!("{remark}"));
        }
        let known_ns = cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
        let latency_ns = known_ns + effects.latency_ns();
        Self::start(move |opened, stop| {
            let (_node, ports) = match sim::open(&camera) {
                Ok(open) => open,
                Err(e) => return answer(&opened, Err(e)),
            };
            answer(&opened, Ok(()));
            complain(sim::film(camera, scenes, &ports, latency_ns, stop));
        })
    }

    /// Starts to show the pictures of a clip, in step with its replayed arm.
    ///
    /// # Errors
    /// [`CameraError`] when the clip cannot be read or shared memory fails.
    pub fn replayed(clip: &Path, clock: ReplayClock) -> Result<Self, CameraError> {
        let pictures = [topics::CAMERA_COLOR.name, topics::CAMERA_DEPTH.name, topics::CAMERA_INFO.name];
        let messages = ClipMessages::open(clip, &pictures)?;
        Self::start(move |opened, stop| {
            let node = match Node::open("rt_bridge_camera") {
                Ok(node) => node,
                Err(e) => return answer(&opened, Err(e)),
            };
            answer(&opened, Ok(()));
            complain(replay::show(&node, messages, &clock, stop));
        })
    }

    /// Starts the thread and waits until it says whether its topics are open: iceoryx2's ports belong to the thread that
    /// makes them.
    fn start(
        body: impl FnOnce(Sender<Result<(), CameraError>>, &AtomicBool) + Send + 'static,
    ) -> Result<Self, CameraError> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = stop.clone();
        let handle = starting::start("camera", move |opened| body(opened, &stopping))?;
        Ok(Self { stop, handle: Some(handle) })
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(handle) = self.handle.take() {
            let _panicked = handle.join();
        }
    }
}

fn answer(opened: &Sender<Result<(), CameraError>>, outcome: Result<(), TransportError>) {
    // The starter waits for this; it cannot be gone.
    let _gone = opened.send(outcome.map_err(CameraError::from));
}

fn complain(outcome: Result<(), TransportError>) {
    if let Err(e) = outcome {
        tracing::error!("the camera stopped: {e}");
    }
}
