//! `rt_bridge doctor`: explains the machine before a robot moves, and says whether it is ready for it. Looks only; what it
//! does is a latency test of two seconds and, where a robot is named, a connection and echo requests.

mod communication;
mod echo;
mod latency;
mod machine;
mod network;
mod ports;
mod readings;
mod shared_memory;

use crate::gripper::GripperChoice;
use crate::times::Percentiles;
use crate::wrench::WrenchChoice;
use serde::Serialize;
use shared_mem::cell::Cell;
use std::fmt;
use std::path::Path;

/// How a thing stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// Works, but not as well as it could.
    Warning,
    /// Something will not work.
    Problem,
}

/// One line of the doctor's report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub check: &'static str,
    /// How it stands.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What to do about it; none where all is well.
    pub remedy: Option<String>,
    /// It is a known cause of `communication_constraints_violation`: commands may come too late for a robot.
    pub delays_commands: bool,
}

/// All of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Line by line.
    pub findings: Vec<Finding>,
    /// Checks that found a known cause of the robot's error of this name.
    pub communication_constraints_violation: Vec<&'static str>,
    /// Nothing stands in the way: no problem, and with a robot none of these causes.
    pub ready: bool,
    /// The same in a line.
    pub conclusion: String,
    /// Wake-up latency of a 1 kHz loop over two seconds [us].
    pub wake_us: Percentiles,
}

/// What is to be reached beside the machine itself.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Address of a robot.
    pub robot: Option<String>,
    pub gripper: Option<GripperChoice>,
    /// A force/torque sensor.
    pub wrench: Option<WrenchChoice>,
    /// What the laboratory knows about its cell.
    pub cell: Cell,
}

/// Looks at everything.
pub fn examine(reach: &Reach) -> Report {
    let root = Path::new("/");
    let mut findings = communication::judge(&readings::read(root, reach.robot.as_deref()));
    findings.extend(machine::examine());
    findings.extend(shared_memory::examine());
    if let Some(host) = &reach.robot {
        findings.push(network::robot(host));
    }
    findings.extend(ports::examine(root));
    findings.extend(reach.gripper.as_ref().map(|choice| ports::gripper(choice, &reach.cell)));
    findings.extend(reach.wrench.as_ref().map(|choice| ports::wrench(choice, &reach.cell)));
    let (finding, wake_us) = latency::examine();
    findings.push(finding);
    Report::new(findings, wake_us, reach.robot.is_some())
}

impl Report {
    /// Concludes. What only delays commands stands in the way of a robot, and of nothing else.
    fn new(findings: Vec<Finding>, wake_us: Percentiles, has_robot: bool) -> Self {
        let hinders = |f: &&Finding| f.verdict == Verdict::Problem || (has_robot && f.delays_commands);
        let reasons: Vec<_> = findings.iter().filter(hinders).map(|f| format!("{} ({})", f.check, f.found)).collect();
        let causes = findings.iter().filter(|f| f.delays_commands).map(|f| f.check).collect();
        let conclusion = if reasons.is_empty() { "ready".into() } else { format!("not ready: {}", reasons.join(", ")) };
        Self { communication_constraints_violation: causes, ready: reasons.is_empty(), conclusion, findings, wake_us }
    }
}

impl Finding {
    fn ok(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, verdict: Verdict::Ok, found: found.into(), remedy: None, delays_commands: false }
    }

    fn warning(check: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { verdict: Verdict::Warning, remedy: Some(remedy.into()), ..Self::ok(check, found) }
    }

    fn problem(check: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { verdict: Verdict::Problem, remedy: Some(remedy.into()), ..Self::ok(check, found) }
    }

    /// The same as a known cause of `communication_constraints_violation`.
    fn delaying(self) -> Self {
        Self { delays_commands: true, ..self }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = match self.verdict {
            Verdict::Ok => "ok     ",
            Verdict::Warning => "warning",
            Verdict::Problem => "PROBLEM",
        };
        write!(f, "{mark}  {:<14} {}", self.check, self.found)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n{:25}-> {remedy}", ""),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(findings: Vec<Finding>, has_robot: bool) -> Report {
        Report::new(findings, crate::times::Times::new().percentiles(), has_robot)
    }

    #[test]
    fn a_problem_stands_in_the_way_of_every_arm_and_shows_its_remedy() {
        for has_robot in [false, true] {
            let report = report(vec![Finding::ok("a", "fine"), Finding::problem("b", "broken", "mend it")], has_robot);
            assert_eq!((report.ready, report.conclusion.as_str()), (false, "not ready: b (broken)"));
            assert!(report.findings[1].to_string().contains("-> mend it"));
        }
    }

    #[test]
    fn what_delays_commands_stands_in_the_way_of_a_robot_only_and_what_is_not_ideal_of_nothing() {
        let findings = || {
            let late = |check, found| Finding::warning(check, found, "mend it").delaying();
            vec![late("load", "3.0"), Finding::warning("cores", "two", "take four"), late("kernel", "slow")]
        };
        let (simulated, robot) = (report(findings(), false), report(findings(), true));
        assert_eq!((simulated.ready, simulated.conclusion.as_str()), (true, "ready"));
        assert_eq!((robot.ready, robot.conclusion.as_str()), (false, "not ready: load (3.0), kernel (slow)"));
        for report in [simulated, robot] {
            assert_eq!(report.communication_constraints_violation, ["load", "kernel"]);
        }
        assert_eq!(report(vec![Finding::warning("cores", "two", "take four")], true).conclusion, "ready");
    }
}
