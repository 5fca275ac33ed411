//! Identification, diagnosis, and the list of effects. Answers are those of `--json`, as text; the Python side reads them.

use crate::failed;
use calibration::check::gate::{self, Allowed};
use calibration::diagnose::{Options, diagnose as diagnosed};
use inference::engine::{Call, Engine};
use calibration::identify::{Identification, Optimizer, arm, object};
use inference::interrupt::Interrupt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shared_mem::recording::{Provenance, Session};
use shared_mem::theta::Theta;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use twin::arm::ArmModel;
use twin::effects::{Role, Shape, Stage, registry};

/// How often long work looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Work beside Python's own thread, which Ctrl-C ends as in a terminal.
fn interruptible<T: Send>(py: Python<'_>, work: impl FnOnce(&Interrupt) -> anyhow::Result<T> + Send) -> PyResult<T> {
    let interrupt = Interrupt::default();
    py.detach(|| {
        let (done, answer) = channel();
        std::thread::scope(|scope| {
            let flag = interrupt.clone();
            scope.spawn(move || done.send(work(&flag)));
            loop {
                match answer.recv_timeout(LOOK) {
                    Ok(answer) => return answer.map_err(|error| failed(format!("{error:#}"))),
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(asked) = Python::attach(|py| py.check_signals()) {
                            interrupt.ask();
                            // It keeps what it has found before it ends.
                            let _cut_short = answer.recv();
                            return Err(asked);
                        }
                    }
                    Err(RecvTimeoutError::Disconnected) => return Err(failed("the work ended without an answer")),
                }
            }
        })
    })
}

/// The engine of a command, where one is given.
fn engine(
    command: Option<String>,
    limit: f64,
    session: &Session,
    interrupt: &Interrupt,
) -> anyhow::Result<Option<Arc<Engine>>> {
    let Some(command) = command else { return Ok(None) };
    let arm = ArmModel::from_cell(&session.cell)?;
    let call = Call { command, limit: Duration::try_from_secs_f64(limit)? };
    Ok(Some(Engine::start(call, &session.cell, &session.folder, arm.joint_names(), interrupt)?))
}

/// What a session says about its cell; the JSON of `calibration diagnose --json`.
#[pyfunction]
#[pyo3(signature = (session, *, cell, object, theta, seed, torques, budget, engine_command, engine_limit, as_recorded, mix))]
#[allow(clippy::too_many_arguments)] // the command's options, of which Python's side has names and defaults
pub(crate) fn diagnose(
    py: Python<'_>,
    session: PathBuf,
    cell: Option<PathBuf>,
    object: Option<String>,
    theta: Option<String>,
    seed: u64,
    torques: bool,
    budget: Option<f64>,
    engine_command: Option<String>,
    engine_limit: f64,
    as_recorded: bool,
    mix: bool,
) -> PyResult<String> {
    let theta = theta.map(|text| serde_json::from_str::<Theta>(&text)).transpose();
    let theta = theta.map_err(|error| PyValueError::new_err(format!("parameters: {error}")))?;
    interruptible(py, |interrupt| {
        let mut session = Session::open_with(&session, cell.as_deref())?;
        session.about(object.as_deref())?;
        let theta = theta.map(|theta| theta.about(&session.cell));
        let looked = gate::look(&session, Allowed { as_recorded, mix, ..Allowed::default() })?;
        let engine = engine(engine_command, engine_limit, &session, interrupt)?;
        let budget = budget.map(Duration::try_from_secs_f64).transpose()?;
        let options = Options { theta, seed, torques, budget, engine, ..Options::default() };
        let mut found = diagnosed(&session, &options, interrupt)?;
        gate::add(&mut found.warnings, &looked);
        Ok(serde_json::to_string(&found)?)
    })
}

fn optimizer(name: &str) -> PyResult<Optimizer> {
    let all = [Optimizer::LeastSquares, Optimizer::Swarm, Optimizer::Evolution];
    let known = || all.map(Optimizer::name).join(", ");
    let found = all.into_iter().find(|optimizer| optimizer.name() == name);
    found.ok_or_else(|| PyValueError::new_err(format!("optimizer {name:?} is none of {}", known())))
}

/// Stiffness and damping of every joint; the JSON of `calibration identify arm --json`.
#[pyfunction]
#[pyo3(signature = (session, *, cell, parameters, also, optimizer, budget, seed, out, engine_command, engine_limit, mix))]
#[allow(clippy::too_many_arguments)] // as above
pub(crate) fn identify_arm(
    py: Python<'_>,
    session: PathBuf,
    cell: Option<PathBuf>,
    parameters: Option<PathBuf>,
    also: Vec<String>,
    optimizer: &str,
    budget: usize,
    seed: u64,
    out: Option<PathBuf>,
    engine_command: Option<String>,
    engine_limit: f64,
    mix: bool,
) -> PyResult<String> {
    let optimizer = self::optimizer(optimizer)?;
    interruptible(py, |interrupt| {
        let opened = Session::open_with(&session, cell.as_deref())?;
        let provenance = Provenance::of(&opened);
        gate::unmixed(&provenance, mix)?;
        let engine = engine(engine_command, engine_limit, &opened, interrupt)?;
        let options = arm::Options { session, cell, object: None, also, optimizer, out, parameters, budget, seed, engine };
        text(arm::identify(&options, interrupt)?, &provenance)
    })
}

/// Friction, mass, centre of mass and tip friction; the JSON of `calibration identify object --json`.
#[pyfunction]
#[pyo3(signature = (session, *, cell, object, parameters, optimizer, budget, seed, out, engine_command, engine_limit, mix))]
#[allow(clippy::too_many_arguments)] // as above
pub(crate) fn identify_object(
    py: Python<'_>,
    session: PathBuf,
    cell: Option<PathBuf>,
    object: Option<String>,
    parameters: Option<PathBuf>,
    optimizer: &str,
    budget: usize,
    seed: u64,
    out: Option<PathBuf>,
    engine_command: Option<String>,
    engine_limit: f64,
    mix: bool,
) -> PyResult<String> {
    let optimizer = self::optimizer(optimizer)?;
    interruptible(py, |interrupt| {
        let opened = Session::open_with(&session, cell.as_deref())?;
        let provenance = Provenance::of(&opened);
        gate::unmixed(&provenance, mix)?;
        let engine = engine(engine_command, engine_limit, &opened, interrupt)?;
        let options = object::Options { session, cell, object, also: Vec::new(), optimizer, out, parameters, budget, seed, engine };
        text(object::identify(&options, interrupt)?, &provenance)
    })
}

fn text(mut found: Identification, provenance: &Provenance) -> anyhow::Result<String> {
    found.origin = provenance.to_string();
    Ok(serde_json::to_string(&found)?)
}

/// Every effect that a cell may have, as JSON.
#[pyfunction]
pub(crate) fn effects() -> String {
    let stage = |stage| match stage {
        Stage::Control => "control",
        Stage::Hit => "hit",
        Stage::Slide => "slide",
        Stage::Camera => "camera",
    };
    let all = registry().iter().map(|effect| {
        let parameters = effect.parameters.iter().map(|parameter| {
            let numbers = match parameter.shape {
                Shape::Number => serde_json::json!(1),
                Shape::PerJoint => serde_json::json!("joints"),
                Shape::Vector(count) => serde_json::json!(count),
            };
            // What has no bound has no JSON number.
            let resting = Some(parameter.resting_value()).filter(|value| value.is_finite());
            serde_json::json!({
                "name": parameter.name, "unit": parameter.unit, "numbers": numbers, "plausible": parameter.plausible,
                "resting": resting, "is_size": matches!(parameter.role, Role::Size { .. }),
            })
        });
        serde_json::json!({
            "name": effect.name, "stage": stage(effect.stage), "parameters": parameters.collect::<Vec<_>>(),
            "confusable_with": effect.confusable_with,
        })
    });
    serde_json::Value::from(all.collect::<Vec<_>>()).to_string()
}
