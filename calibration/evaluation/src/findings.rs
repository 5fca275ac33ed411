//! What trials say: each policy on each task in each world with its interval, policies against each other on the same starts, and how
//! far one world predicts another.

use crate::statistics::{
    Agreement, Cell, LEVEL, Pairs, Powered, Share, agreement, difference, kruskal_wallis, powered, smallest_difference,
};
use crate::trial::Trial;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// All of it. Orders are those in which worlds, policies and tasks first occur.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// Level of all intervals.
    pub level: f64,
    /// Every policy on every task in every world.
    pub cells: Vec<CellFinding>,
    /// Policies against each other, on one task in one world.
    pub policies: Vec<PolicyPair>,
    /// Worlds against each other.
    pub worlds: Vec<WorldPair>,
}

/// A policy on a task in a world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellFinding {
    /// World.
    pub world: String,
    /// Policy.
    pub policy: String,
    /// Task.
    pub task: String,
    /// Successes of trials.
    #[serde(flatten)]
    pub share: Share,
    /// Share of successes.
    pub success: f64,
    /// Its interval (Wilson).
    pub interval: [f64; 2],
    /// Mean progress, where all trials have one.
    pub progress: Option<f64>,
    /// The smallest difference from it that as many trials of another policy would show four times in five.
    pub smallest_difference: Option<f64>,
}

/// Two policies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolicyPair {
    /// World.
    pub world: String,
    /// Task.
    pub task: String,
    /// The first and the second.
    pub policies: [String; 2],
    /// The comparison.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// Two shares: the first less the second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// How much larger the first is.
    pub difference: f64,
    /// Its interval (Newcombe; for pairs where there are pairs).
    pub interval: [f64; 2],
    /// Trials from the same starts; none where starts are not known.
    pub pairs: Option<Pairs>,
    /// McNemar's chance of so one-sided a parting, where there are pairs.
    pub p: Option<f64>,
}

/// Largest chance of such a difference by luck with which two shares count as different (a choice, that of their intervals).
const LUCK: f64 = 0.05;

impl Comparison {
    /// Whether the trials tell which share is larger: by the interval, and by McNemar's exact test where there are pairs. Of few
    /// pairs the interval alone is too sure: four of four against none has one without 0 and a chance of 1/8.
    pub fn tells_apart(&self) -> bool {
        let [low, high] = self.interval;
        (low > 0.0 || high < 0.0) && self.p.is_none_or(|p| p <= LUCK)
    }
}

/// Two worlds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorldPair {
    /// The one that predicts.
    pub simulated: String,
    /// The one that is predicted.
    pub real: String,
    /// How they agree, over policies and tasks that both have; `None` for less than three.
    pub agreement: Option<Agreement>,
    /// Policy by policy, task by task.
    pub cells: Vec<WorldCell>,
}

/// A policy on a task in two worlds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorldCell {
    /// Policy.
    pub policy: String,
    /// Task.
    pub task: String,
    /// The world that predicts less the one that is predicted.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// Kruskal and Wallis's chance that trials of both are of one distribution.
    pub kruskal_p: Option<f64>,
    /// Success in the predicted world out of its own trials and those of the other one, where starts are shared.
    pub powered: Option<Powered>,
}

type Cells<'a> = BTreeMap<[&'a str; 3], Vec<&'a Trial>>;

/// Those of a world, a policy and a task.
fn trials_of<'c>(cells: &'c Cells<'c>, key: [&'c str; 3]) -> &'c [&'c Trial] {
    cells.get(&key).map_or(&[], Vec::as_slice)
}

/// What the trials say. Worlds in `real` are predicted by all others; `seed` draws the bootstrap.
pub fn findings(trials: &[Trial], real: &[String], seed: u64) -> Findings {
    let mut cells: Cells<'_> = BTreeMap::new();
    for trial in trials {
        cells.entry([&trial.world, &trial.policy, &trial.task]).or_default().push(trial);
    }
    let worlds = in_order(trials, |trial| &trial.world);
    let policies = in_order(trials, |trial| &trial.policy);
    let tasks = in_order(trials, |trial| &trial.task);
    let mut found = Findings { level: LEVEL, cells: Vec::new(), policies: Vec::new(), worlds: Vec::new() };
    for world in &worlds {
        for task in &tasks {
            let here: Vec<(&str, &[&Trial])> = policies
                .iter()
                .map(|policy| (*policy, trials_of(&cells, [*world, *policy, *task])))
                .filter(|(_, trials)| !trials.is_empty())
                .collect();
            found.cells.extend(here.iter().map(|(policy, trials)| cell([*world, *policy, *task], trials)));
            for (i, (first, own)) in here.iter().enumerate() {
                found.policies.extend(here[i + 1..].iter().map(|(second, others)| PolicyPair {
                    world: (*world).to_owned(),
                    task: (*task).to_owned(),
                    policies: [*first, *second].map(str::to_owned),
                    comparison: compare(own, others),
                }));
            }
        }
    }
    let is_real = |world: &str| real.iter().any(|name| name == world);
    for predicted in worlds.iter().filter(|world| is_real(world)) {
        for simulated in worlds.iter().filter(|world| !is_real(world)) {
            let places: Vec<[&str; 2]> = tasks
                .iter()
                .flat_map(|task| policies.iter().map(move |policy| [*policy, *task]))
                .filter(|[policy, task]| {
                    [*simulated, *predicted].iter().all(|world| cells.contains_key(&[*world, *policy, *task]))
                })
                .collect();
            if !places.is_empty() {
                found.worlds.push(worlds_pair(&cells, [*simulated, *predicted], &places, &tasks, seed));
            }
        }
    }
    found
}

fn in_order<'a>(trials: &'a [Trial], of: impl Fn(&'a Trial) -> &'a String) -> Vec<&'a str> {
    let mut seen = BTreeSet::new();
    trials.iter().map(|trial| of(trial).as_str()).filter(|name| seen.insert(*name)).collect()
}

fn share(trials: &[&Trial]) -> Share {
    Share::of(trials.iter().map(|trial| trial.success))
}

fn cell([world, policy, task]: [&str; 3], trials: &[&Trial]) -> CellFinding {
    let share = share(trials);
    let progress: Option<Vec<f64>> = trials.iter().map(|trial| trial.progress).collect();
    CellFinding {
        world: world.to_owned(),
        policy: policy.to_owned(),
        task: task.to_owned(),
        share,
        success: share.value(),
        interval: share.interval(LEVEL),
        progress: progress.map(|all| all.iter().sum::<f64>() / all.len() as f64),
        smallest_difference: smallest_difference(share.value(), [share.trials; 2], LEVEL),
    }
}

/// Outcomes of trials from the same starts; empty where none is known on both sides.
fn paired(first: &[&Trial], second: &[&Trial]) -> Vec<[bool; 2]> {
    let by_start: BTreeMap<&str, bool> =
        second.iter().filter_map(|trial| Some((trial.start.as_deref()?, trial.success))).collect();
    let pair = |trial: &&Trial| Some([trial.success, *by_start.get(trial.start.as_deref()?)?]);
    first.iter().filter_map(pair).collect()
}

/// By pairs where every trial of the smaller side has one.
fn compare(first: &[&Trial], second: &[&Trial]) -> Comparison {
    let pairs = paired(first, second);
    if pairs.is_empty() || pairs.len() < first.len().min(second.len()) {
        let [value, low, high] = difference(share(first), share(second), LEVEL);
        return Comparison { difference: value, interval: [low, high], pairs: None, p: None };
    }
    let pairs = Pairs::of(pairs);
    let [value, low, high] = pairs.difference(LEVEL);
    Comparison { difference: value, interval: [low, high], pairs: Some(pairs), p: Some(pairs.p_value()) }
}

fn worlds_pair(
    cells: &Cells<'_>,
    [simulated, real]: [&str; 2],
    places: &[[&str; 2]],
    tasks: &[&str],
    seed: u64,
) -> WorldPair {
    let shares: Vec<Cell> = places
        .iter()
        .map(|[policy, task]| Cell {
            simulated: share(trials_of(cells, [simulated, *policy, *task])),
            real: share(trials_of(cells, [real, *policy, *task])),
        })
        .collect();
    let groups: Vec<usize> =
        places.iter().map(|[_, task]| tasks.iter().position(|name| name == task).unwrap_or_default()).collect();
    let cell = |[policy, task]: &[&str; 2]| {
        let [ours, theirs] = [simulated, real].map(|world| trials_of(cells, [world, *policy, *task]));
        let numbers =
            |trials: &[&Trial]| -> Vec<f64> { trials.iter().map(|trial| f64::from(u8::from(trial.success))).collect() };
        let pairs = paired(theirs, ours);
        let starts: BTreeSet<&str> = theirs.iter().filter_map(|trial| trial.start.as_deref()).collect();
        let elsewhere = ours.iter().filter(|trial| trial.start.as_deref().is_none_or(|start| !starts.contains(start)));
        let more: Vec<bool> = elsewhere.map(|trial| trial.success).collect();
        WorldCell {
            policy: (*policy).to_owned(),
            task: (*task).to_owned(),
            comparison: compare(ours, theirs),
            kruskal_p: kruskal_wallis(&[&numbers(ours), &numbers(theirs)]).map(|test| test.p),
            powered: (pairs.len() == theirs.len()).then(|| powered(&pairs, &more, LEVEL)).flatten(),
        }
    };
    WorldPair {
        simulated: simulated.to_owned(),
        real: real.to_owned(),
        agreement: agreement(&shares, &groups, LEVEL, seed),
        cells: places.iter().map(cell).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(world: &str, policy: &str, successes: u64, count: u64) -> Vec<Trial> {
        (0..count)
            .map(|start| Trial {
                world: world.into(),
                policy: policy.into(),
                task: "pick".into(),
                start: Some(start.to_string()),
                success: start < successes,
                progress: Some(0.5),
            })
            .collect()
    }

    #[test]
    fn four_of_four_against_none_are_too_few_and_six_of_six_are_enough() {
        let differ = |count| {
            let given = [trials("twin", "a", count, count), trials("twin", "b", 0, count)].concat();
            let comparison = findings(&given, &[], 1).policies[0].comparison;
            assert!(comparison.interval[0] > 0.0, "{comparison:?}");
            comparison.tells_apart()
        };
        assert_eq!([4, 6].map(differ), [false, true]);
    }

    #[test]
    fn the_same_starts_are_compared_one_by_one_and_worlds_by_what_both_have() {
        let all = [("a", 90, 18), ("b", 60, 11), ("c", 20, 5)];
        let mut given: Vec<Trial> = Vec::new();
        for (policy, simulated, real) in all {
            given.extend(trials("twin", policy, simulated, 100));
            given.extend(trials("robot", policy, real, 20));
        }
        given.extend(trials("twin", "alone", 1, 100));
        let found = findings(&given, &["robot".to_owned()], 1);
        assert_eq!((found.cells.len(), found.policies.len(), found.worlds.len()), (7, 9, 1));
        let first = &found.policies[0];
        assert!((first.comparison.difference - 0.3).abs() < 1e-12);
        assert_eq!(first.comparison.pairs.map(|pairs| pairs.first_only), Some(30));
        assert!(first.comparison.p.is_some_and(|p| p < 1e-6));
        let pair = &found.worlds[0];
        assert_eq!((pair.simulated.as_str(), pair.real.as_str(), pair.cells.len()), ("twin", "robot", 3));
        let agreement = pair.agreement.expect("three policies");
        assert!(agreement.pearson > 0.98 && agreement.rank_violation == 0.0);
        // The first twenty starts are those of the robot, and all of `a`'s are a success there.
        let powered = pair.cells[0].powered.expect("shared starts");
        assert!(powered.value <= 0.9 && pair.cells[0].comparison.pairs.is_some(), "{powered:?}");
        assert_eq!(found.cells[0].progress, Some(0.5));
        assert!(serde_json::to_string(&found).is_ok());
    }

    #[test]
    fn without_starts_shares_are_compared() {
        let mut given = trials("twin", "a", 8, 10);
        given.extend(trials("twin", "b", 5, 10));
        given.iter_mut().for_each(|trial| trial.start = None);
        let found = findings(&given, &[], 1);
        assert!(found.policies[0].comparison.pairs.is_none() && found.worlds.is_empty());
    }
}
