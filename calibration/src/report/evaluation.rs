//! An evaluation for people: its page, and a few lines for a terminal.

use crate::page::figure::forest::{Group, Row, forest};
use crate::page::figure::scatter::{Point, scatter};
use crate::page::frame::{facts, figure, frame, unbroken};
use crate::page::picture::picture;
use crate::study::{Done, Plan};
use crate::words::share::{percent, percent_interval};
use evaluation::film::strip;
use evaluation::findings::{CellFinding, Comparison, Findings, PolicyPair, WorldCell, WorldPair};
use evaluation::policy::Source;
use evaluation::rollout::{Still, script};
use maud::{Markup, html};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

/// Failures of a policy on a task of which there is a film, and films in all.
const FILMS: [usize; 2] = [2, 24];

/// What the page is made of.
#[derive(Debug)]
pub struct Sheet<'a> {
    /// What the trials say.
    pub findings: &'a Findings,
    /// Trials that were run here.
    pub done: &'a [Done],
    /// What was to be done.
    pub plan: &'a Plan,
}

/// The findings in one sentence: how far one world predicts another, else which policy is better and by how much, else how often they
/// succeed. Where the trials cannot tell, that.
pub fn sentence(findings: &Findings) -> String {
    for pair in &findings.worlds {
        if let Some(agreement) = pair.agreement {
            let (simulated, real) = (&pair.simulated, &pair.real);
            let correlation = interval(agreement.pearson, agreement.pearson_interval);
            if agreement.pearson_interval[0] <= 0.0 {
                return format!(
                    "Too few trials to tell how far success in {simulated} predicts that in {real}: a correlation of {correlation}."
                );
            }
            return format!(
                "Success in {simulated} predicts that in {real} with a correlation of {correlation}; the mean rank violation is {:.3}.",
                agreement.rank_violation
            );
        }
    }
    if let Some(sentence) = better(findings) {
        return sentence;
    }
    let shares = || findings.cells.iter().map(|cell| cell.success);
    let (low, high) = (shares().fold(f64::INFINITY, f64::min), shares().fold(f64::NEG_INFINITY, f64::max));
    if low == high {
        return format!("Success in {} of the trials.", percent(low));
    }
    format!("Success in {} to {} of the trials, by policy, task and world.", percent(low), percent(high))
}

/// Which policy beats which by most, where there are several.
fn better(findings: &Findings) -> Option<String> {
    let of = |pair: &&PolicyPair| pair.comparison.difference.abs();
    let differs = |pair: &&PolicyPair| pair.comparison.tells_apart();
    let all = &findings.policies;
    if all.is_empty() {
        return None;
    }
    let Some(most) = all.iter().filter(differs).max_by(|a, b| of(a).total_cmp(&of(b))) else {
        return Some("Too few trials to tell the policies apart.".into());
    };
    let Comparison { difference, interval: [low, high], .. } = most.comparison;
    let [first, second] = &most.policies;
    let (winner, loser, [low, high]) =
        if difference > 0.0 { (first, second, [low, high]) } else { (second, first, [-high, -low]) };
    let several = all.iter().any(|pair| pair.world != most.world);
    let world = if several { format!(" in {}", most.world) } else { String::new() };
    let others = all.iter().filter(differs).count() - 1;
    let others = match others {
        0 => String::new(),
        1 => "; 1 other pair differs as well".to_owned(),
        count => format!("; {count} other pairs differ as well"),
    };
    let points = |share: f64| format!("{:.0}", 100.0 * share);
    Some(format!(
        "{winner} beats {loser} on {}{world} by {} [{}, {}] points{others}.",
        most.task,
        points(difference.abs()),
        points(low),
        points(high)
    ))
}

fn interval(value: f64, [low, high]: [f64; 2]) -> String {
    format!("{value:.2} [{low:.2}, {high:.2}]")
}

impl Sheet<'_> {
    pub fn page(&self) -> String {
        let found = self.findings;
        let trials: u64 = found.cells.iter().map(|cell| cell.share.trials).sum();
        let body = html! {
            p.kicker { "Evaluation of policies from the same starts" }
            h1 { (unbroken(&sentence(found))) }
            (facts(&[
                (trials.to_string(), "trials"),
                (different(found.cells.iter().map(|cell| &cell.policy)), "policies"),
                (different(found.cells.iter().map(|cell| &cell.task)), "tasks"),
                (different(found.cells.iter().map(|cell| &cell.world)), "worlds"),
            ]))
            (figure("Success", "Dot and bar: share of trials and 95 % interval (Wilson).", &shares(found)))
            (self.worlds())
            (between_policies(found))
            (self.table())
            (self.failures())
        };
        let first = format!("{} starts of each task from {} on", self.plan.episodes, self.plan.seed);
        frame("evaluation", &format!("calibration evaluate: {first}"), &body)
    }

    fn worlds(&self) -> Markup {
        let pairs = &self.findings.worlds;
        html! {
            @if !pairs.is_empty() {
                (figure(
                    "How far one world predicts another",
                    "Each dot is a policy on a task; on the dashed line both worlds agree. The correlation's interval is that of shares without the scatter of few trials.",
                    &html! {
                        div.pair { @for pair in pairs { (scatter([&pair.simulated, &pair.real], &self.points(pair))) } }
                        (agreements(pairs))
                    }
                ))
                (figure(
                    "World by world",
                    "How much more often a policy succeeds in the simulation than in the other world; and what few trials there and many simulated ones say together about success there.",
                    &html! { @for pair in pairs { (world_table(pair)) } }
                ))
            }
        }
    }

    fn points(&self, pair: &WorldPair) -> Vec<Point> {
        let of = |world: &str, cell: &WorldCell| {
            let is =
                |found: &&CellFinding| found.world == world && found.policy == cell.policy && found.task == cell.task;
            let found = self.findings.cells.iter().find(is);
            found.map_or([f64::NAN; 3], |found| [found.success, found.interval[0], found.interval[1]])
        };
        let point = |cell: &WorldCell| Point {
            name: format!("{} on {}", cell.policy, cell.task),
            x: of(&pair.simulated, cell),
            y: of(&pair.real, cell),
        };
        pair.cells.iter().map(point).collect()
    }

    fn table(&self) -> Markup {
        html! {
            details open {
                summary { "Policy by policy" }
                table {
                    tr {
                        th { "world" } th { "policy" } th { "task" } th.n { "success" } th { "" } th.n { "progress" }
                        th.n { "smallest difference seen" } th { "missing at the end, most often" }
                    }
                    @for cell in &self.findings.cells {
                        tr {
                            td { (cell.world) } td { (cell.policy) } td { (cell.task) }
                            td.n { (cell.share.successes) " of " (cell.share.trials) }
                            td.nowrap { (percent_interval(cell.success, cell.interval)) }
                            td.n { (cell.progress.map_or_else(|| "-".to_owned(), percent)) }
                            td.n { (cell.smallest_difference.map_or_else(|| "-".to_owned(), percent)) }
                            td { (self.missing(cell)) }
                        }
                    }
                }
            }
        }
    }

    /// The most frequent causes of failure of a cell.
    fn missing(&self, cell: &CellFinding) -> String {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for done in self.done.iter().filter(|done| is_of(done, cell) && !done.outcome.success) {
            let words = done.outcome.fault.iter().chain(&done.outcome.missed);
            words.for_each(|words| *counts.entry(words).or_default() += 1);
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
        let words: Vec<String> = counts.iter().take(2).map(|(words, count)| format!("{words} ({count})")).collect();
        words.join(", ")
    }

    fn failures(&self) -> Markup {
        let [of_each, most] = FILMS;
        let mut films = Vec::new();
        for cell in &self.findings.cells {
            let mut failed: Vec<&Done> =
                self.done.iter().filter(|done| is_of(done, cell) && !done.outcome.success).collect();
            failed.sort_by(|a, b| a.outcome.progress.total_cmp(&b.outcome.progress));
            films.extend(failed.into_iter().take(of_each).filter_map(|done| self.film(done)));
            if films.len() >= most {
                break;
            }
        }
        html! {
            @if !films.is_empty() {
                section {
                    h2 { "Failures" }
                    p.note { "From start to end, evenly in time; those that came least far of each policy on each task." }
                    @for (words, png) in &films { figure { (picture(png, words)) figcaption { (words) } } }
                }
            }
        }
    }

    fn film(&self, done: &Done) -> Option<(String, Vec<u8>)> {
        let world = self.plan.worlds.iter().find(|world| world.name == done.trial.world)?;
        let task = world.tasks.iter().find(|task| task.name() == done.trial.task)?;
        let policy = self.plan.policies.iter().find(|policy| policy.name == done.trial.policy)?;
        // A script does the same again; any other policy's moments were kept.
        let stills: Vec<Still> = match policy.source {
            Source::Expert { noise } => script(task, done.seed, noise, true).ok()?.stills,
            Source::Served(_) | Source::Onnx(_) => done.outcome.stills.clone(),
        };
        let mut words =
            format!("{} on {} in {}, start {}", done.trial.policy, done.trial.task, done.trial.world, done.seed);
        let missing: Vec<&str> = done.outcome.fault.iter().chain(&done.outcome.missed).map(String::as_str).collect();
        let _ = write!(words, ": {:.1} s, progress {}", done.outcome.duration_s, percent(done.outcome.progress));
        if !missing.is_empty() {
            let _ = write!(words, "; missing: {}", missing.join(", "));
        }
        Some((words, strip(task, &stills)?))
    }
}

fn is_of(done: &Done, cell: &CellFinding) -> bool {
    done.trial.world == cell.world && done.trial.policy == cell.policy && done.trial.task == cell.task
}

/// How many different names there are.
fn different<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.collect::<BTreeSet<_>>().len().to_string()
}

fn shares(found: &Findings) -> Markup {
    let mut groups: Vec<(&str, Vec<Row>)> = Vec::new();
    for cell in &found.cells {
        let row = Row {
            name: format!("{} ({})", cell.policy, cell.world),
            value: cell.success,
            interval: cell.interval,
            nominal: None,
            warning: None,
        };
        match groups.iter_mut().find(|(task, _)| *task == cell.task) {
            Some((_, rows)) => rows.push(row),
            None => groups.push((&cell.task, vec![row])),
        }
    }
    forest(&groups.into_iter().map(|(name, rows)| Group { name, unit: "%", rows }).collect::<Vec<_>>())
}

fn agreements(pairs: &[WorldPair]) -> Markup {
    html! {
        table {
            tr { th { "worlds" } th.n { "policies on tasks" } th { "correlation" } th { "mean maximum rank violation" } }
            @for pair in pairs {
                @if let Some(found) = pair.agreement {
                    tr {
                        td { (pair.simulated) ", " (pair.real) } td.n { (found.cells) }
                        td { (interval(found.pearson, found.pearson_interval)) }
                        td { (format!("{:.3} [{:.3}, {:.3}]", found.rank_violation, found.rank_violation_interval[0], found.rank_violation_interval[1])) }
                    }
                }
            }
        }
    }
}

fn difference(comparison: &Comparison) -> String {
    let [low, high] = comparison.interval.map(|end| 100.0 * end);
    format!("{:+.0} [{low:+.0}, {high:+.0}] %", 100.0 * comparison.difference)
}

fn world_table(pair: &WorldPair) -> Markup {
    html! {
        table {
            tr {
                th { (pair.simulated) " less " (pair.real) } th { "task" } th { "difference" } th.n { "p" }
                th { "success in " (pair.real) ", both together" } th.n { "worth so many trials there" }
            }
            @for cell in &pair.cells {
                tr {
                    td { (cell.policy) } td { (cell.task) } td.nowrap { (difference(&cell.comparison)) }
                    td.n { (cell.comparison.p.or(cell.kruskal_p).map_or_else(|| "-".to_owned(), chance)) }
                    td.nowrap { (cell.powered.map_or_else(|| "-".to_owned(), |powered| percent_interval(powered.value, powered.interval))) }
                    td.n { (cell.powered.map_or_else(|| "-".to_owned(), |powered| format!("{:.0}", powered.worth_trials))) }
                }
            }
        }
    }
}

fn between_policies(found: &Findings) -> Markup {
    let rows = html! {
        table {
            tr { th { "world" } th { "task" } th { "first" } th { "second" } th { "first less second" } th.n { "p (McNemar)" } }
            @for pair in &found.policies {
                tr {
                    td { (pair.world) } td { (pair.task) } td { (pair.policies[0]) } td { (pair.policies[1]) }
                    td.nowrap { (difference(&pair.comparison)) }
                    td.n { (pair.comparison.p.map_or_else(|| "-".to_owned(), chance)) }
                }
            }
        }
    };
    html! {
        @if !found.policies.is_empty() {
            (figure("Policies against each other", "Start by start where starts are shared; 95 % intervals (Newcombe).", &rows))
        }
    }
}

fn chance(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

/// The findings for a terminal.
pub fn words(found: &Findings, out: &Path) -> String {
    let mut text = String::new();
    for cell in &found.cells {
        let share = format!("{} of {}", cell.share.successes, cell.share.trials);
        let interval = percent_interval(cell.success, cell.interval);
        let _ = writeln!(text, "{:10} {:24} {:16} {share:>12}  {interval}", cell.world, cell.policy, cell.task);
    }
    for pair in &found.worlds {
        match pair.agreement {
            Some(found) => {
                let _ = writeln!(
                    text,
                    "{} and {}: correlation {}, rank violation {:.3} over {} policies on tasks",
                    pair.simulated,
                    pair.real,
                    interval(found.pearson, found.pearson_interval),
                    found.rank_violation,
                    found.cells
                );
            }
            None => {
                let _ = writeln!(
                    text,
                    "{} and {}: a correlation takes three policies on tasks that both have",
                    pair.simulated, pair.real
                );
            }
        }
    }
    let _ = write!(text, "{} Page: {}", sentence(found), out.join("report.html").display());
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{World, run};
    use evaluation::findings::findings;
    use evaluation::policy::{ActionKind, Keys};
    use evaluation::rollout::Asking;
    use evaluation::trial::Trial;
    use inference::interrupt::Interrupt;
    use inference::kept::Kept;
    use std::sync::Arc;
    use twin::task::Task;

    #[test]
    fn the_page_shows_shares_worlds_and_films_of_failures() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../twin/tasks/push_milk.toml");
        let task = Arc::new(Task::read(&file).expect("a task that ships"));
        let world = World { name: "twin".into(), tasks: vec![task], description: String::new() };
        let policies = ["expert", "worse=expert:noise=0.05", "worst=expert:noise=0.3"];
        let asking = Asking { keys: Keys::default(), actions: ActionKind::Recorded, rate: 20, chunk: None };
        let policies = policies.iter().map(|text| text.parse().expect("a policy")).collect();
        let plan = Plan { policies, worlds: vec![world], episodes: 6, seed: 0, asking };
        let done = run(&plan, Kept::nothing(), &Interrupt::default()).expect("trials");
        let again = run(&plan, Kept::nothing(), &Interrupt::default()).expect("trials");
        assert!(done == again && done.len() == 18 && done.iter().any(|done| !done.outcome.success));
        let mut trials: Vec<Trial> = done.iter().map(|done| done.trial.clone()).collect();
        let robot = trials.clone().into_iter().map(|trial| Trial { world: "robot".into(), ..trial });
        trials.extend(robot.collect::<Vec<_>>());
        let found = findings(&trials, &["robot".to_owned()], 0);
        let page = Sheet { findings: &found, done: &done, plan: &plan }.page();
        for text in ["worst", "that in robot", "data:image/png;base64,", "milk in place at groove", "McNemar"] {
            assert!(page.contains(text), "no {text}");
        }
        assert!(words(&found, Path::new("out")).contains("6 of 6"));
        let alone = Findings { worlds: Vec::new(), ..found };
        assert!(sentence(&alone).starts_with("expert beats worst on push_milk"), "{}", sentence(&alone));
        let few = Findings {
            policies: alone
                .policies
                .iter()
                .cloned()
                .map(|pair| PolicyPair { comparison: Comparison { interval: [-0.1, 0.9], ..pair.comparison }, ..pair })
                .collect(),
            ..alone
        };
        assert!(sentence(&few).starts_with("Too few trials"));
    }
}
