//! A small policy that is trained here on demonstrations of the twin: it predicts what it has not seen, and does the task from
//! starts that it has not seen. It stands for the way of the large ones: the same numbers, the same protocol.
//!
//! Actions are found by locally weighted linear regression (Atkeson, Moore and Schaal 1997) over the nearest of all
//! demonstrated states, as by Pari et al. 2021 over nearest neighbours.

mod server;

use evaluation::policy::{ActionKind, Array, Keys, Policy, Served};
use evaluation::rollout::{Asking, run};
use nalgebra::{DMatrix, DVector};
use server::{actions, entry, serve};
use std::path::Path;
use std::sync::Arc;
use twin::task::{Numbers, ROWS_A_SECOND, Run, Signs, Task};

/// Actions a second, as demonstrations are exported.
const RATE: u32 = 20;
/// Demonstrations to learn from, and such that predictions are held against.
const LEARNT: u64 = 40;
const HELD_OUT: u64 = 10;
/// One sigma of the way points of demonstrations [m].
const NOISE: f64 = 0.003;
/// States that have a say in an action.
const NEAREST: usize = 60;
/// Weight of small slopes against the nearest states, in squares of SI units.
const RIDGE: f32 = 1e-3;
/// Actions of an answer: where demonstrations pause, one period alone would go nowhere.
const CHUNK: usize = 10;

/// A state with its surroundings, and by how much the state was to change until each of the next periods, one behind the other.
type Pair = (Vec<f32>, Vec<f32>);

/// The laptop, without cameras: numbers are all that this policy sees. (The milk box goes into its groove under the mean of all
/// actions, too.)
fn task() -> Arc<Task> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../twin/tasks/close_laptop.toml");
    let text = std::fs::read_to_string(file).expect("a task that ships");
    let (before, after) = text.split_once("[[camera]]").expect("a camera");
    let behind = after.find("\n[[").expect("more blocks");
    let folder = tempfile::tempdir().expect("room");
    let path = folder.path().join("close_laptop.toml");
    std::fs::write(&path, [before, &after[behind..]].concat()).expect("room");
    Arc::new(Task::read(&path).expect("a task"))
}

fn demonstrated(task: &Task, seeds: std::ops::Range<u64>) -> Vec<Pair> {
    let numbers = Numbers::of(task);
    let every = (ROWS_A_SECOND / RATE) as usize;
    let mut pairs = Vec::new();
    for seed in seeds {
        let how = Run { seed, duration: task.horizon(), noise: NOISE };
        let (episode, shown) = task.demonstration(&how).expect("a script");
        if !episode.success {
            continue;
        }
        let mut signs = Signs::default();
        let rows: Vec<_> = shown.moments.iter().step_by(every).collect();
        for (now, row) in rows.iter().enumerate().take(rows.len() - 1) {
            let state = numbers.state(row, &mut signs);
            let around = numbers.surroundings(row, &mut signs);
            let change = |ahead: usize| {
                let action = numbers.action(rows[(now + ahead).min(rows.len() - 1)], &signs);
                action.into_iter().zip(&state).map(|(to, from)| to - from).collect::<Vec<f32>>()
            };
            let changes = (1..=CHUNK).flat_map(change).collect();
            pairs.push(([&state[..], &around].concat(), changes));
        }
    }
    pairs
}

/// What is to change, by locally weighted regression at a state over demonstrated ones.
fn regression(pairs: &[Pair], seen: &[f32]) -> Vec<f32> {
    let distance = |pair: &Pair| pair.0.iter().zip(seen).map(|(x, y)| (x - y).powi(2)).sum::<f32>();
    let mut near: Vec<(f32, &Pair)> = pairs.iter().map(|pair| (distance(pair), pair)).collect();
    near.select_nth_unstable_by(NEAREST, |a, b| a.0.total_cmp(&b.0));
    let farthest = near[NEAREST].0.sqrt();
    near.truncate(NEAREST);
    let weight = |squared: f32| (1.0 - (squared.sqrt() / farthest).powi(3)).powi(3).max(0.0).sqrt();
    let (width, answers) = (1 + seen.len(), near[0].1.1.len());
    let design = DMatrix::from_fn(NEAREST, width, |row, k| {
        let (squared, pair) = near[row];
        weight(squared) * if k == 0 { 1.0 } else { pair.0[k - 1] - seen[k - 1] }
    });
    let right = DMatrix::from_fn(NEAREST, answers, |row, k| weight(near[row].0) * near[row].1.1[k]);
    let ridge = DVector::from_fn(width, |k, _| if k == 0 { 0.0 } else { RIDGE });
    let normal = design.tr_mul(&design) + DMatrix::from_diagonal(&ridge);
    let slopes = normal.cholesky().expect("a ridge").solve(&design.tr_mul(&right));
    slopes.row(0).iter().copied().collect()
}

/// Mean square of what is left of changes of the state.
fn left(pairs: &[Pair], predicted: impl Fn(&[f32]) -> Vec<f32>) -> f32 {
    let squares = |(seen, change): &Pair| -> f32 {
        predicted(seen).iter().zip(change).map(|(ours, its)| (ours - its).powi(2)).sum()
    };
    pairs.iter().map(squares).sum::<f32>() / pairs.len() as f32
}

/// How many of some episodes from unseen starts succeed, of a policy that says how the state is to change.
fn successes(task: &Arc<Task>, policy: impl Fn(&[f32]) -> Vec<f32> + Send + Sync + 'static) -> usize {
    let policy = Arc::new(policy);
    let asking =
        Asking { keys: Keys::read(&[], task).expect("keys"), actions: ActionKind::Recorded, rate: RATE, chunk: None };
    let episode = |seed: &u64| {
        let policy = Arc::clone(&policy);
        let address = serve(move |observation| {
            let numbers = |key| Array::read(entry(observation, key)).expect("an array").values;
            let state = numbers("observation/state");
            let change = policy(&[state.clone(), numbers("observation/environment_state")].concat());
            let action = |by: &[f32]| state.iter().zip(by).map(|(from, by)| from + by).collect();
            Some(actions(&change.chunks(state.len()).map(action).collect::<Vec<Vec<f32>>>()))
        });
        let mut served = Policy::Served(Served::connect(&address).expect("a policy"));
        run(task, *seed, &mut served, &asking, || false).expect("an episode").0.success
    };
    (1000..1012).filter(episode).count()
}

#[test]
fn a_policy_trained_on_demonstrations_predicts_held_out_ones_and_does_the_task_from_unseen_starts() {
    let task = task();
    let (learnt, held_out) = (demonstrated(&task, 0..LEARNT), demonstrated(&task, LEARNT..LEARNT + HELD_OUT));
    let count = learnt.len() as f32;
    let mean: Vec<f32> =
        (0..learnt[0].1.len()).map(|k| learnt.iter().map(|(_, change)| change[k]).sum::<f32>() / count).collect();
    let by_mean = left(&held_out, |_| mean.clone());
    let by_trained = left(&held_out, |seen| regression(&learnt, seen));
    // Both margins were set before the first run.
    assert!(by_trained < 0.2 * by_mean, "{by_trained} of {by_mean} is left");
    let succeeded = successes(&task, move |seen| regression(&learnt, seen));
    assert!(succeeded >= 9, "{succeeded} of 12");
    assert_eq!(successes(&task, move |_| mean.clone()), 0);
}
