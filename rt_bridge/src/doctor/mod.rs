//! `rt_bridge doctor`: explains the machine before a robot moves. Looks only; the one thing it does is a latency test of
//! two seconds.

mod latency;
mod machine;
mod network;
mod ports;
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
}

/// All of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Line by line.
    pub findings: Vec<Finding>,
    /// Wake-up latency of a 1 kHz loop over two seconds [us].
    pub wake_us: Percentiles,
}

/// What is to be reached beside the machine itself.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Address of a robot.
    pub robot: Option<String>,
    /// A gripper.
    pub gripper: Option<GripperChoice>,
    /// A force/torque sensor.
    pub wrench: Option<WrenchChoice>,
    /// What the laboratory knows about its cell.
    pub cell: Cell,
}

/// Looks at everything.
#[must_use]
pub fn examine(reach: &Reach) -> Report {
    let mut findings = machine::examine();
    findings.extend(shared_memory::examine());
    if let Some(host) = &reach.robot {
        findings.push(network::robot(host));
    }
    findings.extend(ports::examine(Path::new("/")));
    findings.extend(reach.gripper.as_ref().map(|choice| ports::gripper(choice, &reach.cell)));
    findings.extend(reach.wrench.as_ref().map(|choice| ports::wrench(choice, &reach.cell)));
    let (finding, wake_us) = latency::examine();
    findings.push(finding);
    Report { findings, wake_us }
}

impl Report {
    /// The worst of all findings.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.findings.iter().map(|f| f.verdict).max().unwrap_or(Verdict::Ok)
    }
}

impl Finding {
    fn ok(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, verdict: Verdict::Ok, found: found.into(), remedy: None }
    }

    fn warning(check: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { check, verdict: Verdict::Warning, found: found.into(), remedy: Some(remedy.into()) }
    }

    fn problem(check: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { check, verdict: Verdict::Problem, found: found.into(), remedy: Some(remedy.into()) }
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

    #[test]
    fn one_problem_makes_a_report_a_problem_and_shows_its_remedy() {
        let findings = vec![Finding::ok("a", "fine"), Finding::problem("b", "broken", "mend it")];
        let wake_us = crate::times::Times::new().percentiles();
        let report = Report { findings, wake_us };
        assert_eq!(report.verdict(), Verdict::Problem);
        assert!(report.findings[1].to_string().contains("-> mend it"));
    }
}
