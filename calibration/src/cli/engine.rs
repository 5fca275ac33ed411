//! `--engine`: roll-outs by another program.

use inference::engine::{Call, Engine};
use inference::interrupt::Interrupt;
use shared_mem::recording::Session;
use std::sync::Arc;
use std::time::Duration;
use twin::arm::ArmModel;

/// What another program is asked for.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct EngineArguments {
    /// A program that simulates the cell in place of the twin, over the protocol of docs/engine.md: one process for each core.
    #[arg(long, value_name = "COMMAND")]
    engine: Option<String>,
    /// An engine that takes longer than this for one roll-out is given up.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 60,
        requires = "engine",
        value_parser = clap::value_parser!(u64).range(1..=86_400)
    )]
    engine_limit: u64,
}

impl EngineArguments {
    /// The engine, greeted; none where none is asked for.
    ///
    /// # Errors
    /// A cell without an arm, or an engine that does not answer.
    pub(super) fn start(&self, session: &Session, interrupt: &Interrupt) -> anyhow::Result<Option<Arc<Engine>>> {
        let Some(command) = self.engine.clone() else { return Ok(None) };
        let cell = &session.cell;
        if cell.robot.is_none() || cell.controller.is_none() {
            anyhow::bail!("--engine simulates an arm, and cell.toml has no [robot] and [controller]; add them");
        }
        let arm = ArmModel::from_cell(cell)?;
        let call = Call { command, limit: Duration::from_secs(self.engine_limit) };
        Ok(Some(Engine::start(call, cell, &session.folder, arm.joint_names(), interrupt)?))
    }
}

/// What was found with an engine; where it was given up on the way, why, and where what was found until then is.
///
/// # Errors
/// Those of the work, or the engine's.
pub(super) fn heard<T>(engine: Option<&Arc<Engine>>, found: anyhow::Result<T>) -> anyhow::Result<T> {
    match (found, engine.and_then(|engine| engine.failure())) {
        (Err(found), Some(failure)) if failure.to_string() != found.to_string() => {
            anyhow::bail!("{failure} ({found})")
        }
        (found, _) => found,
    }
}
