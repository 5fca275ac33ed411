//! Pictures of a camera that a robot holds, one at each rest of the arm: colour and, where there is any, depth of the same moment.

use super::link::{Link, LinkError};
use shared_mem::interrupt::Interrupt;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::time::now_ns;
use shared_mem::topics::{CAMERA_COLOR, CAMERA_DEPTH};
use shared_mem::transport::{ImageSample, ImageSubscriber, Node, TransportError};
use std::time::{Duration, Instant};

/// Joints slower than this stand still [rad/s].
const MAX_STILL_SPEED: f64 = 5e-3;
/// They have done so for so long: what swings has come to rest.
const REST_TIME: Duration = Duration::from_millis(400);
/// How long that, or a picture, is waited for.
const PICTURE_TIMEOUT: Duration = Duration::from_secs(10);
/// How much later than the colour of a moment its depth may arrive.
const MAX_DEPTH_DELAY: Duration = Duration::from_millis(300);
/// Between two looks.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// No picture could be had.
#[derive(Debug, thiserror::Error)]
pub enum ShotError {
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Shared memory failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(
        "no pictures arrive on /camera/color; start the bridge with its camera (`rt_bridge run --camera realsense`), then start again"
    )]
    NoPictures,
    /// The arm does not come to rest.
    #[error("the arm does not come to rest within {} s; look at its gains, then start again", PICTURE_TIMEOUT.as_secs())]
    Restless,
    /// The user ended it.
    #[error("interrupted")]
    Interrupted,
}

/// Pixels without gaps between rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Pixels {
    /// What they are.
    pub header: ImageHeader,
    /// Row by row.
    pub bytes: Vec<u8>,
}

/// What was seen at one rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// The arm then.
    pub state: ArmState,
    pub colour: Pixels,
    /// Depth of the same moment.
    pub depth: Option<Pixels>,
}

/// A seat beside the camera.
#[derive(Debug)]
pub struct Shots {
    colour: ImageSubscriber,
    depth: ImageSubscriber,
    latency: Duration,
    // Declared last: ports go before the node they belong to.
    _node: Node,
}

impl Shots {
    /// Takes the seat in `domain` (default: the one this process was started in); `latency` is the camera's.
    ///
    /// # Errors
    /// [`ShotError::Transport`].
    pub fn open(domain: Option<&str>, latency: Duration) -> Result<Self, ShotError> {
        const NAME: &str = "calibration capture pictures";
        let node = domain.map_or_else(|| Node::open(NAME), |domain| Node::open_in(domain, NAME))?;
        let (colour, depth) = (node.image_subscriber(CAMERA_COLOR)?, node.image_subscriber(CAMERA_DEPTH)?);
        Ok(Self { colour, depth, latency, _node: node })
    }

    /// A picture taken once the arm is at rest, and the arm's pose.
    ///
    /// # Errors
    /// [`ShotError`] with the remedy.
    pub fn take(&self, link: &mut Link, interrupt: &Interrupt) -> Result<Shot, ShotError> {
        let state = rest(link, interrupt)?;
        let after = now_ns() + u64::try_from(self.latency.as_nanos()).unwrap_or(0);
        let began = Instant::now();
        let colour = loop {
            if let Some(picture) = newer(&self.colour, |header| header.stamp_ns > after)? {
                break picture;
            }
            // The arm's states are taken off their queue meanwhile.
            while link.next_state()?.is_some() {}
            if interrupt.asked() {
                return Err(ShotError::Interrupted);
            }
            if began.elapsed() > PICTURE_TIMEOUT {
                return Err(ShotError::NoPictures);
            }
            std::thread::sleep(POLL_INTERVAL);
        };
        let (sequence, began) = (colour.header.sequence, Instant::now());
        let mut depth = None;
        while depth.is_none() && began.elapsed() < MAX_DEPTH_DELAY {
            depth = newer(&self.depth, |header| header.sequence == sequence)?;
            std::thread::sleep(POLL_INTERVAL);
        }
        Ok(Shot { state, colour, depth })
    }
}

/// The first waiting picture that is wanted.
fn newer(of: &ImageSubscriber, wanted: impl Fn(&ImageHeader) -> bool) -> Result<Option<Pixels>, TransportError> {
    while let Some(sample) = of.receive()? {
        if wanted(sample.header()) {
            return Ok(Some(packed(&sample)));
        }
    }
    Ok(None)
}

fn packed(sample: &ImageSample) -> Pixels {
    let header = *sample.header();
    let row = header.width as usize * if header.encoding == PixelEncoding::Rgb8 { 3 } else { 2 };
    let rows = sample.bytes().chunks(header.stride.max(1) as usize).take(header.height as usize);
    let bytes = rows.flat_map(|bytes| bytes.iter().take(row).copied()).collect();
    Pixels { header: ImageHeader { stride: row as u32, ..header }, bytes }
}

/// The arm once it has stood still for a while.
fn rest(link: &mut Link, interrupt: &Interrupt) -> Result<ArmState, ShotError> {
    let began = Instant::now();
    let mut since: Option<Instant> = None;
    while began.elapsed() < PICTURE_TIMEOUT {
        if interrupt.asked() {
            return Err(ShotError::Interrupted);
        }
        let Some(state) = link.next_state()? else {
            std::thread::sleep(POLL_INTERVAL);
            continue;
        };
        let fastest = state.dq.iter().take(state.dof as usize).fold(0.0_f64, |most, dq| most.max(dq.abs()));
        if fastest > MAX_STILL_SPEED {
            since = None;
        } else if since.get_or_insert_with(Instant::now).elapsed() > REST_TIME {
            return Ok(state);
        }
    }
    Err(ShotError::Restless)
}
