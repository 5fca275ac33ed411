//! All results as one: in the order of the units, without gaps, none of another question, none that was changed.

use super::SweepError;
use super::result::{Stored, result_of};
use super::unit::Unit;
use evaluation::findings::{Findings, findings};
use evaluation::trial::{self, Trial};
use serde_json::{Value, json};
use std::path::Path;

/// What is merged.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// A line of JSON for each unit: unit, seed, command, answer.
    pub answers: String,
    /// All trials, where the units are evaluations: as a table, and what they say.
    pub trials: Option<(String, Findings)>,
    pub units: usize,
    /// What they took together [s].
    pub seconds: f64,
}

/// Merges the results of a sweep.
///
/// # Errors
/// [`SweepError`] for gaps, with how many and how to fill them, for a result of another question, and for one that was changed.
pub fn merge(sweep: &Path, units: &[Unit]) -> Result<Merged, SweepError> {
    let missing: Vec<usize> =
        units.iter().filter(|unit| !result_of(sweep, unit).exists()).map(|unit| unit.unit).collect();
    if let Some(first) = missing.first() {
        let what = format!(
            "{} of {} units have no result yet, the first is unit {first}; `calibration sweep local` fills the gaps",
            missing.len(),
            units.len()
        );
        return Err(SweepError::Content { file: sweep.to_owned(), what });
    }
    let (mut answers, mut trials, mut seconds) = (String::new(), Vec::new(), 0.0);
    let mut are_evaluations = true;
    for unit in units {
        let stored = Stored::read(sweep, unit)?;
        let line = json!({ "unit": unit.unit, "seed": unit.seed, "command": unit.command, "answer": stored.answer });
        answers += &line.to_string();
        answers.push('\n');
        seconds += stored.seconds;
        match (stored.files.get("trials.csv"), are_evaluations) {
            (Some(table), true) => trials.extend(trial::parse(table, &result_of(sweep, unit))?),
            _ => are_evaluations = false,
        }
    }
    let trials = are_evaluations.then(|| together(&trials)).transpose()?;
    Ok(Merged { answers, trials, units: units.len(), seconds })
}

fn together(trials: &[Trial]) -> Result<(String, Findings), SweepError> {
    // Trials of files of other worlds stand in the evaluations of all slices.
    let mut seen = std::collections::BTreeMap::new();
    let mut kept: Vec<Trial> = Vec::new();
    for trial in trials {
        let name = (&trial.world, &trial.policy, &trial.task, &trial.start);
        match seen.get(&name) {
            Some(before) if *before == trial && trial.start.is_some() => continue,
            Some(_) if trial.start.is_some() => {
                let start = trial.start.as_deref().unwrap_or_default();
                let what = format!(
                    "{} on {} in {} from start {start} has two outcomes; give each unit starts of its own",
                    trial.policy, trial.task, trial.world
                );
                return Err(SweepError::Asked(what));
            }
            _ => {}
        }
        seen.insert(name, trial);
        kept.push(trial.clone());
    }
    let simulated = |world: &str| ["twin", "nominal"].contains(&world);
    let mut real: Vec<String> =
        kept.iter().map(|trial| trial.world.clone()).filter(|world| !simulated(world)).collect();
    real.sort();
    real.dedup();
    let found = findings(&kept, &real, 0);
    Ok((trial::table(&kept), found))
}

impl Merged {
    /// What it is, in numbers.
    pub fn summary(&self) -> Value {
        let findings = self.trials.as_ref().map(|(_, findings)| findings);
        json!({ "units": self.units, "seconds": self.seconds, "findings": findings })
    }
}
