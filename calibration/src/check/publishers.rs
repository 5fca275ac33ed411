//! Two publishers on one topic: positions that jump away and back, row by row or now and then, to one side, of several joints at
//! once and for seconds. An encoder's coarse steps, a command that jumps between two values and noise do some of that, not all.

use super::columns::{Columns, Signals};
use super::limits::{
    JUMP_BACK, JUMP_BACK_ROWS, JUMP_QUARTILES, JUMP_SHARE, JUMP_STEPS, JUMPS, SAME_SIDE, SPIKE, SPIKE_MOTION,
    TURN_ROWS, TURNS_A_SECOND, TURNS_ALIKE, TURNS_LAST,
};
use super::remark::{Fault, Remark, Severity, Size};
use super::statistics::{median, quantile};

/// Joints of one publisher move so far at least from row to row for a jump to be counted [rad].
const LEAST_JUMP: f64 = 5e-4;
/// Rows apart over which rows of one publisher are looked for among another's.
const APART: std::ops::RangeInclusive<usize> = 1..=4;
/// Steps below this are of the arithmetic and not of an encoder [rad].
const ROUNDING: f64 = 1e-9;

/// A position that is away for some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Jump {
    /// The first row that is away.
    row: usize,
    /// How many rows it is away.
    rows: usize,
    /// By how much [rad].
    by: f64,
}

/// Remarks on both topics.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    clip.topics().into_iter().filter_map(|(topic, signals)| topic_remark(clip, topic, signals)).collect()
}

fn topic_remark(clip: &Columns, topic: &str, signals: &Signals) -> Option<Remark> {
    let found: Vec<Vec<Jump>> = signals.q.iter().map(|q| jumps(q)).collect();
    let (joint, jumps) = found.iter().enumerate().max_by_key(|(_, jumps)| jumps.len())?;
    let share = jumps.len() as f64 / signals.len() as f64;
    if jumps.len() < JUMPS || share < JUMP_SHARE || !of_two_arms(jumps) {
        return spikes(clip, topic, signals, &found);
    }
    let others = found.iter().enumerate().filter(|(other, _)| *other != joint).map(|(_, jumps)| jumps.as_slice());
    let whole = last(jumps, &signals.t) && (signals.dof() == 1 || at_once(jumps, others));
    let sizes: Vec<f64> = jumps.iter().map(|jump| jump.by.abs()).collect();
    let (value, [lo, hi]) = (median(sizes.clone()), super::statistics::range(&sizes)?);
    let what = format!(
        "the {topic} position of {} jumps away and back {} times, by {:.1} mrad",
        clip.joint(joint),
        jumps.len(),
        value * 1e3
    );
    let size = Size { value, interval: [lo, hi], unit: "rad" };
    let remark = |what: String| {
        Remark::new(Fault::TwoPublishers, &clip.file, topic, what).at(signals.t[jumps[0].row]).sized(size)
    };
    Some(if whole {
        remark(format!("{what}: rows of two publishers on one topic"))
            .mended_by("see with `ros2 topic info --verbose` who publishes there, and record one of them only")
    } else {
        // Rows of one joint, or of a moment: they cost what they are.
        remark(format!("{what}: single rows that were not measured, or a second publisher for a moment"))
            .mended_by("look at those rows; with `ros2 topic info --verbose` at who publishes there")
            .weighed(Severity::Note)
    })
}

/// Single rows that lie where no joint goes: they were not measured.
fn spikes(clip: &Columns, topic: &str, signals: &Signals, found: &[Vec<Jump>]) -> Option<Remark> {
    let far = |(joint, jumps): (usize, &Vec<Jump>)| {
        let mut steps: Vec<f64> = signals.q[joint].windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let least = SPIKE.max(SPIKE_MOTION * quantile(&mut steps, 0.99));
        let far = jumps.iter().filter(move |jump| jump.rows <= TURN_ROWS && jump.by.abs() > least);
        far.map(move |jump| (joint, *jump)).collect::<Vec<_>>()
    };
    let all: Vec<(usize, Jump)> = found.iter().enumerate().flat_map(far).collect();
    let (joint, first) = all.iter().min_by_key(|(_, jump)| jump.row).copied()?;
    let mut rows: Vec<usize> = all.iter().map(|(_, jump)| jump.row).collect();
    rows.sort_unstable();
    rows.dedup();
    let sizes: Vec<f64> = all.iter().map(|(_, jump)| jump.by.abs()).collect();
    let what = format!(
        "the {topic} positions jump away and back in {} of {} rows, {} first, by {:.2} rad: they were not measured there",
        rows.len(),
        signals.len(),
        clip.joint(joint),
        first.by.abs()
    );
    Some(
        Remark::new(Fault::UnusableRows, &clip.file, topic, what)
            .at(signals.t[first.row])
            .sized(Size { value: median(sizes.clone()), interval: super::statistics::range(&sizes)?, unit: "rad" })
            .mended_by("take those rows out of the log, and look at the driver if this repeats"),
    )
}

/// Whether jumps are those of another arm's rows: short ones, and one after the other to the same side.
fn of_two_arms(jumps: &[Jump]) -> bool {
    let share = |count: usize, all: usize| count as f64 / all.max(1) as f64;
    let short = jumps.iter().filter(|jump| jump.rows <= TURN_ROWS).count();
    let same_side = jumps.windows(2).filter(|pair| pair[0].by.signum() == pair[1].by.signum()).count();
    share(short, jumps.len()) >= TURNS_ALIKE && share(same_side, jumps.len() - 1) >= SAME_SIDE
}

/// Whether there are jumps in seconds one after the other.
fn last(jumps: &[Jump], t: &[f64]) -> bool {
    let second = |jump: &Jump| t[jump.row].floor();
    let mut full: Vec<f64> = Vec::new();
    for same in jumps.chunk_by(|a, b| second(a) == second(b)).filter(|same| same.len() >= TURNS_A_SECOND) {
        full.push(second(&same[0]));
    }
    let runs = full.chunk_by(|a, b| b - a <= 1.0);
    runs.map(<[f64]>::len).max().is_some_and(|seconds| seconds >= TURNS_LAST)
}

/// Whether another joint jumps in half of the same rows.
fn at_once<'a>(jumps: &[Jump], mut others: impl Iterator<Item = &'a [Jump]>) -> bool {
    let both = |other: &[Jump]| {
        jumps.iter().filter(|jump| other.binary_search_by_key(&jump.row, |other| other.row).is_ok()).count()
    };
    others.any(|other| 2 * both(other) >= jumps.len())
}

/// Rows where a position jumps away and is back within a few rows.
fn jumps(q: &[f64]) -> Vec<Jump> {
    if q.len() < 20 {
        return Vec::new();
    }
    // Of rows that alternate those two apart are of one publisher.
    let quartile = |apart: usize| {
        let mut changes: Vec<f64> = (apart..q.len()).map(|i| (q[i] - q[i - apart]).abs()).collect();
        quantile(&mut changes, 0.25)
    };
    let usual = APART.map(quartile).fold(f64::INFINITY, f64::min);
    let changes = APART.flat_map(|apart| (apart..q.len()).map(move |i| (q[i] - q[i - apart]).abs()));
    let encoder = changes.filter(|change| *change > ROUNDING).fold(f64::INFINITY, f64::min);
    let encoder = if encoder.is_finite() { encoder } else { 0.0 };
    let least = (JUMP_QUARTILES * usual).max(JUMP_STEPS * encoder).max(LEAST_JUMP);
    let step = |i: usize| q[i] - q[i - 1];
    let mut found = Vec::new();
    let mut i = 1;
    while i < q.len() {
        let there = step(i);
        if there.abs() > least {
            let small = |k: usize| step(k).abs() < JUMP_BACK * there.abs();
            let returns = |k: usize| (step(k) + there).abs() < JUMP_BACK * there.abs();
            let back = (i + 1..(i + 1 + JUMP_BACK_ROWS).min(q.len())).find(|k| !small(*k)).filter(|k| returns(*k));
            // An oscillation comes and goes by steps alike, another publisher at once.
            if let Some(back) = back.filter(|_| i == 1 || small(i - 1) || returns(i - 1)) {
                found.push(Jump { row: i, rows: back - i, by: there });
                i = back;
            }
        }
        i += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;
    use shared_mem::cell::ClipKind;

    fn noise(i: usize) -> f64 {
        1e-5 * ((i as f64 * 78.233).sin() * 43_758.545).fract()
    }

    fn smooth(i: usize) -> f64 {
        0.3 * (i as f64 * 1e-3).sin() + noise(i)
    }

    /// Two joints that do the same, a row a millisecond.
    /// The first remark on two joints that are the same.
    fn remark_on(q: impl Fn(usize) -> f64) -> Option<Remark> {
        remark_on_joints(|_, row| q(row))
    }

    /// The same of the position of each joint in each row.
    fn remark_on_joints(q: impl Fn(usize, usize) -> f64) -> Option<Remark> {
        let rows = 0..5000;
        let column = |joint: usize| -> Vec<f64> { rows.clone().map(|row| q(joint, row)).collect() };
        let columns = vec![column(0), column(1)];
        let measured = Signals {
            t: rows.map(|i| i as f64 * 1e-3).collect(),
            q: columns,
            noise: vec![0.0; 2],
            ..Signals::default()
        };
        let clip = Columns {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            measured,
            desired: Signals::default(),
            pose_t: Vec::new(),
            object: shared_mem::recording::ObjectSeries::default(),
            names: Vec::new(),
            noticed: Vec::new(),
            damage: None,
        };
        remarks(&clip).into_iter().next()
    }

    #[test]
    fn a_second_publisher_is_told_from_motion_noise_and_single_spoilt_rows() {
        let plain: Vec<f64> = (0..2000).map(smooth).collect();
        assert_eq!(jumps(&plain).len(), 0);
        let every_second: Vec<f64> = (0..2000).map(|i| smooth(i) + if i % 2 == 0 { 0.01 } else { 0.0 }).collect();
        assert!(jumps(&every_second).len() > 900, "{}", jumps(&every_second).len());
        let now_and_then: Vec<f64> = (0..2000).map(|i| smooth(i) + if i % 37 < 2 { 0.05 } else { 0.0 }).collect();
        assert!((50..56).contains(&jumps(&now_and_then).len()), "{}", jumps(&now_and_then).len());
        let step: Vec<f64> = (0..2000).map(|i| smooth(i) + if i > 900 { 0.2 } else { 0.0 }).collect();
        assert_eq!(jumps(&step).len(), 0, "a step that stays is no second publisher");
    }

    #[test]
    fn two_publishers_take_turns_for_seconds_and_a_moment_of_them_is_a_note() {
        for every in [2, 37] {
            let found = remark_on(|i| smooth(i) + if i % every == 0 { 0.05 } else { 0.0 }).expect("a remark");
            assert_eq!(found.severity, Severity::Wrong, "{every}: {found}");
        }
        let moment = remark_on(|i| smooth(i) + if i > 3100 && i < 3400 && i % 10 == 0 { 0.05 } else { 0.0 });
        assert_eq!(moment.expect("a remark").severity, Severity::Note);
    }

    #[test]
    fn coarse_encoders_binary_commands_and_noise_are_no_second_publisher() {
        for seed in 0..40 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let bits: Vec<bool> = (0..5000).map(|_| rng.random_range(0.0..1.0) < 0.5).collect();
            let spread: Vec<f64> =
                (0..5000).map(|_| (0..6).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>()).collect();
            let wide: Vec<f64> = (0..5000).map(|_| rng.random_range(0.0..1.0)).collect();
            // A binary command of so many rows a bit.
            for rows in [1, 3, 7] {
                let found = remark_on(|i| if bits[i / rows] { 0.08 } else { 0.0 });
                assert!(found.is_none(), "{rows} rows a bit: {found:?}");
            }
            let found = remark_on(|i| smooth(i) + 1.4e-3 * spread[i]);
            assert!(found.is_none(), "noise: {found:?}");
            let found = remark_on_joints(|joint, row| {
                // Each joint has noise of its own.
                let at = (row + 2500 * joint) % 5000;
                smooth(row) + 1.4e-3 * spread[at] * if wide[at] < 0.01 { 8.0 } else { 1.0 }
            });
            assert!(
                found.as_ref().is_none_or(|found| found.severity == Severity::Note),
                "noise with far values: {found:?}"
            );
            // An encoder whose last bit flickers.
            let step = [1.5e-3, 6e-3][seed as usize % 2];
            let found =
                remark_on(|i| ((0.02 * (i as f64 * 1e-3).sin() + 0.2 * step * spread[i]) / step).round() * step);
            assert!(found.is_none(), "encoder: {found:?}");
        }
    }
}
