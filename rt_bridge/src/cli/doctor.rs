//! `rt_bridge doctor`.

use crate::doctor::{Reach, Verdict, examine};
use crate::gripper::GripperChoice;
use crate::run::ArmChoice;
use crate::wrench::WrenchChoice;
use anyhow::{Result, bail};
use clap::Args;
use shared_mem::answer;
use shared_mem::cell::Cell;
use std::path::PathBuf;

/// Explain this machine before a robot moves
///
/// Looks at kernel, scheduling, memory lock, processors, shared memory, network and devices, and measures for two seconds
/// how late a 1 kHz loop wakes. Each line is ok, a warning or a problem, with what to do about it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  rt_bridge doctor\n  rt_bridge doctor --arm fci://172.16.0.2 --json\n  \
    rt_bridge doctor --cell cell.toml --gripper serial:///dev/ttyUSB0 --wrench can://can0\n\n\
    JSON: findings [{check, verdict (ok, warning, problem), found, remedy}], wake_us. Exit code 1 when there is a problem.")]
pub(super) struct DoctorArguments {
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
    pub(super) fn execute(self) -> Result<()> {
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
        }
        if report.verdict() == Verdict::Problem {
            let first = report.findings.iter().find(|f| f.verdict == Verdict::Problem);
            let [found, remedy] = first.map_or(["", ""], |f| [&f.found, f.remedy.as_deref().unwrap_or("")]);
            bail!("{found}; {remedy}");
        }
        Ok(())
    }
}
