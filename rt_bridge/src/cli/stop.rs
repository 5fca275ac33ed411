//! `rt_bridge stop`.

use super::newest_state;
use anyhow::{Result, bail};
use clap::Args;
use shared_mem::answer;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::motion::{MotionChunk, MotionKind, STOP_SILENCE_NS};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::thread;
use std::time::{Duration, Instant};

/// How long a bridge may take to show its arm.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long an arm may take to brake: from the highest speeds it takes half a second.
const LONGEST: Duration = Duration::from_secs(5);
/// Less than this is standing still [rad/s].
const REST_SPEED: f64 = 1e-5;
/// An arm rests that stood still for so long: longer than all joints of a motion turn round together.
const REST: Duration = Duration::from_millis(100);
/// Pause between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Brake the arm of a running bridge now, whoever moves it
///
/// What is queued is dropped, and no other sender gets the arm: nothing begins before nobody has sent anything for half a second.
/// It is no emergency stop: a person at a robot keeps the button in the hand.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge stop\n  rt_bridge stop --json\n\n\
    JSON: q_d [rad], where the arm rests, and seconds until it did. Exit code 1 when it does not come to rest.")]
pub struct StopArguments {
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl StopArguments {
    pub(super) fn execute(self) -> Result<()> {
        let node = Node::open("rt_bridge_stop")?;
        let (states, motions) = (node.subscriber(topics::ARM_STATE)?, node.publisher(topics::ARM_MOTION)?);
        // Before anything else: whether a bridge hears it shows afterwards.
        motions.send(&MotionChunk { stamp_ns: now_ns(), kind: MotionKind::Stop, ..MotionChunk::default() })?;
        let (begin, mut still_since) = (Instant::now(), None::<Instant>);
        while begin.elapsed() < PATIENCE + LONGEST {
            let Some(state) = newest_state(&states, PATIENCE)? else {
                bail!(
                    "no bridge showed an arm within {} s: nothing was stopped; `TWINALIGN_DOMAIN` has to be that of the bridge",
                    PATIENCE.as_secs()
                );
            };
            let stands = state.dq_d.iter().all(|dq| dq.abs() < REST_SPEED);
            still_since = if stands { still_since.or_else(|| Some(Instant::now())) } else { None };
            if let Some(since) = still_since.filter(|since| since.elapsed() >= REST) {
                let seconds = since.duration_since(begin).as_secs_f64();
                let q = &state.q_d[..(state.dof as usize).min(MAX_JOINTS)];
                if self.json {
                    answer::json(&serde_json::json!({ "q_d": q, "seconds": seconds }))?;
                } else {
                    answer::words(format!(
                        "the arm rests after {seconds:.2} s; it moves again for whoever asks after {:.1} s without any sender",
                        1e-9 * STOP_SILENCE_NS as f64
                    ))?;
                }
                return Ok(());
            }
            thread::sleep(POLL_PERIOD);
        }
        bail!("the arm still moves {} s after the stop: press the button", begin.elapsed().as_secs())
    }
}
