//! Logs that run at another rate than what they log: rows that repeat older ones, and topics whose rates beat.

use super::columns::{Columns, Signals};
use super::limits::{FEWEST_POSES, FEWEST_ROWS, HELD_SHARE, POSE_MOTION, REPEAT_MOTION};
use super::remark::{Fault, Remark, Size};
use super::stamps;
use super::statistics::quantile;

/// Remarks on a clip.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    let held = clip.topics().into_iter().filter_map(|(topic, signals)| held_rows(clip, topic, signals));
    held.chain(held_poses(clip)).chain(unsynchronised(clip)).collect()
}

/// Rows that repeat the one before to the bit although the joints move.
fn held_rows(clip: &Columns, topic: &str, signals: &Signals) -> Option<Remark> {
    const AROUND: usize = 5;
    let rows = signals.len();
    if rows < FEWEST_ROWS {
        return None;
    }
    let resolution: Vec<f64> = signals.q.iter().map(|q| smallest_step(q)).collect();
    // Before the row as well as behind it: what has just stopped may repeat itself.
    let moves = |i: usize| {
        (0..signals.dof()).any(|j| {
            let [before, now, after] = [i - AROUND, i, i + AROUND].map(|row| signals.q[j][row]);
            let way = (now - before).abs().min((after - now).abs()) / AROUND as f64;
            way > REPEAT_MOTION * resolution[j].max(1e-7)
        })
    };
    let moving: Vec<usize> = (AROUND..rows - AROUND).filter(|i| moves(*i)).collect();
    let repeats = |i: &&usize| signals.q.iter().all(|q| q[**i] == q[**i - 1]);
    let held = moving.iter().filter(repeats).count();
    let share = held as f64 / moving.len().max(1) as f64;
    if moving.len() < FEWEST_ROWS || share < HELD_SHARE {
        return None;
    }
    let rate = 1.0 / signals.step();
    let first = *moving.iter().find(repeats)?;
    Some(remark(clip, topic, [rate, rate * (1.0 - share)], share, held, moving.len()).at(signals.t[first]))
}

fn remark(clip: &Columns, topic: &str, [rate, real]: [f64; 2], share: f64, held: usize, of: usize) -> Remark {
    // A share of n rows is known to this.
    let half = 1.96 * (share * (1.0 - share) / of as f64).sqrt();
    Remark::new(
        Fault::HeldRows,
        &clip.file,
        topic,
        format!(
            "{held} of {of} moving rows of {topic} repeat the one before to the bit: it is logged at {rate:.0} Hz but comes at about \
             {real:.0} Hz, so that a row is up to {:.1} ms old",
            1e3 / real
        ),
    )
    .sized(Size { value: real, interval: [real - rate * half, real + rate * half], unit: "Hz" })
    .mended_by(format!("log {topic} when it arrives, with its own stamp, instead of once a loop"))
}

/// Smallest change between two rows; 0 where nothing changes.
fn smallest_step(q: &[f64]) -> f64 {
    // The smallest of all is chance where the noise is continuous.
    let mut steps: Vec<f64> = q.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    if steps.is_empty() { 0.0 } else { quantile(&mut steps, 0.02) }
}

fn held_poses(clip: &Columns) -> Option<Remark> {
    let poses = &clip.object.poses;
    let place = |i: usize| nalgebra::Vector3::from(poses[i].position());
    let moves = |i: &usize| (place(i + 2) - place(i - 3)).norm() > 2.0 * POSE_MOTION;
    let moving: Vec<usize> = (3..poses.len().saturating_sub(2)).filter(moves).collect();
    let repeats = |i: &&usize| poses[**i] == poses[**i - 1];
    let held = moving.iter().filter(repeats).count();
    let share = held as f64 / moving.len().max(1) as f64;
    if moving.len() < FEWEST_POSES || share < HELD_SHARE {
        return None;
    }
    let rate = 1.0 / super::statistics::median(clip.pose_t.windows(2).map(|w| w[1] - w[0]).collect());
    let first = *moving.iter().find(repeats)?;
    Some(remark(clip, "object poses", [rate, rate * (1.0 - share)], share, held, moving.len()).at(clip.pose_t[first]))
}

/// Commands whose age at a measured row goes up and down.
fn unsynchronised(clip: &Columns) -> Option<Remark> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    if measured.len() < FEWEST_ROWS || desired.len() < FEWEST_ROWS {
        return None;
    }
    stamps::beat(measured, desired)?;
    let [rate, commanded] = [measured, desired].map(|signals| 1.0 / signals.step());
    Some(
        Remark::new(
            Fault::UnsynchronisedRates,
            &clip.file,
            "measured and desired",
            format!(
                "measurements come at {rate:.1} Hz and commands at {commanded:.1} Hz, unsynchronised: a command is 0 to {:.1} ms old at a \
                 measured row; they are compared by their stamps",
                1e3 / commanded
            ),
        )
        .sized(Size { value: 0.5 / commanded, interval: [0.0, 1.0 / commanded], unit: "s" })
        .mended_by("log every command that the controller takes, with its own stamp"),
    )
}
