//! The offline half of the demo: `twin replay` under the laboratory's gains and under the true ones, and the traces to show.

use crate::interrupt::Interrupt;
use crate::processes::{Program, Running, arguments};
use anyhow::{Context as _, ensure};
use serde::Deserialize;
use shared_mem::recording::{ClipMessages, Payload, read_arm_states};
use shared_mem::topics::TWIN_STATE;
use std::collections::HashMap;
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
    /// Seconds, and twin minus robot [rad].
    pub(super) error: Vec<[f64; 2]>,
}

/// Simulates `what` (a session or a clip), under `parameters` where given, and writes the twin's clip to `out` where given.
///
/// # Errors
/// When `twin replay` fails or answers something else than agreed.
pub(super) fn replay(
    what: &Path,
    cell: &Path,
    parameters: Option<&Path>,
    out: Option<&Path>,
    interrupt: &Interrupt,
) -> anyhow::Result<Replay> {
    let mut list = arguments([&"replay", &what, &"--cell", &cell, &"--json"]);
    for (flag, path) in [("--parameters", parameters), ("--out", out)] {
        list.extend(path.into_iter().flat_map(|path| arguments([&flag, &path])));
    }
    let answer = Running::start(Program::Twin, &list, None)?.finish(PATIENCE, || interrupt.asked())?;
    serde_json::from_str(&answer).with_context(|| format!("`twin replay --json` answered {answer:?}"))
}

/// The path of `joint` in `clip`, and the twin's in `simulated`, the clip that `twin replay --out` wrote.
///
/// # Errors
/// When a file cannot be read, or the two have no moment in common.
pub(super) fn trace(clip: &Path, simulated: &Path, joint: usize) -> anyhow::Result<Trace> {
    let states = read_arm_states(clip)?;
    let mut twin = HashMap::new();
    for message in ClipMessages::open(simulated, &[TWIN_STATE.name])? {
        if let Payload::TwinState(state) = message?.payload {
            twin.insert(state.mirrors_ns, state.q[joint]);
        }
    }
    let first = states.first().map_or(0, |state| state.stamp_ns);
    let mut trace = Trace { real: Vec::new(), error: Vec::new() };
    for state in &states {
        let t = (state.stamp_ns - first) as f64 * 1e-9;
        trace.real.push([t, state.q[joint]]);
        if let Some(predicted) = twin.get(&state.stamp_ns) {
            trace.error.push([t, predicted - state.q[joint]]);
        }
    }
    ensure!(
        !trace.error.is_empty(),
        "{} and {} have no moment in common; both must come from one clip",
        clip.display(),
        simulated.display()
    );
    Ok(trace)
}
