//! `rt_bridge serve`.

use super::stop_flag;
use crate::serve::{Pace, Ports, Report, Server};
use crate::sim::hidden;
use crate::times;
use anyhow::Result;
use clap::Args;
use shared_mem::answer;
use shared_mem::cell::Cell;
use shared_mem::quantity::seconds;
use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Play a Franka robot: the simulated cell as an FR3 that speaks FCI version 10, until Ctrl-C
///
/// Point any libfranka program (0.18 to 0.21) at this address instead of a robot's. Torque, joint and Cartesian
/// interfaces, impedance, load, collision thresholds, reflexes, error recovery and the packet-loss rule act as on a robot,
/// on the twin's dynamics; the table and the object are there to be hit. A program must be set not to insist on a
/// real-time kernel where there is none (franka::RealtimeConfig::kIgnore, or --realtime ignore with rt_bridge run).
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    rt_bridge serve --cell fr3\n  \
    rt_bridge run --cell fr3 --arm fci://127.0.0.1 --realtime ignore   in another terminal, drives it\n  \
    rt_bridge serve --cell fr3 --effects hidden.toml --bind 0.0.0.0\n  \
    rt_bridge serve --cell fr3 --port 0 --lock-step --fast --json\n\n\
    JSON: cycles (the robot's milliseconds), motions, reflexes, lost_commands, clients, refused (connections), slipped\n\
    (milliseconds that began so late that the robot's clock waited), late_us (how late its thread woke).")]
pub struct ServeArguments {
    /// What the laboratory knows about its cell; `fr3` for the one that is built in. [robot] has to be an FR3
    #[arg(long, value_name = "cell.toml")]
    cell: PathBuf,
    /// Address of this machine to listen at; 0.0.0.0 for all of them
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    bind: IpAddr,
    /// Port of the arm; 0 for any that is free. Clients of libfranka know no other than 1337
    #[arg(long, default_value_t = Ports::default().arm)]
    port: u16,
    /// Port of the hand; 0 for any that is free
    #[arg(long, default_value_t = 1338)]
    hand_port: u16,
    /// No hand
    #[arg(long, conflicts_with = "hand_port")]
    no_hand: bool,
    /// Effects of the simulated cell that no client knows of
    #[arg(long, value_name = "hidden.toml")]
    effects: Option<PathBuf>,
    /// Parameters of the simulated cell that no client knows of
    #[arg(long, value_name = "theta.toml")]
    parameters: Option<PathBuf>,
    /// While a motion is commanded, let the robot's clock wait for each command instead of losing it
    #[arg(long)]
    lock_step: bool,
    /// In lock-step, do not hold to real time: as fast as the client answers
    #[arg(long, requires = "lock_step")]
    fast: bool,
    /// Stop after this many seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<Duration>,
    /// End when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl ServeArguments {
    pub(super) fn execute(self) -> Result<()> {
        let cell = Cell::read(&self.cell)?;
        let ports = Ports { bind: self.bind, arm: self.port, hand: (!self.no_hand).then_some(self.hand_port) };
        let pace = match (self.lock_step, self.fast) {
            (false, _) => Pace::RealTime,
            (true, false) => Pace::LockStep,
            (true, true) => Pace::Fast,
        };
        let hidden = hidden::read(&cell, self.parameters.as_deref(), self.effects.as_deref())?;
        let server = Server::open(&cell, hidden.as_ref(), ports, pace)?;
        let stop = stop_flag(self.parent)?;
        let hand = server.hand_address().map_or(String::new(), |hand| format!(", its hand at {hand}"));
        tracing::info!("an FR3 (FCI version 10) listens at {}{hand}", server.address()?);
        for effect in hidden.iter().flat_map(hidden::on_the_way) {
            tracing::warn!(
                "{effect} acts on positions under joint impedance alone; clients that command torques, or under Cartesian \
                 impedance, do not meet it: torque_delay acts on those"
            );
        }
        let report = server.run(&stop, self.duration);
        if self.json {
            answer::json(&report)?;
        } else {
            answer::words(in_words(&report))?;
        }
        Ok(())
    }
}

fn in_words(report: &Report) -> String {
    format!(
        "{} clients, {} connections refused, {} motions, {} reflexes, {} lost commands in {:.1} s of the robot's time\nwake-up p99.9 {}, {} cycles slipped",
        report.clients,
        report.refused,
        report.robot.motions,
        report.robot.reflexes,
        report.robot.lost_commands,
        report.robot.cycles as f64 * 1e-3,
        times::in_words(report.late_us.p999),
        report.slipped
    )
}
