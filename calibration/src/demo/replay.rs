//! The offline half of the demo: `twin replay` under the laboratory's gains and under the true ones, and the traces to show.

use anyhow::{Context as _, ensure};
use capture::processes::{Program, Running, arguments};
use inference::interrupt::Interrupt;
use serde::Deserialize;
use shared_mem::recording::{ClipMessages, Payload};
use shared_mem::time::seconds_between;
use shared_mem::topics::{ARM_STATE, TWIN_GAP, TWIN_STATE};
use std::path::Path;
use std::time::Duration;

/// How long one replay may take.
const PATIENCE: Duration = Duration::from_secs(120);

/// What `twin replay --json` answers, as far as the demo reads it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Replay {
    /// Averages over the clips.
    pub(super) mean: Mean,
}

/// Averages over the clips.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Mean {
    /// Root mean square of twin minus robot, by joint [rad].
    pub(super) joint_rms_rad: Vec<f64>,
}

/// A joint's path and what the twin made of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    /// Seconds from the clip's first row, and the measured position [rad].
    pub(super) real: Vec<[f64; 2]>,
    /// Seconds, and the twin's position [rad].
    pub(super) twin: Vec<[f64; 2]>,
    /// Seconds, and twin minus robot [rad].
    pub(super) error: Vec<[f64; 2]>,
}

/// Simulates `what` (a session or a clip), under `parameters` where given, and writes the twin's clip to `out` where given.
///
/// # Errors
/// When `twin replay` fails or answers something else than agreed.
pub(super) fn replay(
    what: &Path,
    parameters: Option<&Path>,
    out: Option<&Path>,
    interrupt: &Interrupt,
) -> anyhow::Result<Replay> {
    let mut list = arguments([&"replay", &what, &"--json"]);
    for (flag, path) in [("--parameters", parameters), ("--out", out)] {
        list.extend(path.into_iter().flat_map(|path| arguments([&flag, &path])));
    }
    let answer = Running::start(Program::Twin, &list, None)?.finish(PATIENCE, || interrupt.asked())?;
    serde_json::from_str(&answer).with_context(|| format!("`twin replay --json` answered {answer:?}"))
}

/// The path of `joint` and the twin's distance from it, out of a clip that `twin replay --out` wrote.
///
/// # Errors
/// When the file cannot be read or holds no gap.
pub(super) fn trace(simulated: &Path, joint: usize) -> anyhow::Result<Trace> {
    let mut trace = Trace { real: Vec::new(), twin: Vec::new(), error: Vec::new() };
    let mut first = None;
    let mut seconds = |stamp_ns| seconds_between(*first.get_or_insert(stamp_ns), stamp_ns);
    for message in ClipMessages::open(simulated, &[ARM_STATE.name, TWIN_STATE.name, TWIN_GAP.name])? {
        match message?.payload {
            Payload::ArmState(state) => trace.real.push([seconds(state.stamp_ns), state.q[joint]]),
            Payload::TwinState(state) => trace.twin.push([seconds(state.stamp_ns), state.q[joint]]),
            Payload::TwinGap(gap) => trace.error.push([seconds(gap.stamp_ns), gap.joint_error[joint]]),
            _ => {}
        }
    }
    ensure!(
        !trace.error.is_empty() && !trace.real.is_empty(),
        "{} holds no gap between robot and twin; build all programs from the same version",
        simulated.display()
    );
    Ok(trace)
}
