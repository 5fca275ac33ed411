//! `rt_bridge doctor`.

use crate::doctor::{Reach, examine};
use crate::gripper::GripperChoice;
use crate::run::ArmChoice;
use crate::wrench::WrenchChoice;
use anyhow::Result;
use clap::Args;
use shared_mem::answer;
use shared_mem::cell::Cell;
use std::path::PathBuf;
use std::process::ExitCode;

/// Explain this machine before a robot moves
///
/// Looks at kernel, scheduling, memory lock, processors, shared memory, network and devices, and measures for two seconds
/// how late a 1 kHz loop wakes. Each line is ok, a warning or a problem, with what to do about it.
///
/// Before the end it names what this machine has of the known causes of `communication_constraints_violation`, the robot's error
/// when commands miss their millisecond. The last line is `ready`, or `not ready:` and why: problems and, where --arm names a
/// robot, these causes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge doctor\n  rt_bridge doctor --arm fci://172.16.0.2 --json\n  \
    rt_bridge doctor --cell cell.toml --gripper serial:///dev/ttyUSB0 --wrench can://can0\n\n\
    JSON: findings [{check, verdict (ok, warning, problem), found, remedy, delays_commands}],\n\
    communication_constraints_violation [checks that found a cause], ready, conclusion (the last line), wake_us.\n\
    Exit code 1 when not ready.")]
pub struct DoctorArguments {
    /// A robot to reach, fci://HOST
    #[arg(long, value_name = "ARM")]
    arm: Option<ArmChoice>,
    /// A gripper to reach: serial:///dev/ttyUSB0 or fci://HOST; it is not moved
    #[arg(long, value_name = "GRIPPER")]
    gripper: Option<GripperChoice>,
    /// A force/torque sensor to reach: can://INTERFACE
    #[arg(long, value_name = "SENSOR")]
    wrench: Option<WrenchChoice>,
    /// Says which gripper and sensor they are, where they are not as shipped
    #[arg(long, value_name = "cell.toml")]
    cell: Option<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl DoctorArguments {
    pub(super) fn execute(self) -> Result<ExitCode> {
        let robot = match self.arm {
            Some(ArmChoice::Fci(host)) => Some(host),
            _ => None,
        };
        let cell = self.cell.as_deref().map(Cell::read).transpose()?.unwrap_or_default();
        let report = examine(&Reach { robot, gripper: self.gripper, wrench: self.wrench, cell });
        if self.json {
            answer::json(&report)?;
        } else {
            for finding in &report.findings {
                answer::words(finding.to_string())?;
            }
            let causes = &report.communication_constraints_violation;
            if !causes.is_empty() {
                let text = "these may end a robot's motion with communication_constraints_violation:";
                answer::words(format!("{text} {}", causes.join(", ")))?;
            }
            answer::words(&report.conclusion)?;
        }
        Ok(if report.ready { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
