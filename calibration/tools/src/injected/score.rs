//! How often a fault is found where it is, and where it is not.

use super::damage::inject;
use super::faults::Injected;
use super::sessions::Clean;
use calibration::check::check_clips;
use calibration::check::remark::Fault;
use std::collections::BTreeMap;

/// One session with a fault, or without.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trial {
    /// The fault that was put in; none in a clean session.
    pub fault: Option<Injected>,
    /// Whether a remark of its family was made; in a clean session, whether none was.
    pub right: bool,
    /// Other remarks that were made.
    pub beside: Vec<Fault>,
}

impl Trial {
    /// Looks at a clean session.
    pub fn clean(session: &Clean) -> Self {
        let remarks = check_clips(&session.cell, &session.clips).remarks;
        let beside: Vec<Fault> = remarks.iter().map(|remark| remark.fault).collect();
        Self { fault: None, right: beside.is_empty(), beside }
    }

    /// Puts a fault into a clean session and looks at it; `None` where the session has nothing that could have the fault.
    pub fn with(fault: Injected, session: &Clean, seed: u64) -> Option<Self> {
        let damaged = inject(fault, session, seed)?;
        let remarks = check_clips(&damaged.cell, &damaged.clips).remarks;
        let (own, beside): (Vec<Fault>, Vec<Fault>) =
            remarks.iter().map(|remark| remark.fault).partition(|found| fault.is_found_as(*found));
        Some(Self { fault: Some(fault), right: !own.is_empty(), beside })
    }
}

/// A count of successes with its 95 % interval after Wilson (1927).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    pub right: usize,
    pub all: usize,
}

impl Score {
    /// The interval of the rate.
    pub fn interval(self) -> [f64; 2] {
        if self.all == 0 {
            return [0.0, 1.0];
        }
        let (n, z2) = (self.all as f64, 1.959_964_f64.powi(2));
        let p = self.right as f64 / n;
        let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = (z2 * (p * (1.0 - p) / n + z2 / (4.0 * n * n))).sqrt() / (1.0 + z2 / n);
        [(middle - half).max(0.0), (middle + half).min(1.0)]
    }

    pub fn rate(self) -> f64 {
        self.right as f64 / self.all.max(1) as f64
    }
}

/// A line for each fault and one for the clean sessions.
pub fn table(trials: &[Trial]) -> String {
    let mut by_fault: BTreeMap<Option<Injected>, Vec<&Trial>> = BTreeMap::new();
    for trial in trials {
        by_fault.entry(trial.fault).or_default().push(trial);
    }
    let line = |(fault, trials): (&Option<Injected>, &Vec<&Trial>)| {
        let score = Score { right: trials.iter().filter(|trial| trial.right).count(), all: trials.len() };
        let name = fault.map_or("clean: no remark", Injected::name);
        let [lo, hi] = score.interval().map(|rate| 100.0 * rate);
        let mut beside: BTreeMap<&str, usize> = BTreeMap::new();
        trials.iter().flat_map(|trial| &trial.beside).for_each(|fault| *beside.entry(fault.key()).or_default() += 1);
        let beside: Vec<String> = beside.iter().map(|(key, count)| format!("{key} {count}")).collect();
        format!(
            "{name:<44} {:>4} of {:<4} {:>5.1} % [{lo:.1}, {hi:.1}]   {}",
            score.right,
            score.all,
            100.0 * score.rate(),
            beside.join(", ")
        )
        .trim_end()
        .to_owned()
    };
    let lines: Vec<String> = by_fault.iter().map(line).collect();
    format!("{:<44} found         rate [95 % interval]   also said\n{}", "fault", lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        let [lo, hi] = Score { right: 8, all: 10 }.interval();
        assert!((lo - 0.490).abs() < 1e-3 && (hi - 0.943).abs() < 1e-3, "{lo} {hi}");
        assert_eq!(Score { right: 0, all: 0 }.interval(), [0.0, 1.0]);
    }
}
