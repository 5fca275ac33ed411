//! An evaluation: every policy on every task from the same starts in every world, kept trial by trial.

use evaluation::policy::{Named, Policy, Source};
use evaluation::rollout::{self, Asking, Outcome, RunError};
use evaluation::trial::Trial;
use inference::interrupt::Interrupt;
use inference::kept::{Fingerprint, Kept};
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use shared_mem::input;
use shared_mem::progress::Progress;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use twin::task::Task;

/// A world that is simulated here: its name, and the tasks in it.
#[derive(Debug, Clone)]
pub struct World {
    /// In trials and reports.
    pub name: String,
    /// The tasks, in the order in which they were given.
    pub tasks: Vec<Arc<Task>>,
    /// What makes it differ from other worlds of that name: cell.toml and theta.toml.
    pub description: String,
}

/// What is to be done.
#[derive(Debug, Clone)]
pub struct Plan {
    pub policies: Vec<Named>,
    pub worlds: Vec<World>,
    /// Starts of each task, the same for all.
    pub episodes: u64,
    /// The first of them; the others follow it.
    pub seed: u64,
    /// How policies that are no scripts are asked.
    pub asking: Asking,
}

/// A trial and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    pub trial: Trial,
    /// What came of it.
    pub outcome: Outcome,
    /// The start's seed.
    pub seed: u64,
}

/// One trial to be run.
struct Unit<'a> {
    world: &'a World,
    policy: &'a Named,
    task: &'a Arc<Task>,
    seed: u64,
}

/// Runs the plan; what `kept` knows already is not run again. Empty after an interruption: `kept` has what there was.
///
/// # Errors
/// [`RunError`] of the first trial that cannot be run.
pub fn run(plan: &Plan, kept: &Kept, interrupt: &Interrupt) -> Result<Vec<Done>, RunError> {
    let (units, files) = (plan.units(), Files::of(&plan.policies));
    let (bar, count) = (Progress::new("evaluate", units.len() as u64), AtomicU64::new(0));
    let step = |unit: &Unit<'_>| {
        bar.show(count.fetch_add(1, Ordering::Relaxed) + 1, &format!("{} on {}", unit.policy.name, unit.task.name()));
    };
    let scripted = |unit: &Unit<'_>, noise: f64| -> Result<Option<Outcome>, RunError> {
        if interrupt.asked() {
            return Ok(None);
        }
        let work = || rollout::script(unit.task, unit.seed, noise, false);
        let outcome = kept.once_if_ok(&unit.fingerprint(&plan.asking, &files), work)?;
        step(unit);
        Ok(Some(outcome))
    };
    let mut outcomes: Vec<Option<Outcome>> = units
        .par_iter()
        .map(|unit| match unit.policy.source {
            Source::Expert { noise } => scripted(unit, noise),
            Source::Served(_) | Source::Onnx(_) => Ok(None),
        })
        .collect::<Result<_, _>>()?;
    // A server thinks about one observation at a time, and ONNX Runtime about one with all cores.
    let mut open: Option<(&Source, Policy)> = None;
    for (unit, outcome) in units.iter().zip(&mut outcomes) {
        let source = &unit.policy.source;
        if matches!(source, Source::Expert { .. }) {
            continue;
        }
        let fingerprint = unit.fingerprint(&plan.asking, &files);
        if interrupt.asked() {
            break;
        }
        let known = kept.known(&fingerprint);
        let found = match known {
            Some(known) => known,
            None => {
                if open.as_ref().is_none_or(|(opened, _)| *opened != source) {
                    open = Policy::open(source)?.map(|policy| (source, policy));
                }
                let Some((_, policy)) = &mut open else { break };
                match rollout::run(unit.task, unit.seed, policy, &plan.asking, || interrupt.asked()) {
                    Ok((found, _)) => found,
                    Err(RunError::Interrupted) => break,
                    Err(error) => return Err(error),
                }
            }
        };
        kept.keep(&fingerprint, &found);
        step(unit);
        *outcome = Some(found);
    }
    if interrupt.asked() {
        return Ok(Vec::new());
    }
    let done = |(unit, outcome): (&Unit<'_>, Option<Outcome>)| outcome.map(|outcome| unit.done(outcome));
    Ok(units.iter().zip(outcomes).filter_map(done).collect())
}

/// What is in the files of policies, each as a hash: a policy that was trained on is another one under the same name.
struct Files<'a>(BTreeMap<&'a Path, String>);

impl<'a> Files<'a> {
    fn of(policies: &'a [Named]) -> Self {
        let files = policies.iter().filter_map(|policy| match &policy.source {
            Source::Onnx(path) => Some(path.as_path()),
            Source::Expert { .. } | Source::Served(_) => None,
        });
        Self(files.map(|path| (path, content(path))).collect())
    }
}

/// The hash of a network and of its weights, which torch writes into a file of their own.
fn content(path: &Path) -> String {
    let mut hasher = Sha256::new();
    let mut weights = path.as_os_str().to_owned();
    weights.push(".data");
    for file in [path, Path::new(&weights)] {
        // One that cannot be read is said when the policy is opened.
        hasher.update(input::bytes(file, input::Kind::Network).unwrap_or_default());
    }
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Plan {
    fn units(&self) -> Vec<Unit<'_>> {
        let mut units = Vec::new();
        for world in &self.worlds {
            for policy in &self.policies {
                for task in &world.tasks {
                    units.extend((0..self.episodes).map(|i| Unit {
                        world,
                        policy,
                        task,
                        seed: self.seed.wrapping_add(i),
                    }));
                }
            }
        }
        units
    }
}

impl Unit<'_> {
    /// What its outcome depends on.
    fn fingerprint(&self, asking: &Asking, files: &Files<'_>) -> Fingerprint {
        let how = match &self.policy.source {
            Source::Expert { noise } => format!("script {noise:e}"),
            Source::Served(address) => format!("{address} {asking:?}"),
            Source::Onnx(path) => format!("{} {asking:?}", files.0.get(path.as_path()).map_or("", String::as_str)),
        };
        Fingerprint::of("trial").with(&(self.task.name(), self.task.text(), &self.world.description, how, self.seed))
    }

    fn done(&self, outcome: Outcome) -> Done {
        let trial = Trial {
            world: self.world.name.clone(),
            policy: self.policy.name.clone(),
            task: self.task.name().to_owned(),
            start: Some(self.seed.to_string()),
            success: outcome.success,
            progress: Some(outcome.progress),
        };
        Done { trial, outcome, seed: self.seed }
    }
}
