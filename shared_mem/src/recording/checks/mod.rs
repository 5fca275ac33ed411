//! Faults that recordings of foreign systems have: each is mended where that is safe, and told in one sentence.
//!
//! Units: rad, rad/s, N m, ns. Called for every series that was read from a file.

mod clocks;
mod degrees;
mod object;
mod outlying;
mod wraps;

pub(super) use object::{beside_arm, object};
pub(super) use outlying::find as outlying_rows;
pub(super) use wraps::same_turn;

use super::series::JointSeries;
use crate::statistics::median;

/// Largest share of rows that may be left out before reading fails; one may be in any case, of this many and more.
const LARGEST_BAD_SHARE: f64 = 0.01;
const ROWS_OF_ONE: usize = 20;

/// Beyond this no number of a joint was measured [rad, rad/s, N m], and sums of squares lose all others.
const LARGEST_NUMBER: f64 = 1e6;

/// Mends a joint series and tells what was found; fails with a sentence when too much of it is unusable.
pub(super) fn joints(
    mut series: JointSeries,
    topic: &str,
    names: &[String],
) -> Result<(JointSeries, Vec<String>), String> {
    let mut warnings = Vec::new();
    if let Some(outlying) = outlying_rows(&series.stamps_ns, topic)? {
        series = series.select_rows(&outlying.kept);
        warnings.push(outlying.warning);
    }
    let moves = (1..series.len()).any(|i| step(&series, 0, i) > 1e-3);
    let dof = series.dof;
    unlogged_block(&mut series.dq, (dof, moves), topic, "velocities", &mut warnings);
    unlogged_block(&mut series.tau, (dof, moves), topic, "torques", &mut warnings);
    series = drop_non_finite(&series, topic, names, &mut warnings)?;
    if let Some((kept, told)) = clocks::one_time(&series.stamps_ns, topic) {
        series = series.select_rows(&kept.collect::<Vec<_>>());
        warnings.push(told);
    }
    series = sort(series, topic, &mut warnings);
    series = drop_glitch(series, topic, &mut warnings);
    series = wraps::unwrap(series, topic, &mut warnings);
    warnings.extend(interleaved(&series, topic));
    warnings.extend(degrees::beyond_turns(&series, topic));
    Ok((series, warnings))
}

/// Faults that only show when the two topics are laid side by side.
pub(super) fn pair(desired: &mut JointSeries, measured: &mut JointSeries) -> Vec<String> {
    let mut warnings: Vec<String> = degrees::against_each_other(desired, measured).into_iter().collect();
    warnings.extend(same_turn(desired, measured));
    let (Some(d0), Some(d1)) = (desired.stamps_ns.first(), desired.stamps_ns.last()) else { return warnings };
    let (Some(m0), Some(m1)) = (measured.stamps_ns.first(), measured.stamps_ns.last()) else { return warnings };
    if d1 < m0 || m1 < d0 {
        warnings.push(
            "the desired and measured rows do not overlap in time: their stamps come from different clocks; \
             let one machine stamp both"
                .into(),
        );
    }
    warnings
}

/// A block that its driver never filled in counts as not logged. `(joints, whether the arm moves)`: while it moves, no
/// velocity and no torque stays the same to the last bit.
fn unlogged_block(
    block: &mut Vec<f64>,
    (dof, moves): (usize, bool),
    topic: &str,
    what: &str,
    warnings: &mut Vec<String>,
) {
    let bad = block.iter().filter(|v| !v.is_finite()).count();
    let constant = block.iter().zip(block.iter().skip(dof)).all(|(a, b)| a == b);
    let why = if bad * 2 > block.len() {
        "mostly not finite"
    } else if moves && !block.is_empty() && constant {
        "the same in every row while the arm moves"
    } else {
        return;
    };
    warnings.push(format!("`{topic}`: {what} are {why}: taken as not logged; look at the driver if they should be"));
    block.clear();
}

/// How many of so many rows may be left out: 1 %, and one of 20 and more.
pub fn few_rows(rows: usize) -> usize {
    ((rows as f64 * LARGEST_BAD_SHARE) as usize).max(usize::from(rows >= ROWS_OF_ONE))
}

fn left_out(topic: &str, bad: usize, total: usize, first: &str) -> Result<String, String> {
    if bad > few_rows(total) {
        return Err(format!(
            "{bad} of {total} rows cannot be used ({first}); at most 1 % may be left out: record again, or cut the clip"
        ));
    }
    Ok(format!("`{topic}`: {bad} of {total} rows left out: {first}; look at the driver if this repeats"))
}

fn drop_non_finite(
    series: &JointSeries,
    topic: &str,
    names: &[String],
    warnings: &mut Vec<String>,
) -> Result<JointSeries, String> {
    let bad_joint = |i: usize| {
        let rows = [Some(series.q_row(i)), series.dq_row(i), series.tau_row(i)];
        rows.into_iter().flatten().find_map(|row| row.iter().position(|v| v.is_nan() || v.abs() > LARGEST_NUMBER))
    };
    let good: Vec<usize> = (0..series.len()).filter(|&i| bad_joint(i).is_none()).collect();
    let Some((row, joint)) = (0..series.len()).find_map(|i| Some((i, bad_joint(i)?))) else {
        return Ok(series.clone());
    };
    let joint = names.get(joint).map_or_else(|| format!("joint {}", joint + 1), |name| format!("joint `{name}`"));
    let what = format!("row {row}, {joint} is not finite (NaN or infinite) or beyond {LARGEST_NUMBER:e}");
    warnings.push(left_out(topic, series.len() - good.len(), series.len(), &what)?);
    Ok(series.select_rows(&good))
}

/// Sorts by stamp and keeps the first row of each stamp.
fn sort(series: JointSeries, topic: &str, warnings: &mut Vec<String>) -> JointSeries {
    let stamps = &series.stamps_ns;
    let unsorted = stamps.windows(2).filter(|w| matches!(w, [a, b] if b < a)).count();
    let repeated = stamps.windows(2).filter(|w| matches!(w, [a, b] if b == a)).count();
    if unsorted == 0 && repeated == 0 {
        return series;
    }
    let mut rows: Vec<usize> = (0..series.len()).collect();
    rows.sort_by_key(|&i| stamps.get(i).copied());
    let before = rows.len();
    rows.dedup_by_key(|i| stamps.get(*i).copied());
    warnings.extend(order_sentence(topic, unsorted, before - rows.len()));
    series.select_rows(&rows)
}

fn order_sentence(topic: &str, unsorted: usize, repeated: usize) -> Option<String> {
    let found = match (unsorted, repeated) {
        (0, 0) => return None,
        (n, 0) => format!("stamps go back {n} times; rows were sorted"),
        (0, n) => format!("{n} stamps repeat; the first row of each was kept"),
        (n, m) => {
            format!("stamps go back {n} times and {m} repeat; rows were sorted and the first row of each stamp kept")
        }
    };
    Some(format!("`{topic}`: {found}; see whether two nodes publish on it"))
}

/// Largest change of any joint from row `i` to row `k` [rad].
fn step(series: &JointSeries, i: usize, k: usize) -> f64 {
    series.q_row(i).iter().zip(series.q_row(k)).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max)
}

/// A first row that lies far from the second, while the rows behind are close together, was never measured.
fn drop_glitch(series: JointSeries, topic: &str, warnings: &mut Vec<String>) -> JointSeries {
    const ROWS: usize = 12;
    if series.len() < ROWS {
        return series;
    }
    let first = step(&series, 0, 1);
    let usual = (1..ROWS - 1).map(|i| step(&series, i, i + 1)).fold(0.0, f64::max);
    if first < 0.02 || first < 10.0 * usual {
        return series;
    }
    warnings.push(format!(
        "`{topic}`: the first row lies {first:.3} rad from the second and was left out; start recording once the \
         robot reports"
    ));
    series.select_rows(&(1..series.len()).collect::<Vec<_>>())
}

/// Two publishers on one topic make every row jump there and back.
fn interleaved(series: &JointSeries, topic: &str) -> Option<String> {
    let n = series.len().checked_sub(2).filter(|n| *n >= 20)?;
    let jumps = |joint: usize| {
        let q = |i: usize| series.q_row(i).get(joint).copied().unwrap_or(0.0);
        (1..=n)
            .filter(|&i| {
                let (there, back) = (q(i) - q(i - 1), q(i + 1) - q(i));
                there * back < 0.0 && there.abs().min(back.abs()) > 0.02 && (there + back).abs() < 0.25 * there.abs()
            })
            .count()
    };
    let worst = (0..series.dof).map(jumps).max()?;
    (worst as f64 > 0.3 * n as f64).then(|| {
        format!(
            "`{topic}`: positions jump there and back in {worst} of {n} rows: two nodes publish on it; record one of \
             them only"
        )
    })
}

/// Samples that did not arrive, by the stamps of those that did.
pub(super) fn gaps(stamps_ns: &[u64], topic: &str) -> Option<String> {
    let steps: Vec<u64> = stamps_ns.windows(2).filter_map(|w| w.last()?.checked_sub(*w.first()?)).collect();
    let usual = median(steps.iter().map(|step| *step as f64)).filter(|usual| *usual > 0.0)?;
    let is_gap = |step: u64| step as f64 > 1.8 * usual;
    let count = steps.iter().filter(|s| is_gap(**s)).count();
    let (row, longest) = steps.iter().enumerate().max_by_key(|(_, s)| **s)?;
    let lost: f64 = steps.iter().filter(|s| is_gap(**s)).map(|s| (*s as f64 / usual).round() - 1.0).sum();
    (count > 0).then(|| {
        format!(
            "`{topic}`: {count} gaps, about {lost:.0} of {} samples lost, the longest {:.1} ms behind row {row} \
             (samples come every {:.2} ms); nothing is filled in",
            stamps_ns.len() as f64 + lost,
            *longest as f64 * 1e-6,
            usual * 1e-6
        )
    })
}
