//! Two publishers on one topic: positions that jump away and back, row by row or now and then.

use super::columns::{Columns, Signals};
use super::limits::{JUMP_BACK, JUMP_BACK_ROWS, JUMP_QUARTILES, JUMP_SHARE, JUMP_STEPS, JUMPS};
use super::remark::{Fault, Remark, Size};
use super::statistics::{median, quantile};

/// Joints of one publisher move so far at least from row to row for a jump to be counted [rad].
const LEAST_JUMP: f64 = 5e-4;
/// Rows apart over which rows of one publisher are looked for among another's.
const APART: std::ops::RangeInclusive<usize> = 1..=4;

/// Remarks on both topics.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    clip.topics().into_iter().filter_map(|(topic, signals)| topic_remark(clip, topic, signals)).collect()
}

fn topic_remark(clip: &Columns, topic: &str, signals: &Signals) -> Option<Remark> {
    let found = (0..signals.dof()).map(|joint| (joint, jumps(&signals.q[joint])));
    let (joint, jumps) = found.max_by_key(|(_, jumps)| jumps.len())?;
    let share = jumps.len() as f64 / signals.len() as f64;
    if jumps.len() < JUMPS || share < JUMP_SHARE {
        return None;
    }
    let sizes: Vec<f64> = jumps.iter().map(|(_, size)| *size).collect();
    let (value, [lo, hi]) = (median(sizes.clone()), super::statistics::range(&sizes)?);
    Some(
        Remark::new(
            Fault::TwoPublishers,
            &clip.file,
            topic,
            format!(
                "the {topic} position of {} jumps away and back {} times, by {:.1} mrad: rows of two publishers on one topic",
                clip.joint(joint),
                jumps.len(),
                value * 1e3
            ),
        )
        .at(signals.t[jumps[0].0])
        .sized(Size { value, interval: [lo, hi], unit: "rad" })
        .mended_by("see with `ros2 topic info --verbose` who publishes there, and record one of them only"),
    )
}

/// Rows where a position jumps away and is back within a few rows, and by how much.
fn jumps(q: &[f64]) -> Vec<(usize, f64)> {
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
    let encoder = changes.filter(|change| *change > 0.0).fold(f64::INFINITY, f64::min);
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
                found.push((i, there.abs()));
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

    #[test]
    fn a_second_publisher_is_told_from_motion_noise_and_single_spoilt_rows() {
        let noise = |i: usize| 1e-5 * ((i as f64 * 78.233).sin() * 43_758.545).fract();
        let q = |i: usize| 0.3 * (i as f64 * 1e-3).sin() + noise(i);
        let plain: Vec<f64> = (0..2000).map(q).collect();
        assert_eq!(jumps(&plain).len(), 0);
        let every_second: Vec<f64> = (0..2000).map(|i| q(i) + if i % 2 == 0 { 0.01 } else { 0.0 }).collect();
        assert!(jumps(&every_second).len() > 900, "{}", jumps(&every_second).len());
        let now_and_then: Vec<f64> = (0..2000).map(|i| q(i) + if i % 37 < 2 { 0.05 } else { 0.0 }).collect();
        assert!((50..56).contains(&jumps(&now_and_then).len()), "{}", jumps(&now_and_then).len());
        let step: Vec<f64> = (0..2000).map(|i| q(i) + if i > 900 { 0.2 } else { 0.0 }).collect();
        assert_eq!(jumps(&step).len(), 0, "a step that stays is no second publisher");
    }
}
